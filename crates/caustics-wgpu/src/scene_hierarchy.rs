//! The binary hierarchy that the shaders traverse.

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
    let spheres: Vec<_> = spheres.collect::<Vec<_>>();
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
