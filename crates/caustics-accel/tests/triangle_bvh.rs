//! The triangle tree against a brute-force search in f64.

mod common;

use caustics_accel::{AccelError, BvhOptions, BvhPreset, Instructions, Intersect, TriangleBvh};
use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{Hit, Ray};
use proptest::prelude::*;

/// Relative error that single precision is granted in each step; a few times its unit.
const STEP: f64 = 1e-6;

/// What double precision says about a ray and a triangle.
struct Verdict {
    /// The ray passes well inside the triangle's edges.
    certain: bool,
    /// It passes inside, or so close to an edge that single precision cannot tell.
    possible: bool,
    t: f64,
    t_error: f64,
}

/// Woop's test in double precision, with bounds for what single precision may make of it.
fn judge(ray: &Ray, triangle: [Vec3; 3]) -> Verdict {
    let origin = ray.origin.as_dvec3();
    let direction = ray.direction.as_dvec3().to_array();
    let z = ray.direction.abs().max_position();
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    // Sheared coordinates, and the magnitudes of the terms that they are the difference of.
    let mut place = [[0.0; 3]; 3];
    let mut size = [[0.0; 3]; 3];
    for (i, vertex) in triangle.iter().enumerate() {
        let p: [f64; 3] = (vertex.as_dvec3() - origin).to_array();
        for (out, axis) in [x, y].into_iter().enumerate() {
            let shear = direction[axis] / direction[z] * p[z];
            place[i][out] = p[axis] - shear;
            size[i][out] = p[axis].abs() + shear.abs();
        }
        place[i][2] = p[z];
    }
    let mut weights = [0.0; 3];
    let mut errors = [0.0; 3];
    for i in 0..3 {
        let (b, c) = ((i + 1) % 3, (i + 2) % 3);
        weights[i] = place[c][0] * place[b][1] - place[c][1] * place[b][0];
        errors[i] = STEP * (size[c][0] * size[b][1] + size[c][1] * size[b][0]);
    }
    let sum: f64 = weights.iter().sum();
    let sign = sum.signum();
    let certain = (0..3).all(|i| weights[i] * sign > errors[i]);
    let possible =
        (0..3).all(|i| weights[i] >= -errors[i]) || (0..3).all(|i| weights[i] <= errors[i]);
    let depth: f64 = (0..3).map(|i| weights[i] * place[i][2]).sum();
    let lowest = (0..3).map(|i| place[i][2]).fold(f64::INFINITY, f64::min);
    let highest = (0..3)
        .map(|i| place[i][2])
        .fold(f64::NEG_INFINITY, f64::max);
    let spread = (errors.iter().sum::<f64>() / sum.abs()).min(1.0) * (highest - lowest);
    let farthest = lowest.abs().max(highest.abs());
    // Inside the triangle the depth lies between the vertices' in any precision.
    let depth = if certain {
        depth / sum
    } else {
        (depth / sum).clamp(lowest, highest)
    };
    let depth = if depth.is_nan() { lowest } else { depth };
    let spread = if possible && !certain {
        highest - lowest
    } else {
        spread
    };
    Verdict {
        certain,
        possible,
        t: depth / direction[z],
        t_error: (spread + 4.0 * STEP * farthest) / direction[z].abs(),
    }
}

fn check(positions: &[Vec3], triangles: &[[u32; 3]], tree: &TriangleBvh, ray: &Ray) {
    let corners = |i: usize| triangles[i].map(|vertex| positions[vertex as usize]);
    let hit = tree.closest_hit(ray);
    let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
    let farthest = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t));
    for i in 0..triangles.len() {
        let verdict = judge(ray, corners(i));
        let (from, to) = (verdict.t - verdict.t_error, verdict.t + verdict.t_error);
        if verdict.certain && from > t_min && to < t_max {
            assert!(
                farthest <= to,
                "{ray:?} hits triangle {i} at {} +- {} and not {hit:?}",
                verdict.t,
                verdict.t_error
            );
            assert!(tree.is_occluded(ray), "{ray:?} is stopped by triangle {i}");
        }
    }
    if let Some(hit) = hit {
        let verdict = judge(ray, corners(hit.primitive as usize));
        assert!(verdict.possible, "{ray:?} passes by triangle {hit:?}");
        let off = (f64::from(hit.t) - verdict.t).abs();
        assert!(
            off <= verdict.t_error,
            "{ray:?} hits at {} instead of {}",
            hit.t,
            verdict.t
        );
        assert!(
            hit.t > ray.t_min && hit.t < ray.t_max,
            "{hit:?} is outside the range of {ray:?}"
        );
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        assert!(
            weights.iter().all(|w| (-1e-5..=1.00001).contains(w)),
            "{hit:?}"
        );
        assert!(tree.is_occluded(ray));
    }
}

fn unit_coordinates() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(
        prop_oneof![3 => -1.0_f32..1.0, 1 => (-2_i8..3).prop_map(|i| f32::from(i) / 2.0)],
    )
}

/// A soup of triangles: fat ones, slivers down to an aspect of 10^6, needles of no area, copies.
fn soup() -> impl Strategy<Value = (Vec<Vec3>, Vec<[u32; 3]>)> {
    let triangle = (
        unit_coordinates(),
        unit_coordinates(),
        unit_coordinates(),
        prop_oneof![Just(1.0_f32), Just(0.1), Just(1e-3), Just(1e-6), Just(0.0)],
        prop_oneof![Just(1.0_f32), Just(0.1)],
    );
    let scale = prop_oneof![Just(1.0_f32), Just(1e-4), Just(1e4)];
    let centre = prop_oneof![Just([0.0_f32; 3]), Just([1e4, -3e3, 50.0])];
    let copies = 1_usize..4;
    (
        prop::collection::vec(triangle, 0..150),
        scale,
        centre,
        copies,
    )
        .prop_map(|(triangles, scale, centre, copies)| {
            let mut positions = Vec::new();
            let mut indices = Vec::new();
            for (a, b, c, thickness, length) in triangles {
                let [a, b, c] = [a, b, c].map(Vec3::from_array);
                let first = positions.len() as u32;
                let along = (b - a) * length;
                for p in [a, a + along, a + along * 0.5 + (c - a) * thickness * length] {
                    positions.push(p * scale + Vec3::from_array(centre));
                }
                for _ in 0..copies {
                    indices.push([first, first + 1, first + 2]);
                }
            }
            (positions, indices)
        })
}

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
        rays in prop::collection::vec((unit_coordinates(), unit_coordinates(), any::<[u8; 4]>()), 24),
    ) {
        let tree = TriangleBvh::new(&positions, &triangles, &options).unwrap();
        let size = tree.bounds().diagonal().length().max(1e-3);
        for (from, to, [kind, choice, a, b]) in rays {
            let [from, to] = [from, to].map(Vec3::from_array);
            let middle = if tree.is_empty() { Vec3::ZERO } else { tree.bounds().center() };
            let origin = middle + from * size;
            let mut target = middle + to * size * 0.5;
            if !triangles.is_empty() && kind & 1 == 0 {
                // At a point of a triangle, so that most rays hit something.
                let corners = triangles[choice as usize % triangles.len()];
                let [p, q, r] = corners.map(|vertex| positions[vertex as usize]);
                let (u, v) = (f32::from(a) / 512.0, f32::from(b) / 512.0);
                target = p + (q - p) * u + (r - p) * v;
            }
            let mut direction = target - origin;
            if kind & 6 == 2 {
                // Along an axis.
                let axis = direction.abs().max_position();
                let mut along = Vec3::ZERO;
                along[axis] = direction[axis];
                direction = along;
            }
            if direction.length() < 1e-9 {
                continue;
            }
            let ray = Ray::new(origin, direction);
            check(&positions, &triangles, &tree, &ray);
            check(&positions, &triangles, &tree, &Ray { t_min: 0.5, t_max: 1.1, ..ray });
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
        prop::collection::vec((offset.clone(), offset), 0..100),
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

#[test]
fn bundles_through_a_mesh_find_what_single_rays_find() {
    let (positions, triangles) = common::icosphere(4, Vec3::ZERO);
    let tree = TriangleBvh::new(&positions, &triangles, &BvhOptions::default()).unwrap();
    let rays: Vec<Ray> = (0..10_000_u32)
        .map(|i| {
            let (x, y) = ((i % 100) as f32 / 80.0 - 0.7, (i / 100) as f32 / 80.0 - 0.6);
            Ray::new(
                Vec3::new(0.1, 0.2, 4.0),
                Vec3::new(x, y, 0.3) - Vec3::new(0.1, 0.2, 4.0),
            )
        })
        .collect();
    let single: Vec<Option<Hit>> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
    assert!(single.iter().flatten().count() > 5000);
    let mut streamed = vec![None; rays.len()];
    tree.closest_hits(&rays, &mut streamed);
    assert_eq!(single, streamed);
    // The shorter slice counts.
    let mut few = vec![None; 21];
    tree.closest_hits(&rays, &mut few);
    assert_eq!(few, single[..21]);
    tree.closest_hits(&rays[..3], &mut streamed);
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
