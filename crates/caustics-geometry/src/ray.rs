use glam::Vec3;

/// A half-line, limited to the parameters `t_min < t < t_max`.
///
/// The point at parameter `t` is `origin + t * direction`. The direction need not be of unit
/// length; `t` counts in units of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in metres.
    pub origin: Vec3,
    /// Where it goes; not zero.
    pub direction: Vec3,
    /// Nearest parameter at which a hit counts, exclusive.
    pub t_min: f32,
    /// Farthest parameter at which a hit counts, exclusive.
    pub t_max: f32,
}

impl Ray {
    /// A ray without a far limit.
    #[must_use]
    pub fn new(origin: impl Into<Vec3>, direction: impl Into<Vec3>) -> Self {
        Self::with_range(origin, direction, 0.0, f32::INFINITY)
    }

    /// A ray whose hits must lie strictly between `t_min` and `t_max`.
    #[must_use]
    pub fn with_range(
        origin: impl Into<Vec3>,
        direction: impl Into<Vec3>,
        t_min: f32,
        t_max: f32,
    ) -> Self {
        Self {
            origin: origin.into(),
            direction: direction.into(),
            t_min,
            t_max,
        }
    }

    /// The point at parameter `t`.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// Whether a hit at parameter `t` counts; false for NaN.
    #[inline]
    #[must_use]
    pub fn contains(&self, t: f32) -> bool {
        (self.t_min < t) & (t < self.t_max)
    }
}
