//! A view for tests.

use caustics_accel::BvhOptions;
use caustics_geometry::shapes;
use caustics_scene::{Camera, Instance, Material, Projection, Scene, Shape, World};
use glam::{Affine3A, Quat, Vec3};

use crate::gbuffer::GBuffer;

/// What a tilted camera sees of a floor, a ball on it, a rod as thin as a pixel, and nothing beyond: an odd
/// number of pixels.
pub(crate) fn floor_and_ball() -> GBuffer {
    let mut scene = Scene::new();
    let floor = shapes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let floor = Shape::Mesh(scene.add_mesh(floor.unwrap()));
    let ball = Shape::Sphere {
        center: Vec3::new(0.2, 0.5, 0.1),
        radius: 0.5,
    };
    let (corner, width) = (Vec3::new(-1.2, 0.02, -0.8), 0.02 * Vec3::X);
    let rod = shapes::quad(corner, Vec3::new(1.0, 0.0, 1.3), -width);
    let rod = Shape::Mesh(scene.add_mesh(rod.unwrap()));
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let grey = grey.unwrap();
    for (name, shape) in [("floor", floor), ("ball", ball), ("rod", rod)] {
        scene
            .add_instance(Instance::new(name, shape, grey))
            .unwrap();
    }
    let turn = Quat::from_rotation_x(-0.9);
    let pose = Affine3A::from_rotation_translation(turn, Vec3::new(0.0, 3.0, 2.0));
    let projection = Projection::Perspective { yfov: 1.2 };
    let camera = Camera::new("above", pose, projection).unwrap();
    let world = World::new(&scene).unwrap();
    let intersector = world.intersector(&BvhOptions::default()).unwrap();
    GBuffer::new(&world, &intersector, &camera, 151, 133).unwrap()
}
