//! Properties of the flattened world, against f64 and against brute force.

use caustics_geometry::{Hit, Ray, TriangleMesh};
use caustics_scene::{
    BvhOptions, Instance, Intersect, Material, Scene, SceneError, Shape, World, builtin,
};
use glam::{Affine3A, DMat3, DVec3, Mat3, Quat, Vec3};
use proptest::prelude::*;

fn vector(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
    [range.clone(), range.clone(), range].prop_map(Vec3::from)
}

fn unit() -> impl Strategy<Value = Vec3> {
    vector(-1.0..1.0)
        .prop_filter("of some length", |v| v.length() > 0.1)
        .prop_map(Vec3::normalize)
}

/// A transform that scales each axis by 0.1 to 10, mirrored or not.
fn transform() -> impl Strategy<Value = Affine3A> {
    let scale = prop::array::uniform3((-1.0f32..1.0, any::<bool>())).prop_map(|axes| {
        Vec3::from(axes.map(|(power, mirror)| 10f32.powf(power) * if mirror { -1.0 } else { 1.0 }))
    });
    (scale, unit(), 0.0f32..6.0, vector(-10.0..10.0)).prop_map(
        |(scale, axis, angle, translation)| {
            let rotation = Quat::from_axis_angle(axis, angle);
            Affine3A::from_scale_rotation_translation(scale, rotation, translation)
        },
    )
}

/// Corners that are not nearly on a line, and normals within 60 degrees of the face's, or, as in
/// files that are inside out, of its opposite.
fn triangle() -> impl Strategy<Value = ([Vec3; 3], [Vec3; 3])> {
    let corners =
        prop::array::uniform3(vector(-2.0..2.0)).prop_filter("well shaped", |[a, b, c]| {
            let (p, q) = (*b - *a, *c - *a);
            let longest = p.length().max(q.length()).max((p - q).length());
            p.cross(q).length() > 0.1 * longest * longest && longest > 0.1
        });
    (corners, prop::array::uniform3(unit()), any::<bool>()).prop_map(
        |([a, b, c], tilts, inward)| {
            let face = (b - a).cross(c - a).normalize() * if inward { -1.0 } else { 1.0 };
            ([a, b, c], tilts.map(|tilt| (face + 0.8 * tilt).normalize()))
        },
    )
}

/// Barycentric weights inside a triangle.
fn weights() -> impl Strategy<Value = (f32, f32)> {
    (0.0f32..1.0, 0.0f32..1.0).prop_map(|(u, v)| {
        if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        }
    })
}

fn world_of(corners: [Vec3; 3], normals: [Vec3; 3], transform: Affine3A) -> World {
    let mut scene = Scene::new();
    let mesh = TriangleMesh::new(corners.to_vec(), Some(normals.to_vec()), vec![[0, 1, 2]]);
    let mesh = scene.add_mesh(mesh.unwrap());
    let material = scene
        .add_material(Material::diffuse("m", [0.5; 3]))
        .unwrap();
    let instance = Instance::new("t", Shape::Mesh(mesh), material).with_transform(transform);
    scene.add_instance(instance).unwrap();
    World::new(&scene).unwrap()
}

fn dmat(matrix: Mat3) -> DMat3 {
    matrix.as_dmat3()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Oracle: the transform applied in f64 to the interpolated position, and its inverse transpose
    /// to normals.
    #[test]
    fn surface_positions_and_normals(
        (corners, normals) in triangle(),
        (u, v) in weights(),
        transform in transform(),
        toward in unit(),
    ) {
        let world = world_of(corners, normals, transform);
        let linear = dmat(Mat3::from(transform.matrix3));
        let normal_matrix = linear.inverse().transpose();
        let mirrored = linear.determinant() < 0.0;
        // A mirrored triangle names its corners in the other order.
        let order = if mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let weights = [1.0 - f64::from(u) - f64::from(v), u.into(), v.into()];
        let sum = |values: [DVec3; 3]| -> DVec3 {
            (0..3).map(|k| weights[k] * values[order[k]]).sum()
        };
        let placed = corners.map(|p| linear * p.as_dvec3() + transform.translation.as_dvec3());
        let position = sum(placed);
        let face = {
            let [a, b, c] = order.map(|k| placed[k]);
            (b - a).cross(c - a).normalize()
        };
        let unit_normals = normals.map(|n| (normal_matrix * n.as_dvec3()).normalize());
        let interpolated = sum(unit_normals);
        prop_assume!(interpolated.length() > 0.1);
        let shading = interpolated.normalize();
        prop_assume!(shading.dot(face).abs() > 1e-3);
        let shading = shading * shading.dot(face).signum();

        let ray = Ray::new(position.as_vec3() - 3.0 * toward, toward);
        prop_assume!(toward.as_dvec3().dot(face).abs() > 1e-3);
        let hit = Hit { t: 3.0, u, v, primitive: 0 };
        let point = world.surface(&ray, &hit).unwrap();
        let off = (point.spawn.position.as_dvec3() - position).abs();
        // The vertices were rounded once in the transform.
        let scale = f64::from(world.bounds().min.abs().max(world.bounds().max.abs()).max_element());
        prop_assert!(off.max_element() < 1e-5 * scale.max(1.0), "{off}");
        // Rounded vertices turn a sliver's face by their error over its height.
        let edges = [placed[1] - placed[0], placed[2] - placed[1], placed[0] - placed[2]];
        let longest = edges.iter().map(|e| e.length()).fold(0.0, f64::max);
        let height = edges[0].cross(edges[1]).length() / longest;
        let turn = 1e-6 + 4e-6 * scale.max(1.0) / height;
        prop_assert!(point.geometric_normal.as_dvec3().distance(face) < turn);
        prop_assert!(point.shading_normal.as_dvec3().distance(shading) < 1e-5);
        prop_assert!(point.shading_normal.dot(point.geometric_normal) >= 0.0);
        prop_assert_eq!(point.from_outside, toward.as_dvec3().dot(face) < 0.0);
    }

    /// Oracle: central differences in f64 of the interpolated unit normal.
    #[test]
    fn normals_turn_as_differences_say(
        (corners, normals) in triangle(),
        (u, v) in weights(),
        (du, dv) in (-1.0f64..1.0, -1.0f64..1.0),
    ) {
        let world = world_of(corners, normals, Affine3A::IDENTITY);
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        let point = world.surface(&ray, &Hit { t: 1.0, u, v, primitive: 0 }).unwrap();
        let gradient = world.normal_gradient(&point);
        prop_assert!(gradient.normal.distance(point.shading_normal) < 1e-6);

        let unit_normals = world.triangle_normals(0).unwrap().map(Vec3::as_dvec3);
        let face = point.geometric_normal.as_dvec3();
        let at = |step: f64| {
            let (u, v) = (f64::from(u) + step * du, f64::from(v) + step * dv);
            let [a, b, c] = unit_normals;
            let normal = ((1.0 - u - v) * a + u * b + v * c).normalize();
            normal * normal.dot(face).signum()
        };
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let displacement = du * (b - a) + dv * (c - a);
        let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
        let found = gradient.along(displacement.as_vec3()).as_dvec3();
        prop_assert!(found.distance(expected) < 1e-4 * (1.0 + expected.length()),
            "{found} {expected}");
    }

    /// Oracle: on a sphere, the exact normal at the displaced point.
    #[test]
    fn spheres_turn_with_their_radius(
        center in vector(-5.0..5.0), power in -2.0f32..2.0, outward in unit(), along in unit(),
    ) {
        let radius = 10f32.powf(power);
        let mut scene = Scene::new();
        let glass = scene.add_material(Material::dielectric("g", 1.5)).unwrap();
        scene.add_instance(Instance::new("s", Shape::Sphere { center, radius }, glass)).unwrap();
        let world = World::new(&scene).unwrap();
        let ray = Ray::new(center + 3.0 * radius * outward, -outward);
        let hit = world.intersector(&BvhOptions::default()).unwrap().closest_hit(&ray).unwrap();
        prop_assert_eq!(hit.primitive, 0);
        let point = world.surface(&ray, &hit).unwrap();
        prop_assert!(point.from_outside);
        // The ray's origin is rounded.
        let tolerance = 1e-6 + 2e-6 * center.length() / radius;
        prop_assert!(point.shading_normal.distance(outward) < tolerance);
        let gradient = world.normal_gradient(&point);
        prop_assert_eq!(gradient.normal, point.shading_normal);
        let change = gradient.along(radius * along);
        let tangential = along - along.dot(point.shading_normal) * point.shading_normal;
        prop_assert!(change.distance(tangential) < 1e-5);
    }

    /// Oracle: every triangle and sphere tested one by one.
    #[test]
    fn the_intersector_finds_the_closest_of_all(
        centers in prop::collection::vec(vector(-3.0..3.0), 1..8),
        origin in vector(-6.0..6.0),
        direction in unit(),
        transform in transform(),
    ) {
        let mut scene = Scene::new();
        let glass = scene.add_material(Material::dielectric("g", 1.5)).unwrap();
        let mesh = caustics_geometry::shapes::icosphere(1.0, 1).unwrap();
        let mesh = scene.add_mesh(mesh);
        let body = Instance::new("mesh", Shape::Mesh(mesh), glass).with_transform(transform);
        scene.add_instance(body).unwrap();
        for center in centers {
            let ball = Shape::Sphere { center, radius: 0.5 };
            scene.add_instance(Instance::new("ball", ball, glass)).unwrap();
        }
        let world = World::new(&scene).unwrap();
        let intersector = world.intersector(&BvhOptions::default()).unwrap();
        let ray = Ray::new(origin, direction);
        let count = world.triangles().len() as u32;
        let mut closest: Option<(f64, u32)> = None;
        let mut keep = |t: f64, primitive| {
            if t > 0.0 && closest.is_none_or(|(least, _)| t < least) {
                closest = Some((t, primitive));
            }
        };
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        for primitive in 0..count {
            let triangle = world.triangle(primitive).unwrap();
            let a = triangle.a.as_dvec3();
            let (p, q) = (triangle.b.as_dvec3() - a, triangle.c.as_dvec3() - a);
            // o + t d = a + u p + v q, solved by Cramer's rule.
            let solution = DMat3::from_cols(p, q, -d).inverse() * (o - a);
            let least = solution.x.min(solution.y).min(1.0 - solution.x - solution.y);
            // On an edge rounding decides.
            prop_assume!(least.abs() > 1e-4);
            if least > 0.0 {
                keep(solution.z, primitive);
            }
        }
        for (primitive, sphere) in (count..).zip(world.spheres()) {
            let from_center = o - sphere.center.as_dvec3();
            let (b, radius) = (from_center.dot(d), f64::from(sphere.radius));
            let discriminant = b * b - d.length_squared() * (from_center.length_squared() - radius * radius);
            prop_assume!(discriminant.abs() > 1e-4);
            if discriminant > 0.0 {
                keep((-b - discriminant.sqrt()) / d.length_squared(), primitive);
                keep((-b + discriminant.sqrt()) / d.length_squared(), primitive);
            }
        }
        let found = intersector.closest_hit(&ray);
        prop_assert_eq!(found.is_some(), closest.is_some());
        prop_assert_eq!(intersector.is_occluded(&ray), found.is_some());
        if let (Some(hit), Some((t, primitive))) = (found, closest) {
            let normal = world.surface(&ray, &hit).unwrap().geometric_normal;
            // Rounded coordinates of up to 20 metres move a face, and a slanting ray meets it the
            // later or sooner.
            let tolerance = 2e-5 / f64::from(normal.dot(direction)).abs();
            let off = (f64::from(hit.t) - t).abs();
            prop_assert!(off < tolerance, "{} {t}", hit.t);
            prop_assert!(hit.primitive == primitive || off > 0.0, "another primitive at the same place");
        }
        if let Some(hit) = found {
            let point = world.surface(&ray, &hit).unwrap();
            prop_assert_eq!(Some(point.object), world.object_of(hit.primitive));
            // Spawned either way along the normal, a ray does not meet the same primitive again.
            for direction in [point.geometric_normal, -point.geometric_normal] {
                let next = point.spawn.ray_towards(point.geometric_normal, direction);
                if let Some(next) = intersector.closest_hit(&next) {
                    prop_assert!(next.primitive != hit.primitive || next.t > 1e-3);
                }
            }
        }
    }

    /// A body stays closed and outward under any transform, and its volume scales with it.
    #[test]
    fn instances_keep_their_outside(transform in transform()) {
        let mut scene = Scene::new();
        let mesh = caustics_geometry::shapes::icosphere(1.0, 2).unwrap();
        let volume = mesh.signed_volume();
        let mesh = scene.add_mesh(mesh);
        let glass = scene.add_material(Material::dielectric("g", 1.5)).unwrap();
        let body = Instance::new("body", Shape::Mesh(mesh), glass).with_transform(transform);
        scene.add_instance(body).unwrap();
        let world = World::new(&scene).unwrap();
        let placed = TriangleMesh::new(
            world.positions().to_vec(), None, world.triangles().to_vec(),
        ).unwrap();
        prop_assert!(placed.is_closed());
        let expected = volume * transform.matrix3.determinant().abs();
        prop_assert!((placed.signed_volume() / expected - 1.0).abs() < 1e-3);
    }
}

#[test]
fn numbers_that_no_primitive_has_are_no_surface() {
    let world = World::new(&builtin::cognac_glass()).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    let count = world.triangles().len() as u32;
    for primitive in [count, count + 1, u32::MAX] {
        let hit = Hit {
            t: 1.0,
            u: 0.3,
            v: 0.3,
            primitive,
        };
        assert!(world.surface(&ray, &hit).is_none());
    }
}

#[test]
fn scenes_refuse_what_they_cannot_hold() {
    let mut scene = Scene::new();
    let mesh = scene.add_mesh(caustics_geometry::shapes::icosphere(1.0, 0).unwrap());
    let material = scene.add_material(Material::dielectric("g", 1.5)).unwrap();
    let ball = Shape::Sphere {
        center: Vec3::ZERO,
        radius: 1.0,
    };
    let squashed = Affine3A::from_scale(Vec3::new(1.0, 2.0, 1.0));
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let place = |shape, transform| Instance::new("x", shape, material).with_transform(transform);

    let result = scene.add_instance(place(ball, squashed));
    assert!(
        matches!(result, Err(SceneError::Ellipsoid { .. })),
        "{result:?}"
    );
    let result = scene.add_instance(place(Shape::Mesh(mesh), flat));
    assert!(
        matches!(result, Err(SceneError::Transform { .. })),
        "{result:?}"
    );
    let point = Shape::Sphere {
        center: Vec3::ZERO,
        radius: 0.0,
    };
    let result = scene.add_instance(place(point, Affine3A::IDENTITY));
    assert!(
        matches!(result, Err(SceneError::Sphere { .. })),
        "{result:?}"
    );
    let far = Affine3A::from_scale(Vec3::splat(1e30));
    scene.add_instance(place(Shape::Mesh(mesh), far)).unwrap();
    let world = World::new(&scene);
    assert!(
        matches!(world, Err(SceneError::OutOfRange { .. })),
        "{world:?}"
    );

    let mut other = Scene::new();
    let result = other.add_instance(place(ball, Affine3A::IDENTITY));
    assert!(
        matches!(result, Err(SceneError::UnknownMaterial { .. })),
        "{result:?}"
    );
    let result = other.add_material(Material::diffuse("white", [2.0; 3]));
    assert!(
        matches!(result, Err(SceneError::Material { .. })),
        "{result:?}"
    );
    other
        .add_material(Material::diffuse("white", [1.0; 3]))
        .unwrap();
    let result = other.add_instance(place(Shape::Mesh(mesh), Affine3A::IDENTITY));
    assert!(
        matches!(result, Err(SceneError::UnknownMesh { .. })),
        "{result:?}"
    );
}

#[test]
fn emissive_spheres_and_mirrored_scales() {
    let mut scene = Scene::new();
    let lamp = Material::diffuse("lamp", [0.0; 3]).with_emission([2.0; 3]);
    let lamp = scene.add_material(lamp).unwrap();
    let mesh = scene.add_mesh(caustics_geometry::shapes::cuboid([1.0; 3]).unwrap());
    scene
        .add_instance(Instance::new("box", Shape::Mesh(mesh), lamp))
        .unwrap();
    let ball = Shape::Sphere {
        center: Vec3::X,
        radius: 0.5,
    };
    let doubled = Affine3A::from_scale(Vec3::new(2.0, -2.0, 2.0));
    scene
        .add_instance(Instance::new("ball", ball, lamp).with_transform(doubled))
        .unwrap();
    let world = World::new(&scene).unwrap();
    let [cube, sphere] = world.emitters() else {
        panic!("two lights")
    };
    assert_eq!((cube.primitives(), cube.area()), (0..12, 6.0));
    assert_eq!(sphere.primitives(), 12..13);
    assert!((sphere.area() - 4.0 * std::f32::consts::PI).abs() < 1e-5);
    assert_eq!(world.spheres()[0].center, Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(sphere.choose(0.5).0, 12);
    assert!(world.specular_bounds().is_empty());
    assert!((world.bounds().max.x - 3.0).abs() < 1e-6 && (world.bounds().min.x + 0.5).abs() < 1e-6);
}
