//! A camera and a light for files that have none.

use caustics::glam::Vec3;
use caustics::prelude::*;

/// Adds what the scene lacks to be seen, and says so.
pub(crate) fn complete(scene: &mut Scene) -> Vec<String> {
    let mut notices = Vec::new();
    let Ok(world) = World::new(scene) else {
        // The caller meets the same error where it can report it.
        return notices;
    };
    let (center, radius) = world.bounds().bounding_sphere();
    if scene.cameras().is_empty() {
        let eye = center + radius * Vec3::new(0.6, 1.0, 1.9);
        let camera = Camera::look_at("default", eye, center, Vec3::Y, 0.8);
        if camera.is_ok_and(|camera| scene.add_camera(camera).is_ok()) {
            notices.push("the file has no camera: one looks at the whole scene".into());
        }
    }
    if !world.is_lit() {
        let position = center + radius * Vec3::new(-1.2, 2.0, -0.6);
        let intensity = Vec3::splat(20.0 * radius * radius);
        if Light::point(position, intensity).is_ok_and(|light| scene.add_light(light).is_ok()) {
            notices.push("the file has no light: a lamp stands above the scene".into());
        }
    }
    notices
}
