use std::ops::Range;

use caustics_scene::World;
use glam::Vec3;

/// The least cosine between the normals of two triangles that are one surface: what a footprint on one
/// of them lights of the other.
const SMOOTH_COSINE: f32 = 0.5;

/// The edges of triangles across which no other triangle goes on smoothly, in the order of the triangles.
pub(crate) fn sharp_edges(world: &World, triangles: Range<u32>) -> Vec<[u32; 2]> {
    let mut sides: Vec<Side> = triangles
        .filter_map(|triangle| Some((triangle, world.facet(triangle)?.normal)))
        .flat_map(|(triangle, normal)| {
            let [a, b, c] = world.triangles()[triangle as usize];
            [[a, b], [b, c], [c, a]].map(|vertices| Side { vertices, normal })
        })
        .collect();
    // Most triangles share vertices with those beside them, which is soon known of the others.
    let by_vertices = |side: &Side| {
        let [a, b] = side.vertices;
        [a.min(b), a.max(b)]
    };
    sides = kept_of_edges(sides, by_vertices, |edge| {
        if is_smooth(edge) { 0 } else { edge.len() }
    });
    // Where normals differ, each has vertices of its own. Both zeros are one place.
    let place = |vertex: u32| (world.positions()[vertex as usize] + 0.0).to_array();
    let by_places = |side: &Side| {
        let mut ends = side.vertices.map(|it| place(it).map(f32::to_bits));
        ends.sort_unstable();
        ends
    };
    sides = kept_of_edges(sides, by_places, |edge| usize::from(!is_smooth(edge)));
    sides.into_iter().map(|side| side.vertices).collect()
}

/// A side of a triangle.
#[derive(Clone, Copy)]
struct Side {
    vertices: [u32; 2],
    /// Of the triangle.
    normal: Vec3,
}

/// Whether the first of an edge's sides goes on smoothly in another.
fn is_smooth(edge: &[Side]) -> bool {
    let mut normals = edge.iter().map(|side| side.normal);
    normals
        .next()
        .is_some_and(|first| normals.any(|it| first.dot(it) >= SMOOTH_COSINE))
}

/// The sides that stay of edges, which are those of one key: as many of an edge's first as `kept` says, in
/// the order in which they came.
fn kept_of_edges<K: Ord>(
    sides: Vec<Side>,
    key: impl Fn(&Side) -> K,
    kept: impl Fn(&[Side]) -> usize,
) -> Vec<Side> {
    let mut keyed: Vec<(K, usize, Side)> = (0..)
        .zip(sides)
        .map(|(number, side)| (key(&side), number, side))
        .collect();
    keyed.sort_unstable_by(|a, b| (&a.0, a.1).cmp(&(&b.0, b.1)));
    let mut stay = Vec::new();
    for edge in keyed.chunk_by(|a, b| a.0 == b.0) {
        let sides: Vec<Side> = edge.iter().map(|it| it.2).collect();
        stay.extend(edge[..kept(&sides)].iter().map(|it| (it.1, it.2)));
    }
    stay.sort_unstable_by_key(|it| it.0);
    stay.into_iter().map(|it| it.1).collect()
}
