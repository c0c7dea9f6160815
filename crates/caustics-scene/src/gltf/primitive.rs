//! Meshes from primitives.

use super::accessor::AccessorReader;
use super::document::is_supported;
use super::element::Element;
use super::error::GltfError;
use super::warning::{WarningKind, Warnings};
use crate::scene::MeshId;
use ::gltf::json;
use caustics_geometry::TriangleMesh;
use glam::Vec3;
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
use std::collections::HashMap;
use std::rc::Rc;

/// Triangles that any file may have, however short.
const FREE_TRIANGLES: u64 = 1 << 16;

/// What makes two primitives the same mesh.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
struct Key {
    positions: usize,
    normals: Option<usize>,
    indices: Option<usize>,
    mode: u32,
}

/// Turns primitives into meshes, each distinct one once.
#[derive(Debug)]
pub(crate) struct PrimitiveReader<'a> {
    accessors: AccessorReader<'a>,
    /// Positions and normals already read, by accessor: writers like to share one among many
    /// primitives.
    vectors: HashMap<usize, Rc<Vec<Vec3>>>,
    meshes: HashMap<Key, Option<MeshId>>,
    triangles: u64,
}

impl<'a> PrimitiveReader<'a> {
    pub(crate) fn new(accessors: AccessorReader<'a>) -> Self {
        Self {
            accessors,
            vectors: HashMap::new(),
            meshes: HashMap::new(),
            triangles: 0,
        }
    }

    /// The mesh of a primitive, as what `add` makes of it the first time; `None` where it has no
    /// triangles.
    pub(crate) fn mesh(
        &mut self,
        primitive: &json::mesh::Primitive,
        element: &Element,
        warnings: &mut Warnings,
        add: impl FnOnce(TriangleMesh) -> MeshId,
    ) -> Result<Option<MeshId>, GltfError> {
        report(primitive, element, warnings);
        let Checked::Valid(mode) = primitive.mode else {
            let message = "has a mode that does not exist".to_owned();
            return Err(GltfError::Json {
                place: element.to_string(),
                message,
            });
        };
        if let Some(mode) = without_area(mode) {
            warnings.push(element, WarningKind::PrimitiveMode { mode });
            return Ok(None);
        }
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
        let Some(positions) = attribute(Semantic::Positions) else {
            warnings.push(element, WarningKind::NoPositions);
            return Ok(None);
        };
        let key = Key {
            positions: positions.value(),
            normals: attribute(Semantic::Normals).map(json::Index::value),
            indices: primitive.indices.map(|index| index.value()),
            mode: mode.as_gl_enum(),
        };
        if let Some(mesh) = self.meshes.get(&key) {
            return Ok(*mesh);
        }
        let mesh = self.build(key, mode, element, warnings)?.map(add);
        self.meshes.insert(key, mesh);
        Ok(mesh)
    }

    fn build(
        &mut self,
        key: Key,
        mode: Mode,
        element: &Element,
        warnings: &mut Warnings,
    ) -> Result<Option<TriangleMesh>, GltfError> {
        let positions = self.vectors(key.positions, "positions", element)?;
        let normals = match key.normals {
            Some(normals) => Some(self.vectors(normals, "normals", element)?),
            None => None,
        };
        if let Some(normals) = normals
            .as_ref()
            .filter(|list| list.len() != positions.len())
        {
            return Err(GltfError::NormalCount {
                element: element.clone(),
                positions: positions.len(),
                normals: normals.len(),
            });
        }
        let indices = match key.indices {
            Some(indices) => self.accessors.indices(indices, || element.clone())?,
            // Accessors are in memory: there are fewer than 2^32 vectors of 12 bytes, or the cut
            // range leaves some out, which is better than a wrong number.
            None => (0..u32::try_from(positions.len()).unwrap_or(u32::MAX)).collect(),
        };
        check_indices(&indices, positions.len(), element)?;
        let (triangles, rest) = assemble(&indices, mode);
        if rest > 0 {
            warnings.push(element, WarningKind::IncompleteTriangle { indices: rest });
        }
        self.count(triangles.len(), element)?;

        let (used, triangles) = renumber(triangles, positions.len());
        let gather = |list: &[Vec3]| used.iter().map(|&vertex| list[vertex as usize]).collect();
        let positions: Vec<Vec3> = gather(&positions);
        let normals: Option<Vec<Vec3>> = normals.map(|normals| gather(&normals));
        let mesh = match normals {
            Some(normals) => TriangleMesh::new(positions, Some(normals), triangles),
            None => TriangleMesh::with_flat_normals(&positions, &triangles),
        }
        .map_err(|source| GltfError::Mesh {
            element: element.clone(),
            source,
        })?;

        if mesh.removed_degenerate() > 0 {
            let count = mesh.removed_degenerate();
            warnings.push(element, WarningKind::DegenerateTriangles { count });
        }
        if mesh.replaced_normals() > 0 {
            let count = mesh.replaced_normals();
            warnings.push(element, WarningKind::ZeroNormals { count });
        }
        if mesh.triangles().is_empty() {
            warnings.push(element, WarningKind::NoTriangles);
            return Ok(None);
        }
        Ok(Some(mesh))
    }

    fn vectors(
        &mut self,
        accessor: usize,
        usage: &'static str,
        element: &Element,
    ) -> Result<Rc<Vec<Vec3>>, GltfError> {
        if let Some(vectors) = self.vectors.get(&accessor) {
            return Ok(Rc::clone(vectors));
        }
        let vectors = Rc::new(
            self.accessors
                .vectors(accessor, usage, || element.clone())?,
        );
        self.vectors.insert(accessor, Rc::clone(&vectors));
        Ok(vectors)
    }

    /// Keeps a short file from asking for many triangles by using the same data again and again.
    /// Triangles of an honest file take more than a byte each.
    fn count(&mut self, triangles: usize, element: &Element) -> Result<(), GltfError> {
        self.triangles += triangles as u64;
        let limit = self
            .accessors
            .buffers
            .total_bytes()
            .saturating_add(FREE_TRIANGLES);
        if self.triangles > limit {
            return Err(GltfError::TooManyTriangles {
                element: element.clone(),
                count: self.triangles,
            });
        }
        Ok(())
    }
}

/// Notes what a primitive has that is not modelled.
fn report(primitive: &json::mesh::Primitive, element: &Element, warnings: &mut Warnings) {
    let colored =
        |semantic: &Checked<Semantic>| matches!(semantic, Checked::Valid(Semantic::Colors(_)));
    if primitive.attributes.keys().any(colored) {
        warnings.push(element, WarningKind::VertexColors);
    }
    if primitive
        .targets
        .as_ref()
        .is_some_and(|targets| !targets.is_empty())
    {
        warnings.push(element, WarningKind::MorphTargets);
    }
    for name in primitive
        .extensions
        .iter()
        .flat_map(|extensions| extensions.others.keys())
    {
        if !is_supported(name) {
            warnings.push(element, WarningKind::Extension { name: name.clone() });
        }
    }
}

/// The name of a mode that draws no triangles.
fn without_area(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::Points => Some("points"),
        Mode::Lines | Mode::LineLoop | Mode::LineStrip => Some("lines"),
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => None,
    }
}

fn check_indices(indices: &[u32], vertices: usize, element: &Element) -> Result<(), GltfError> {
    match indices
        .iter()
        .position(|&vertex| vertex as usize >= vertices)
    {
        Some(position) => Err(GltfError::VertexIndex {
            element: element.clone(),
            position,
            vertex: indices[position],
            vertices,
        }),
        None => Ok(()),
    }
}

/// Triangles from a list, strip, or fan of indices, and how many indices were left over.
fn assemble(indices: &[u32], mode: Mode) -> (Vec<[u32; 3]>, usize) {
    match mode {
        Mode::TriangleStrip => {
            // Every other triangle is wound the other way; a repeated index is how strips are
            // joined, and makes no triangle.
            let triangles = indices.windows(3).enumerate().map(|(place, corner)| {
                let swap = place % 2;
                [corner[0], corner[1 + swap], corner[2 - swap]]
            });
            let distinct = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
            (triangles.filter(distinct).collect(), short(indices))
        }
        Mode::TriangleFan => {
            let edges = indices.get(1..).unwrap_or_default().windows(2);
            (
                edges.map(|edge| [edge[0], edge[1], indices[0]]).collect(),
                short(indices),
            )
        }
        _ => {
            let (triangles, rest) = indices.as_chunks::<3>();
            (triangles.to_vec(), rest.len())
        }
    }
}

/// Indices that are too few for a single triangle of a strip or fan.
fn short(indices: &[u32]) -> usize {
    if indices.len() < 3 { indices.len() } else { 0 }
}

/// The vertices that triangles use, in increasing order, and the triangles with vertices numbered
/// in that order.
fn renumber(mut triangles: Vec<[u32; 3]>, vertices: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    // Sorted, not marked, where there are many more vertices than corners, since a file may have
    // many small primitives of the same vertices.
    let used: Vec<u32> = if vertices > 3 * triangles.len() {
        let mut corners = triangles.as_flattened().to_vec();
        corners.sort_unstable();
        corners.dedup();
        corners
    } else {
        let mut marks = vec![false; vertices];
        for &corner in triangles.as_flattened() {
            marks[corner as usize] = true;
        }
        (0..)
            .zip(marks)
            .filter_map(|(vertex, marked)| marked.then_some(vertex))
            .collect()
    };
    if used.len() < vertices {
        for corner in triangles.as_flattened_mut() {
            // Every corner is among those used.
            *corner = used.partition_point(|vertex| vertex < corner) as u32;
        }
    }
    (used, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_alternate_and_may_be_joined() {
        let (triangles, rest) = assemble(&[0, 1, 2, 3, 3, 4, 4, 5, 6], Mode::TriangleStrip);
        assert_eq!(triangles, [[0, 1, 2], [1, 3, 2], [4, 5, 6]]);
        assert_eq!(rest, 0);
        assert_eq!(assemble(&[0, 1], Mode::TriangleStrip), (vec![], 2));
    }

    #[test]
    fn fans_share_their_first_vertex() {
        let (triangles, _) = assemble(&[9, 1, 2, 3], Mode::TriangleFan);
        assert_eq!(triangles, [[1, 2, 9], [2, 3, 9]]);
        assert_eq!(assemble(&[], Mode::TriangleFan), (vec![], 0));
    }

    #[test]
    fn a_rest_makes_no_triangle() {
        assert_eq!(
            assemble(&[0, 1, 2, 3, 4], Mode::Triangles),
            (vec![[0, 1, 2]], 2)
        );
    }

    #[test]
    fn unused_vertices_are_left_out() {
        for vertices in [8, 1000] {
            let (used, triangles) = renumber(vec![[7, 2, 5], [5, 2, 3]], vertices);
            assert_eq!(used, [2, 3, 5, 7]);
            assert_eq!(triangles, [[3, 0, 2], [2, 0, 1]]);
        }
        let (used, triangles) = renumber(vec![[2, 0, 1]], 3);
        assert_eq!((used, triangles), (vec![0, 1, 2], vec![[2, 0, 1]]));
    }
}
