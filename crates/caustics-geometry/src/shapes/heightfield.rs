use glam::{UVec2, Vec2, Vec3};

use super::ShapeError;
use super::error::{check_count, check_positive, check_vertices};
use crate::TriangleMesh;

/// A surface `y = height(x, z)` over a rectangle of this extent along x and z, centred on the
/// origin and cut into `cells` along x and z, two triangles each, its front upwards.
///
/// Normals are those of the mesh, smoothed; where the slope is known,
/// [`heightfield_with_slope`] is exact.
///
/// # Errors
///
/// [`ShapeError`] where the extent is not positive, there are no cells or too many, or a height
/// is not finite.
pub fn heightfield(
    extent: impl Into<Vec2>,
    cells: impl Into<UVec2>,
    height: impl Fn(f32, f32) -> f32,
) -> Result<TriangleMesh, ShapeError> {
    let grid = Grid::new(extent.into(), cells.into())?;
    Ok(TriangleMesh::new(
        grid.positions(height),
        None,
        grid.triangles(),
    )?)
}

/// A [`heightfield`] with its exact normals, from `slope(x, z)`, the derivatives of the height
/// along x and along z.
///
/// # Errors
///
/// As [`heightfield`]; [`ShapeError::Mesh`] also where a slope is not finite.
pub fn heightfield_with_slope(
    extent: impl Into<Vec2>,
    cells: impl Into<UVec2>,
    height: impl Fn(f32, f32) -> f32,
    slope: impl Fn(f32, f32) -> Vec2,
) -> Result<TriangleMesh, ShapeError> {
    let grid = Grid::new(extent.into(), cells.into())?;
    let positions = grid.positions(height);
    let normals = positions
        .iter()
        .map(|position| {
            let slope = slope(position.x, position.z);
            Vec3::new(-slope.x, 1.0, -slope.y)
        })
        .collect();
    Ok(TriangleMesh::new(
        positions,
        Some(normals),
        grid.triangles(),
    )?)
}

/// A regular grid in the plane of x and z.
struct Grid {
    extent: Vec2,
    cells: UVec2,
}

impl Grid {
    fn new(extent: Vec2, cells: UVec2) -> Result<Self, ShapeError> {
        check_positive("extent along x", extent.x)?;
        check_positive("extent along z", extent.y)?;
        check_count("cells along x", cells.x as usize, 1)?;
        check_count("cells along z", cells.y as usize, 1)?;
        check_vertices((u64::from(cells.x) + 1).saturating_mul(u64::from(cells.y) + 1))?;
        Ok(Self { extent, cells })
    }

    fn positions(&self, height: impl Fn(f32, f32) -> f32) -> Vec<Vec3> {
        let along = |extent: f32, index: u32, cells: u32| {
            // In f64, so that the last point lies where the extent says.
            (f64::from(extent) * (f64::from(index) / f64::from(cells) - 0.5)) as f32
        };
        let mut positions =
            Vec::with_capacity((self.cells.x as usize + 1) * (self.cells.y as usize + 1));
        for row in 0..=self.cells.y {
            let z = along(self.extent.y, row, self.cells.y);
            for column in 0..=self.cells.x {
                let x = along(self.extent.x, column, self.cells.x);
                positions.push(Vec3::new(x, height(x, z), z));
            }
        }
        positions
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        let stride = self.cells.x + 1;
        let mut triangles = Vec::with_capacity(2 * self.cells.x as usize * self.cells.y as usize);
        for row in 0..self.cells.y {
            for column in 0..self.cells.x {
                let first = row * stride + column;
                let (right, below) = (first + 1, first + stride);
                triangles.extend([[first, below, below + 1], [first, below + 1, right]]);
            }
        }
        triangles
    }
}
