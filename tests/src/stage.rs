//! The parts that the oracles' scenes have in common.

use caustics_geometry::{TriangleMesh, shapes};
use caustics_scene::{Instance, Light, Material, Scene, Shape};
use glam::Vec3;

use crate::TestError;

/// Adds a mesh of one material.
///
/// # Errors
/// If the material is out of range.
pub fn add_mesh(
    scene: &mut Scene,
    name: &str,
    mesh: TriangleMesh,
    material: Material,
) -> Result<(), TestError> {
    let material = scene.add_material(material)?;
    let mesh = scene.add_mesh(mesh);
    scene.add_instance(Instance::new(name, Shape::Mesh(mesh), material))?;
    Ok(())
}

/// Adds a grey horizontal square that receives light on both sides, `2 * half_width` metres wide,
/// at height `y` around the y axis.
///
/// # Errors
/// If a number is not finite or the square has no area.
pub fn add_receiver(scene: &mut Scene, half_width: f64, y: f64) -> Result<(), TestError> {
    let (half, y) = (half_width as f32, y as f32);
    let corner = Vec3::new(-half, y, half);
    let mesh = shapes::quad(corner, 2.0 * half * Vec3::X, -2.0 * half * Vec3::Z)?;
    add_mesh(scene, "receiver", mesh, Material::diffuse("grey", [0.5; 3]))
}

/// Adds a sun of `irradiance` W/m² (on a plane that faces it) that shines downwards, `angle`
/// radians off the vertical, towards +x.
///
/// # Errors
/// If a number is out of range.
pub fn add_sun(scene: &mut Scene, angle: f64, irradiance: f64) -> Result<(), TestError> {
    let direction = Vec3::new(angle.sin() as f32, -angle.cos() as f32, 0.0);
    scene.add_light(Light::directional(
        direction,
        Vec3::splat(irradiance as f32),
    )?)?;
    Ok(())
}
