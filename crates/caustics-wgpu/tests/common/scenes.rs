//! Small scenes made in code.

use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::{icosphere, quad};
use caustics_scene::{Instance, Light, Material, Scene, Shape, World};
use caustics_wgpu::glam::{Affine3A, Vec3};

use super::tracing::Stage;

pub(crate) fn add(scene: &mut Scene, shape: Shape, at: Vec3, material: Material) {
    let material = scene.add_material(material).unwrap();
    let instance = Instance {
        transform: Affine3A::from_translation(at),
        ..Instance::new("", shape, material)
    };
    scene.add_instance(instance).unwrap();
}

pub(crate) fn add_mesh(scene: &mut Scene, mesh: TriangleMesh, at: Vec3, material: Material) {
    let shape = Shape::Mesh(scene.add_mesh(mesh));
    add(scene, shape, at, material);
}

pub(crate) fn ball(radius: f32) -> Shape {
    let center = Vec3::ZERO;
    Shape::Sphere { center, radius }
}

/// A floor of 8 metres, and nothing that shines.
pub(crate) fn floor() -> Scene {
    let mut scene = Scene::new();
    let mesh = quad([-4.0, 0.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]).unwrap();
    add_mesh(
        &mut scene,
        mesh,
        Vec3::ZERO,
        Material::diffuse("white", [0.8; 3]),
    );
    scene
}

/// A floor with a faceted ball of glass.
pub(crate) fn glass() -> Scene {
    let mut scene = floor();
    let glass = Material::dielectric("glass", 1.5);
    add_mesh(&mut scene, icosphere(0.7, 3).unwrap(), Vec3::Y, glass);
    scene
}

pub(crate) fn lit(mut scene: Scene, light: Light) -> Stage {
    scene.add_light(light).unwrap();
    Stage::new(World::new(&scene).unwrap())
}

pub(crate) fn lamp() -> Light {
    Light::point([0.4, 3.0, 0.2], [5.0, 4.0, 3.0]).unwrap()
}
