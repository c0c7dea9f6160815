use glam::Vec3;

use super::ShapeError;
use super::error::check_positive;
use crate::TriangleMesh;

/// A box of these side lengths, with a flat normal on each face.
///
/// # Errors
///
/// [`ShapeError::NotPositive`] where a side length is not positive.
pub fn cuboid(size: impl Into<Vec3>) -> Result<TriangleMesh, ShapeError> {
    let size = size.into();
    check_positive("width", size.x)?;
    check_positive("height", size.y)?;
    check_positive("depth", size.z)?;
    let half = 0.5 * size;
    let mut positions = Vec::with_capacity(24);
    let mut normals = Vec::with_capacity(24);
    let mut triangles = Vec::with_capacity(12);
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let normal = side * Vec3::AXES[axis];
            // right x up = normal, so that the corners run counterclockwise from outside.
            let right = side * Vec3::AXES[(axis + 1) % 3];
            let up = Vec3::AXES[(axis + 2) % 3];
            let first = positions.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                positions.push(half * (normal + x * right + y * up));
                normals.push(normal);
            }
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Ok(TriangleMesh::new(positions, Some(normals), triangles)?)
}

/// The parallelogram of a corner and the two edges that leave it, in two triangles; its front
/// is where `right x up` points.
///
/// # Errors
///
/// [`ShapeError::NotPositive`] where the edges span no area, [`ShapeError::Mesh`] where a
/// coordinate is not finite.
pub fn quad(
    corner: impl Into<Vec3>,
    right: impl Into<Vec3>,
    up: impl Into<Vec3>,
) -> Result<TriangleMesh, ShapeError> {
    let (corner, right, up) = (corner.into(), right.into(), up.into());
    let positions = vec![corner, corner + right, corner + right + up, corner + up];
    let mesh = TriangleMesh::new(positions, None, vec![[0, 1, 2], [0, 2, 3]])?;
    if mesh.triangles().len() < 2 {
        return Err(ShapeError::NotPositive {
            quantity: "area",
            value: mesh.area(),
        });
    }
    Ok(mesh)
}
