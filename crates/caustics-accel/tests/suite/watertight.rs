//! No ray leaves a closed mesh.

use crate::common;

use caustics_accel::{BvhOptions, Instructions, Intersect, TriangleBvh};
use caustics_geometry::glam::Vec3;
use caustics_geometry::{PrecomputedTriangle, Ray, Triangle};
use common::{Aim, AimedRays, icosphere};

/// How many of `count` rays from inside a closed mesh hit nothing.
fn escaped(tree: &impl Intersect, rays: &mut AimedRays<'_>, aim: Aim, count: u64) -> u64 {
    let mut escaped = 0;
    for _ in 0..count {
        let ray = rays.next(aim);
        escaped += u64::from(tree.closest_hit(&ray).is_none());
        escaped += u64::from(!tree.is_occluded(&ray));
    }
    escaped
}

fn escaped_from_icosphere(instructions: Instructions, centre: Vec3, count: u64) -> [u64; 2] {
    let (positions, triangles) = icosphere(5, centre);
    let options = BvhOptions {
        instructions,
        ..BvhOptions::default()
    };
    let tree = TriangleBvh::new(&positions, &triangles, &options).expect("a valid mesh");
    let mut rays = AimedRays::new(&positions, &triangles, centre);
    [Aim::Edge, Aim::Vertex].map(|aim| escaped(&tree, &mut rays, aim, count))
}

#[test]
fn a_million_rays_at_edges_and_vertices_stay_inside() {
    let escaped = escaped_from_icosphere(Instructions::Detect, Vec3::ZERO, 1_000_000);
    assert_eq!(escaped, [0, 0], "at edges, at vertices");
}

#[test]
fn far_from_the_origin_they_stay_inside_too() {
    let centre = Vec3::new(1000.0, -300.0, 20.0);
    assert_eq!(
        escaped_from_icosphere(Instructions::Detect, centre, 200_000),
        [0, 0]
    );
}

#[test]
fn portable_instructions_leak_no_more() {
    assert_eq!(
        escaped_from_icosphere(Instructions::Portable, Vec3::ZERO, 100_000),
        [0, 0]
    );
}

/// As the photons of a lattice go: sixteen or 64 of them through the same few triangles.
#[test]
fn bundles_aimed_at_one_vertex_stay_inside() {
    let (positions, triangles) = icosphere(5, Vec3::ZERO);
    let tree = TriangleBvh::new(&positions, &triangles, &BvhOptions::default()).expect("a mesh");
    for (i, &vertex) in positions.iter().enumerate() {
        let rays: Vec<Ray> = (0..64)
            .map(|ray| {
                let turn = (ray + i) as f32;
                let offset = Vec3::new(turn.sin(), turn.cos(), (2.0 * turn).sin()) * 0.01;
                Ray::new(offset, vertex - offset)
            })
            .collect();
        for bundle in [16, 64] {
            let mut hits = vec![None; bundle];
            tree.closest_hits(&rays[..bundle], &mut hits);
            assert!(hits.iter().all(Option::is_some), "vertex {i}");
        }
    }
}

/// The control: a test that is known not to be watertight lets the same rays through.
#[test]
fn the_same_rays_escape_through_moeller_trumbore() {
    struct EveryTriangle(Vec<PrecomputedTriangle>);
    impl Intersect for EveryTriangle {
        fn closest_hit(&self, ray: &Ray) -> Option<caustics_geometry::Hit> {
            let hit = self.0.iter().find_map(|triangle| triangle.intersect(ray))?;
            Some(caustics_geometry::Hit {
                t: hit.t,
                u: hit.u,
                v: hit.v,
                primitive: 0,
            })
        }
    }
    let (positions, triangles) = icosphere(2, Vec3::ZERO);
    let every = EveryTriangle(
        triangles
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
                PrecomputedTriangle::new(&Triangle::new(a, b, c))
            })
            .collect(),
    );
    let mut rays = AimedRays::new(&positions, &triangles, Vec3::ZERO);
    let [edge, vertex] =
        [Aim::Edge, Aim::Vertex].map(|aim| escaped(&every, &mut rays, aim, 20_000));
    println!("escaped of 40000 questions each: {edge} at edges, {vertex} at vertices");
    assert!(edge > 100 && vertex > 100);
}

/// The long count: 10^8 rays at shared edges and 10^8 at vertices.
#[test]
#[ignore = "takes minutes: run with --release and --ignored"]
fn a_hundred_million_rays_at_edges_and_vertices_stay_inside() {
    let escaped = escaped_from_icosphere(Instructions::Detect, Vec3::ZERO, 100_000_000);
    println!("escaped at edges and at vertices: {escaped:?} of 10^8 each");
    assert_eq!(escaped, [0, 0], "at edges, at vertices");
}
