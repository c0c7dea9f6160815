use caustics_geometry::shapes::heightfield_with_slope;
use caustics_scene::{Instance, Material, Scene, Shape};
use glam::{Affine3A, DVec2, Vec2, Vec3};

use crate::TestError;
use crate::numerics::integrate_rectangle;
use crate::optics::schlick;
use crate::stage::{add_receiver, add_sun};

/// A piece of a parabolic mirror beside its axis, with the sun straight above, that throws its
/// light through the focus onto a receiver above it.
///
/// The mirror is `y = (x² + z²) / (4 f)`. All light goes through the focus at height `f`, and a
/// ray at the distance `r` from the axis leaves it at the angle with `tan(angle / 2) = r / (2 f)`:
/// the map to the receiver is a stereographic and a central projection, which a quadratic inverts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParabolicMirror {
    /// Focal length `f`, in metres.
    pub focal_length: f64,
    /// Least x of the piece, above 0, so that the receiver is not in the beam, in metres.
    pub near: f64,
    /// Width of the piece along x and along z, in metres.
    pub width: f64,
    /// Height of the receiver above the mirror's vertex, more than the focal length, in metres.
    pub screen_height: f64,
    /// Reflectance of the metal at normal incidence.
    pub f0: f64,
    /// Irradiance of the beam, in W/m².
    pub sun: f64,
}

impl ParabolicMirror {
    /// Irradiance at a point of the receiver, in W/m².
    #[must_use]
    pub fn irradiance_at(&self, point: DVec2) -> f64 {
        let on_mirror = self.mirrored_from(point);
        let past_mirror = DVec2::new(on_mirror.x - self.near - 0.5 * self.width, on_mirror.y);
        if past_mirror.abs().max_element() > 0.5 * self.width {
            return 0.0;
        }
        let f = self.focal_length;
        let height = on_mirror.length_squared() / (4.0 * f);
        // r -> |f - s| r / (f - height) stretches by its value over r around the axis, and by its
        // slope along r.
        let beyond = (self.screen_height - f).abs();
        let around = beyond / (f - height);
        let along = beyond * (f + height) / (f - height).powi(2);
        // The normal halves the angle between the beam and the reflected light.
        let cosine = 1.0 / (1.0 + on_mirror.length_squared() / (4.0 * f * f)).sqrt();
        self.sun * schlick(cosine, self.f0) / (around * along)
    }

    /// Flux that lands in a rectangle of the receiver, which must be lit all over, in watts.
    #[must_use]
    pub fn flux(&self, min: DVec2, max: DVec2) -> f64 {
        let at = |x, z| self.irradiance_at(DVec2::new(x, z));
        integrate_rectangle(at, (min.x, max.x), (min.y, max.y), 4)
    }

    /// Where light from a point of the mirror lands.
    #[must_use]
    pub fn land(&self, on_mirror: DVec2) -> DVec2 {
        let height = on_mirror.length_squared() / (4.0 * self.focal_length);
        let beyond = self.focal_length - self.screen_height;
        on_mirror * beyond / (self.focal_length - height)
    }

    /// The arrangement, for the tracer, with the piece cut into `cells` squares each way.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, cells: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        let middle = self.near + 0.5 * self.width;
        let f = self.focal_length;
        let from_axis = |x: f32, z: f32| DVec2::new(f64::from(x) + middle, f64::from(z));
        let piece = heightfield_with_slope(
            Vec2::splat(self.width as f32),
            [cells, cells],
            |x, z| (from_axis(x, z).length_squared() / (4.0 * f)) as f32,
            |x, z| (from_axis(x, z) / (2.0 * f)).as_vec2(),
        )?;
        let metal = scene.add_material(Material::metal("metal", [self.f0 as f32; 3]))?;
        let shape = Shape::Mesh(scene.add_mesh(piece));
        let moved = Affine3A::from_translation(Vec3::new(middle as f32, 0.0, 0.0));
        scene.add_instance(Instance::new("mirror", shape, metal).with_transform(moved))?;
        self.add_screen(&mut scene)?;
        add_sun(&mut scene, 0.0, self.sun)?;
        Ok(scene)
    }

    /// The receiver ends at the axis, so that it does not shade the mirror.
    fn add_screen(&self, scene: &mut Scene) -> Result<(), TestError> {
        let corner = self.near + self.width;
        let reach = self.land(DVec2::new(corner, 0.5 * self.width)).length();
        let mut screen = Scene::new();
        add_receiver(&mut screen, reach, self.screen_height)?;
        let material = scene.add_material(screen.materials()[0].clone())?;
        let shape = Shape::Mesh(scene.add_mesh(screen.meshes()[0].clone()));
        let aside = Affine3A::from_translation(Vec3::new(-reach as f32, 0.0, 0.0));
        scene.add_instance(Instance::new("screen", shape, material).with_transform(aside))?;
        Ok(())
    }

    /// The point of the mirror from which light lands at `point`.
    fn mirrored_from(&self, point: DVec2) -> DVec2 {
        // Tangent of the angle off the axis at the focus, and of its half.
        let tangent = point / (self.focal_length - self.screen_height);
        let half = tangent / (1.0 + (1.0 + tangent.length_squared()).sqrt());
        2.0 * self.focal_length * half
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const MIRROR: ParabolicMirror = ParabolicMirror {
        focal_length: 1.0,
        near: 0.4,
        width: 1.0,
        screen_height: 1.6,
        f0: 0.8,
        sun: 3.0,
    };

    #[test]
    fn agrees_with_rays_traced_by_vectors() {
        for from in [DVec2::new(0.5, 0.3), DVec2::new(1.3, -0.4)] {
            let normal = DVec3::new(-0.5 * from.x, 1.0, -0.5 * from.y).normalize();
            let reflected = DVec3::NEG_Y + 2.0 * normal.y * normal;
            let start = DVec3::new(from.x, 0.25 * from.length_squared(), from.y);
            let landed = start + (MIRROR.screen_height - start.y) / reflected.y * reflected;
            let closed = MIRROR.land(from);
            assert!((closed - DVec2::new(landed.x, landed.z)).length() < 1e-14);
            assert!((MIRROR.mirrored_from(closed) - from).length() < 1e-14);
            // Against the area of a small square's image.
            let step = 1e-5;
            let image = |x, y| MIRROR.land(from + DVec2::new(x, y)) - closed;
            let along = image(step, 0.0) - image(-step, 0.0);
            let across = image(0.0, step) - image(0.0, -step);
            let stretch = along.perp_dot(across).abs() / (4.0 * step * step);
            let expected = MIRROR.sun * schlick(normal.y, MIRROR.f0) / stretch;
            assert!((MIRROR.irradiance_at(closed) / expected - 1.0).abs() < 1e-7);
        }
    }

    #[test]
    fn is_dark_beyond_the_image() {
        let outside = MIRROR.land(DVec2::new(1.41, 0.0));
        assert_eq!(MIRROR.irradiance_at(outside), 0.0);
        assert!(MIRROR.irradiance_at(MIRROR.land(DVec2::new(1.39, 0.0))) > 0.0);
    }
}
