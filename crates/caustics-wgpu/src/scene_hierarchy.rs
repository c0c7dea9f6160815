//! The binary hierarchy that the shaders traverse.
//!
//! Binary, because its boxes are fitted anew in shaders, row by row, and because a node is two aligned
//! loads. That is a choice of design: in shaders no wide or compressed layout was measured against it.
//! On the CPU, where this workspace did measure, an eight-wide tree is the faster one.

use std::ops::Range;

use caustics_geometry::Aabb;
use caustics_scene::World;
use glam::{Vec3, Vec3A};
use obvhs::Boundable;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::body_order::BodyOrder;
use crate::gpu_scene::{NO_PRIMITIVE, Node, SPHERE_BIT};

/// Levels that the shader's stack has room for. A tree that needs more is built anew, by halving.
pub(crate) const MAX_LEVELS: u32 = 64;

/// Each box is wider on all sides by this part of the largest coordinate, so that a ray that runs in
/// the plane of a box's side is inside.
const MARGIN: f32 = 8.0 * f32::EPSILON;

/// All primitives of a world in a tree whose leaves hold one each; the root is node 0.
#[derive(Clone, Debug)]
pub(crate) struct SceneHierarchy {
    pub(crate) nodes: Vec<Node>,
    /// Inner nodes by their height above the leaves: those whose children are leaves first, so that
    /// a later one's children are all in earlier rows.
    pub(crate) rows: Vec<Vec<u32>>,
    pub(crate) margin: f32,
}

/// The box of a primitive.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    bounds: Aabb,
    primitive: u32,
}

impl Boundable for Leaf {
    /// The box, grown by up to a 200th, each by an amount of its own: of equal boxes the builder
    /// would find none that is the best partner of its best partner, and merge one pair a round.
    fn aabb(&self) -> obvhs::aabb::Aabb {
        let hash = self.primitive.wrapping_mul(0x9e37_79b9) >> 8;
        let amount = hash as f32 / (1 << 24) as f32;
        let size = self.bounds.diagonal().max_element();
        let magnitude = self.bounds.min.abs().max(self.bounds.max.abs());
        let growth = amount * (size / 256.0 + magnitude * (8.0 * f32::EPSILON));
        obvhs::aabb::Aabb::new(
            Vec3A::from(self.bounds.min - growth),
            Vec3A::from(self.bounds.max + growth),
        )
    }
}

impl SceneHierarchy {
    pub(crate) fn new(world: &World, order: &BodyOrder) -> Self {
        let leaves = leaves(world, order);
        let margin = margin(&world.bounds());
        let mut nodes = clustered(&leaves);
        let mut rows = rows(&nodes);
        if rows.len() as u32 >= MAX_LEVELS {
            nodes = halved(&leaves);
            rows = self::rows(&nodes);
        }
        let mut hierarchy = Self {
            nodes,
            rows,
            margin,
        };
        hierarchy.fit(&leaves);
        hierarchy
    }

    /// The first node to visit.
    pub(crate) fn root(&self) -> u32 {
        if self.nodes.is_empty() {
            NO_PRIMITIVE
        } else {
            0
        }
    }

    /// All nodes, so that children come before their parents, and the rows in which those lie that
    /// can be fitted at once.
    pub(crate) fn refit_order(&self) -> (Vec<u32>, Vec<Range<u32>>) {
        let is_leaf = |&node: &u32| self.nodes[node as usize].is_leaf != 0;
        let leaves: Vec<u32> = (0..self.nodes.len() as u32).filter(is_leaf).collect();
        let mut order = Vec::with_capacity(self.nodes.len());
        let mut rows = Vec::new();
        for row in std::iter::once(&leaves).chain(&self.rows) {
            let start = order.len() as u32;
            order.extend_from_slice(row);
            rows.push(start..order.len() as u32);
        }
        (order, rows)
    }

    /// Computes all boxes.
    fn fit(&mut self, leaves: &[Leaf]) {
        for node in &mut self.nodes {
            if node.is_leaf != 0 {
                let leaf = &leaves[node.first as usize];
                node.first = leaf.primitive;
                node.low = (leaf.bounds.min - self.margin).to_array();
                node.high = (leaf.bounds.max + self.margin).to_array();
            }
        }
        for &index in self.rows.iter().flatten() {
            let first = self.nodes[index as usize].first as usize;
            let [left, right] = [self.nodes[first], self.nodes[first + 1]];
            let node = &mut self.nodes[index as usize];
            node.low = Vec3::from(left.low).min(right.low.into()).to_array();
            node.high = Vec3::from(left.high).max(right.high.into()).to_array();
        }
    }
}

/// By how much every box in a scene of this size is wider than what it holds, in metres.
pub(crate) fn margin(bounds: &Aabb) -> f32 {
    if bounds.is_empty() {
        return 0.0;
    }
    MARGIN * bounds.min.abs().max(bounds.max.abs()).max_element()
}

fn leaves(world: &World, order: &BodyOrder) -> Vec<Leaf> {
    let triangles = (0..world.triangles().len() as u32).filter_map(|primitive| {
        let bounds = world.triangle(primitive)?.bounds();
        Some(Leaf { bounds, primitive })
    });
    let spheres = (0..).zip(world.objects()).filter_map(|(object, it)| {
        let sphere = world.spheres()[it.spheres.start as usize..it.spheres.end as usize].first()?;
        Some(Leaf {
            bounds: sphere.bounds(),
            primitive: SPHERE_BIT | order.bodies[object as usize],
        })
    });
    triangles.chain(spheres).collect()
}

/// Clusters neighbouring boxes from the bottom up: PLOC and parallel reinsertion (Meister, Bittner
/// 2018), by obvhs. Leaves are numbered by their place in the list.
fn clustered(leaves: &[Leaf]) -> Vec<Node> {
    let indices = (0..leaves.len() as u32).collect();
    let mut tree: Bvh2 = PlocBuilder::new().build(
        PlocSearchDistance::Low,
        leaves,
        indices,
        SortPrecision::U64,
        2,
    );
    ReinsertionOptimizer::default().run(&mut tree, 0.02, None);
    let nodes = tree.nodes.iter().map(|node| Node {
        first: node.first_index,
        is_leaf: u32::from(node.is_leaf()),
        ..Node::default()
    });
    nodes.collect()
}

/// Halves the primitives at the median of their centres: no deeper than their number's logarithm.
fn halved(leaves: &[Leaf]) -> Vec<Node> {
    let mut order: Vec<u32> = (0..leaves.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * leaves.len());
    nodes.push(Node::default());
    let mut waiting = vec![(0, 0, leaves.len())];
    while let Some((node, start, end)) = waiting.pop() {
        let slice = &mut order[start..end];
        if slice.len() == 1 {
            nodes[node].first = slice[0];
            nodes[node].is_leaf = 1;
            continue;
        }
        let center = |index: u32| leaves[index as usize].bounds.center();
        let centers = Aabb::from_points(slice.iter().map(|&index| center(index)));
        let axis = centers.diagonal().max_position();
        let middle = slice.len() / 2;
        slice.select_nth_unstable_by(middle, |&a, &b| {
            center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b))
        });
        nodes[node].first = nodes.len() as u32;
        waiting.push((nodes.len(), start, start + middle));
        waiting.push((nodes.len() + 1, start + middle, end));
        nodes.extend([Node::default(); 2]);
    }
    nodes
}

/// The inner nodes by height.
fn rows(nodes: &[Node]) -> Vec<Vec<u32>> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut waiting = Vec::new();
    waiting.extend((!nodes.is_empty()).then_some(0u32));
    while let Some(index) = waiting.pop() {
        let node = &nodes[index as usize];
        if node.is_leaf == 0 {
            order.push(index);
            waiting.extend([node.first, node.first + 1]);
        }
    }
    let mut heights = vec![0usize; nodes.len()];
    let mut rows: Vec<Vec<u32>> = Vec::new();
    for &index in order.iter().rev() {
        let first = nodes[index as usize].first as usize;
        let height = 1 + heights[first].max(heights[first + 1]);
        heights[index as usize] = height;
        if rows.len() < height {
            rows.resize_with(height, Vec::new);
        }
        rows[height - 1].push(index);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_geometry::shapes::icosphere;
    use caustics_scene::{Instance, Material, Scene, Shape};

    /// A faceted ball, and exact ones in a row.
    fn world(spheres: u32) -> World {
        let mut scene = Scene::new();
        let white = scene.add_material(Material::diffuse("", [0.5; 3])).unwrap();
        let mesh = Shape::Mesh(scene.add_mesh(icosphere(1.0, 2).unwrap()));
        let balls = (0..spheres).map(|place| Shape::Sphere {
            center: Vec3::new(3.0 + 1.5 * place as f32, 0.0, 0.0),
            radius: 0.5,
        });
        for shape in std::iter::once(mesh).chain(balls) {
            scene.add_instance(Instance::new("", shape, white)).unwrap();
        }
        World::new(&scene).unwrap()
    }

    fn contains(outer: &Node, inner: &Node) -> bool {
        (0..3)
            .all(|axis| outer.low[axis] <= inner.low[axis] && inner.high[axis] <= outer.high[axis])
    }

    #[test]
    fn every_primitive_is_in_one_leaf_and_all_boxes_above_it() {
        let world = world(3);
        let order = BodyOrder::new(&world).unwrap();
        let tree = SceneHierarchy::new(&world, &order);
        let mut found = Vec::new();
        for node in &tree.nodes {
            if node.is_leaf != 0 {
                found.push(node.first);
            } else {
                for child in [node.first, node.first + 1] {
                    assert!(contains(node, &tree.nodes[child as usize]));
                }
            }
        }
        found.sort_unstable();
        let triangles = 0..world.triangles().len() as u32;
        let expected = triangles.chain((1..4).map(|object| SPHERE_BIT | order.bodies[object]));
        assert_eq!(found, expected.collect::<Vec<_>>());
    }

    #[test]
    fn rows_hold_every_node_after_its_children() {
        let world = world(0);
        let tree = SceneHierarchy::new(&world, &BodyOrder::new(&world).unwrap());
        let (order, rows) = tree.refit_order();
        let mut row_of = vec![None; tree.nodes.len()];
        for (row, range) in rows.iter().enumerate() {
            for &node in &order[range.start as usize..range.end as usize] {
                assert_eq!(row_of[node as usize].replace(row), None);
            }
        }
        for (node, row) in tree.nodes.iter().zip(&row_of) {
            if node.is_leaf == 0 {
                assert!(row_of[node.first as usize] < *row);
                assert!(row_of[node.first as usize + 1] < *row);
            }
        }
        assert!(row_of.iter().all(Option::is_some));
        assert!((rows.len() as u32) < MAX_LEVELS);
    }

    #[test]
    fn halving_is_no_deeper_than_the_logarithm() {
        // All boxes alike: clusters could form a chain.
        let bounds = Aabb::new(Vec3::ZERO, Vec3::ONE);
        let leaves: Vec<Leaf> = (0..1000)
            .map(|primitive| Leaf { bounds, primitive })
            .collect();
        let nodes = halved(&leaves);
        assert_eq!(nodes.len(), 2 * leaves.len() - 1);
        assert_eq!(rows(&nodes).len(), 10);
    }

    #[test]
    fn an_empty_world_has_no_root_and_one_primitive_has_a_leaf() {
        let empty = World::new(&Scene::new()).unwrap();
        let tree = SceneHierarchy::new(&empty, &BodyOrder::new(&empty).unwrap());
        assert_eq!((tree.root(), tree.nodes.len()), (NO_PRIMITIVE, 0));
        let mut scene = Scene::new();
        let white = scene.add_material(Material::diffuse("", [0.5; 3])).unwrap();
        let shape = Shape::Sphere {
            center: Vec3::ZERO,
            radius: 1.0,
        };
        scene.add_instance(Instance::new("", shape, white)).unwrap();
        let one = World::new(&scene).unwrap();
        let tree = SceneHierarchy::new(&one, &BodyOrder::new(&one).unwrap());
        assert_eq!((tree.root(), tree.nodes.len()), (0, 1));
        assert_eq!(
            (tree.nodes[0].first, tree.nodes[0].is_leaf),
            (SPHERE_BIT, 1)
        );
    }
}
