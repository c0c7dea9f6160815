use glam::Vec3;

use crate::Ray;

/// A box whose sides are parallel to the axes, closed: its faces belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the smallest coordinates, in metres.
    pub min: Vec3,
    /// The corner with the largest coordinates, in metres.
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The box of no points: whatever it is united with comes out unchanged.
    pub const EMPTY: Self = Self {
        min: Vec3::splat(f32::INFINITY),
        max: Vec3::splat(f32::NEG_INFINITY),
    };

    /// The box between two opposite corners, given in any order.
    #[must_use]
    pub fn new(corner: impl Into<Vec3>, opposite: impl Into<Vec3>) -> Self {
        let (p, q) = (corner.into(), opposite.into());
        Self {
            min: p.min(q),
            max: p.max(q),
        }
    }

    /// The smallest box around some points; [`Aabb::EMPTY`] around none.
    #[must_use]
    pub fn from_points<P: Into<Vec3>>(points: impl IntoIterator<Item = P>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |bounds, point| bounds.extend(point))
    }

    /// The smallest box around this one and a point.
    #[must_use]
    pub fn extend(&self, point: impl Into<Vec3>) -> Self {
        let point = point.into();
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// The smallest box around this one and another.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Whether the box holds no point at all. A flat box, or one of a single point, does.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether a point lies in the box or on its faces.
    #[must_use]
    pub fn contains(&self, point: impl Into<Vec3>) -> bool {
        let point = point.into();
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// The middle of the box; the origin for an empty one.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        // Halved before the sum, so that the largest boxes do not overflow.
        if self.is_empty() {
            Vec3::ZERO
        } else {
            0.5 * self.min + 0.5 * self.max
        }
    }

    /// The vector from the smallest to the largest corner, zero for an empty box.
    #[must_use]
    pub fn diagonal(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            self.max - self.min
        }
    }

    /// The area of the six faces, in square metres.
    #[must_use]
    pub fn surface_area(&self) -> f32 {
        let d = self.diagonal();
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// Center and radius of a sphere that holds the whole box; radius 0 for an empty one.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let center = self.center();
        if self.is_empty() {
            return (center, 0.0);
        }
        // Measured from the rounded center, which may sit nearer to one corner than to the
        // other; the factor covers the rounding of the length itself.
        let reach = (self.max - center).max(center - self.min);
        (center, reach.length() * (1.0 + 4.0 * f32::EPSILON))
    }

    /// The parameters at which a ray enters and leaves the box, both clipped to the range of the
    /// ray, or none where it passes by.
    ///
    /// The far end is pushed out by the rounding error of both ends (Ize 2013, "Robust BVH Ray
    /// Traversal"), so that a ray that touches the box is never lost. An empty box is never hit.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<(f32, f32)> {
        // Each end is rounded twice, by half of EPSILON: in the difference and in the quotient.
        // That makes twice EPSILON for both, and half as much again for second order.
        const ROUNDING: f32 = 3.0 * f32::EPSILON;
        if self.is_empty() {
            return None;
        }
        let (mut enter, mut leave) = (ray.t_min, ray.t_max);
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            let (low, high) = (self.min[axis], self.max[axis]);
            if direction == 0.0 {
                // The quotients below would be 0/0 for an origin in a face.
                if origin < low || origin > high {
                    return None;
                }
                continue;
            }
            let (to_low, to_high) = ((low - origin) / direction, (high - origin) / direction);
            let far = to_low.max(to_high);
            enter = enter.max(to_low.min(to_high));
            leave = leave.min(far + ROUNDING * far.abs());
        }
        (enter <= leave).then_some((enter, leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_box_is_neutral_and_never_hit() {
        let unit = Aabb::new([0.0; 3], [1.0; 3]);
        assert_eq!(Aabb::EMPTY.union(&unit), unit);
        assert_eq!(
            Aabb::EMPTY.extend([2.0, 3.0, 4.0]),
            Aabb::new([2.0, 3.0, 4.0], [2.0, 3.0, 4.0])
        );
        assert!(Aabb::EMPTY.is_empty());
        assert_eq!(Aabb::EMPTY.surface_area(), 0.0);
        assert_eq!(Aabb::EMPTY.bounding_sphere(), (Vec3::ZERO, 0.0));
        assert_eq!(
            Aabb::EMPTY.intersect(&Ray::new([0.0; 3], [1.0, 0.0, 0.0])),
            None
        );
    }

    #[test]
    fn measures_of_a_box_of_one_two_three() {
        let bounds = Aabb::new([1.0, 2.0, 3.0], [0.0, 0.0, 0.0]);
        assert_eq!(bounds.center(), Vec3::new(0.5, 1.0, 1.5));
        assert_eq!(bounds.diagonal(), Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(bounds.surface_area(), 22.0);
        let (center, radius) = bounds.bounding_sphere();
        assert_eq!(center, bounds.center());
        assert!((radius - 0.5 * 14.0_f32.sqrt()).abs() < 2e-6);
    }

    #[test]
    fn enters_and_leaves_where_a_hand_says() {
        let unit = Aabb::new([0.0; 3], [1.0; 3]);
        let through = Ray::new([-1.0, 0.5, 0.5], [2.0, 0.0, 0.0]);
        let (enter, leave) = unit.intersect(&through).unwrap();
        assert_eq!(enter, 0.5);
        assert!((leave - 1.0).abs() < 1e-6);
        let inside = Ray::new([0.5; 3], [0.0, 0.0, -1.0]);
        assert_eq!(unit.intersect(&inside).unwrap().0, 0.0);
        let away = Ray::new([-1.0, 0.5, 0.5], [-1.0, 0.0, 0.0]);
        assert_eq!(unit.intersect(&away), None);
        let beyond = Ray::with_range([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0], 0.0, 0.9);
        assert_eq!(unit.intersect(&beyond), None);
    }

    #[test]
    fn ray_within_a_face_hits_and_beside_it_misses() {
        let unit = Aabb::new([0.0; 3], [1.0; 3]);
        assert!(
            unit.intersect(&Ray::new([-1.0, 1.0, 0.0], [1.0, 0.0, -0.0]))
                .is_some()
        );
        assert!(
            unit.intersect(&Ray::new([-1.0, 1.1, 0.0], [1.0, 0.0, 0.0]))
                .is_none()
        );
        let flat = Aabb::new([0.0, 0.0, 0.0], [1.0, 0.0, 1.0]);
        assert!(
            flat.intersect(&Ray::new([0.5, 2.0, 0.5], [0.0, -1.0, 0.0]))
                .is_some()
        );
    }
}
