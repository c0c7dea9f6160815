use std::f64::consts::FRAC_PI_2;

use caustics_geometry::shapes::{ProfilePoint, revolution_with_normals};
use caustics_scene::{Material, Scene};
use glam::{DVec2, Vec2};

use crate::TestError;
use crate::measure::Region;
use crate::numerics::{integrate, sign_changes};
use crate::optics::schlick;
use crate::stage::{add_mesh, add_receiver, add_sun};

/// The inside of an upright mirror ring that stands on a receiver, in slanting sun: the nephroid in
/// a cup.
///
/// Only the light that is reflected once is described, `Photon::events == 1`, and only inside the
/// ring. Its wall is thin and reflects on both sides, so that it shades itself.
///
/// A point of the wall is given by its angle `phi` from +x and, for its height `y`, by the
/// horizontal length `l = y tan(angle)` that light travels from there down to the receiver. It
/// lands at `R (cos phi, sin phi) - l (cos 2 phi, sin 2 phi)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorCylinder {
    /// Radius, in metres.
    pub radius: f64,
    /// Height of the wall, in metres.
    pub height: f64,
    /// Reflectance of the metal at normal incidence.
    pub f0: f64,
    /// Angle of the sun off the vertical, towards +x, in radians.
    pub angle: f64,
    /// Irradiance on a plane that faces the sun, in W/m².
    pub sun: f64,
}

impl MirrorCylinder {
    /// Flux that lands in a region of the receiver, which must lie inside the ring, in watts.
    ///
    /// For each angle the region is an interval of lengths, so that one integral is left.
    #[must_use]
    pub fn flux(&self, region: &Region) -> f64 {
        self.flux_by_angle(|phi| self.lengths_in(region, phi))
    }

    /// Irradiance at a point of the receiver inside the ring, in W/m²: the sum over all points of
    /// the wall from which light lands there.
    #[must_use]
    pub fn irradiance_at(&self, point: DVec2) -> f64 {
        // The point is on the line of the reflected light where their cross product is 0.
        let aside = |phi: f64| {
            self.towards_wall(phi, point)
                .perp_dot(DVec2::from_angle(2.0 * phi))
        };
        sign_changes(aside, -FRAC_PI_2, FRAC_PI_2, 20_000)
            .into_iter()
            .map(|phi| {
                let length = self
                    .towards_wall(phi, point)
                    .dot(DVec2::from_angle(2.0 * phi));
                let (low, high) = self.lit_lengths(phi);
                if (low..=high).contains(&length) {
                    let width = self.radius * phi.cos();
                    // The determinant of the map's derivative, against that of the beam.
                    self.wall_power(phi) / (width - 2.0 * length).abs()
                } else {
                    0.0
                }
            })
            .sum()
    }

    /// The arrangement, for the tracer: the ring stands around the origin, as a prism of this many
    /// sides with the cylinder's normals at its edges.
    ///
    /// A side is at most `R (pi / segments)² / 2` inside the cylinder: with 1024, 5e-6 R.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, segments: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        let (radius, height) = (self.radius as f32, self.height as f32);
        let normal = Vec2::NEG_X;
        let profile = [
            ProfilePoint {
                position: Vec2::new(radius, height),
                normal,
            },
            ProfilePoint {
                position: Vec2::new(radius, 0.0),
                normal,
            },
        ];
        let wall = revolution_with_normals(&profile, segments)?;
        let metal = Material::metal("metal", [self.f0 as f32; 3]);
        add_mesh(&mut scene, "ring", wall, metal)?;
        add_receiver(&mut scene, 4.0 * self.radius, 0.0)?;
        add_sun(&mut scene, self.angle, self.sun)?;
        Ok(scene)
    }

    /// The integral over the angle of what is reflected from an interval of lengths.
    fn flux_by_angle(&self, lengths: impl Fn(f64) -> Option<(f64, f64)>) -> f64 {
        let flux = |phi: f64| {
            let (lit_low, lit_high) = self.lit_lengths(phi);
            let length = lengths(phi).map_or(0.0, |(low, high)| {
                (high.min(lit_high) - low.max(lit_low)).max(0.0)
            });
            self.wall_power(phi) * length
        };
        // The interval's ends have kinks in the angle; so many panels leave 1e-7.
        integrate(flux, -FRAC_PI_2, FRAC_PI_2, 20_000)
    }

    /// Reflected flux for each unit of angle and of length, in W/m: the beam's irradiance of the
    /// wall, `E sin(angle) cos(phi)`, times its area `R dphi dl / tan(angle)`.
    fn wall_power(&self, phi: f64) -> f64 {
        let cosine = self.angle.sin() * phi.cos();
        self.sun * self.angle.cos() * self.radius * phi.cos() * schlick(cosine, self.f0)
    }

    /// The lengths of the lit part of the wall from which light reaches the receiver before it
    /// meets the wall again; empty where the second is less than the first.
    fn lit_lengths(&self, phi: f64) -> (f64, f64) {
        let longest = self.height * self.angle.tan();
        // Both the beam on its way in and the reflected light cross the ring on this chord.
        let chord = 2.0 * self.radius * phi.cos();
        ((longest - chord).max(0.0), longest.min(chord))
    }

    fn lengths_in(&self, region: &Region, phi: f64) -> Option<(f64, f64)> {
        let (wall, back) = (
            self.radius * DVec2::from_angle(phi),
            DVec2::from_angle(2.0 * phi),
        );
        match *region {
            Region::Everything => Some((0.0, f64::INFINITY)),
            Region::Disc { center, radius } => {
                let relative = wall - center;
                let middle = relative.dot(back);
                let half = radius * radius - relative.length_squared() + middle * middle;
                (half > 0.0).then(|| (middle - half.sqrt(), middle + half.sqrt()))
            }
            Region::Rectangle { min, max } => {
                let (first, second) = ((wall - min) / back, (wall - max) / back);
                let (low, high) = (first.min(second), first.max(second));
                Some((low.max_element(), high.min_element()))
            }
        }
    }

    fn towards_wall(&self, phi: f64, point: DVec2) -> DVec2 {
        self.radius * DVec2::from_angle(phi) - point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::integrate_rectangle;
    use glam::DVec3;

    const RING: MirrorCylinder = MirrorCylinder {
        radius: 1.2,
        height: 0.8,
        f0: 0.9,
        angle: 0.8,
        sun: 2.0,
    };

    #[test]
    fn agrees_with_rays_traced_by_vectors() {
        // A coarse sum over the wall with its own optics, reflected and followed to the receiver.
        let region = Region::Disc {
            center: DVec2::new(0.2, 0.1),
            radius: 0.4,
        };
        let (columns, rows) = (4000, 400);
        let down = DVec3::new(RING.angle.sin(), -RING.angle.cos(), 0.0);
        let mut sum = 0.0;
        for column in 0..columns {
            let phi = std::f64::consts::TAU * (f64::from(column) + 0.5) / f64::from(columns);
            let inward = -DVec3::new(phi.cos(), 0.0, phi.sin());
            let cosine = -down.dot(inward);
            if cosine <= 0.0 {
                continue;
            }
            for row in 0..rows {
                let y = RING.height * (f64::from(row) + 0.5) / f64::from(rows);
                let wall = DVec3::new(0.0, y, 0.0) - RING.radius * inward;
                // The beam came over the opposite wall, and the reflected light misses it.
                let chord = 2.0 * RING.radius * cosine / down.dot(down.with_y(0.0));
                let shaded = (wall - chord * down).y < RING.height;
                let reflected = down + 2.0 * cosine * inward;
                let landed = wall - wall.y / reflected.y * reflected;
                let landed = DVec2::new(landed.x, landed.z);
                if !shaded && landed.length() < RING.radius && region.contains(landed) {
                    sum += cosine * schlick(cosine, RING.f0);
                }
            }
        }
        let cell = std::f64::consts::TAU * RING.radius * RING.height / f64::from(columns * rows);
        let (traced, exact) = (RING.sun * cell * sum, RING.flux(&region));
        assert!((traced / exact - 1.0).abs() < 1e-3, "{traced} and {exact}");
    }

    #[test]
    fn irradiance_adds_up_to_the_flux() {
        // Where light comes from one point of the wall, and where it comes from three; both clear
        // of the nephroid and of the ends of the lit wall.
        for (x, z) in [((0.42, 0.5), (-0.04, 0.04)), ((0.75, 0.78), (-0.01, 0.01))] {
            let region = Region::Rectangle {
                min: DVec2::new(x.0, z.0),
                max: DVec2::new(x.1, z.1),
            };
            let at = |x, z| RING.irradiance_at(DVec2::new(x, z));
            let sum = integrate_rectangle(at, x, z, 1);
            let exact = RING.flux(&region);
            assert!(
                exact > 0.0 && (sum / exact - 1.0).abs() < 1e-5,
                "{sum} and {exact}"
            );
        }
    }

    #[test]
    fn the_cusp_of_the_nephroid_is_half_a_radius_from_the_wall() {
        // Where R cos(phi) = 2 l, at phi = 0: x = R / 2.
        let cusp = DVec2::new(0.5 * RING.radius, 0.0);
        let beside = RING.irradiance_at(cusp + DVec2::new(-0.003, 0.0));
        assert!(
            beside > 20.0 * RING.irradiance_at(cusp + DVec2::new(-0.3, 0.0)),
            "{beside}"
        );
    }
}
