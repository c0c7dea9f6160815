//! A camera and a light for files that have none.

use caustics::glam::Vec3;
use caustics::prelude::*;
use caustics::scene::SceneError;

/// Adds what the scene lacks to be seen, and says so.
pub(crate) fn complete(scene: &mut Scene) -> Result<Vec<String>, SceneError> {
    let mut notices = Vec::new();
    let world = World::new(scene)?;
    let (center, radius) = world.bounds().bounding_sphere();
    if scene.cameras().is_empty() {
        let eye = center + radius * Vec3::new(0.6, 1.0, 1.9);
        let camera = Camera::look_at("default", eye, center, Vec3::Y, 0.8);
        if let Ok(camera) = camera {
            scene.add_camera(camera)?;
            notices.push("the file has no camera: one looks at the whole scene".into());
        }
    }
    if !world.is_lit() {
        let position = center + radius * Vec3::new(-1.2, 2.0, -0.6);
        let intensity = Vec3::splat(20.0 * radius * radius);
        if let Ok(light) = Light::point(position, intensity) {
            scene.add_light(light)?;
            notices.push("the file has no light: a lamp stands above the scene".into());
        }
    }
    Ok(notices)
}
