use glam::Vec3;

use crate::photon::Coverage;

/// Which part of the width of all that blurs a photon's light, as the places on an area light do, the
/// third and fourth parameters of its differential stand for: their derivatives of the direction are
/// [`bounded`](RayDifferential::bounded) as those of a step are, and a whole light may turn it by more.
pub const BLUR_EDGE: f32 = 0.125;

/// How much area photons cover that overlap, in the geometric mean of their step's and their
/// [`BLUR_EDGE`]'s.
const OVERLAP: f32 = 4.0;

/// The least area of two displacements, in the sum of their squares: at a fold they are parallel.
const LEAST_AREA: f32 = 0.01;

/// How a ray's start and direction change with the parameters of its emission.
///
/// `position[i]` and `direction[i]` are the derivatives of the ray's point and of its unit
/// direction in parameter `i`. Point, spot and directional lights have `N = 2` parameters; a ray
/// from an area light has 4, two of its direction and two of its start. The same type serves rays
/// from the eye, whose parameters are the pixel's coordinates.
///
/// The operations are those of Igehy, *Tracing Ray Differentials* (SIGGRAPH 1999): a chain of
/// [`transferred`](Self::transferred), [`reflected`](Self::reflected) and
/// [`refracted`](Self::refracted) is the derivative of the whole path by the chain rule, and
/// everything in it is exact to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferential<const N: usize = 2> {
    /// Derivatives of the point on the ray, in metres a unit of the parameter.
    pub position: [Vec3; N],
    /// Derivatives of the unit direction, a unit of the parameter.
    pub direction: [Vec3; N],
}

impl<const N: usize> RayDifferential<N> {
    /// The differential of a ray that does not depend on its parameters.
    pub const ZERO: Self = Self {
        position: [Vec3::ZERO; N],
        direction: [Vec3::ZERO; N],
    };

    /// After travelling `distance` along the unit `direction` to a plane with normal
    /// `plane_normal`: each neighbour travels as far as it needs to reach the same plane
    /// (Igehy's equations 10 and 12).
    ///
    /// `distance` is in metres, `plane_normal` a unit vector to either side. The correction grows
    /// without bound towards grazing incidence, as the true displacement does. A ray in the plane
    /// itself, or so nearly that the correction overflows, gives the displacement without it,
    /// since no neighbour's distance exists.
    #[must_use]
    pub fn transferred(&self, direction: Vec3, distance: f32, plane_normal: Vec3) -> Self {
        let along = direction.dot(plane_normal);
        let position = std::array::from_fn(|i| {
            let moved = self.position[i] + distance * self.direction[i];
            let corrected = moved - moved.dot(plane_normal) / along * direction;
            if corrected.is_finite() {
                corrected
            } else {
                moved
            }
        });
        Self {
            position,
            direction: self.direction,
        }
    }

    /// After mirror reflection of the unit `direction` at a unit `normal` that changes by
    /// `normal_change[i]` in parameter `i` (Igehy's equation 15).
    #[must_use]
    pub fn reflected(&self, direction: Vec3, normal: Vec3, normal_change: [Vec3; N]) -> Self {
        let along = direction.dot(normal);
        let directions = std::array::from_fn(|i| {
            let (change, bend) = (self.direction[i], normal_change[i]);
            let along_change = change.dot(normal) + direction.dot(bend);
            change - 2.0 * (along * bend + along_change * normal)
        });
        Self {
            position: self.position,
            direction: directions,
        }
    }

    /// After refraction of the unit `direction` to the unit `refracted` direction, at a unit
    /// `normal` on the side from which the light comes, which changes by `normal_change[i]`; `eta`
    /// is the ratio of the index left to the index entered (Igehy's equations 17 to 19).
    ///
    /// It grows without bound towards the critical angle, as the true derivative does;
    /// [`bounded`](Self::bounded) keeps it finite.
    #[must_use]
    pub fn refracted(
        &self,
        direction: Vec3,
        refracted: Vec3,
        normal: Vec3,
        eta: f32,
        normal_change: [Vec3; N],
    ) -> Self {
        let along = direction.dot(normal);
        // Never positive: the refracted ray leaves on the other side of the normal.
        let along_refracted = refracted.dot(normal).min(-f32::MIN_POSITIVE);
        let mu = eta * along - along_refracted;
        let mu_slope = eta - eta * eta * along / along_refracted;
        let directions = std::array::from_fn(|i| {
            let (change, bend) = (self.direction[i], normal_change[i]);
            let along_change = change.dot(normal) + direction.dot(bend);
            eta * change - (mu * bend + mu_slope * along_change * normal)
        });
        Self {
            position: self.position,
            direction: directions,
        }
    }

    /// The differential with the derivatives of the direction shortened to `limit` (a length, in
    /// units of the parameter; not negative), and whether any was longer or not finite.
    ///
    /// A derivative that is not finite becomes zero, in the position too; a finite one of the
    /// position is left alone.
    #[must_use]
    pub fn bounded(&self, limit: f32) -> (Self, bool) {
        let mut result = *self;
        let mut shortened = false;
        for change in &mut result.direction {
            if !change.is_finite() {
                *change = Vec3::ZERO;
                shortened = true;
            } else if change.length() > limit {
                // Scaled first: the square of a large derivative, and so its length, overflows.
                let scaled = *change / change.abs().max_element();
                *change = scaled * (limit / scaled.length());
                shortened = true;
            }
        }
        for moved in &mut result.position {
            if !moved.is_finite() {
                *moved = Vec3::ZERO;
                shortened = true;
            }
        }
        (result, shortened)
    }

    /// The differential for a sample spacing `factor` times as wide.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self {
            position: self.position.map(|it| factor * it),
            direction: self.direction.map(|it| factor * it),
        }
    }

    /// Two axes, in metres, of a photon's footprint in the plane with unit `normal`: those of
    /// [`footprint`](Self::footprint).
    #[must_use]
    pub fn footprint_axes(&self, normal: Vec3) -> [Vec3; 2] {
        self.footprint(normal).0
    }

    /// Two axes, in metres, of a photon's footprint in the plane with unit `normal`, and how it lies
    /// among its neighbours'.
    ///
    /// With two parameters these are the displacements. With four, the first two step to a photon's
    /// neighbours in a lattice and the others go along a part, [`BLUR_EDGE`], of all that blurs its
    /// light: for an area light the places on it, one of which each photon has. Where a step covers the
    /// area `a` and the whole blur `b`, about `sqrt(b / a)` photons shall overlap, and the footprint
    /// covers `a + 0.5 sqrt(a b)`: the geometric mean is as wide as the patterns in which places and
    /// steps can beat. Without blur it has the covariance `sum of p pᵀ` of the steps, as with two
    /// parameters; the more photons overlap the rounder it is, since long steps, as at silhouettes, then
    /// reach beyond where the blurred light does.
    ///
    /// Under a square lamp over a glass sphere round footprints had a quarter of the error of such as
    /// keep the shape of steps and blur, each at its own best factor. Of factors from 0.375 to 0.625 all
    /// from 0.475 on are within 3 % of each other at 65,536, 262,144 and 2,000,000 photons.
    ///
    /// Where an eighth of the blur is at least as wide as a step, `b >= 64 a`, the footprint covers five
    /// steps or more: it [overlaps](Coverage::Overlap) others. Under a narrower lamp, or few photons, the
    /// lattice would still show, and it is a [`Cell`](Coverage::Cell), as all with two parameters are.
    #[must_use]
    pub fn footprint(&self, normal: Vec3) -> ([Vec3; 2], Coverage) {
        if let [first, second] = self.position[..] {
            return ([first, second], Coverage::Cell);
        }
        // Scaled by the largest: its square overflows long before it does.
        let scale = self
            .position
            .iter()
            .fold(0.0f32, |a, it| a.max(it.abs().max_element()));
        if scale == 0.0 {
            return ([Vec3::ZERO; 2], Coverage::Cell);
        }
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let moved = |i: usize| self.position.get(i).map_or(Vec3::ZERO, |it| *it / scale);
        let area = |one: Vec3, other: Vec3| {
            let squares = one.length_squared() + other.length_squared();
            one.cross(other).length().max(LEAST_AREA * squares)
        };
        let steps = [moved(0), moved(1)];
        let step = area(steps[0], steps[1]);
        let blur = area(moved(2), moved(3));
        let overlap = OVERLAP * (step * blur).sqrt();
        let coverage = if blur >= step && step > 0.0 {
            Coverage::Overlap
        } else {
            Coverage::Cell
        };
        // How much of the steps' own shape is left.
        let covered = step + overlap;
        let own = if covered > 0.0 { step / covered } else { 1.0 };
        let disc = covered - own * step;
        let (mut xx, mut xy, mut yy) = (disc, 0.0, disc);
        for step in steps.map(|it| own.sqrt() * it) {
            let (x, y) = (step.dot(tangent), step.dot(bitangent));
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        // The columns of the covariance's Cholesky factor.
        let x = xx.sqrt();
        let shear = if x > 0.0 { xy / x } else { 0.0 };
        let y = (yy - shear * shear).max(0.0).sqrt();
        let axes = [
            scale * (x * tangent + shear * bitangent),
            scale * y * bitangent,
        ];
        (axes, coverage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Straight down, its neighbours fanning out along x by 1 a unit, and shifted along z.
    fn downwards() -> RayDifferential {
        RayDifferential {
            position: [Vec3::ZERO, Vec3::Z],
            direction: [Vec3::X, Vec3::ZERO],
        }
    }

    #[test]
    fn transfer_onto_a_slope_of_45_degrees() {
        // From a point 2 above, the neighbour x = 2 h lands where 2 - y = x: lower by as much.
        let normal = Vec3::new(1.0, 1.0, 0.0).normalize();
        let landed = downwards().transferred(Vec3::NEG_Y, 2.0, normal);
        assert!(landed.position[0].abs_diff_eq(Vec3::new(2.0, -2.0, 0.0), 1e-6));
        assert_eq!(landed.position[1], Vec3::Z);
        assert_eq!(landed.direction, downwards().direction);
    }

    #[test]
    fn a_mirror_that_turns_by_one_turns_its_reflection_by_two() {
        let bent = [Vec3::ZERO, Vec3::Z];
        let reflected = downwards().reflected(Vec3::NEG_Y, Vec3::Y, bent);
        assert_eq!(reflected.direction, [Vec3::X, 2.0 * Vec3::Z]);
    }

    #[test]
    fn refraction_straight_through_scales_angles_by_the_ratio() {
        // Small angles: sin t = eta sin i; a normal that turns by 1 turns the light by 1 - eta.
        let bent = [Vec3::ZERO, Vec3::Z];
        let refracted = downwards().refracted(Vec3::NEG_Y, Vec3::NEG_Y, Vec3::Y, 0.75, bent);
        assert_eq!(refracted.direction, [0.75 * Vec3::X, -0.25 * Vec3::Z]);
    }

    #[test]
    fn bounds_shorten_and_report() {
        let long = RayDifferential {
            position: [Vec3::NAN, 1e30 * Vec3::X],
            direction: [3e30 * Vec3::new(1.0, 0.0, 1.0), Vec3::INFINITY],
        };
        let (short, shortened) = long.bounded(0.5);
        assert!(shortened);
        assert_relative_eq!(short.direction[0].length(), 0.5, max_relative = 1e-6);
        assert_eq!(short.direction[1], Vec3::ZERO);
        assert_eq!(short.position, [Vec3::ZERO, 1e30 * Vec3::X]);
        assert_eq!(downwards().bounded(1.0), (downwards(), false));
    }

    #[test]
    fn four_parameters_overlap_the_more_the_wider_their_blur_is() {
        let axes = |long: f32, blur: f32| {
            let spread = RayDifferential::<4> {
                position: [
                    2.0 * long * Vec3::X,
                    2.0 * Vec3::Z,
                    blur * Vec3::X,
                    -blur * Vec3::Z,
                ],
                ..RayDifferential::ZERO
            };
            spread.footprint_axes(Vec3::Y)
        };
        let area = |[one, other]: [Vec3; 2]| one.cross(other).length();
        // Without blur it is the step.
        let [one, other] = axes(9.0, 0.0).map(Vec3::length);
        assert_relative_eq!(one.max(other), 18.0, max_relative = 1e-5);
        assert_relative_eq!(one.min(other), 2.0, max_relative = 1e-5);
        // An eighth of the blur is 9 steps wide: 4 + 4 sqrt(4 * 324).
        assert_relative_eq!(area(axes(1.0, 18.0)), 148.0, max_relative = 1e-5);
        // A long step under much blur: 36 + 4 sqrt(36 * 10^6), and round but for a part in 500.
        let long = axes(9.0, 1000.0);
        assert_relative_eq!(area(long), 24036.0, max_relative = 0.01);
        let [one, other] = long.map(Vec3::length_squared);
        assert_relative_eq!(one.max(other) / one.min(other), 1.0, epsilon = 0.01);
        // Steps that go nowhere say nothing.
        assert_eq!(area(axes(0.0, 0.0)), 0.0);
    }

    #[test]
    fn footprints_overlap_from_five_steps_on() {
        let found = |step: f32, blur: f32| {
            let spread = RayDifferential::<4> {
                position: [
                    step * Vec3::X,
                    step * Vec3::Z,
                    blur * Vec3::X,
                    blur * Vec3::Z,
                ],
                ..RayDifferential::ZERO
            };
            let (axes, coverage) = spread.footprint(Vec3::Y);
            (axes[0].cross(axes[1]).length() / step.powi(2), coverage)
        };
        let (area, coverage) = found(2.0, 2.001);
        assert_relative_eq!(area, 5.0, max_relative = 1e-3);
        assert_eq!(coverage, Coverage::Overlap);
        assert_eq!(found(2.0, 1.999).1, Coverage::Cell);
        assert_eq!(found(2.0, 0.0).1, Coverage::Cell);
        assert_eq!(found(0.0, 1.0).1, Coverage::Cell);
        // Without any blur there is nothing but the lattice.
        assert_eq!(downwards().footprint(Vec3::Y).1, Coverage::Cell);
    }
}
