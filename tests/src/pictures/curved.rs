use caustics_trace::Photon;
use glam::DVec2;

use super::{ExactPicture, RINGS, SIZE};
use crate::TestError;
use crate::numerics::integrate;
use crate::oracles::{FlatWater, LensOverCap, PlanoConvexLens, RadialLens, SunOverRipples};
use crate::pixel_sum::PixelSum;

/// Receivers that curve.
impl ExactPicture {
    /// Light that a lens gathers on a part of a sphere of this curvature, per metre, at most 3 either
    /// way: above 0 a hill, below a bowl.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn curved_under_lens(curvature: f64) -> Result<Self, TestError> {
        let half = 0.3;
        let cap = LensOverCap {
            lens: PlanoConvexLens {
                curvature_radius: 1.0,
                aperture: 0.5,
                ior: 1.5,
                floor_distance: 0.9,
                irradiance: 2.0,
            },
            curvature,
            rim: 0.3,
        };
        let width = 2.0 * half / SIZE as f64;
        let mut sum = PixelSum::new(SIZE);
        let step = cap.lens.max_angle() / f64::from(RINGS);
        for ring in 0..RINGS {
            let angle = (f64::from(ring) + 0.5) * step;
            if let Some(landing) = cap.land(angle) {
                // What a pixel sees of the slope is wider than the pixel.
                let flux = cap.ring_flux(angle, step) * landing.transmittance * landing.upright;
                let center = DVec2::splat(0.5 * SIZE as f64);
                sum.add_circle(center, landing.radius / width, flux / (width * width));
            }
        }
        Ok(Self {
            name: "lens over a sphere",
            scene: cap.scene(4096, 256)?,
            events: 2,
            center: DVec2::ZERO,
            half,
            height: -cap.lens.floor_distance,
            is_lit_from_below: false,
            distance: 0.3,
            irradiance: sum.into_flux(),
        })
    }

    /// Slanting sun through still water on ripples with this curvature, per metre, on their crests and
    /// in their troughs; at least 3.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn ripples_in_sun(curvature: f64) -> Result<Self, TestError> {
        let half = 0.2;
        let ripples = SunOverRipples {
            water: FlatWater {
                ior: 1.33,
                half_width: 0.5,
                depth: 0.2,
                attenuation: 0.0,
                angle: 0.9,
                sun: 2.0,
            },
            slope: 0.6,
            curvature,
            half_width: 0.3,
        };
        let width = 2.0 * half / SIZE as f64;
        let column = |column: usize| {
            let start = column as f64 * width - half;
            integrate(|x| ripples.irradiance_at(x), start, start + width, 4) / width
        };
        let row: Vec<f64> = (0..SIZE).map(column).collect();
        Ok(Self {
            name: "sun on ripples",
            scene: ripples.scene(16_384)?,
            events: 1,
            center: DVec2::ZERO,
            half,
            height: 0.0,
            is_lit_from_below: false,
            distance: 0.15,
            irradiance: row.repeat(SIZE),
        })
    }
}

/// A photon whose light falls straight on the plane of its footprint: the plain plane, for comparison
/// with points of a receiver followed along the light. What it lights off the plane is projected along
/// the normal, and as bright as what it lights in the plane but for the cosine between the normals, by
/// which no flux is won or lost.
#[must_use]
pub fn on_plain_plane(photon: Photon) -> Photon {
    Photon {
        incoming: -photon.normal,
        ..photon
    }
}
