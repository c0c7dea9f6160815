use std::f64::consts::FRAC_PI_2;

use caustics_scene::{Instance, Material, Scene, Shape};
use glam::Vec3;

use super::{Landing, RadialLens};
use crate::TestError;
use crate::optics::transmittance;
use crate::stage::{add_receiver, add_sun};

/// A glass ball above a receiver, with the sun straight above.
///
/// Only the light that is refracted twice is described, `Photon::events == 2`. Where the receiver
/// is nearer than the paraxial focus, the map folds: the caustic has a bright edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLens {
    /// Radius of the ball, in metres.
    pub radius: f64,
    /// Refractive index of the ball.
    pub ior: f64,
    /// From the ball's centre down to the receiver, in metres.
    pub floor_distance: f64,
    /// Irradiance of the beam, in W/m².
    pub irradiance: f64,
}

impl SphereLens {
    /// The arrangement, for the tracer: the centre of the ball is the origin.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        let glass = scene.add_material(Material::dielectric("glass", self.ior as f32))?;
        let ball = Shape::Sphere {
            center: Vec3::ZERO,
            radius: self.radius as f32,
        };
        scene.add_instance(Instance::new("ball", ball, glass))?;
        add_receiver(&mut scene, 4.0 * self.radius, -self.floor_distance)?;
        add_sun(&mut scene, 0.0, self.irradiance)?;
        Ok(scene)
    }
}

impl RadialLens for SphereLens {
    fn curvature_radius(&self) -> f64 {
        self.radius
    }

    fn max_angle(&self) -> f64 {
        FRAC_PI_2
    }

    fn irradiance(&self) -> f64 {
        self.irradiance
    }

    /// The ray meets the ball at the polar angle `i`, turns by `i - t`, crosses on a chord that
    /// spans `pi - 2 t`, and turns by `i - t` again.
    fn land(&self, angle: f64) -> Option<Landing> {
        let inside = (angle.sin() / self.ior).asin();
        let deviation = 2.0 * (angle - inside);
        let exit = 2.0 * inside - angle;
        let (x, y) = (self.radius * exit.sin(), -self.radius * exit.cos());
        let fall = self.floor_distance + y;
        (deviation < FRAC_PI_2).then(|| Landing {
            position: x - fall * deviation.tan(),
            transmittance: transmittance(angle, 1.0, self.ior).powi(2),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::integrate;
    use crate::optics::refract;
    use glam::DVec3;
    use std::f64::consts::TAU;

    const LENS: SphereLens = SphereLens {
        radius: 1.5,
        ior: 1.5,
        floor_distance: 1.8,
        irradiance: 2.0,
    };

    #[test]
    fn agrees_with_rays_traced_by_vectors() {
        for angle in [0.01, 0.3, 0.8, 1.1] {
            let entry = LENS.radius * DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
            let inside = refract(DVec3::NEG_Y, entry / LENS.radius, 1.0, LENS.ior).expect("enters");
            let exit = entry - 2.0 * entry.dot(inside) * inside;
            let left = refract(inside, -exit / LENS.radius, LENS.ior, 1.0).expect("leaves");
            let landed = exit - (exit.y + LENS.floor_distance) / left.y * left;
            let position = LENS.land(angle).expect("lands").position;
            assert!((position - landed.x).abs() < 1e-12, "{position}, {landed}");
        }
    }

    #[test]
    fn paraxial_rays_meet_at_the_focal_length_of_a_ball() {
        // n R / (2 (n - 1)) from the centre.
        let lens = SphereLens {
            floor_distance: 1.5 * LENS.radius,
            ..LENS
        };
        let landing = lens.land(1e-3).expect("lands");
        assert!(
            landing.position.abs() < 1e-8 && (landing.transmittance - 0.96 * 0.96).abs() < 1e-6
        );
    }

    #[test]
    fn irradiance_is_the_slope_of_the_flux_across_the_fold() {
        // The edge of the bright disc, where three rays become one, is at 0.111.
        for (start, end) in [(0.03, 0.09), (0.13, 0.2), (0.6, 0.9)] {
            let ring = integrate(|rho| TAU * rho * LENS.irradiance_at(rho), start, end, 4);
            let difference = LENS.flux_within(end) - LENS.flux_within(start);
            assert!(
                (ring / difference - 1.0).abs() < 1e-6,
                "{ring} and {difference}"
            );
        }
    }

    #[test]
    fn all_flux_is_what_the_ball_lets_through() {
        // By impact parameters in place of angles; the outermost are thrown upwards.
        let through = |b: f64| {
            let angle = (b / LENS.radius).asin();
            let lands = LENS.land(angle).is_some();
            if lands {
                TAU * b * transmittance(angle, 1.0, LENS.ior).powi(2)
            } else {
                0.0
            }
        };
        let all = LENS.irradiance * integrate(through, 0.0, LENS.radius, 10_000);
        assert!((LENS.flux_within(1e9) / all - 1.0).abs() < 1e-6, "{all}");
    }
}
