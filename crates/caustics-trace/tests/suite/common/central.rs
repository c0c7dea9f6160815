//! Derivatives by central differences in f64.

use caustics_trace::glam::DVec3;

/// A point and a direction as functions of one parameter, or their derivatives in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PointAndDirection {
    pub(crate) position: DVec3,
    pub(crate) direction: DVec3,
}

impl PointAndDirection {
    fn combined(self, weight: f64, other: Self, other_weight: f64) -> Self {
        Self {
            position: weight * self.position + other_weight * other.position,
            direction: weight * self.direction + other_weight * other.direction,
        }
    }

    /// The larger of the two relative differences.
    pub(crate) fn relative_difference(&self, other: &Self) -> f64 {
        let relative = |a: DVec3, b: DVec3| {
            let difference = (a - b).length();
            // Zero on both sides, as the direction of parallel rays is.
            if difference == 0.0 {
                0.0
            } else {
                difference / b.length()
            }
        };
        relative(self.position, other.position).max(relative(self.direction, other.direction))
    }
}

/// Of central differences, how far two successive estimates may differ: far below the tolerance of
/// what they are an oracle for.
const AGREEMENT: f64 = 1e-5;

/// The derivative of `path` at 0, by central differences with Richardson's extrapolation, at the
/// step, of those below `widest`, where halving it changes least; `None` where no step agrees with
/// its half to [`AGREEMENT`].
pub(crate) fn derivative(
    widest: f64,
    path: impl Fn(f64) -> Option<PointAndDirection>,
) -> Option<PointAndDirection> {
    let difference = |step: f64| {
        let (after, before) = (path(step)?, path(-step)?);
        Some(after.combined(0.5 / step, before, -0.5 / step))
    };
    let extrapolated = |step: f64| {
        let (coarse, fine) = (difference(step)?, difference(0.5 * step)?);
        Some(fine.combined(4.0 / 3.0, coarse, -1.0 / 3.0))
    };
    (0..7)
        .filter_map(|level| {
            let step = widest * 0.2f64.powi(level);
            let (coarse, fine) = (extrapolated(step)?, extrapolated(0.5 * step)?);
            Some((fine.relative_difference(&coarse), fine))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(disagreement, _)| *disagreement < AGREEMENT)
        .map(|(_, derivative)| derivative)
}
