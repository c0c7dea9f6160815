//! A mesh in its place, and what rounding makes of it.

use caustics_geometry::Aabb;
use caustics_geometry::glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};

use crate::triangles::MAX_COORDINATE;

/// Bound on the relative error of what is computed here and in the leaf test, with room to spare:
/// sixteen roundings.
const GAMMA: f64 = 16.0 / (1_u64 << 24) as f64;

/// Where a mesh is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// World from object: a row for each of the world's axes, the last entry a translation.
    pub(super) rows: [[f32; 4]; 3],
    /// Object from world, likewise.
    pub(super) inverse: [[f32; 4]; 3],
    /// The transform mirrors, so that triangles turn round.
    pub(super) mirrors: bool,
    /// What a box in the object's frame must grow by to each side, in its units: this ...
    pub(super) pad: f32,
    /// ... and this times the largest coordinate of a ray's origin.
    pub(super) pad_by_origin: f32,
}

impl Placement {
    /// `None` for a transform that is singular or not finite, or leads too far.
    pub(super) fn new(transform: &Affine3A, mesh: &Aabb) -> Option<Self> {
        let matrix = DMat3::from_cols(
            transform.matrix3.x_axis.as_dvec3(),
            transform.matrix3.y_axis.as_dvec3(),
            transform.matrix3.z_axis.as_dvec3(),
        );
        let translation = transform.translation.as_dvec3();
        let inverse = DAffine3 {
            matrix3: matrix,
            translation,
        }
        .inverse();
        let placement = Self {
            rows: rows_of(matrix, translation),
            inverse: rows_of(inverse.matrix3, inverse.translation),
            mirrors: matrix.determinant() < 0.0,
            pad: 0.0,
            pad_by_origin: 0.0,
        };
        let is_finite = |rows: [[f32; 4]; 3]| rows.iter().flatten().all(|x| x.is_finite());
        if !is_finite(placement.rows) || !is_finite(placement.inverse) {
            return None;
        }
        // A world point of the mesh is off by GAMMA (|A| q + |T|) from the exact image of the
        // object's point, and by GAMMA times its distance from the ray's origin where the leaf
        // test sees it; a ray's point is off by GAMMA (|M| (|o| + |p|) + |s|) in the object's
        // frame, where A and T are the transform, M and s its inverse, and norms are of the
        // largest row. |M| takes the former there, and |p| is at most |A| q + |T|.
        let farthest = if mesh.is_empty() {
            0.0
        } else {
            f64::from(mesh.min.abs().max(mesh.max.abs()).max_element())
        };
        let reach = norm(matrix) * farthest + translation.abs().max_element();
        if reach > f64::from(MAX_COORDINATE) {
            return None;
        }
        let shrink = norm(inverse.matrix3);
        let pad = GAMMA * (3.0 * shrink * reach + inverse.translation.abs().max_element());
        Some(Self {
            pad: (pad as f32).next_up(),
            pad_by_origin: ((3.0 * GAMMA * shrink) as f32).next_up(),
            ..placement
        })
    }

    /// The box around the mesh in the world, as far as rounding may move its vertices.
    pub(super) fn bounds(&self, mesh: &Aabb) -> Aabb {
        if mesh.is_empty() {
            return Aabb::EMPTY;
        }
        let (low, high) = (mesh.min.as_dvec3(), mesh.max.as_dvec3());
        let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
        let farthest = low.abs().max(high.abs());
        let bound = |row: &[f32; 4], sign: f64| {
            let [x, y, z, shift] = row.map(f64::from);
            let row = DVec3::new(x, y, z);
            let slack = GAMMA * (row.abs().dot(farthest) + shift.abs());
            row.dot(center) + shift + sign * (row.abs().dot(half) + slack)
        };
        let corner = |sign: f64| {
            let [x, y, z] = self.rows.map(|row| bound(&row, sign) as f32);
            // One way or the other the conversion rounds.
            let away = |x: f32| {
                if sign < 0.0 {
                    x.next_down()
                } else {
                    x.next_up()
                }
            };
            Vec3::new(away(x), away(y), away(z))
        };
        Aabb {
            min: corner(-1.0),
            max: corner(1.0),
        }
    }

    /// How far boxes in the object's frame must reach for a ray that starts at `origin`.
    #[inline(always)]
    pub(super) fn pad(&self, origin: Vec3) -> f32 {
        self.pad + self.pad_by_origin * origin.abs().max_element()
    }

    /// A point in the object's frame.
    #[inline(always)]
    pub(super) fn point_to_object(&self, point: Vec3) -> Vec3 {
        let shift = Vec3::from_array(self.inverse.map(|row| row[3]));
        self.direction_to_object(point) + shift
    }

    /// A direction in the object's frame, as long as the transform makes it.
    #[inline(always)]
    pub(super) fn direction_to_object(&self, direction: Vec3) -> Vec3 {
        let [x, y, z] = self
            .inverse
            .map(|[x, y, z, _]| x * direction.x + y * direction.y + z * direction.z);
        Vec3::new(x, y, z)
    }
}

fn rows_of(matrix: DMat3, translation: DVec3) -> [[f32; 4]; 3] {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis, translation];
    std::array::from_fn(|row| columns.map(|column| column[row] as f32))
}

/// The largest sum of magnitudes in a row.
fn norm(matrix: DMat3) -> f64 {
    (matrix.x_axis.abs() + matrix.y_axis.abs() + matrix.z_axis.abs()).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Aabb {
        Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0))
    }

    #[test]
    fn boxes_follow_the_transform() {
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(2.0, 1.0, 0.5),
            caustics_geometry::glam::Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
            Vec3::new(10.0, 0.0, 0.0),
        );
        let placement = Placement::new(&transform, &unit_box()).unwrap();
        let bounds = placement.bounds(&unit_box());
        // Turned by a quarter: two wide along y and one along x.
        assert!(bounds.min.abs_diff_eq(Vec3::new(9.0, -2.0, -0.5), 2e-5));
        assert!(bounds.max.abs_diff_eq(Vec3::new(11.0, 2.0, 0.5), 2e-5));
        assert!(!placement.mirrors && placement.bounds(&Aabb::EMPTY).is_empty());
        let back = placement.point_to_object(transform.transform_point3(Vec3::ONE));
        assert!(back.abs_diff_eq(Vec3::ONE, 1e-5));
    }

    #[test]
    fn transforms_that_cannot_be_undone_are_refused() {
        let refused = |transform| Placement::new(&transform, &unit_box()).is_none();
        assert!(refused(Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0))));
        assert!(refused(Affine3A::from_scale(Vec3::splat(1e12))));
        assert!(refused(Affine3A::from_translation(Vec3::splat(f32::NAN))));
        assert!(refused(Affine3A::from_translation(Vec3::splat(1e12))));
        let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        assert!(Placement::new(&mirrored, &unit_box()).unwrap().mirrors);
    }
}
