//! The nodes of a scene and where they are in the world.

use super::document::{Document, follow};
use super::element::{Element, ElementKind};
use super::error::GltfError;
use ::gltf::json;
use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};

/// A node that belongs to the scene, in its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedNode {
    pub(crate) index: usize,
    /// World from node.
    pub(crate) transform: Affine3A,
}

/// The nodes of the scene to show, each parent before its children, and those in the file's order:
/// the default scene, or the first one, or, where there is none, everything.
pub(crate) fn placed_nodes(document: &Document) -> Result<Vec<PlacedNode>, GltfError> {
    let parents = parents(document)?;
    let roots = roots(document, &parents)?;
    let mut placed = Vec::with_capacity(document.nodes.len());
    // A stack of its own, since a file may nest nodes deeper than threads have stack.
    let mut stack: Vec<(usize, Affine3A)> = roots
        .iter()
        .rev()
        .map(|&root| (root, Affine3A::IDENTITY))
        .collect();
    while let Some((index, parent)) = stack.pop() {
        let node = &document.nodes[index];
        let transform = parent * local_transform(node, || document.node_element(index))?;
        if !transform.is_finite() {
            let problem = "transform is not finite in the world";
            return Err(GltfError::Transform {
                element: document.node_element(index),
                problem,
            });
        }
        placed.push(PlacedNode { index, transform });
        stack.extend(children(node).rev().map(|child| (child, transform)));
    }
    Ok(placed)
}

fn children(node: &json::Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(json::Index::value)
}

/// The parent of each node, having checked that nodes form trees.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, GltfError> {
    let mut parents = vec![None; document.nodes.len()];
    for (index, node) in document.nodes.iter().enumerate() {
        for child in children(node) {
            let from = || document.node_element(index);
            follow(&document.nodes, child, ElementKind::Node, from)?;
            if let Some(first) = parents[child].replace(index) {
                let element = document.node_element(child);
                return Err(GltfError::SeveralParents {
                    element,
                    first,
                    second: index,
                });
            }
        }
    }
    // With one parent each, nodes that no root leads to go round in a circle.
    let mut reached = vec![false; parents.len()];
    let mut stack: Vec<usize> = (0..parents.len())
        .filter(|&node| parents[node].is_none())
        .collect();
    while let Some(node) = stack.pop() {
        reached[node] = true;
        stack.extend(children(&document.nodes[node]));
    }
    match reached.iter().position(|reached| !reached) {
        Some(index) => Err(GltfError::Cycle {
            element: document.node_element(index),
        }),
        None => Ok(parents),
    }
}

fn roots(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, GltfError> {
    let count = document.scenes.len();
    let index = match document.default_scene {
        Some(index) if index >= count => return Err(GltfError::DefaultScene { index, count }),
        Some(index) => index,
        None if count > 0 => 0,
        None => {
            return Ok((0..parents.len())
                .filter(|&node| parents[node].is_none())
                .collect());
        }
    };
    let element = || document.scene_element(index);
    let mut roots = Vec::new();
    let mut listed = vec![false; parents.len()];
    for node in &document.scenes[index].nodes {
        let node = node.value();
        follow(&document.nodes, node, ElementKind::Node, element)?;
        let reason = match parents[node] {
            Some(parent) => Some(format!("it is a child of node {parent}")),
            None => listed[node].then(|| "it has listed it before".to_owned()),
        };
        if let Some(reason) = reason {
            return Err(GltfError::NotARoot {
                element: element(),
                node,
                reason,
            });
        }
        listed[node] = true;
        roots.push(node);
    }
    Ok(roots)
}

fn local_transform(
    node: &json::Node,
    element: impl FnOnce() -> Element,
) -> Result<Affine3A, GltfError> {
    let checked = match &node.matrix {
        Some(matrix) => from_matrix(matrix),
        None => from_parts(node),
    };
    checked.map_err(|problem| GltfError::Transform {
        element: element(),
        problem,
    })
}

fn from_matrix(columns: &[f32; 16]) -> Result<Affine3A, &'static str> {
    let column = |index: usize| Vec3A::from_slice(&columns[4 * index..]);
    let last_row = [3, 7, 11, 15].map(|index| columns[index]);
    if columns.iter().any(|value| !value.is_finite()) {
        return Err("matrix is not finite");
    }
    if last_row != [0.0, 0.0, 0.0, 1.0] {
        return Err("matrix does not have the last row 0 0 0 1");
    }
    let matrix3 = Mat3A::from_cols(column(0), column(1), column(2));
    Ok(Affine3A {
        matrix3,
        translation: column(3),
    })
}

fn from_parts(node: &json::Node) -> Result<Affine3A, &'static str> {
    let translation = node.translation.map_or(Vec3::ZERO, Vec3::from);
    let scale = node.scale.map_or(Vec3::ONE, Vec3::from);
    let rotation = node
        .rotation
        .map_or(Quat::IDENTITY, |rotation| Quat::from_array(rotation.0));
    if !(translation.is_finite() && scale.is_finite() && rotation.is_finite()) {
        return Err("translation, rotation, or scale is not finite");
    }
    let length = rotation.length();
    if !(length.is_finite() && length > 1e-6) {
        return Err("rotation has no direction");
    }
    Ok(Affine3A::from_scale_rotation_translation(
        scale,
        rotation.normalize(),
        translation,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_comes_before_rotation_and_rotation_before_translation() {
        let half = 0.5f32.sqrt();
        let node = json::Node {
            translation: Some([10.0, 20.0, 30.0]),
            // A quarter turn about z, and not of unit length.
            rotation: Some(json::scene::UnitQuaternion([
                0.0,
                0.0,
                2.0 * half,
                2.0 * half,
            ])),
            scale: Some([2.0, 3.0, 4.0]),
            ..json::Node::default()
        };
        let transform = from_parts(&node).unwrap();
        let point = transform.transform_point3(Vec3::ONE);
        assert!(
            point.abs_diff_eq(Vec3::new(10.0 - 3.0, 20.0 + 2.0, 30.0 + 4.0), 1e-5),
            "{point}"
        );
    }

    #[test]
    fn matrices_are_column_major_and_affine() {
        let mut columns = [0.0; 16];
        (columns[0], columns[5], columns[10], columns[15]) = (1.0, 1.0, 1.0, 1.0);
        columns[12..15].copy_from_slice(&[7.0, 8.0, 9.0]);
        let transform = from_matrix(&columns).unwrap();
        assert_eq!(
            transform,
            Affine3A::from_translation(Vec3::new(7.0, 8.0, 9.0))
        );
        columns[3] = 0.1;
        assert!(from_matrix(&columns).is_err());
        columns[3] = f32::NAN;
        assert!(from_matrix(&columns).is_err());
    }
}
