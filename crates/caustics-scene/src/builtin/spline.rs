//! Smooth curves through given points.

use glam::Vec2;

/// A cubic spline through points, with continuous second derivatives, so that a surface of
/// revolution about it has no jumps in curvature for a caustic to show. Its parameter is the length
/// of the polyline through the points, which keeps it from swinging out where they lie close
/// together.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    points: Vec<Vec2>,
    /// First derivatives at the points, per metre of polyline.
    tangents: Vec<Vec2>,
    /// Lengths between the points.
    lengths: Vec<f32>,
}

impl Spline {
    /// The spline through at least two points, all different from their neighbours, that begins and
    /// ends along these directions.
    ///
    /// The tangents solve the tridiagonal equations of equal second derivatives on both sides of
    /// each inner point (Farin, "Curves and surfaces for CAGD", section 9.1).
    pub(super) fn through(points: &[Vec2], begin: Vec2, end: Vec2) -> Self {
        let lengths: Vec<f32> = points
            .windows(2)
            .map(|ends| ends[0].distance(ends[1]))
            .collect();
        let slopes: Vec<Vec2> = points
            .windows(2)
            .zip(&lengths)
            .map(|(ends, length)| (ends[1] - ends[0]) / length)
            .collect();
        let mut tangents = vec![begin.normalize(); points.len()];
        let last = points.len() - 1;
        tangents[last] = end.normalize();
        // Thomas's algorithm: eliminate upwards, substitute downwards.
        let mut upper = vec![0.0; points.len()];
        for k in 1..last {
            let (before, after) = (lengths[k - 1], lengths[k]);
            let right_side = 3.0 * (after * slopes[k - 1] + before * slopes[k]);
            let pivot = 2.0 * (before + after) - after * upper[k - 1];
            upper[k] = before / pivot;
            tangents[k] = (right_side - after * tangents[k - 1]) / pivot;
        }
        for k in (1..last).rev() {
            tangents[k] = tangents[k] - upper[k] * tangents[k + 1];
        }
        Self {
            points: points.to_vec(),
            tangents,
            lengths,
        }
    }

    /// Position and direction (not of unit length) at one of the points.
    pub(super) fn at_knot(&self, point: usize) -> (Vec2, Vec2) {
        (self.points[point], self.tangents[point])
    }

    /// Positions and directions along the curve: all the points, and between each two of them as
    /// many more as make `steps` equal steps of the parameter.
    pub(super) fn walk(&self, steps: usize) -> impl Iterator<Item = (Vec2, Vec2)> {
        let spans = self.lengths.len();
        (0..=spans * steps).map(move |step| {
            let span = (step / steps).min(spans - 1);
            self.at(span, (step - span * steps) as f32 / steps as f32)
        })
    }

    /// Position and direction in a span, `s` running from 0 to 1: Hermite's cubic.
    fn at(&self, span: usize, s: f32) -> (Vec2, Vec2) {
        let length = self.lengths[span];
        let (p, q) = (self.points[span], self.points[span + 1]);
        let (dp, dq) = (
            length * self.tangents[span],
            length * self.tangents[span + 1],
        );
        let chord = q - p;
        // p + s (dp + s (c + s d)), with c and d such that the end is q with the derivative dq.
        let c = 3.0 * chord - 2.0 * dp - dq;
        let d = dp + dq - 2.0 * chord;
        let position = p + s * (dp + s * (c + s * d));
        let derivative = dp + s * (2.0 * c + s * 3.0 * d);
        (position, derivative / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_through_its_points_along_its_ends() {
        let points = [
            Vec2::ZERO,
            Vec2::new(2.0, 1.0),
            Vec2::new(3.0, 4.0),
            Vec2::new(0.0, 5.0),
        ];
        let spline = Spline::through(&points, Vec2::X, Vec2::new(-3.0, 0.0));
        let walked: Vec<(Vec2, Vec2)> = spline.walk(4).collect();
        assert_eq!(walked.len(), 13);
        for (k, point) in points.iter().enumerate() {
            assert!(walked[4 * k].0.distance(*point) < 1e-6, "{k}");
            assert_eq!(spline.at_knot(k).0, *point);
        }
        assert_eq!(walked[0].1.normalize(), Vec2::X);
        assert!(walked[12].1.normalize().distance(Vec2::NEG_X) < 1e-6);
    }

    #[test]
    fn second_derivatives_agree_at_inner_points() {
        let points = [
            Vec2::ZERO,
            Vec2::new(2.0, 1.0),
            Vec2::new(2.5, 1.5),
            Vec2::new(0.0, 5.0),
        ];
        let spline = Spline::through(&points, Vec2::X, Vec2::NEG_X);
        for k in 1..3 {
            // A cubic's first derivative is a parabola: its own derivative at an end follows from
            // three values.
            let at = |span: usize, s: f32| spline.at(span, s).1;
            let (before, after) = (spline.lengths[k - 1], spline.lengths[k]);
            let left = (3.0 * at(k - 1, 1.0) - 4.0 * at(k - 1, 0.5) + at(k - 1, 0.0)) / before;
            let right = (-3.0 * at(k, 0.0) + 4.0 * at(k, 0.5) - at(k, 1.0)) / after;
            assert!(left.distance(right) < 1e-4, "{k}: {left} {right}");
        }
    }

    #[test]
    fn a_straight_line_stays_straight() {
        let points = [0.0, 1.0, 1.5, 4.0].map(Vec2::splat);
        let spline = Spline::through(&points, Vec2::ONE, Vec2::ONE);
        for (position, direction) in spline.walk(7) {
            assert!((position.x - position.y).abs() < 1e-6);
            assert!(direction.distance(Vec2::ONE.normalize()) < 1e-6);
        }
    }
}
