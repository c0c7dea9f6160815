//! Meshes in their places against the same meshes flattened into one.

use crate::common;

use std::sync::Arc;

use caustics_accel::{
    AccelError, BvhInstance, BvhOptions, InstanceBvh, Instructions, Intersect, TriangleBvh,
};
use caustics_geometry::glam::{Affine3A, DVec3, Quat, Vec3};
use caustics_geometry::{Aabb, Ray};
use common::brute_force::{agrees, rays_at, soup, unit_coordinates};
use common::{Aim, AimedRays, icosphere};
use proptest::prelude::*;

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

fn bvh_of((positions, triangles): &Mesh) -> Arc<TriangleBvh> {
    let options = BvhOptions::default();
    Arc::new(TriangleBvh::new(positions, triangles, &options).expect("a valid mesh"))
}

fn placed(mesh: &Arc<TriangleBvh>, transform: Affine3A) -> BvhInstance {
    BvhInstance {
        mesh: Arc::clone(mesh),
        transform,
    }
}

/// The meshes in the world, as one.
fn flattened(parts: &[(&Mesh, Affine3A)]) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for ((vertices, indices), transform) in parts {
        let first = positions.len() as u32;
        positions.extend(vertices.iter().map(|p| transform.transform_point3(*p)));
        let mirrors = transform.matrix3.determinant() < 0.0;
        triangles.extend(indices.iter().map(|&[a, b, c]| {
            let turned = if mirrors { [a, c, b] } else { [a, b, c] };
            turned.map(|vertex| vertex + first)
        }));
    }
    (positions, triangles)
}

/// Without triangles along an axis, which cannot be hit as long as they are not turned.
fn without_lines((positions, mut triangles): Mesh) -> Mesh {
    triangles.retain(|corners| {
        let size = Aabb::from_points(corners.map(|vertex| positions[vertex as usize])).diagonal();
        size.cmpgt(Vec3::ZERO).bitmask().count_ones() >= 2
    });
    (positions, triangles)
}

fn transforms() -> impl Strategy<Value = Affine3A> {
    let scale =
        prop_oneof![3 => 0.5_f32..2.0, 1 => Just(1.0), 1 => -2.0_f32..-0.5, 1 => 0.001_f32..0.01];
    (
        prop::array::uniform3(scale),
        prop::array::uniform4(-1.0_f32..1.0),
        unit_coordinates(),
        prop_oneof![Just(1.0_f32), Just(100.0), Just(1e4)],
    )
        .prop_map(|(scale, turn, shift, far)| {
            let turn = Quat::from_array(turn);
            let turn = if turn.length() > 0.1 {
                turn.normalize()
            } else {
                Quat::IDENTITY
            };
            let shift = Vec3::from_array(shift) * far;
            Affine3A::from_scale_rotation_translation(Vec3::from_array(scale), turn, shift)
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn agrees_with_brute_force_on_the_flattened_mesh(
        first in soup(),
        second in soup(),
        places in prop::collection::vec((any::<bool>(), transforms()), 0..8),
        aims in prop::collection::vec((unit_coordinates(), unit_coordinates(), any::<[u8; 4]>()), 24),
        instructions in prop::sample::select(vec![Instructions::Detect, Instructions::Portable]),
    ) {
        let meshes = [first, second].map(without_lines);
        let trees = [bvh_of(&meshes[0]), bvh_of(&meshes[1])];
        let parts: Vec<_> = places.iter().map(|&(which, at)| (&meshes[usize::from(which)], at)).collect();
        let (positions, triangles) = flattened(&parts);
        let instances = places.iter().map(|&(which, at)| placed(&trees[usize::from(which)], at));
        let ours = InstanceBvh::new(instances.collect(), instructions).unwrap();
        prop_assert_eq!(ours.len(), triangles.len());
        let corners = triangles.iter().flatten().map(|&vertex| positions[vertex as usize]);
        let bounds = Aabb::from_points(corners);
        prop_assert!(bounds.is_empty() || ours.bounds().union(&bounds) == ours.bounds());
        for ray in rays_at(&positions, &triangles, aims) {
            agrees(&positions, &triangles, &ours, &ray)?;
            agrees(&positions, &triangles, &ours, &Ray { t_min: 0.5, t_max: 1.1, ..ray })?;
        }
    }

    /// To the bit, but for slivers seen along their length: where on those a hit is, is uncertain
    /// by more than the size of a box, so that each order of search may find another one.
    #[test]
    fn finds_what_the_flattened_mesh_finds(
        places in prop::collection::vec(transforms(), 1..6),
        aims in prop::collection::vec((unit_coordinates(), unit_coordinates(), any::<[u8; 4]>()), 64),
        instructions in prop::sample::select(vec![Instructions::Detect, Instructions::Portable]),
    ) {
        let mesh = icosphere(2, Vec3::new(0.5, 0.0, 0.0));
        let tree = bvh_of(&mesh);
        let parts: Vec<_> = places.iter().map(|&at| (&mesh, at)).collect();
        let flat = flattened(&parts);
        let instances = places.iter().map(|&at| placed(&tree, at)).collect();
        let ours = InstanceBvh::new(instances, instructions).unwrap();
        let reference = bvh_of(&flat);
        let rays = rays_at(&flat.0, &flat.1, aims);
        // Rays from one of them to where the others go: many in a bundle.
        let fan: Vec<Ray> = rays
            .iter()
            .take(64)
            .map(|ray| Ray { direction: rays[0].direction + 0.05 * ray.direction, ..rays[0] })
            .collect();
        let mut streamed = vec![None; fan.len()];
        ours.closest_hits(&fan, &mut streamed);
        for (ray, hit) in fan.iter().zip(streamed) {
            prop_assert_eq!(ours.closest_hit(ray), hit, "{:?}", ray);
        }
        for ray in rays {
            prop_assert_eq!(ours.closest_hit(&ray), reference.closest_hit(&ray), "{:?}", ray);
            prop_assert_eq!(ours.is_occluded(&ray), reference.is_occluded(&ray), "{:?}", ray);
        }
    }
}

/// Lattices of rays over spheres in many places, so that the ways of a bundle lead into several of
/// them, and in some it enters boxes by different sides.
#[test]
fn streams_find_what_single_rays_find() {
    let tree = bvh_of(&icosphere(3, Vec3::ZERO));
    let instances: Vec<BvhInstance> = (0..60_u32)
        .map(|i| {
            let turn = Quat::from_euler(Default::default(), 0.3 * i as f32, 1.1, -2.0);
            let mirror = if i % 3 == 0 { -1.0 } else { 1.0 };
            let scale = Vec3::new(mirror, 1.0, 0.3 + 0.02 * i as f32);
            let shift = Vec3::new((i % 8) as f32, (i / 8) as f32, (i % 5) as f32);
            let transform = Affine3A::from_scale_rotation_translation(0.6 * scale, turn, shift);
            placed(&tree, transform)
        })
        .collect();
    for instructions in [Instructions::Detect, Instructions::Portable] {
        let ours = InstanceBvh::new(instances.clone(), instructions).unwrap();
        let light = Vec3::new(3.1, 4.2, 30.0);
        let towards = |(x, y): (u32, u32)| {
            let target = Vec3::new(x as f32 / 16.0 - 0.5, y as f32 / 16.0 - 0.5, 0.0);
            (light, target - light)
        };
        let along = |(x, y): (u32, u32)| {
            let from = Vec3::new(x as f32 / 16.0 - 0.5, y as f32 / 16.0 - 0.5, 9.0);
            (from, Vec3::NEG_Z)
        };
        let in_rows = (0..16_384_u32).map(|i| (i % 128, i / 128));
        let sets: [Vec<(Vec3, Vec3)>; 3] = [
            common::morton_cells(7).map(towards).collect(),
            common::morton_cells(7).map(along).collect(),
            in_rows.map(towards).collect(),
        ];
        for set in sets {
            let rays: Vec<Ray> = set.iter().map(|&(from, way)| Ray::new(from, way)).collect();
            let single: Vec<_> = rays.iter().map(|ray| ours.closest_hit(ray)).collect();
            assert!(single.iter().flatten().count() > 5000);
            let mut streamed = vec![None; rays.len()];
            ours.closest_hits(&rays, &mut streamed);
            assert_eq!(single, streamed);
        }
    }
}

/// Rays from inside a placed sphere, aimed at the edges and vertices of its flattened triangles.
fn escaped(transform: Affine3A, count: u64) -> u64 {
    let mesh = icosphere(5, Vec3::ZERO);
    let ours = InstanceBvh::new(
        vec![placed(&bvh_of(&mesh), transform)],
        Instructions::Detect,
    );
    let ours = ours.expect("a valid transform");
    let (positions, triangles) = flattened(&[(&mesh, transform)]);
    // Rays start within half of the unit sphere: the transforms must map that inside.
    let mut rays = AimedRays::new(&positions, &triangles, transform.translation.into());
    let mut escaped = 0;
    for aim in [Aim::Edge, Aim::Vertex] {
        for _ in 0..count {
            let ray = rays.next(aim);
            escaped += u64::from(ours.closest_hit(&ray).is_none());
            escaped += u64::from(!ours.is_occluded(&ray));
        }
    }
    escaped
}

#[test]
fn rays_at_edges_and_vertices_stay_inside_placed_meshes() {
    let turn = Quat::from_euler(Default::default(), 0.3, 1.1, -2.0);
    let far = Vec3::new(1000.0, -300.0, 20.0);
    for (scale, shift) in [
        (Vec3::ONE, Vec3::ZERO),
        (Vec3::splat(1.7), far),
        (Vec3::new(1.0, 40.0, -3.0), Vec3::ZERO),
        (Vec3::new(-1.0, 1000.0, 1.0), far),
    ] {
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, shift);
        assert_eq!(escaped(transform, 100_000), 0, "{scale} {shift}");
    }
}

/// The long count: 2.5 10^7 rays at edges and as many at vertices, in each of four places.
#[test]
#[ignore = "takes minutes: run with --release and --ignored"]
fn a_hundred_million_rays_stay_inside_placed_meshes() {
    for i in 0..4_u32 {
        let turn = Quat::from_rotation_x(0.7 + i as f32) * Quat::from_rotation_z(i as f32);
        let scale = Vec3::new(1.0 + i as f32, 1.0, 1.0 - 3.0 * (i % 2) as f32);
        let shift = Vec3::new(37.0, -4.0, 1.0) * i as f32;
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, shift);
        let escaped = escaped(transform, 12_500_000);
        println!("escaped of 5 10^7 questions: {escaped}");
        assert_eq!(escaped, 0);
    }
}

/// A hemisphere, and its image in a mirror: a closed sphere of two instances.
#[test]
fn nothing_escapes_between_instances_that_share_an_edge() {
    let (rows, columns) = (40_u32, 40_u32);
    let mut positions = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let theta = std::f64::consts::PI * f64::from(row) / f64::from(rows);
            let phi = std::f64::consts::PI * f64::from(column) / f64::from(columns);
            let p = DVec3::new(
                theta.sin() * phi.sin(),
                theta.cos(),
                theta.sin() * phi.cos(),
            );
            // Exactly in the mirror's plane.
            let on_rim = column == 0 || column == columns || row == 0 || row == rows;
            positions.push(if on_rim { p.with_x(0.0) } else { p }.as_vec3());
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let (b, c) = (a + 1, a + columns + 1);
            triangles.extend([[a, b, c], [b, c + 1, c]]);
        }
    }
    let rim: Vec<Vec3> = positions.iter().copied().filter(|p| p.x == 0.0).collect();
    let half = bvh_of(&(positions, triangles));
    let turn =
        Affine3A::from_rotation_y(0.4) * Affine3A::from_translation(Vec3::new(3.0, 1.0, 2.0));
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let instances = vec![placed(&half, turn), placed(&half, turn * mirror)];
    let whole = InstanceBvh::new(instances, Instructions::Detect).unwrap();
    let mut missed = 0;
    for i in 0..200_000_u32 {
        let a = rim[i as usize % rim.len()];
        let b = rim[(i as usize + 1) % rim.len()];
        let part = (i % 997) as f32 / 997.0;
        let target = turn.transform_point3(if i % 2 == 0 { a } else { a.lerp(b, part) });
        let turned = i as f32;
        let offset = Vec3::new(turned.sin(), (1.3 * turned).cos(), (2.1 * turned).sin()) * 0.2;
        let origin = turn.transform_point3(offset);
        missed += u32::from(
            whole
                .closest_hit(&Ray::new(origin, target - origin))
                .is_none(),
        );
    }
    assert_eq!(missed, 0);
}

#[test]
fn instances_move_and_change_without_new_meshes() {
    let mesh = icosphere(3, Vec3::ZERO);
    let tree = bvh_of(&mesh);
    let at = |x: f32| Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
    let instances = (0..100)
        .map(|i| placed(&tree, at(3.0 * i as f32)))
        .collect();
    let mut ours = InstanceBvh::new(instances, Instructions::Detect).unwrap();
    let down = |x: f32| Ray::new(Vec3::new(x + 0.1, 5.0, 0.05), Vec3::NEG_Y);
    for i in 0..100_u32 {
        let hit = ours.closest_hit(&down(3.0 * i as f32)).unwrap();
        assert_eq!(
            ours.locate(hit.primitive).map(|(instance, _)| instance),
            Some(i as usize)
        );
    }
    let triangles = tree.len() as u32;
    assert_eq!(ours.locate(triangles), Some((1, 0)));
    assert_eq!(ours.locate(100 * triangles), None);

    ours.set_transforms(&[(7, at(-50.0)), (8, at(-60.0))])
        .unwrap();
    assert_eq!(ours.closest_hit(&down(21.0)), None);
    let hit = ours.closest_hit(&down(-60.0)).unwrap();
    assert_eq!(
        ours.locate(hit.primitive).map(|(instance, _)| instance),
        Some(8)
    );

    let raised: Vec<Vec3> = mesh.0.iter().map(|p| *p + Vec3::Y).collect();
    let mut refitted = TriangleBvh::clone(&tree);
    refitted.refit(&raised, &mesh.1).unwrap();
    ours.set_mesh(8, Arc::new(refitted)).unwrap();
    assert!((ours.closest_hit(&down(-60.0)).unwrap().t - hit.t + 1.0).abs() < 1e-5);
    assert!((ours.closest_hit(&down(0.0)).unwrap().t - hit.t).abs() < 1e-5);
    assert_eq!(ours.instances().len(), 100);
    assert!(ours.memory_bytes() < 100 * 1000);
}

#[test]
fn what_cannot_be_placed_is_refused() {
    let tree = bvh_of(&icosphere(1, Vec3::ZERO));
    let limit = TriangleBvh::MAX_COORDINATE;
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let refused = AccelError::InvalidTransform { instance: 1, limit };
    let good = placed(&tree, Affine3A::IDENTITY);
    let error = InstanceBvh::new(
        vec![good.clone(), placed(&tree, flat)],
        Instructions::Detect,
    );
    assert_eq!(error.unwrap_err(), refused);
    let mut ours = InstanceBvh::new(vec![good.clone(), good], Instructions::Detect).unwrap();
    let away = (0, Affine3A::from_translation(Vec3::splat(9.0)));
    assert_eq!(ours.set_transforms(&[away, (1, flat)]), Err(refused));
    let absent = AccelError::NoSuchInstance {
        instance: 2,
        instances: 2,
    };
    assert_eq!(
        ours.set_transforms(&[away, (2, away.1)]),
        Err(absent.clone())
    );
    assert_eq!(ours.set_mesh(2, Arc::clone(&tree)), Err(absent));
    let other = bvh_of(&icosphere(0, Vec3::ZERO));
    assert!(matches!(
        ours.set_mesh(0, other),
        Err(AccelError::TriangleCountChanged {
            given: 20,
            expected: 80
        })
    ));
    // Nothing has moved.
    assert!(ours.is_occluded(&Ray::new(Vec3::ZERO, Vec3::X)));
}

#[test]
fn nothing_is_never_hit() {
    let empty = bvh_of(&(Vec::new(), Vec::new()));
    for instances in [vec![], vec![placed(&empty, Affine3A::IDENTITY)]] {
        let ours = InstanceBvh::new(instances, Instructions::Detect).unwrap();
        assert!(ours.is_empty());
        assert_eq!(ours.bounds(), Aabb::EMPTY);
        assert_eq!(ours.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert!(!ours.is_occluded(&Ray::new(Vec3::ZERO, Vec3::X)));
        assert_eq!(ours.locate(0), None);
    }
    // An empty mesh between others does not take a number.
    let one = bvh_of(&icosphere(0, Vec3::ZERO));
    let at = |mesh: &_| placed(mesh, Affine3A::IDENTITY);
    let ours = InstanceBvh::new(vec![at(&one), at(&empty), at(&one)], Instructions::Detect);
    assert_eq!(ours.unwrap().locate(20), Some((2, 0)));
}
