use std::f64::consts::PI;

use crate::numerics::{integrate, sign_changes};

/// Intervals in which roots are looked for.
const SAMPLES: usize = 20_000;

/// Pieces of eight nodes for the integral over one interval without a root.
const PANELS: usize = 64;

/// Where a ray of a parallel beam along a lens's axis lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landing {
    /// Signed distance from the axis in the ray's own half-plane, in metres: negative where the
    /// ray has crossed the axis.
    pub position: f64,
    /// The part of the light that is left.
    pub transmittance: f64,
}

/// A lens with a spherical front in a parallel beam along its axis, over a receiver across it.
///
/// By its symmetry the caustic is a map of one dimension, from the angle at which a ray meets the
/// front to the distance from the axis at which it lands.
pub trait RadialLens {
    /// Radius of curvature of the front, in metres.
    fn curvature_radius(&self) -> f64;

    /// The largest angle of incidence at the front, in radians.
    fn max_angle(&self) -> f64;

    /// Irradiance of the beam on a plane across it, in W/m².
    fn irradiance(&self) -> f64;

    /// Where the ray lands that meets the front at this angle; `None` where it does not.
    fn land(&self, angle: f64) -> Option<Landing>;

    /// Flux that lands within `radius` of the axis, in watts.
    fn flux_within(&self, radius: f64) -> f64 {
        let outside = |angle| self.distance(angle) - radius;
        let mut ends = vec![0.0];
        ends.extend(sign_changes(outside, 0.0, self.max_angle(), SAMPLES));
        ends.push(self.max_angle());
        // A ring of the beam between the angles i and i + di has the area pi R² sin(2 i) di.
        let area = PI * self.curvature_radius().powi(2);
        let flux = |angle: f64| {
            let left = self
                .land(angle)
                .map_or(0.0, |landing| landing.transmittance);
            self.irradiance() * area * (2.0 * angle).sin() * left
        };
        ends.windows(2)
            .filter(|piece| outside(0.5 * (piece[0] + piece[1])) <= 0.0)
            .map(|piece| integrate(flux, piece[0], piece[1], PANELS))
            .sum()
    }

    /// Irradiance of the receiver at `radius` from the axis, in W/m²: the sum over all rays that
    /// land there, `E T b db / (rho drho)` each.
    fn irradiance_at(&self, radius: f64) -> f64 {
        let angles = sign_changes(
            |angle| self.distance(angle) - radius,
            0.0,
            self.max_angle(),
            SAMPLES,
        );
        let area_slope = |angle: f64| 0.5 * self.curvature_radius().powi(2) * (2.0 * angle).sin();
        angles
            .into_iter()
            .filter_map(|angle| {
                let step = 1e-6;
                let slope =
                    (self.distance(angle + step) - self.distance(angle - step)) / (2.0 * step);
                let part = self.land(angle)?.transmittance * area_slope(angle);
                Some(self.irradiance() * part / (radius * slope.abs()))
            })
            .sum()
    }

    /// Distance from the axis at which a ray lands, infinite where it does not.
    fn distance(&self, angle: f64) -> f64 {
        self.land(angle)
            .map_or(f64::INFINITY, |landing| landing.position.abs())
    }
}
