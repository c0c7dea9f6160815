use caustics_geometry::shapes;
use caustics_scene::{Material, Scene};
use glam::DVec2;
use glam::Vec3;

use crate::TestError;
use crate::optics::transmittance;
use crate::stage::{add_mesh, add_receiver, add_sun};

/// A square sheet of still water over a receiver, in the sun.
///
/// The water's surface is a square around the y axis, the receiver is `depth` below it. All light
/// that enters is shifted alike, so that the receiver's lit part is the same square, moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatWater {
    /// Refractive index of the water.
    pub ior: f64,
    /// Half the width of the surface, in metres.
    pub half_width: f64,
    /// Height of the surface above the receiver, in metres.
    pub depth: f64,
    /// Absorption coefficient of the water, per metre.
    pub attenuation: f64,
    /// Angle of the sun off the vertical, towards +x, in radians.
    pub angle: f64,
    /// Irradiance on a plane that faces the sun, in W/m².
    pub sun: f64,
}

impl FlatWater {
    /// Irradiance of the lit square, in W/m²: what falls onto the surface, times what it lets
    /// through, times what the way through the water leaves.
    #[must_use]
    pub fn irradiance(&self) -> f64 {
        let way = self.depth / self.refracted_angle().cos();
        let left = (-self.attenuation * way).exp();
        self.sun * self.angle.cos() * transmittance(self.angle, 1.0, self.ior) * left
    }

    /// The two corners of the lit square, least and largest x and z, in metres.
    #[must_use]
    pub fn lit_square(&self) -> (DVec2, DVec2) {
        let shift = DVec2::new(self.depth * self.refracted_angle().tan(), 0.0);
        (shift - self.half_width, shift + self.half_width)
    }

    /// The arrangement, for the tracer.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        self.add_to(&mut scene)?;
        add_receiver(&mut scene, 2.0 * self.half_width + 2.0 * self.depth, 0.0)?;
        Ok(scene)
    }

    /// Adds the water and the sun.
    pub(super) fn add_to(&self, scene: &mut Scene) -> Result<(), TestError> {
        let half = self.half_width as f32;
        let corner = Vec3::new(-half, self.depth as f32, half);
        let surface = shapes::quad(corner, 2.0 * half * Vec3::X, -2.0 * half * Vec3::Z)?;
        let water = Material::dielectric("water", self.ior as f32)
            .with_attenuation([self.attenuation as f32; 3]);
        add_mesh(scene, "water", surface, water)?;
        add_sun(scene, self.angle, self.sun)
    }

    /// Of the light in the water, off the vertical, in radians.
    pub(super) fn refracted_angle(&self) -> f64 {
        (self.angle.sin() / self.ior).asin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertical_sun_loses_two_percent_at_the_surface() {
        let water = FlatWater {
            ior: 1.33,
            half_width: 1.0,
            depth: 2.0,
            attenuation: 0.0,
            angle: 0.0,
            sun: 10.0,
        };
        // ((1.33 - 1) / (1.33 + 1))² = 0.020059
        assert!((water.irradiance() - 10.0 * (1.0 - 0.020_059)).abs() < 1e-5);
        assert_eq!(water.lit_square(), (DVec2::splat(-1.0), DVec2::splat(1.0)));
        let turbid = FlatWater {
            attenuation: 0.5,
            ..water
        };
        assert!((turbid.irradiance() / water.irradiance() - (-1.0f64).exp()).abs() < 1e-15);
    }
}
