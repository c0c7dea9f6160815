use caustics_geometry::shapes;
use caustics_scene::{Instance, Material, Scene, Shape};
use glam::{Affine3A, Vec3};

use crate::TestError;
use crate::optics::transmittance;
use crate::stage::{add_receiver, add_sun};

/// A square plate of glass above a receiver, with the sun straight above.
///
/// Light goes back and forth between the plate's faces and leaves a part below each time, all in
/// the plate's own shadow: the only closed form with infinitely many events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlassSlab {
    /// Refractive index of the glass.
    pub ior: f64,
    /// Width of the plate, in metres; it is half as thick and as far above the receiver.
    pub width: f64,
    /// Irradiance on a plane that faces the sun, in W/m².
    pub sun: f64,
}

impl GlassSlab {
    /// Flux that reaches the receiver after this many specular events, in watts: two refractions
    /// and `events - 2` reflections inside.
    #[must_use]
    pub fn flux_after(&self, events: u32) -> f64 {
        if events < 2 || events % 2 == 1 {
            return 0.0;
        }
        let through = transmittance(0.0, 1.0, self.ior);
        let reflected = (1.0 - through).powi(events as i32 - 2);
        self.sun * self.width * self.width * through * through * reflected
    }

    /// All flux that reaches the receiver, in watts: the geometric series `(1 - R) / (1 + R)`.
    #[must_use]
    pub fn flux(&self) -> f64 {
        let reflected = 1.0 - transmittance(0.0, 1.0, self.ior);
        self.sun * self.width * self.width * (1.0 - reflected) / (1.0 + reflected)
    }

    /// The arrangement, for the tracer.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        let width = self.width as f32;
        let glass = scene.add_material(Material::dielectric("glass", self.ior as f32))?;
        let plate = scene.add_mesh(shapes::cuboid([width, 0.5 * width, width])?);
        let lifted = Affine3A::from_translation(Vec3::new(0.0, 0.75 * width, 0.0));
        let plate = Instance::new("plate", Shape::Mesh(plate), glass).with_transform(lifted);
        scene.add_instance(plate)?;
        add_receiver(&mut scene, 2.0 * self.width, 0.0)?;
        add_sun(&mut scene, 0.0, self.sun)?;
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_adds_up() {
        let slab = GlassSlab {
            ior: 2.4,
            width: 2.0,
            sun: 3.0,
        };
        let sum: f64 = (0..60).map(|events| slab.flux_after(events)).sum();
        assert!((sum - slab.flux()).abs() < 1e-12);
        assert_eq!(slab.flux_after(3), 0.0);
    }
}
