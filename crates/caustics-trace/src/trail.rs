use caustics_geometry::{Aabb, Hit, Ray};
use caustics_scene::World;
use glam::{UVec3, Vec3};

use crate::casters::Casters;

/// Blocks along each side of the space in which paths are followed: 64 in all, a bit each.
const SIDE: u32 = 4;

/// Pieces that a ray is cut into, each of which marks the blocks around it.
const PIECES: u16 = 8;

/// Where a photon's path went, branches included: which casters it met, and which blocks of space it
/// passed through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trail<'a> {
    casters: &'a Casters,
    space: Space,
    /// A bit for each caster met.
    pub(crate) touched: u32,
    /// A bit for each block passed.
    pub(crate) passed: u64,
}

impl<'a> Trail<'a> {
    pub(crate) fn new(casters: &'a Casters, space: Space) -> Self {
        Self {
            casters,
            space,
            touched: 0,
            passed: 0,
        }
    }

    /// Begins another path.
    pub(crate) fn clear(&mut self) {
        (self.touched, self.passed) = (0, 0);
    }

    /// Follows a ray to its hit, or out of the world.
    pub(crate) fn passes(&mut self, world: &World, ray: &Ray, hit: Option<&Hit>) {
        if let Some(caster) = hit
            .and_then(|hit| world.object_of(hit.primitive))
            .and_then(|object| self.casters.of_object(object))
        {
            self.touched |= 1 << caster;
        }
        let length = match hit {
            Some(hit) => hit.t,
            None => self.space.way_out(ray.origin),
        };
        let at = |piece: u16| ray.at(length * f32::from(piece) / f32::from(PIECES));
        for piece in 0..PIECES {
            let (from, to) = (at(piece), at(piece + 1));
            self.passed |= self.space.blocks(&Aabb::new(from, to));
        }
    }
}

/// Space in blocks. Those at the border go on to infinity, so that everything is in one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Space {
    min: Vec3,
    /// Blocks for each metre.
    scale: Vec3,
    diagonal: f32,
}

impl Space {
    pub(crate) fn around(bounds: &Aabb) -> Self {
        let size = bounds.diagonal().max(Vec3::splat(f32::MIN_POSITIVE));
        Self {
            min: bounds.min,
            scale: SIDE as f32 / size,
            diagonal: size.length(),
        }
    }

    /// The blocks that a box touches. Boxes that share a point share a block.
    pub(crate) fn blocks(&self, bounds: &Aabb) -> u64 {
        let block = |point: Vec3| -> UVec3 {
            // Casts saturate, and a NaN is 0.
            ((point - self.min) * self.scale)
                .as_uvec3()
                .min(UVec3::splat(SIDE - 1))
        };
        let (low, high) = (block(bounds.min), block(bounds.max));
        let mut blocks = 0;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    blocks |= 1 << ((z * SIDE + y) * SIDE + x);
                }
            }
        }
        blocks
    }

    /// How far a ray from a point may go before it is past everything.
    fn way_out(&self, origin: Vec3) -> f32 {
        let off = (origin - self.min).length();
        if off.is_finite() {
            2.0 * (off + self.diagonal)
        } else {
            self.diagonal
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_that_meet_share_a_block() {
        let space = Space::around(&Aabb::new([0.0; 3], [4.0; 3]));
        let one = Aabb::new([0.5; 3], [0.6; 3]);
        assert_eq!(space.blocks(&one), 1);
        assert_eq!(space.blocks(&Aabb::new([0.5; 3], [1.5, 0.6, 0.6])), 0b11);
        assert_eq!(space.blocks(&Aabb::new([-9.0; 3], [9.0; 3])), u64::MAX);
        // Beyond the border is the border's block.
        assert_eq!(space.blocks(&Aabb::new([-9.0; 3], [-8.0; 3])), 1);
        assert_eq!(space.blocks(&Aabb::new([9.0; 3], [9.5; 3])), 1 << 63);
    }
}
