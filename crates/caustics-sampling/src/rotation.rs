use glam::Vec2;

use crate::counter_rng::CounterRng;
use crate::unit_interval::wrapped_sum;

/// A shift of the unit square on the torus: randomises any lattice without changing the distances
/// in it (Cranley and Patterson 1976).
///
/// ```
/// use caustics_sampling::{Rotation, glam::vec2};
///
/// let rotated = Rotation::new(9).apply(vec2(0.9, 0.1));
/// assert!(rotated.cmpge(vec2(0.0, 0.0)).all() && rotated.cmplt(vec2(1.0, 1.0)).all());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rotation {
    shift: Vec2,
}

impl Rotation {
    /// No rotation.
    pub const NONE: Self = Self { shift: Vec2::ZERO };

    /// A random rotation.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self {
            shift: CounterRng::new(seed, 0).next_vec2(),
        }
    }

    /// The shift along `u` and `v`, both in `[0, 1)`.
    #[must_use]
    pub const fn shift(&self) -> Vec2 {
        self.shift
    }

    /// Shifts a point of the unit square, modulo one on both axes.
    #[must_use]
    #[inline]
    pub fn apply(&self, point: Vec2) -> Vec2 {
        Vec2::new(
            wrapped_sum(point.x, self.shift.x),
            wrapped_sum(point.y, self.shift.y),
        )
    }
}
