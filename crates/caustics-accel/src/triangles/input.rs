//! What triangles are accepted.

use caustics_geometry::glam::{Vec3, Vec3A};

use crate::AccelError;

/// The largest magnitude of a vertex coordinate, in metres: products of three of them fit an f32.
pub(crate) const MAX_COORDINATE: f32 = 1e11;

/// Whether a triangle within these bounds can be hit: one that is a line along an axis or a point cannot.
pub(crate) fn can_be_hit(low: Vec3A, high: Vec3A) -> bool {
    (high - low).cmpgt(Vec3A::ZERO).bitmask().count_ones() >= 2
}

pub(crate) fn validate<P: Copy + Into<Vec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    limit: usize,
) -> Result<(), AccelError> {
    if triangles.len() > limit {
        return Err(AccelError::TooManyTriangles {
            count: triangles.len(),
            limit,
        });
    }
    for (vertex, &position) in positions.iter().enumerate() {
        let position: Vec3 = position.into();
        if !position.is_finite() {
            return Err(AccelError::NonFiniteVertex { vertex });
        }
        let coordinate = position.abs().max_element();
        if coordinate > MAX_COORDINATE {
            let limit = MAX_COORDINATE;
            return Err(AccelError::VertexTooFar {
                vertex,
                coordinate,
                limit,
            });
        }
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            if vertex as usize >= positions.len() {
                let vertices = positions.len();
                return Err(AccelError::VertexOutOfRange {
                    triangle,
                    vertex,
                    vertices,
                });
            }
        }
    }
    Ok(())
}

/// The corners of a triangle.
pub(crate) fn corners_of<P: Copy + Into<Vec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    triangle: u32,
) -> [[f32; 3]; 3] {
    triangles[triangle as usize].map(|vertex| {
        let position: Vec3 = positions[vertex as usize].into();
        position.to_array()
    })
}
