use glam::Vec3;

use crate::Triangle;
use crate::unit_vector::direction;

/// The unit normal of each vertex: the mean of the normals of its triangles, weighted by the
/// angle that each has at the vertex (Thürmer and Wüthrich 1998, "Computing Vertex Normals from
/// Polygonal Facets"), so that the way a surface is cut into triangles does not show.
///
/// A vertex without triangles, or at which they cancel, gets one of its triangles' normals, or
/// +Y. The triangles' indices must be in range.
pub(crate) fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    let mut fallbacks = vec![Vec3::Y; positions.len()];
    for corners in triangles {
        let corners = corners.map(|index| index as usize);
        let [a, b, c] = corners.map(|index| positions[index]);
        let Some(normal) = Triangle { a, b, c }.unit_normal() else {
            continue;
        };
        let angles = [
            angle(b - a, c - a),
            angle(c - b, a - b),
            angle(a - c, b - c),
        ];
        for (index, angle) in corners.into_iter().zip(angles) {
            sums[index] += angle * normal;
            fallbacks[index] = normal;
        }
    }
    sums.iter()
        .zip(fallbacks)
        .map(|(sum, fallback)| direction(*sum).unwrap_or(fallback))
        .collect()
}

/// The angle between two edges, in radians; accurate for the smallest ones and near pi too.
fn angle(p: Vec3, q: Vec3) -> f32 {
    let (p, q) = (p / p.abs().max_element(), q / q.abs().max_element());
    p.cross(q).length().atan2(p.dot(q))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_corner_does_not_depend_on_its_diagonals() {
        // Three faces of a cube around the origin, one of them cut into two triangles there:
        // weighting by triangle would pull the normal towards that face.
        let positions = [
            Vec3::ZERO,
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::new(1.0, 1.0, 0.0),
        ];
        let triangles = [[0, 4, 1], [0, 2, 4], [0, 3, 2], [0, 1, 3]];
        let normals = smooth_normals(&positions, &triangles);
        let expected = Vec3::splat(-1.0).normalize();
        assert!((normals[0] - expected).length() < 1e-6, "{}", normals[0]);
    }

    #[test]
    fn vertices_without_a_mean_normal_still_get_one() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
        let both_sides = smooth_normals(&positions, &[[0, 1, 2], [0, 2, 1]]);
        assert_eq!(both_sides[0].abs(), Vec3::Z);
        assert_eq!(both_sides[3], Vec3::Y);
    }
}
