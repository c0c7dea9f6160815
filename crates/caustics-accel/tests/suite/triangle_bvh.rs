//! The triangle tree against a brute-force search in f64.

use crate::common;

use caustics_accel::{AccelError, BvhOptions, BvhPreset, Instructions, Intersect, TriangleBvh};
use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{Hit, Ray};
use common::brute_force::{agrees, rays_at, soup, unit_coordinates};
use proptest::prelude::*;

fn options() -> impl Strategy<Value = BvhOptions> {
    let preset = prop::sample::select(vec![
        BvhPreset::FastestBuild,
        BvhPreset::FastBuild,
        BvhPreset::Balanced,
        BvhPreset::FastTrace,
    ]);
    let instructions = prop::sample::select(vec![Instructions::Detect, Instructions::Portable]);
    (preset, instructions).prop_map(|(preset, instructions)| BvhOptions {
        preset,
        instructions,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn agrees_with_brute_force(
        (positions, triangles) in soup(),
        options in options(),
        aims in prop::collection::vec((unit_coordinates(), unit_coordinates(), any::<[u8; 4]>()), 24),
    ) {
        let tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
        for ray in rays_at(&positions, &triangles, aims) {
            agrees(&positions, &triangles, &tree, &ray)?;
            agrees(&positions, &triangles, &tree, &Ray { t_min: 0.5, t_max: 1.1, ..ray })?;
        }
    }

    #[test]
    fn all_instructions_give_the_same_bits(
        (positions, triangles) in soup(),
        rays in prop::collection::vec((unit_coordinates(), unit_coordinates()), 32),
    ) {
        let build = |instructions| {
            let options = BvhOptions { instructions, ..BvhOptions::default() };
            TriangleBvh::new(&positions, &triangles, &options).unwrap()
        };
        let (detected, portable) = (build(Instructions::Detect), build(Instructions::Portable));
        let size = detected.bounds().diagonal().length().max(1e-3);
        let middle = if detected.is_empty() { Vec3::ZERO } else { detected.bounds().center() };
        for (from, to) in rays {
            let [from, to] = [from, to].map(|p| middle + Vec3::from_array(p) * size);
            let ray = Ray::new(from, to - from);
            prop_assert_eq!(detected.closest_hit(&ray), portable.closest_hit(&ray));
            prop_assert_eq!(detected.is_occluded(&ray), portable.is_occluded(&ray));
        }
    }
}

/// Rays from a small area through a fan of directions, many in one bundle, some along the axes.
fn fans() -> impl Strategy<Value = (Vec<Vec3>, Vec<Vec3>)> {
    let offset = prop::array::uniform3(-1.0_f32..1.0);
    (
        unit_coordinates(),
        unit_coordinates(),
        prop_oneof![Just(0.0_f32), Just(0.01), Just(0.05), Just(0.5)],
        prop_oneof![Just(0.0_f32), Just(0.01)],
        prop::array::uniform3(prop::bool::weighted(0.7)),
        prop::collection::vec((offset.clone(), offset), 0..200),
    )
        .prop_map(|(from, to, fan, area, axes, offsets)| {
            let axes = Vec3::from_array(axes.map(|kept| f32::from(u8::from(kept))));
            let (from, to) = (Vec3::from_array(from), Vec3::from_array(to));
            let direction = (to - from) * axes;
            offsets
                .into_iter()
                .map(|(p, d)| {
                    let d = Vec3::from_array(d) * axes * fan;
                    (from + Vec3::from_array(p) * area, direction + d)
                })
                .unzip()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn streams_find_what_single_rays_find(
        (positions, triangles) in soup(),
        (origins, directions) in fans(),
        range in prop_oneof![Just((0.0_f32, f32::INFINITY)), Just((0.5_f32, 1.1_f32))],
        options in options(),
    ) {
        let tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
        let size = tree.bounds().diagonal().length().max(1e-3);
        let middle = if tree.is_empty() { Vec3::ZERO } else { tree.bounds().center() };
        let rays: Vec<Ray> = origins
            .iter()
            .zip(&directions)
            .map(|(o, d)| Ray::with_range(middle + *o * size, *d * size, range.0, range.1))
            .collect();
        let single: Vec<Option<Hit>> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
        let mut streamed = vec![None; rays.len()];
        tree.closest_hits(&rays, &mut streamed);
        prop_assert_eq!(single, streamed);
    }
}

/// Lattices over a sphere, whose rays meet many of its vertices and edges exactly: from a point, and
/// all in the same direction; in rows and in squares.
#[test]
fn bundles_through_a_mesh_find_what_single_rays_find() {
    let (positions, triangles) = common::icosphere(4, Vec3::ZERO);
    let rows = (0..10_000_u32).map(|i| (i % 100, i / 100)).collect();
    let squares: Vec<(u32, u32)> = common::morton_cells(7).collect();
    let light = Vec3::new(0.1, 0.2, 4.0);
    for instructions in [Instructions::Detect, Instructions::Portable] {
        let options = BvhOptions {
            instructions,
            ..Default::default()
        };
        let tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
        for (cells, is_point) in [(&rows, true), (&squares, true), (&squares, false)] {
            let rays: Vec<Ray> = cells
                .iter()
                .map(|&(x, y): &(u32, u32)| {
                    let target = Vec3::new(x as f32 / 64.0 - 0.75, y as f32 / 64.0 - 0.75, 0.0);
                    if is_point {
                        Ray::new(light, target - light)
                    } else {
                        Ray::new(target + 4.0 * Vec3::Z, Vec3::NEG_Z)
                    }
                })
                .collect();
            let single: Vec<Option<Hit>> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
            assert!(single.iter().flatten().count() > 5000);
            let mut streamed = vec![None; rays.len()];
            tree.closest_hits(&rays, &mut streamed);
            assert_eq!(single, streamed);
            // The shorter slice counts.
            let mut few = vec![None; 85];
            tree.closest_hits(&rays, &mut few);
            assert_eq!(few, single[..85]);
            tree.closest_hits(&rays[..3], &mut streamed);
        }
    }
}

/// Each of two triangles in one place is hit as often as it comes first.
#[test]
fn of_triangles_in_one_place_streams_find_the_first() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let triangles = [[0, 1, 2]; 20];
    let tree = TriangleBvh::new(&corners, &triangles, &BvhOptions::default()).unwrap();
    let rays: Vec<Ray> = common::morton_cells(3)
        .map(|(x, y)| Ray::new([x as f32 / 8.0, y as f32 / 8.0, 1.0], Vec3::NEG_Z))
        .collect();
    let mut hits = vec![None; rays.len()];
    tree.closest_hits(&rays, &mut hits);
    let single: Vec<Option<Hit>> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
    assert_eq!(hits, single);
    assert!(hits.iter().flatten().count() > 30);
    assert!(hits.iter().flatten().all(|hit| hit.primitive == 0));
}

#[test]
fn empty_tree_is_never_hit() {
    let tree = TriangleBvh::new::<Vec3>(&[], &[], &BvhOptions::default()).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert!(tree.is_empty() && tree.bounds().is_empty());
    assert_eq!(tree.closest_hit(&ray), None);
    assert!(!tree.is_occluded(&ray));
}

#[test]
fn one_triangle() {
    let positions = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]];
    let tree = TriangleBvh::new(&positions, &[[0, 1, 2]], &BvhOptions::default()).unwrap();
    let ray = Ray::new(Vec3::new(0.25, 0.5, 1.0), Vec3::Z);
    assert_eq!(
        tree.closest_hit(&ray),
        Some(Hit {
            t: 4.0,
            u: 0.25,
            v: 0.5,
            primitive: 0
        })
    );
    let back = Ray::new(Vec3::new(0.25, 0.5, 9.0), Vec3::NEG_Z);
    assert_eq!(
        tree.closest_hit(&back),
        Some(Hit {
            t: 4.0,
            u: 0.25,
            v: 0.5,
            primitive: 0
        })
    );
    let strict = |t_min, t_max| {
        tree.closest_hit(&Ray {
            t_min,
            t_max,
            ..ray
        })
    };
    assert_eq!(strict(4.0, 9.0), None);
    assert_eq!(strict(0.0, 4.0), None);
    assert!(strict(3.999_999, 4.000_001).is_some());
    let away = Ray {
        t_min: -9.0,
        ..Ray::new(Vec3::new(0.25, 0.5, 9.0), Vec3::Z)
    };
    assert_eq!(
        tree.closest_hit(&away),
        None,
        "hits behind the origin do not count"
    );
}

#[test]
fn useless_rays_hit_nothing() {
    let positions = [[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]];
    let tree = TriangleBvh::new(&positions, &[[0, 1, 2]], &BvhOptions::default()).unwrap();
    let good = Ray::new(Vec3::NEG_Z, Vec3::Z);
    assert!(tree.is_occluded(&good));
    for bad in [
        Ray {
            direction: Vec3::ZERO,
            ..good
        },
        Ray {
            direction: Vec3::NAN,
            ..good
        },
        Ray {
            direction: Vec3::new(0.0, 0.0, f32::INFINITY),
            ..good
        },
        Ray {
            origin: Vec3::NAN,
            ..good
        },
        Ray {
            t_max: f32::NAN,
            ..good
        },
        Ray {
            t_max: -1.0,
            ..good
        },
        Ray {
            t_min: 2.0,
            t_max: 1.0,
            ..good
        },
    ] {
        assert_eq!(tree.closest_hit(&bad), None, "{bad:?}");
        assert!(!tree.is_occluded(&bad), "{bad:?}");
    }
}

#[test]
fn faces_of_a_box_are_hit_along_the_axes() {
    // Rays that run in the planes of boxes, where 0 * inf arises.
    let positions = [
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [1.0, 1.0, 1.0],
    ];
    let triangles = [[0, 1, 2], [1, 3, 2]];
    let tree = TriangleBvh::new(&positions, &triangles, &BvhOptions::default()).unwrap();
    for zero in [0.0, -0.0] {
        for (x, y) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (1.0, 1.0),
            (0.5, 0.0),
            (1.0, 0.25),
        ] {
            let ray = Ray::new(Vec3::new(x, y, 0.0), Vec3::new(zero, zero, 1.0));
            assert_eq!(
                tree.closest_hit(&ray).map(|hit| hit.t),
                Some(1.0),
                "{ray:?}"
            );
            let ray = Ray::new(Vec3::new(x, y, 2.0), Vec3::new(zero, -zero, -1.0));
            assert_eq!(
                tree.closest_hit(&ray).map(|hit| hit.t),
                Some(1.0),
                "{ray:?}"
            );
        }
    }
}

#[test]
fn a_hundred_thousand_copies_of_a_triangle() {
    let positions = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]];
    let triangles = vec![[0, 1, 2]; 100_000];
    for preset in [BvhPreset::FastestBuild, BvhPreset::Balanced] {
        let options = BvhOptions {
            preset,
            ..BvhOptions::default()
        };
        let tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
        let hit = tree
            .closest_hit(&Ray::new(Vec3::new(0.25, 0.25, 0.0), Vec3::Z))
            .unwrap();
        assert_eq!((hit.t, hit.primitive), (5.0, 0));
    }
}

#[test]
fn bad_meshes_are_refused() {
    let new = |positions: &[[f32; 3]], triangles: &[[u32; 3]]| {
        TriangleBvh::new(positions, triangles, &BvhOptions::default()).unwrap_err()
    };
    assert_eq!(
        new(&[[0.0; 3], [0.0, f32::NAN, 0.0]], &[[0, 1, 1]]),
        AccelError::NonFiniteVertex { vertex: 1 }
    );
    let limit = TriangleBvh::MAX_COORDINATE;
    assert_eq!(
        new(&[[-2e11, 0.0, 0.0]], &[[0, 0, 0]]),
        AccelError::VertexTooFar {
            vertex: 0,
            coordinate: 2e11,
            limit
        }
    );
    assert_eq!(
        new(&[[0.0; 3]], &[[0, 0, 0], [0, 0, 1]]),
        AccelError::VertexOutOfRange {
            triangle: 1,
            vertex: 1,
            vertices: 1
        }
    );
}

#[test]
fn distances_hold_from_tiny_to_huge() {
    for exponent in (-8..=10).step_by(3) {
        let scale = 10.0_f32.powi(exponent);
        let positions = [[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]]
            .map(|p| Vec3::from_array(p) * scale);
        let tree = TriangleBvh::new(&positions, &[[0, 1, 2]], &BvhOptions::default()).unwrap();
        let direction = DVec3::new(0.3, 0.2, 1.0).normalize().as_vec3();
        let hit = tree
            .closest_hit(&Ray::new(Vec3::NEG_Z * scale, direction))
            .unwrap();
        let expected = f64::from(scale) / f64::from(direction.z);
        assert!((f64::from(hit.t) / expected - 1.0).abs() < 3e-7, "{scale}");
    }
}

#[test]
fn refitted_trees_find_what_new_ones_find() {
    let (positions, triangles) = common::icosphere(4, Vec3::ZERO);
    let options = BvhOptions::default();
    let mut tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
    assert_eq!(tree.refit(&positions, &triangles), Ok(1.0));
    let twisted: Vec<Vec3> = positions
        .iter()
        .map(|p| {
            let (sin, cos) = (2.0 * p.y).sin_cos();
            Vec3::new(cos * p.x - sin * p.z, 1.5 * p.y, sin * p.x + cos * p.z) + Vec3::X
        })
        .collect();
    let worse = tree.refit(&twisted, &triangles).unwrap();
    assert!(worse > 1.05 && worse < 5.0, "{worse}");
    assert_eq!(
        (tree.cost_ratio(), tree.needs_rebuild()),
        (worse, worse > 1.5)
    );
    let fresh = TriangleBvh::new(&twisted, &triangles, &options).unwrap();
    assert_eq!(tree.bounds(), fresh.bounds());
    let mut found = 0;
    for i in 0..5000_u32 {
        let (a, b) = (i as f32 * 0.7, i as f32 * 0.1);
        let origin = Vec3::new(a.sin(), b.cos(), (a + b).cos()) * 3.0;
        let ray = Ray::new(origin, Vec3::new(1.0, 0.4 * b.sin(), 0.2) - origin);
        assert_eq!(tree.closest_hit(&ray), fresh.closest_hit(&ray));
        found += u32::from(fresh.is_occluded(&ray));
    }
    assert!(found > 2000);
    // Wrung out until neighbours in the tree are far from each other.
    let wrung: Vec<Vec3> = positions
        .iter()
        .map(|p| {
            let (sin, cos) = (12.0 * p.y).sin_cos();
            Vec3::new(cos * p.x - sin * p.z, p.y, sin * p.x + cos * p.z)
        })
        .collect();
    tree.refit(&wrung, &triangles).unwrap();
    assert!(tree.needs_rebuild());
    tree = TriangleBvh::new(&wrung, &triangles, &options).unwrap();
    assert!(tree.cost_ratio() == 1.0 && !tree.needs_rebuild());
}

#[test]
fn refitting_refuses_another_mesh() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangles = [[0, 1, 2], [0, 1, 1]];
    let mut tree = TriangleBvh::new(&positions, &triangles, &BvhOptions::default()).unwrap();
    assert_eq!(
        tree.refit(&positions, &triangles[..1]),
        Err(AccelError::TriangleCountChanged {
            given: 1,
            expected: 2
        })
    );
    assert_eq!(
        tree.refit(&positions, &[[0, 1, 2], [0, 1, 2]]),
        Err(AccelError::TriangleAppeared { triangle: 1 })
    );
    assert!(tree.refit(&positions, &triangles).is_ok());
}
