use std::f64::consts::FRAC_PI_2;

use caustics_geometry::shapes::{ProfilePoint, revolution_with_normals};
use caustics_scene::{Material, Scene};
use glam::Vec2;

use super::{Landing, RadialLens};
use crate::TestError;
use crate::optics::transmittance;
use crate::stage::{add_mesh, add_receiver, add_sun};

/// A lens with a spherical front upwards and a flat back, above a receiver, with the sun straight
/// above.
///
/// Only the light that is refracted twice is described, `Photon::events == 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanoConvexLens {
    /// Radius of curvature of the front, in metres.
    pub curvature_radius: f64,
    /// Radius of the lens, in metres; its rim has no thickness.
    pub aperture: f64,
    /// Refractive index.
    pub ior: f64,
    /// From the flat back down to the receiver, in metres.
    pub floor_distance: f64,
    /// Irradiance of the beam, in W/m².
    pub irradiance: f64,
}

impl PlanoConvexLens {
    /// The arrangement, for the tracer: the middle of the flat back is the origin. The front is a
    /// mesh of `rings` from the rim to the top and `segments` around.
    ///
    /// Its vertices are on the sphere and its normals the sphere's. Between them a facet is at
    /// most `R (a / rings)² / 8` below the sphere, `a` the largest angle of incidence, and half the
    /// segments' angle squared likewise: with 128 and 512, 2e-5 R.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, rings: u32, segments: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        self.add_to(&mut scene, rings, segments)?;
        add_receiver(&mut scene, 4.0 * self.aperture, -self.floor_distance)?;
        Ok(scene)
    }

    /// Adds the lens and the sun.
    pub(super) fn add_to(
        &self,
        scene: &mut Scene,
        rings: u32,
        segments: u32,
    ) -> Result<(), TestError> {
        let rim = Vec2::new(self.aperture as f32, 0.0);
        let down = Vec2::NEG_Y;
        let mut profile = vec![
            ProfilePoint {
                position: Vec2::ZERO,
                normal: down,
            },
            ProfilePoint {
                position: rim,
                normal: down,
            },
        ];
        profile.extend((0..=rings).rev().map(|ring| {
            let angle = self.max_angle() * f64::from(ring) / f64::from(rings);
            let (sin, cos) = angle.sin_cos();
            let position = Vec2::new(
                (self.curvature_radius * sin) as f32,
                (self.curvature_radius * cos - self.center_depth()) as f32,
            );
            ProfilePoint {
                position: if ring == rings { rim } else { position },
                normal: Vec2::new(sin as f32, cos as f32),
            }
        }));
        let lens = revolution_with_normals(&profile, segments)?;
        add_mesh(
            scene,
            "lens",
            lens,
            Material::dielectric("glass", self.ior as f32),
        )?;
        add_sun(scene, 0.0, self.irradiance)
    }

    /// From the flat back down to the front's centre of curvature, in metres.
    fn center_depth(&self) -> f64 {
        (self.curvature_radius.powi(2) - self.aperture.powi(2)).sqrt()
    }
}

impl RadialLens for PlanoConvexLens {
    fn curvature_radius(&self) -> f64 {
        self.curvature_radius
    }

    fn max_angle(&self) -> f64 {
        (self.aperture / self.curvature_radius).asin()
    }

    fn irradiance(&self) -> f64 {
        self.irradiance
    }

    fn land(&self, angle: f64) -> Option<Landing> {
        let (sin, cos) = angle.sin_cos();
        // Off the vertical inside the lens, and after it.
        let inside = angle - (sin / self.ior).asin();
        let sine = self.ior * inside.sin();
        if sine >= 1.0 {
            return None;
        }
        let outside = sine.asin();
        let thickness = self.curvature_radius * cos - self.center_depth();
        let at_back = self.curvature_radius * sin - thickness * inside.tan();
        let through = transmittance(angle, 1.0, self.ior) * transmittance(inside, self.ior, 1.0);
        (outside < FRAC_PI_2).then(|| Landing {
            position: at_back - self.floor_distance * outside.tan(),
            transmittance: through,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paraxial_rays_meet_at_the_lensmakers_focus() {
        let lens = PlanoConvexLens {
            curvature_radius: 2.0,
            aperture: 0.02,
            ior: 1.5,
            floor_distance: 4.0,
            irradiance: 1.0,
        };
        // f = R / (n - 1) behind a thin lens.
        let position = lens.land(lens.max_angle()).expect("lands").position;
        assert!(position.abs() < 2e-5, "{position}");
        let halfway = PlanoConvexLens {
            floor_distance: 2.0,
            ..lens
        };
        assert!((halfway.irradiance_at(0.002) / (4.0 * 0.96 * 0.96) - 1.0).abs() < 1e-3);
        // All the light, in the half as wide disc.
        let all = std::f64::consts::PI * 0.02f64.powi(2) * 0.96 * 0.96;
        assert!((halfway.flux_within(0.0101) / all - 1.0).abs() < 1e-4);
    }
}
