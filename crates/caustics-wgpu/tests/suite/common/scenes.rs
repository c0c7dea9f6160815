//! Small scenes made in code.

use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::{cuboid, icosphere, quad, torus};
use caustics_scene::{Environment, Instance, Light, Material, Scene, Shape, World};
use caustics_wgpu::glam::{Affine3A, Quat, Vec3};

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

/// A sky of this size, turned about a tilted axis: no axis of it is one of the world's. A gradient from
/// one side to the other, blue above, the ground dark; and a sun of a few degrees that has about as
/// much light as all the rest.
pub(crate) fn sky(width: u16, height: u16) -> Environment {
    let turn = Quat::from_axis_angle(Vec3::new(0.3, 1.0, -0.2).normalize(), 0.7);
    let sun = Vec3::new(0.4, 0.8, 0.2).normalize();
    let texel = |index: u32| {
        let (row, column) = (index / u32::from(width), index % u32::from(width));
        let down = std::f32::consts::PI * (row as f32 + 0.5) / f32::from(height);
        let around = std::f32::consts::TAU * ((column as f32 + 0.5) / f32::from(width) - 0.5);
        let towards = Vec3::new(
            down.sin() * around.sin(),
            down.cos(),
            -down.sin() * around.cos(),
        );
        let own = turn * towards;
        let above = 0.5 + 0.5 * own.y;
        let side = 0.6 + 0.4 * own.x;
        let sun = if own.dot(sun) > 0.998 { 900.0 } else { 0.0 };
        let radiance =
            side * Vec3::new(0.1, 0.2 * above, above * above) + sun * Vec3::new(1.0, 0.9, 0.7);
        radiance.to_array()
    };
    let pixels = (0..u32::from(width) * u32::from(height)).map(texel);
    Environment::new(width.into(), height.into(), pixels.collect()).unwrap()
}

/// A ball of glass, a ring of gold and a prism that disperses, which overlap as seen from some sides,
/// and nothing that shines.
pub(crate) fn casters() -> Scene {
    let mut scene = glass();
    let gold = Material::metal("gold", [1.0, 0.76, 0.33]);
    let ring = torus(0.8, 0.2, 64, 32).unwrap();
    add_mesh(&mut scene, ring, Vec3::new(1.6, 0.4, 0.3), gold);
    // Without absorption, whose last digits are each side's own.
    let flint = Material::dielectric("flint", 1.7).with_dispersion(0.6);
    let prism = cuboid([0.8, 1.0, 0.6]).unwrap();
    add_mesh(&mut scene, prism, Vec3::new(-1.4, 0.7, -0.2), flint);
    scene
}

/// The same picture with left and right exchanged.
pub(crate) fn mirrored(sky: &Environment) -> Environment {
    let [width, height] = sky.size();
    let rows = sky.texels().chunks_exact(width as usize);
    let pixels = rows.flat_map(|row| row.iter().rev().map(|it| it.radiance.to_array()));
    Environment::new(width, height, pixels.collect()).unwrap()
}

pub(crate) fn under(mut scene: Scene, sky: Environment) -> Stage {
    scene.set_environment(Some(sky));
    Stage::new(World::new(&scene).unwrap())
}
