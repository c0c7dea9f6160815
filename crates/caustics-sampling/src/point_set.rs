use glam::Vec2;

use crate::{
    CounterRng, Grid, Rank1Lattice, Rotation, Sequence, halton, halton_scrambled, kronecker, sobol,
};

/// A number of points of the unit square, by any [`Sequence`], ready to be asked for one by one.
///
/// A light maps point `i` to photon `i`. The set is fixed by sequence, count and seed, so that a
/// frame has the same photons as the one before.
///
/// ```
/// use caustics_sampling::{PointSet, Sequence, glam::vec2};
///
/// let points = PointSet::new(Sequence::Grid, 4, 0);
/// let all: Vec<_> = (0..4).map(|index| points.point(index)).collect();
/// assert_eq!(all, [vec2(0.25, 0.25), vec2(0.75, 0.25), vec2(0.25, 0.75), vec2(0.75, 0.75)]);
/// // The edges of a point's cell: times the derivatives of a warp, a photon's footprint.
/// assert_eq!(points.spacing(0), [vec2(0.5, 0.0), vec2(0.0, 0.5)]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSet {
    kind: Kind,
    sequence: Sequence,
    count: u32,
    seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Halton,
    Sobol,
    Grid {
        grid: Grid,
        place: Vec2,
    },
    Fibonacci {
        lattice: Rank1Lattice,
        rotation: Rotation,
    },
    Kronecker {
        rotation: Rotation,
    },
}

impl PointSet {
    /// Prepares `count` points (zero is taken as one).
    ///
    /// A seed of zero gives the plain sequence. Any other scrambles the digits of Halton and
    /// Sobol', shifts every point of the grid alike inside its cell, and rotates the lattices on
    /// the torus: each keeps its structure.
    #[must_use]
    pub fn new(sequence: Sequence, count: u32, seed: u64) -> Self {
        let count = count.max(1);
        let rotation = if seed == 0 {
            Rotation::NONE
        } else {
            Rotation::new(seed)
        };
        let kind = match sequence {
            Sequence::Halton => Kind::Halton,
            Sequence::Sobol => Kind::Sobol,
            Sequence::Grid => {
                let place = if seed == 0 {
                    Vec2::splat(0.5)
                } else {
                    CounterRng::new(seed, 0).next_vec2()
                };
                Kind::Grid {
                    grid: Grid::new(count),
                    place,
                }
            }
            Sequence::Fibonacci => Kind::Fibonacci {
                lattice: Rank1Lattice::fibonacci(count),
                rotation,
            },
            Sequence::Kronecker => Kind::Kronecker { rotation },
        };
        Self {
            kind,
            sequence,
            count,
            seed,
        }
    }

    /// The sequence that the points are from.
    #[must_use]
    pub const fn sequence(&self) -> Sequence {
        self.sequence
    }

    /// Number of points, at least one.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// Point `index`, in `[0, 1)` on both axes. From [`count`](Self::count) on the sequences that
    /// can be extended go on; the others start anew.
    #[must_use]
    #[inline]
    pub fn point(&self, index: u32) -> Vec2 {
        match self.kind {
            Kind::Halton if self.seed == 0 => Vec2::new(halton(index, 0), halton(index, 1)),
            Kind::Halton => Vec2::new(
                halton_scrambled(index, 0, self.seed),
                halton_scrambled(index, 1, self.seed),
            ),
            Kind::Sobol => Vec2::new(sobol(index, 0, self.seed), sobol(index, 1, self.seed)),
            Kind::Grid { grid, place } => {
                let cell = grid.cell(index);
                (cell.corner + place * cell.size).map(crate::unit_interval::nearest)
            }
            Kind::Fibonacci { lattice, rotation } => rotation.apply(lattice.point(index)),
            Kind::Kronecker { rotation } => rotation.apply(kronecker(index)),
        }
    }

    /// Coordinate `dimension` of point `index`, in `[0, 1)`: 0 and 1 are those of
    /// [`point`](Self::point), further ones are for what else a light has to choose, such as the
    /// place on its area.
    ///
    /// Halton and Sobol' have them from their own sequence. The lattices take a scrambled Sobol'
    /// sequence; on the grid it runs along a Z-order curve, so that blocks of neighbouring cells
    /// have well spread values (Ahmed and Wonka, *Screen-Space Blue-Noise Diffusion of Monte Carlo
    /// Sampling Error via Hierarchical Ordering of Pixels*, 2020).
    #[must_use]
    pub fn sample(&self, index: u32, dimension: u32) -> f32 {
        if dimension < 2 {
            return self.point(index)[dimension as usize];
        }
        match self.kind {
            Kind::Halton if self.seed == 0 => halton(index, dimension),
            Kind::Halton => halton_scrambled(index, dimension, self.seed),
            Kind::Sobol => sobol(index, dimension, self.seed),
            // From dimension four on Sobol' is scrambled for a seed of zero, too.
            Kind::Grid { grid, .. } => {
                let cell = grid.cell(index);
                sobol(
                    z_order(cell.column, cell.row),
                    dimension.saturating_add(2),
                    self.seed,
                )
            }
            Kind::Fibonacci { .. } | Kind::Kronecker { .. } => {
                sobol(index, dimension.saturating_add(2), self.seed)
            }
        }
    }

    /// The edges of the cell that point `index` stands for; they span an area of `1 / count`.
    ///
    /// On the grid and the Fibonacci lattice these are the vectors to the point's neighbours; the
    /// other sequences have none that hold everywhere, and get a square.
    #[must_use]
    pub fn spacing(&self, index: u32) -> [Vec2; 2] {
        match self.kind {
            Kind::Grid { grid, .. } => {
                let size = grid.cell(index).size;
                [Vec2::new(size.x, 0.0), Vec2::new(0.0, size.y)]
            }
            Kind::Fibonacci { lattice, .. } => lattice.basis(),
            Kind::Halton | Kind::Sobol | Kind::Kronecker { .. } => {
                let edge = (self.count as f32).sqrt().recip();
                [Vec2::new(edge, 0.0), Vec2::new(0.0, edge)]
            }
        }
    }
}

/// The bits of `x` and `y` in turn, `x` lowest: the place on the Z-order curve, modulo 2^32.
fn z_order(x: u32, y: u32) -> u32 {
    let spread = |bits: u32| {
        let bits = bits & 0xFFFF;
        let bits = (bits | bits << 8) & 0x00FF_00FF;
        let bits = (bits | bits << 4) & 0x0F0F_0F0F;
        let bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z_order_interleaves() {
        assert_eq!(z_order(0b11, 0b00), 0b0101);
        assert_eq!(z_order(0b01, 0b10), 0b1001);
        assert_eq!(z_order(0xFFFF, 0xFFFF), u32::MAX);
    }

    #[test]
    fn high_dimensions_do_not_overflow() {
        for sequence in Sequence::ALL {
            let value = PointSet::new(sequence, 10, 3).sample(u32::MAX, u32::MAX);
            assert!((0.0..1.0).contains(&value), "{sequence}: {value}");
        }
    }
}
