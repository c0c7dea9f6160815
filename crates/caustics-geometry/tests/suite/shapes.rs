//! Mesh generators: closed solids wind outwards, and areas, volumes and normals are those of the
//! shapes that they stand for.

use std::collections::HashMap;
use std::f32::consts::{FRAC_PI_6, PI};

use caustics_geometry::glam::{DVec3, UVec2, Vec2, Vec3};
use caustics_geometry::shapes::{self, ProfilePoint, RevolutionOptions, ShapeError};
use caustics_geometry::{MeshError, TriangleMesh};
use proptest::prelude::*;

/// Every edge runs once each way between places, counted without the library's own `is_closed`.
fn edges_pair_up(mesh: &TriangleMesh) -> bool {
    let mut balance: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    let place = |i: u32| {
        (mesh.positions()[i as usize] + Vec3::ZERO)
            .to_array()
            .map(f32::to_bits)
    };
    for corners in mesh.triangles() {
        for k in 0..3 {
            let (from, to) = (place(corners[k]), place(corners[(k + 1) % 3]));
            *balance.entry([from, to]).or_default() += 1;
            *balance.entry([to, from]).or_default() -= 1;
        }
    }
    // Equal numbers both ways, and, by `one_each_way`, never two the same way.
    balance.values().all(|count| *count == 0)
}

/// No edge is used twice in the same direction.
fn one_each_way(mesh: &TriangleMesh) -> bool {
    let mut seen = std::collections::HashSet::new();
    let place = |i: u32| {
        (mesh.positions()[i as usize] + Vec3::ZERO)
            .to_array()
            .map(f32::to_bits)
    };
    mesh.triangles()
        .iter()
        .all(|t| (0..3).all(|k| seen.insert([place(t[k]), place(t[(k + 1) % 3])])))
}

/// Normals are of unit length, and on the same side as the winding.
fn normals_agree(mesh: &TriangleMesh) -> bool {
    (0..mesh.triangles().len()).all(|i| {
        let face = mesh.triangle(i).and_then(|triangle| triangle.unit_normal());
        let face = face.expect("a mesh keeps only triangles with an area");
        mesh.triangles()[i].iter().all(|&vertex| {
            let normal = mesh.normals()[vertex as usize];
            (normal.length() - 1.0).abs() < 1e-6 && normal.dot(face) > 0.0
        })
    })
}

fn assert_solid(mesh: &TriangleMesh) {
    assert_eq!(mesh.removed_degenerate(), 0);
    assert_eq!(mesh.replaced_normals(), 0);
    assert!(
        edges_pair_up(mesh) && one_each_way(mesh),
        "an edge is open or doubled"
    );
    assert!(mesh.is_closed());
    assert!(mesh.signed_volume() > 0.0, "wound inwards");
    assert!(
        normals_agree(mesh),
        "a normal is not of unit length or on the wrong side"
    );
}

/// Relative difference.
fn off(value: f32, expected: f32) -> f32 {
    (value / expected - 1.0).abs()
}

#[test]
fn icosphere_is_a_sphere() {
    for (subdivisions, triangles) in [(0, 20), (1, 80), (4, 5120)] {
        let mesh = shapes::icosphere(2.0, subdivisions).unwrap();
        assert_solid(&mesh);
        assert_eq!(mesh.triangles().len(), triangles);
        assert_eq!(mesh.positions().len(), triangles / 2 + 2);
        for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
            assert!((*position - 2.0 * *normal).length() < 1e-6);
        }
    }
    // The icosahedron of circumradius R: area 8 sqrt(3) R^2 / (phi sqrt 5), edge R / sin(2 pi/5).
    let icosahedron = shapes::icosphere(1.0, 0).unwrap();
    let edge = 1.0 / (2.0 * PI / 5.0).sin();
    assert!(off(icosahedron.area(), 5.0 * 3.0_f32.sqrt() * edge * edge) < 1e-6);
    let volume = 5.0 / 12.0 * (3.0 + 5.0_f32.sqrt()) * edge.powi(3);
    assert!(off(icosahedron.signed_volume(), volume) < 1e-6);
    let fine = shapes::icosphere(1.0, 5).unwrap();
    assert!(off(fine.area(), 4.0 * PI) < 1e-3);
    assert!(off(fine.signed_volume(), 4.0 / 3.0 * PI) < 2e-3);
}

#[test]
fn uv_sphere_is_a_sphere() {
    let mesh = shapes::uv_sphere(3.0, 96, 48).unwrap();
    assert_solid(&mesh);
    // Two poles and 47 rings of 96.
    assert_eq!(mesh.positions().len(), 2 + 47 * 96);
    assert_eq!(mesh.triangles().len(), 2 * 96 * 47);
    for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
        assert!((*position - 3.0 * *normal).length() < 1e-6);
    }
    assert!(off(mesh.area(), 36.0 * PI) < 2e-3);
    assert!(off(mesh.signed_volume(), 36.0 * PI) < 3e-3);
}

#[test]
fn torus_is_a_torus() {
    let mesh = shapes::torus(3.0, 1.0, 128, 64).unwrap();
    assert_solid(&mesh);
    assert!(off(mesh.area(), 12.0 * PI * PI) < 2e-3);
    // Pappus, with a 64-gon for the small circle and a 128-gon for the large one.
    let polygon = |corners: f32| 0.5 * corners * (2.0 * PI / corners).sin();
    assert!(off(mesh.signed_volume(), 6.0 * polygon(64.0) * polygon(128.0)) < 1e-5);
    for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
        let center = 3.0 * Vec3::new(position.x, 0.0, position.z).normalize();
        assert!((*position - center - *normal).length() < 1e-5);
    }
}

#[test]
fn cuboid_has_flat_faces() {
    let mesh = shapes::cuboid([1.0, 2.0, 3.0]).unwrap();
    assert_solid(&mesh);
    assert_eq!(mesh.triangles().len(), 12);
    assert_eq!(mesh.area(), 22.0);
    assert_eq!(mesh.signed_volume(), 6.0);
    assert_eq!(mesh.bounds().max, Vec3::new(0.5, 1.0, 1.5));
    for (i, corners) in mesh.triangles().iter().enumerate() {
        let face = mesh.triangle(i).unwrap().unit_normal().unwrap();
        assert!(
            corners
                .iter()
                .all(|&vertex| mesh.normals()[vertex as usize] == face)
        );
    }
}

#[test]
fn cylinder_tube_and_disc_have_their_measures() {
    // Of the regular 64-gon, whose area is 32 sin(2 pi / 64) r^2.
    let polygon = 32.0 * (2.0 * PI / 64.0).sin();
    let cylinder = shapes::cylinder(2.0, 5.0, 64).unwrap();
    assert_solid(&cylinder);
    assert!(off(cylinder.signed_volume(), polygon * 4.0 * 5.0) < 1e-6);
    let tube = shapes::tube(1.0, 2.0, 5.0, 64).unwrap();
    assert_solid(&tube);
    assert!(off(tube.signed_volume(), polygon * 3.0 * 5.0) < 1e-6);
    let disc = shapes::disc(2.0, 64).unwrap();
    assert!(!disc.is_closed());
    assert!(off(disc.area(), polygon * 4.0) < 1e-6);
    assert!(disc.normals().iter().all(|normal| *normal == Vec3::Y));
    assert!(normals_agree(&disc));
    // Sharp rims: each normal is along the axis or across it.
    for normal in cylinder.normals().iter().chain(tube.normals()) {
        assert!(normal.y == 0.0 || normal.y.abs() == 1.0, "{normal}");
    }
}

#[test]
fn quad_faces_where_its_edges_say() {
    let mesh = shapes::quad([1.0, 0.0, 0.0], [0.0, 0.0, 2.0], [3.0, 0.0, 0.0]).unwrap();
    assert_eq!(mesh.area(), 6.0);
    assert!(mesh.normals().iter().all(|normal| *normal == Vec3::Y));
    assert!(normals_agree(&mesh));
    let flat = shapes::quad([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
    assert!(matches!(
        flat,
        Err(ShapeError::NotPositive {
            quantity: "area",
            ..
        })
    ));
}

#[test]
fn glass_of_revolution_is_closed_with_the_volume_between_its_walls() {
    // A tumbler: outside up, over the rim, inside down, to the axis again.
    let profile = [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.5, 9.0),
        (3.2, 9.0),
        (2.7, 1.0),
        (0.0, 1.0),
    ]
    .map(|(r, h)| Vec2::new(r, h));
    let mesh = shapes::revolution(&profile, &RevolutionOptions::default()).unwrap();
    assert_solid(&mesh);
    // Frustums: pi h (R^2 + R r + r^2) / 3, for the 64-gon instead of the circle.
    let polygon = 32.0 * (2.0 * PI / 64.0).sin();
    let frustum = |r: f32, s: f32, h: f32| polygon * h * (r * r + r * s + s * s) / 3.0;
    let volume = frustum(3.0, 3.5, 9.0) - frustum(2.7, 3.2, 8.0);
    assert!(off(mesh.signed_volume(), volume) < 1e-5);
}

#[test]
fn smooth_profiles_of_a_circle_have_its_normals_at_any_spacing() {
    // Unequal steps around a circle of radius 2 at distance 5.
    let angles = [
        0.0_f32, 0.3, 0.4, 0.8, 0.9, 1.3, 1.9, 2.2, 2.7, 3.0, 3.6, 4.0, 4.6, 5.1, 5.7,
    ];
    let mut profile: Vec<Vec2> = angles
        .iter()
        .map(|a| Vec2::new(5.0, 0.0) + 2.0 * Vec2::from_angle(*a))
        .collect();
    profile.push(profile[0]);
    let options = RevolutionOptions {
        segments: 48,
        crease_angle: 1.0,
    };
    let mesh = shapes::revolution(&profile, &options).unwrap();
    assert_solid(&mesh);
    for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
        let center = 5.0 * Vec3::new(position.x, 0.0, position.z).normalize();
        let exact = (*position - center).normalize();
        // Exact to second order in the steps, which are up to 0.6.
        assert!((exact - *normal).length() < 0.02, "{exact} {normal}");
    }
}

#[test]
fn axis_ends_are_smooth_or_tips_as_their_slope_says() {
    let options = RevolutionOptions {
        segments: 16,
        crease_angle: FRAC_PI_6,
    };
    let steep = [(0.0, -2.0), (1.0, 0.0), (0.0, 2.0)].map(|(r, h)| Vec2::new(r, h));
    let cone = shapes::revolution(&steep, &options).unwrap();
    assert_solid(&cone);
    // One vertex at the tip for each segment, each with the normal of its own facet's middle.
    let tips: Vec<usize> = (0..cone.positions().len())
        .filter(|&i| cone.positions()[i].y == 2.0)
        .collect();
    assert_eq!(tips.len(), 16);
    for tip in tips {
        let face = cone
            .triangles()
            .iter()
            .position(|t| t.contains(&(tip as u32)))
            .unwrap();
        let face_normal = cone.triangle(face).unwrap().unit_normal().unwrap();
        let normal = cone.normals()[tip];
        let level = |n: Vec3| Vec2::new(n.x, n.z).normalize();
        assert!(level(face_normal).dot(level(normal)) > 0.999_999);
    }
    let flat = [(0.0, -0.1), (1.0, 0.0), (0.0, 0.1)].map(|(r, h)| Vec2::new(r, h));
    let lens = shapes::revolution(&flat, &options).unwrap();
    assert_solid(&lens);
    let top: Vec<usize> = (0..lens.positions().len())
        .filter(|&i| lens.positions()[i].y == 0.1)
        .collect();
    assert_eq!(top.len(), 1);
    assert_eq!(lens.normals()[top[0]], Vec3::Y);
}

#[test]
fn waist_of_no_width_is_two_solids_that_touch() {
    let profile = [(0.0, 0.0), (1.0, 0.5), (0.0, 1.0), (1.0, 1.5), (0.0, 2.0)];
    let profile = profile.map(|(r, h)| Vec2::new(r, h));
    let mesh = shapes::revolution(&profile, &RevolutionOptions::default()).unwrap();
    assert_solid(&mesh);
}

#[test]
fn profile_with_normals_keeps_them() {
    // A plano-convex lens of radius 1: the dome's own normals, a sharp rim, a flat base.
    let mut profile = vec![
        ProfilePoint {
            position: Vec2::ZERO,
            normal: Vec2::new(0.0, -1.0),
        },
        ProfilePoint {
            position: Vec2::new(1.0, 0.0),
            normal: Vec2::new(0.0, -1.0),
        },
    ];
    for k in 0..=8 {
        let direction = Vec2::from_angle(k as f32 / 8.0 * 0.5 * PI);
        let on_axis = if k == 8 { Vec2::Y } else { direction };
        profile.push(ProfilePoint {
            position: on_axis,
            normal: on_axis,
        });
    }
    let mesh = shapes::revolution_with_normals(&profile, 32).unwrap();
    assert_solid(&mesh);
    let domed = mesh.positions().iter().zip(mesh.normals());
    for (position, normal) in domed.filter(|(_, normal)| normal.y > -0.5) {
        assert!((*position - *normal).length() < 1e-6);
    }
}

#[test]
fn heightfield_lies_on_its_function() {
    let height = |x: f32, z: f32| 0.3 * (2.0 * x).sin() + 0.1 * z * z;
    let slope = |x: f32, z: f32| Vec2::new(0.6 * (2.0 * x).cos(), 0.2 * z);
    let cells = UVec2::new(100, 60);
    let exact = shapes::heightfield_with_slope([4.0, 2.0], cells, height, slope).unwrap();
    let smoothed = shapes::heightfield([4.0, 2.0], cells, height).unwrap();
    assert_eq!(exact.triangles().len(), 2 * 100 * 60);
    assert_eq!(exact.positions(), smoothed.positions());
    assert_eq!((exact.bounds().min.x, exact.bounds().max.z), (-2.0, 1.0));
    assert!(normals_agree(&exact) && normals_agree(&smoothed));
    for (i, position) in exact.positions().iter().enumerate() {
        assert_eq!(position.y, height(position.x, position.z));
        let inside = position.x.abs() < 1.99 && position.z.abs() < 0.99;
        let difference = (exact.normals()[i] - smoothed.normals()[i]).length();
        // Second order in the cells of 0.04 within, first order at the border.
        assert!(
            difference < if inside { 1e-3 } else { 0.03 },
            "{difference} at {position}"
        );
    }
}

#[test]
fn wrong_numbers_are_named() {
    let options = RevolutionOptions::default();
    let profile = |points: &[(f32, f32)]| {
        let points: Vec<Vec2> = points.iter().map(|(r, h)| Vec2::new(*r, *h)).collect();
        shapes::revolution(&points, &options).unwrap_err()
    };
    assert_eq!(
        profile(&[(1.0, 0.0), (-1.0, 0.0)]),
        ShapeError::NegativeRadius {
            point: 1,
            radius: -1.0
        }
    );
    assert_eq!(
        profile(&[(1.0, 0.0), (1.0, 0.0)]),
        ShapeError::RepeatedPoint { point: 1 }
    );
    assert_eq!(
        profile(&[(0.0, 0.0), (0.0, 1.0)]),
        ShapeError::SegmentOnAxis { point: 1 }
    );
    assert_eq!(
        profile(&[(1.0, f32::NAN), (1.0, 0.0)]),
        ShapeError::NonFiniteProfile { point: 0 }
    );
    assert_eq!(
        profile(&[(1.0, 0.0)]),
        ShapeError::TooFew {
            quantity: "profile points",
            count: 1,
            minimum: 2
        }
    );
    assert_eq!(
        shapes::uv_sphere(1.0, 2, 8).unwrap_err(),
        ShapeError::TooFew {
            quantity: "segments",
            count: 2,
            minimum: 3
        }
    );
    assert_eq!(
        shapes::torus(1.0, 1.0, 8, 8).unwrap_err(),
        ShapeError::NotBelow {
            quantity: "minor radius",
            value: 1.0,
            limit: 1.0
        }
    );
    assert_eq!(
        shapes::cuboid([1.0, 0.0, 1.0]).unwrap_err(),
        ShapeError::NotPositive {
            quantity: "height",
            value: 0.0
        }
    );
    for subdivisions in [13, 40, u32::MAX] {
        let error = shapes::icosphere(1.0, subdivisions).unwrap_err();
        assert!(
            matches!(error, ShapeError::TooManyVertices { .. }),
            "{error}"
        );
    }
    assert!(matches!(
        shapes::uv_sphere(1.0, u32::MAX, u32::MAX).unwrap_err(),
        ShapeError::TooManyVertices { .. }
    ));
    assert_eq!(
        shapes::heightfield([1.0, 1.0], [1, 1], |_, _| f32::NAN).unwrap_err(),
        ShapeError::Mesh(MeshError::NonFinitePosition { vertex: 0 })
    );
    assert_eq!(
        profile(&[(0.0, 0.0), (0.0, 1.0)]).to_string(),
        "profile points 0 and 1 both lie on the axis"
    );
    assert_eq!(
        shapes::icosphere(-1.0, 2).unwrap_err().to_string(),
        "radius -1 is not positive and finite"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any profile from axis to axis that bulges outwards gives a closed solid of the volume that
    /// Pappus' theorem says, at any scale.
    #[test]
    fn random_solids_of_revolution_are_closed(
        radii in prop::collection::vec(0.1_f32..1.0, 1..8),
        segments in 3_u32..40,
        crease_angle in 0.0_f32..PI,
        log_scale in -4.0_f32..4.0,
    ) {
        let scale = 10.0_f32.powf(log_scale);
        let mut profile = vec![Vec2::ZERO];
        profile.extend(radii.iter().enumerate().map(|(k, r)| scale * Vec2::new(*r, k as f32)));
        profile.push(scale * Vec2::new(0.0, radii.len() as f32 - 1.0 + 0.5));
        let options = RevolutionOptions { segments, crease_angle };
        let mesh = shapes::revolution(&profile, &options).unwrap();
        prop_assert!(edges_pair_up(&mesh) && one_each_way(&mesh) && mesh.is_closed());
        prop_assert!(mesh.normals().iter().all(|normal| (normal.length() - 1.0).abs() < 1e-6));
        let corner = std::f64::consts::TAU / f64::from(segments);
        let polygon = 0.5 * f64::from(segments) * corner.sin();
        let volume: f64 = profile
            .windows(2)
            .map(|ends| {
                let (p, q) = (ends[0].as_dvec2(), ends[1].as_dvec2());
                polygon * (q.y - p.y) * (p.x * p.x + p.x * q.x + q.x * q.x) / 3.0
            })
            .sum();
        prop_assert!((f64::from(mesh.signed_volume()) / volume - 1.0).abs() < 1e-5);
    }

    /// A rotated, stretched or mirrored solid stays closed and outward, with volume and normals
    /// as the map says.
    #[test]
    fn maps_keep_solids_outward(
        columns in prop::array::uniform3(prop::array::uniform3(-2.0_f32..2.0)),
        shift in prop::array::uniform3(-5.0_f32..5.0),
    ) {
        use caustics_geometry::glam::{Affine3A, Mat3};
        let linear = Mat3::from_cols_array_2d(&columns);
        prop_assume!(linear.determinant().abs() > 0.1);
        let map = Affine3A::from_mat3_translation(linear, Vec3::from(shift));
        let sphere = shapes::icosphere(1.0, 2).unwrap();
        let mapped = sphere.transformed(&map).unwrap();
        prop_assert!(mapped.is_closed());
        let stretch = mapped.signed_volume() / sphere.signed_volume();
        prop_assert!((stretch / linear.determinant().abs() - 1.0).abs() < 1e-4);
        let inverse_transpose = linear.as_dmat3().inverse().transpose();
        for (before, after) in sphere.normals().iter().zip(mapped.normals()) {
            let expected: DVec3 = (inverse_transpose * before.as_dvec3()).normalize();
            prop_assert!((expected - after.as_dvec3()).length() < 1e-4);
        }
    }
}
