//! Objects that move against the same scene flattened.

use caustics_geometry::{Ray, shapes};
use caustics_scene::{
    BvhOptions, Instance, InstancedIntersector, Intersect, Material, Scene, SceneError, Shape,
    World, builtin,
};
use glam::{Affine3A, Quat, Vec3};
use proptest::prelude::*;

fn transform() -> impl Strategy<Value = Affine3A> {
    (
        prop::array::uniform3(prop_oneof![0.3_f32..2.0, -2.0_f32..-0.3]),
        prop::array::uniform3(-3.0_f32..3.0),
        prop::array::uniform3(-4.0_f32..4.0),
    )
        .prop_map(|(scale, turn, shift)| {
            Affine3A::from_scale_rotation_translation(
                Vec3::from(scale),
                Quat::from_scaled_axis(Vec3::from(turn)),
                Vec3::from(shift),
            )
        })
}

/// Objects of two meshes, and a sphere between them.
fn scene(places: &[Affine3A]) -> Scene {
    let mut scene = Scene::new();
    let glass = scene
        .add_material(Material::dielectric("glass", 1.5))
        .unwrap();
    let ball = scene.add_mesh(shapes::icosphere(1.0, 3).unwrap());
    let cube = scene.add_mesh(shapes::cuboid([1.0, 2.0, 0.5]).unwrap());
    for (i, &place) in places.iter().enumerate() {
        let shape = Shape::Mesh(if i % 2 == 0 { ball } else { cube });
        let instance = Instance::new(format!("object {i}"), shape, glass);
        scene.add_instance(instance.with_transform(place)).unwrap();
        if i == 1 {
            let sphere = Shape::Sphere {
                center: Vec3::Y,
                radius: 0.5,
            };
            scene
                .add_instance(Instance::new("sphere", sphere, glass))
                .unwrap();
        }
    }
    scene
}

fn same(world: &World, ours: &InstancedIntersector, rays: &[Ray]) -> Result<(), TestCaseError> {
    let flat = world.intersector(&BvhOptions::default()).unwrap();
    let (mut many, mut flat_many) = (vec![None; rays.len()], vec![None; rays.len()]);
    ours.closest_hits(rays, &mut many);
    flat.closest_hits(rays, &mut flat_many);
    for ((ray, many), flat_many) in rays.iter().zip(many).zip(flat_many) {
        let hit = ours.closest_hit(ray);
        prop_assert_eq!((hit, hit), (many, flat_many), "{:?}", ray);
        prop_assert_eq!(hit, flat.closest_hit(ray), "{:?}", ray);
        prop_assert_eq!(ours.is_occluded(ray), flat.is_occluded(ray));
        if let Some(hit) = hit {
            prop_assert!(world.surface(ray, &hit).is_some());
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn objects_that_move_are_found_where_the_flattened_world_has_them(
        places in prop::collection::vec(transform(), 0..7),
        moves in prop::collection::vec((0_usize..7, transform()), 0..4),
        aims in prop::collection::vec(
            (prop::array::uniform3(-6.0_f32..6.0), prop::array::uniform3(-2.0_f32..2.0)), 40),
    ) {
        let mut scene = scene(&places);
        let rays: Vec<Ray> = aims
            .iter()
            .map(|&(from, to)| Ray::new(from, Vec3::from(to) - Vec3::from(from)))
            .collect();
        let world = World::new(&scene).unwrap();
        let mut ours = InstancedIntersector::new(&scene, &world, &BvhOptions::default()).unwrap();
        same(&world, &ours, &rays)?;
        for (index, place) in moves {
            let is_mesh = scene.instances().get(index).is_some_and(|i| matches!(i.shape, Shape::Mesh(_)));
            if is_mesh {
                scene.set_transform(index, place).unwrap();
            }
        }
        let world = World::new(&scene).unwrap();
        ours.follow(&scene, &world).unwrap();
        same(&world, &ours, &rays)?;
    }
}

#[test]
fn an_object_that_its_transform_flattens_in_part_is_found_as_well() {
    // Far enough away that its finest triangles round to nothing.
    let far = Affine3A::from_translation(Vec3::new(8e6, 0.0, 0.0));
    let scene = scene(&[far]);
    let world = World::new(&scene).unwrap();
    assert!(world.triangles().len() < scene.triangle_count() as usize);
    let ours = InstancedIntersector::new(&scene, &world, &BvhOptions::default()).unwrap();
    let flat = world.intersector(&BvhOptions::default()).unwrap();
    let mut found = 0;
    for i in 0..1000_u32 {
        let angle = i as f32;
        let origin = Vec3::new(8e6, 0.4 * angle.sin(), 5.0);
        let ray = Ray::new(origin, [0.05 * angle.cos(), 0.0, -1.0]);
        assert_eq!(ours.closest_hit(&ray), flat.closest_hit(&ray));
        found += u32::from(ours.is_occluded(&ray));
    }
    assert!(found > 500);
}

#[test]
fn another_world_is_refused() {
    let scene = scene(&[Affine3A::IDENTITY; 3]);
    let other = World::new(&builtin::cognac_glass()).unwrap();
    let error = InstancedIntersector::new(&scene, &other, &BvhOptions::default()).unwrap_err();
    assert_eq!(error, SceneError::AnotherWorld { count: 4 });
}

#[test]
fn only_objects_that_exist_move_and_only_where_they_may() {
    let mut scene = scene(&[Affine3A::IDENTITY; 2]);
    assert_eq!(
        scene.set_transform(3, Affine3A::IDENTITY),
        Err(SceneError::UnknownInstance { index: 3, count: 3 })
    );
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    assert!(matches!(
        scene.set_transform(0, flat),
        Err(SceneError::Transform { .. })
    ));
    let squeezed = Affine3A::from_scale(Vec3::new(1.0, 2.0, 1.0));
    assert!(matches!(
        scene.set_transform(2, squeezed),
        Err(SceneError::Ellipsoid { .. })
    ));
    assert_eq!(scene.instances()[2].transform, Affine3A::IDENTITY);
    scene.set_transform(0, squeezed).unwrap();
    assert_eq!(scene.instances()[0].transform, squeezed);
}
