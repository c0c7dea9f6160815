use glam::Vec3;

use crate::gate::MIN_NORMAL_COSINE;
use crate::gbuffer::{GBuffer, Texel};
use crate::parallel;

/// By how much unit normals of one plane may differ.
const NORMAL_TOLERANCE: f32 = 1e-4;

/// How far off their plane points may be, in their largest coordinate: what rounding does to them.
const PLANE_TOLERANCE: f32 = 1e-5;

/// An object of more planes than this counts as curved: it would take long to tell.
const MOST_PLANES: usize = 8;

/// Texels of one task.
const CHUNK: usize = 1 << 13;

/// For each object up to the last that is seen, whether it curves: whether two parts of it that a
/// footprint may light at once lie in different planes. A box does not, since its faces stand upright on
/// each other; stairs and spheres do.
pub(crate) fn curved_objects(buffer: &GBuffer) -> Vec<bool> {
    let chunks: Vec<_> = buffer.texels.chunks(CHUNK).collect();
    let parts = parallel::of_all(&chunks, 1, |texels| {
        let mut seen = SeenObjects::default();
        texels.iter().flatten().for_each(|texel| seen.add(texel));
        seen
    });
    let mut seen = SeenObjects::default();
    for part in parts {
        seen.join(part);
    }
    for (_, texel) in buffer.extras.iter() {
        seen.add(texel);
    }
    seen.planes.into_iter().map(|it| it.is_curved).collect()
}

/// For each object the planes that it has been seen in.
#[derive(Debug, Default)]
struct SeenObjects {
    planes: Vec<Planes>,
}

impl SeenObjects {
    fn of(&mut self, object: usize) -> &mut Planes {
        if self.planes.len() <= object {
            self.planes.resize_with(object + 1, Planes::default);
        }
        &mut self.planes[object]
    }

    fn add(&mut self, texel: &Texel) {
        self.of(texel.object as usize)
            .add(texel.position, texel.normal);
    }

    fn join(&mut self, other: Self) {
        for (object, planes) in other.planes.into_iter().enumerate() {
            let known = self.of(object);
            known.is_curved |= planes.is_curved;
            for (position, normal) in planes.known {
                known.add(position, normal);
            }
        }
    }
}

/// The planes that an object has been seen in.
#[derive(Clone, Debug, Default)]
struct Planes {
    /// A point of each, and its normal.
    known: Vec<(Vec3, Vec3)>,
    is_curved: bool,
}

impl Planes {
    fn add(&mut self, position: Vec3, normal: Vec3) {
        let is_in = |(point, other): &(Vec3, Vec3)| {
            let off = (position - point).dot(*other).abs();
            let size = position.abs().max(point.abs()).max_element();
            normal.distance_squared(*other) <= NORMAL_TOLERANCE * NORMAL_TOLERANCE
                && off <= PLANE_TOLERANCE * size
        };
        // Those seen last are the likeliest.
        if self.is_curved || self.known.iter().rev().any(is_in) {
            return;
        }
        let is_beside = |(_, other): &(Vec3, Vec3)| normal.dot(*other) >= MIN_NORMAL_COSINE;
        self.is_curved = self.known.len() == MOST_PLANES || self.known.iter().any(is_beside);
        self.known.push((position, normal));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_curved(parts: &[(Vec3, Vec3)]) -> bool {
        let mut planes = Planes::default();
        for &(position, normal) in parts {
            planes.add(position, normal.normalize());
        }
        planes.is_curved
    }

    #[test]
    fn boxes_are_flat_and_stairs_and_bends_are_not() {
        let floor = [(Vec3::ZERO, Vec3::Y), (Vec3::new(3.0, 1e-6, 2.0), Vec3::Y)];
        assert!(!is_curved(&floor));
        let sides = [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::NEG_X,
            Vec3::NEG_Y,
            Vec3::NEG_Z,
        ];
        assert!(!is_curved(&sides.map(|it| (it, it))));
        assert!(is_curved(&[(Vec3::ZERO, Vec3::Y), (Vec3::Y, Vec3::Y)]));
        let bent = Vec3::new(0.01, 1.0, 0.0);
        assert!(is_curved(&[(Vec3::ZERO, Vec3::Y), (Vec3::ZERO, bent)]));
    }

    #[test]
    fn an_object_curves_where_two_tasks_saw_different_planes_of_it() {
        let seen = |parts: &[(Vec3, Vec3)]| {
            let mut seen = SeenObjects::default();
            for &(position, normal) in parts {
                seen.of(1).add(position, normal);
            }
            seen
        };
        let is_curved = |one: &[(Vec3, Vec3)], other: &[(Vec3, Vec3)]| {
            let mut joined = seen(one);
            joined.join(seen(other));
            assert!(!joined.planes[0].is_curved);
            joined.planes[1].is_curved
        };
        let (floor, step) = ((Vec3::ZERO, Vec3::Y), (Vec3::Y, Vec3::Y));
        let (further, wall) = ((Vec3::X, Vec3::Y), (Vec3::X, Vec3::X));
        assert!(!is_curved(&[floor], &[further, wall]));
        assert!(is_curved(&[floor], &[wall, step]));
        assert!(is_curved(&[floor], &[further, (2.0 * Vec3::Y, Vec3::Y)]));
        assert!(is_curved(&[], &[floor, step]));
        assert!(is_curved(&[floor, step], &[]));
    }
}
