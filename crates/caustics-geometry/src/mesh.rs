use std::collections::HashMap;

use glam::{Affine3A, Mat3, Vec3};
use thiserror::Error;

use crate::unit_vector::direction;
use crate::vertex_normals::smooth_normals;
use crate::{Aabb, Triangle};

/// The largest coordinate of a vertex, in metres: beyond it, products of three coordinates'
/// differences leave f32 and intersections are no longer reliable.
const LARGEST_COORDINATE: f32 = 1e18;

/// A validated triangle mesh with a unit normal at each vertex.
///
/// All coordinates are finite, all indices are in range, no triangle has zero area, and every
/// normal is of unit length.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    bounds: Aabb,
    removed_degenerate: usize,
    replaced_normals: usize,
}

/// Why arrays do not make a [`TriangleMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A coordinate of a position is NaN or infinite.
    #[error("position of vertex {vertex} is not finite")]
    NonFinitePosition {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A coordinate of a position is too large for f32 arithmetic.
    #[error("position of vertex {vertex} has a coordinate beyond {limit:e}")]
    PositionOutOfRange {
        /// Index of the vertex.
        vertex: usize,
        /// The largest coordinate allowed, in metres.
        limit: f32,
    },
    /// A component of a normal is NaN or infinite.
    #[error("normal of vertex {vertex} is not finite")]
    NonFiniteNormal {
        /// Index of the vertex.
        vertex: usize,
    },
    /// The numbers of normals and positions differ.
    #[error("{normals} normals for {positions} positions")]
    NormalCount {
        /// The number of normals given.
        normals: usize,
        /// The number of positions given.
        positions: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} uses vertex {index} of {vertices}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex that it names.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// There are more vertices or triangles than 32-bit indices can name.
    #[error("{count} vertices or triangles, more than 32-bit indices can name")]
    TooLarge {
        /// The number of vertices or of triangles.
        count: usize,
    },
}

impl TriangleMesh {
    /// A mesh of shared vertices.
    ///
    /// Without normals, smooth ones are computed, weighted by the angles of the triangles at
    /// each vertex; vertices are joined by index, not by position. Normals given are brought to
    /// unit length, and those of zero length are replaced by smooth ones
    /// ([`replaced_normals`](Self::replaced_normals) counts them). Triangles of zero area are
    /// removed ([`removed_degenerate`](Self::removed_degenerate) counts them), which renumbers
    /// those after them.
    ///
    /// # Errors
    ///
    /// [`MeshError`] names the first vertex or triangle that is wrong.
    pub fn new(
        positions: Vec<Vec3>,
        normals: Option<Vec<Vec3>>,
        mut triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        validate_positions(&positions)?;
        validate_triangles(&triangles, positions.len())?;
        let given = triangles.len();
        triangles.retain(|corners| triangle_of(&positions, *corners).unit_normal().is_some());
        let removed_degenerate = given - triangles.len();
        let (normals, replaced_normals) = match normals {
            None => (smooth_normals(&positions, &triangles), 0),
            Some(normals) => unit_normals(normals, &positions, &triangles)?,
        };
        let bounds = Aabb::from_points(positions.iter().copied());
        Ok(Self {
            positions,
            normals,
            triangles,
            bounds,
            removed_degenerate,
            replaced_normals,
        })
    }

    /// A faceted mesh: every triangle gets three vertices of its own, with its own normal.
    ///
    /// # Errors
    ///
    /// As [`TriangleMesh::new`]; the vertices in errors are those given.
    pub fn with_flat_normals(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
    ) -> Result<Self, MeshError> {
        validate_positions(positions)?;
        validate_triangles(triangles, positions.len())?;
        if triangles.len() > u32::MAX as usize / 3 {
            return Err(MeshError::TooLarge {
                count: triangles.len(),
            });
        }
        let mut own_positions = Vec::with_capacity(3 * triangles.len());
        let mut normals = Vec::with_capacity(3 * triangles.len());
        for corners in triangles {
            let triangle = triangle_of(positions, *corners);
            if let Some(normal) = triangle.unit_normal() {
                own_positions.extend([triangle.a, triangle.b, triangle.c]);
                normals.extend([normal; 3]);
            }
        }
        let kept = own_positions.len() / 3;
        let own_triangles = (0..kept as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        let mut mesh = Self::new(own_positions, Some(normals), own_triangles)?;
        mesh.removed_degenerate = triangles.len() - kept;
        Ok(mesh)
    }

    /// The vertices' positions, in metres.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The vertices' unit normals, as many as positions.
    #[must_use]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// The vertex indices of each triangle, counterclockwise as seen from the front.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The triangle of this index, or none past the last.
    #[must_use]
    pub fn triangle(&self, index: usize) -> Option<Triangle> {
        self.triangles
            .get(index)
            .map(|corners| triangle_of(&self.positions, *corners))
    }

    /// The smallest box around all positions.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The area of all triangles, in square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        // Summed in f64: a million small areas would not add up in f32.
        let areas = self.triangles.iter().map(|corners| {
            let triangle = triangle_of(&self.positions, *corners);
            f64::from(triangle.area())
        });
        areas.sum::<f64>() as f32
    }

    /// How many triangles of zero area were removed when the mesh was made.
    #[must_use]
    pub fn removed_degenerate(&self) -> usize {
        self.removed_degenerate
    }

    /// How many normals of zero length were replaced when the mesh was made.
    #[must_use]
    pub fn replaced_normals(&self) -> usize {
        self.replaced_normals
    }

    /// The volume that a closed mesh encloses, in cubic metres: positive if it winds outwards.
    ///
    /// Meaningless for an open mesh; see [`is_closed`](Self::is_closed).
    #[must_use]
    pub fn signed_volume(&self) -> f32 {
        // Measured from the center, in f64: the terms of a far mesh would cancel.
        let center = self.bounds.center().as_dvec3();
        let volumes = self.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|i| self.positions[i as usize].as_dvec3() - center);
            a.dot(b.cross(c))
        });
        (volumes.sum::<f64>() / 6.0) as f32
    }

    /// Whether every edge runs once in each direction, so that the mesh has an inside.
    ///
    /// Vertices count as the same if their positions are equal, whatever their normals.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let mut welded = HashMap::with_capacity(self.positions.len());
        let mut balance: HashMap<(u32, u32), [u32; 2]> = HashMap::new();
        for corners in &self.triangles {
            let corners = corners.map(|index| {
                // Adding zero turns -0 into +0, which is the same place.
                let place = (self.positions[index as usize] + Vec3::ZERO).to_array();
                *welded.entry(place.map(f32::to_bits)).or_insert(index)
            });
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                let backwards = usize::from(from > to);
                balance.entry((from.min(to), from.max(to))).or_default()[backwards] += 1;
            }
        }
        balance.values().all(|count| *count == [1, 1])
    }

    /// The mesh under an affine map.
    ///
    /// Normals follow the inverse transpose. A map that mirrors turns the winding round, so that
    /// the outside stays outside. Triangles that the map flattens are removed and counted.
    ///
    /// # Errors
    ///
    /// [`MeshError::NonFinitePosition`] or [`MeshError::PositionOutOfRange`] where the map leads
    /// there.
    pub fn transformed(&self, map: &Affine3A) -> Result<Self, MeshError> {
        let linear = Mat3::from(map.matrix3);
        let mirrors = linear.determinant() < 0.0;
        // The cofactor matrix is the inverse transpose times the determinant, and exists for
        // flattening maps as well.
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let scale = x.abs().max(y.abs()).max(z.abs()).max_element();
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let (x, y, z) = (x / scale, y / scale, z / scale);
        let cofactor = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let outward = if mirrors { -1.0 } else { 1.0 };
        let positions = self
            .positions
            .iter()
            .map(|p| map.transform_point3(*p))
            .collect();
        let normals = self
            .normals
            .iter()
            .map(|normal| outward * (cofactor * *normal))
            .collect();
        let triangles = self
            .triangles
            .iter()
            .map(|&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] })
            .collect();
        Self::new(positions, Some(normals), triangles)
    }
}

fn triangle_of(positions: &[Vec3], corners: [u32; 3]) -> Triangle {
    let [a, b, c] = corners.map(|index| positions[index as usize]);
    Triangle { a, b, c }
}

fn validate_positions(positions: &[Vec3]) -> Result<(), MeshError> {
    if positions.len() > u32::MAX as usize {
        return Err(MeshError::TooLarge {
            count: positions.len(),
        });
    }
    for (vertex, position) in positions.iter().enumerate() {
        if !position.is_finite() {
            return Err(MeshError::NonFinitePosition { vertex });
        }
        if position.abs().max_element() > LARGEST_COORDINATE {
            return Err(MeshError::PositionOutOfRange {
                vertex,
                limit: LARGEST_COORDINATE,
            });
        }
    }
    Ok(())
}

fn validate_triangles(triangles: &[[u32; 3]], vertices: usize) -> Result<(), MeshError> {
    if triangles.len() > u32::MAX as usize {
        return Err(MeshError::TooLarge {
            count: triangles.len(),
        });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        for &index in corners {
            if index as usize >= vertices {
                return Err(MeshError::IndexOutOfRange {
                    triangle,
                    index,
                    vertices,
                });
            }
        }
    }
    Ok(())
}

/// Normals given, brought to unit length, and how many had to be replaced.
fn unit_normals(
    mut normals: Vec<Vec3>,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
) -> Result<(Vec<Vec3>, usize), MeshError> {
    if normals.len() != positions.len() {
        return Err(MeshError::NormalCount {
            normals: normals.len(),
            positions: positions.len(),
        });
    }
    let mut missing = Vec::new();
    for (vertex, normal) in normals.iter_mut().enumerate() {
        if !normal.is_finite() {
            return Err(MeshError::NonFiniteNormal { vertex });
        }
        match direction(*normal) {
            Some(unit) => *normal = unit,
            None => missing.push(vertex),
        }
    }
    if !missing.is_empty() {
        let smooth = smooth_normals(positions, triangles);
        for &vertex in &missing {
            normals[vertex] = smooth[vertex];
        }
    }
    Ok((normals, missing.len()))
}
