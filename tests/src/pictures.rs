//! Pictures of the oracles' receivers: exact ones, and what the default estimate makes of photons.

use caustics_accel::BvhOptions;
use caustics_render::{FootprintOptions, GBuffer, splat};
use caustics_sampling::Sequence;
use caustics_scene::{Camera, Projection, Scene, World};
use caustics_trace::{Photon, trace_photons};
use glam::{Affine3A, DVec2, Mat3, Vec3};
use std::f64::consts::PI;

use crate::TestError;
use crate::measure::{Region, without_chance};
use crate::oracles::{
    MirrorCylinder, ParabolicMirror, PlanoConvexLens, RadialLens, SphereLens, WavyWater,
};
use crate::pixel_sum::PixelSum;

mod curved;

pub use curved::on_plain_plane;

/// Pixels along each side.
pub const SIZE: usize = 128;

/// Pixels darker than this part of the mean are not lit.
const LIT: f64 = 0.05;

/// Rings that the beam of a lens is cut into.
const RINGS: u32 = 80_000;

/// Squares that the water's surface is cut into each way, for the exact picture where it folds light
/// and for the tracer. With half as many facets as these the tracer's water is another one by
/// a relMSE of 1.3e-7 without folds and 1.5e-6 with them, more than what four million photons leave.
const WATER_SAMPLES: u32 = 2048;
const WATER_FACETS: u32 = 1024;

/// Half of the width of the water's receiver that is shown, in metres.
const WATER_HALF: f64 = 0.5;

/// A square part of a receiver that light falls on from above, or from below, and the irradiance of
/// its pixels.
pub struct ExactPicture {
    /// What it shows.
    pub name: &'static str,
    scene: Scene,
    /// Specular events of the light that the oracle describes.
    events: u32,
    center: DVec2,
    half: f64,
    height: f64,
    is_lit_from_below: bool,
    /// How far off the receiver the camera is, in metres.
    distance: f64,
    /// Mean irradiance of each pixel, row by row along z, in W/m².
    pub irradiance: Vec<f64>,
}

/// How far a picture is from the exact one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureError {
    /// Mean of (t - r)² / (r² + (0.1 mean r)²).
    pub relative_mse: f64,
    /// Median of |t - r| over lit pixels, relative to their mean.
    pub median: f64,
    /// 99.99th percentile of the same.
    pub outliers: f64,
    /// 99.99th percentile over lit pixels of |t - r| / (r + mean r).
    pub off_by: f64,
    /// Where the largest error is: column and row.
    pub worst: [usize; 2],
}

impl ExactPicture {
    /// A glass ball nearer to the receiver than its focus: a bright edge with a fold.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn sphere_lens() -> Result<Self, TestError> {
        let lens = SphereLens {
            radius: 1.0,
            ior: 1.5,
            floor_distance: 1.2,
            irradiance: 2.0,
        };
        let half = 0.5;
        Ok(Self {
            name: "sphere lens",
            scene: lens.scene()?,
            events: 2,
            center: DVec2::ZERO,
            half,
            height: -lens.floor_distance,
            is_lit_from_below: false,
            distance: 0.1,
            irradiance: radial(&lens, half, RINGS),
        })
    }

    /// A plano-convex lens half way to its focus.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn plano_convex_lens() -> Result<Self, TestError> {
        let lens = PlanoConvexLens {
            curvature_radius: 1.0,
            aperture: 0.5,
            ior: 1.5,
            floor_distance: 0.9,
            irradiance: 2.0,
        };
        let half = 0.35;
        Ok(Self {
            name: "plano-convex lens",
            scene: lens.scene(128, 512)?,
            events: 2,
            center: DVec2::ZERO,
            half,
            height: -lens.floor_distance,
            is_lit_from_below: false,
            distance: 0.1,
            irradiance: radial(&lens, half, RINGS),
        })
    }

    /// The nephroid inside a mirror ring.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn mirror_cylinder() -> Result<Self, TestError> {
        let ring = MirrorCylinder {
            radius: 1.0,
            height: 0.9,
            f0: 0.8,
            angle: 0.8,
            sun: 3.0,
        };
        let (center, half) = (DVec2::new(0.45, 0.0), 0.4);
        let exact = |min, max| ring.flux(&Region::Rectangle { min, max });
        Ok(Self {
            name: "mirror cylinder",
            scene: ring.scene(1024)?,
            events: 1,
            center,
            half,
            height: 0.0,
            is_lit_from_below: false,
            distance: 0.1,
            irradiance: pixels(center, half, exact),
        })
    }

    /// The smooth image that a piece of a parabolic mirror makes, and its ends.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn parabolic_mirror() -> Result<Self, TestError> {
        let mirror = ParabolicMirror {
            focal_length: 1.0,
            near: 0.4,
            width: 1.0,
            screen_height: 1.6,
            f0: 0.8,
            sun: 3.0,
        };
        let (center, half) = (DVec2::new(-0.7, 0.0), 0.24);
        Ok(Self {
            name: "parabolic mirror",
            scene: mirror.scene(256)?,
            events: 1,
            center,
            half,
            height: mirror.screen_height,
            is_lit_from_below: true,
            distance: 0.1,
            irradiance: pixels(center, half, |min, max| mirror.flux(min, max)),
        })
    }

    /// Waves too low for folds.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn wavy_water() -> Result<Self, TestError> {
        let water = WavyWater::with_strength(1.0);
        let half = WATER_HALF;
        let exact = pixels(DVec2::ZERO, half, |min, max| water.flux(min, max));
        Self::water("wavy water", &water, exact)
    }

    /// Waves with folds.
    ///
    /// # Errors
    /// If the scene cannot be made.
    pub fn folded_water() -> Result<Self, TestError> {
        let water = WavyWater::with_strength(3.0);
        let area = (2.0 * WATER_HALF / SIZE as f64).powi(2);
        let flux = water.binned_flux(WATER_HALF, SIZE, WATER_SAMPLES);
        let exact = flux.into_iter().map(|flux| flux / area).collect();
        Self::water("folded water", &water, exact)
    }

    fn water(
        name: &'static str,
        water: &WavyWater,
        irradiance: Vec<f64>,
    ) -> Result<Self, TestError> {
        Ok(Self {
            name,
            scene: water.scene(WATER_FACETS)?,
            events: 1,
            center: DVec2::ZERO,
            half: WATER_HALF,
            height: 0.0,
            is_lit_from_below: false,
            distance: 0.2,
            irradiance,
        })
    }

    /// All that have flat receivers.
    ///
    /// # Errors
    /// If a scene cannot be made.
    pub fn all() -> Result<Vec<Self>, TestError> {
        Ok(vec![
            Self::sphere_lens()?,
            Self::plano_convex_lens()?,
            Self::mirror_cylinder()?,
            Self::parabolic_mirror()?,
            Self::wavy_water()?,
            Self::folded_water()?,
        ])
    }

    /// The irradiance that the default estimate gives from so many photons.
    ///
    /// # Errors
    /// If the scene cannot be traced or splatted.
    pub fn estimated(&self, photons: u32, seed: u64) -> Result<Vec<f64>, TestError> {
        let [picture] = self.estimated_from(photons, seed, [|photon| photon])?;
        Ok(picture)
    }

    /// The irradiance that the default estimate gives from so many photons, once for each of several
    /// ways to change them.
    ///
    /// # Errors
    /// If the scene cannot be traced or splatted.
    pub fn estimated_from<const N: usize>(
        &self,
        photons: u32,
        seed: u64,
        changes: [fn(Photon) -> Photon; N],
    ) -> Result<[Vec<f64>; N], TestError> {
        let world = World::new(&self.scene)?;
        let intersector = world.intersector(&BvhOptions::default())?;
        let mut options = without_chance(Sequence::Grid, self.events + 1);
        (options.photons, options.seed) = (photons, seed);
        let map = trace_photons(&world, &intersector, &options, &|_| {})?;
        let size = SIZE as u32;
        let buffer = GBuffer::new(&world, &intersector, &self.camera()?, size, size)?;
        let mut pictures = [const { Vec::new() }; N];
        for (picture, change) in pictures.iter_mut().zip(changes) {
            let photons = map.photons.iter().copied();
            let counted: Vec<Photon> = photons
                .filter(|photon| photon.events == self.events)
                .map(change)
                .collect();
            let (image, _) = splat(&buffer, &counted, &FootprintOptions::default())?;
            // The receiver's albedo is a half.
            let irradiance = |pixel: &[f32; 3]| 2.0 * PI * f64::from(pixel[0]);
            let rows = image.pixels().chunks(SIZE);
            *picture = if self.is_lit_from_below {
                rows.rev().flatten().map(irradiance).collect()
            } else {
                rows.flatten().map(irradiance).collect()
            };
        }
        Ok(pictures)
    }

    /// Close before the receiver, on its lit side, with rows along z, upwards from below.
    fn camera(&self) -> Result<Camera, TestError> {
        let up = if self.is_lit_from_below { -1.0 } else { 1.0 };
        let axes = Mat3::from_cols(Vec3::X, -up * Vec3::Z, up * Vec3::Y);
        let eye = Vec3::new(
            self.center.x as f32,
            self.height as f32 + up * self.distance as f32,
            self.center.y as f32,
        );
        let extent = self.half as f32;
        let projection = Projection::Orthographic {
            xmag: extent,
            ymag: extent,
        };
        let pose = Affine3A::from_mat3_translation(axes, eye);
        Ok(Camera::new("receiver", pose, projection)?)
    }

    /// The error of a picture of the same pixels.
    #[must_use]
    pub fn error(&self, picture: &[f64]) -> PictureError {
        let mean = self.irradiance.iter().sum::<f64>() / self.irradiance.len() as f64;
        let pairs = || picture.iter().zip(&self.irradiance);
        let relative = |(test, exact): (&f64, &f64)| {
            (test - exact).powi(2) / (exact * exact + 0.01 * mean * mean)
        };
        let sorted = |steady: &dyn Fn(f64) -> f64| {
            let mut lit: Vec<(f64, usize)> = pairs()
                .zip(0..)
                .filter(|((_, exact), _)| **exact > LIT * mean)
                .map(|((test, exact), pixel)| ((test - exact).abs() / steady(*exact), pixel))
                .collect();
            lit.sort_by(|a, b| a.0.total_cmp(&b.0));
            lit
        };
        let (lit, relative_to_pixels) = (sorted(&|_| mean), sorted(&|exact| exact + mean));
        let rank = |part: f64| ((part * lit.len() as f64) as usize).min(lit.len() - 1);
        let at = |part: f64| lit[rank(part)];
        let worst = lit[lit.len() - 1].1;
        PictureError {
            relative_mse: pairs().map(relative).sum::<f64>() / picture.len() as f64,
            median: at(0.5).0,
            outliers: at(0.9999).0,
            off_by: relative_to_pixels[rank(0.9999)].0,
            worst: [worst % SIZE, worst / SIZE],
        }
    }
}

/// The mean irradiance of pixels from the flux that they get.
fn pixels(center: DVec2, half: f64, flux: impl Fn(DVec2, DVec2) -> f64) -> Vec<f64> {
    let width = 2.0 * half / SIZE as f64;
    (0..SIZE * SIZE)
        .map(|pixel| {
            let corner = DVec2::new((pixel % SIZE) as f64, (pixel / SIZE) as f64);
            let min = center - half + width * corner;
            flux(min, min + width) / (width * width)
        })
        .collect()
}

/// The mean irradiance of pixels around a lens: rings of the beam, each a circle on the receiver.
fn radial(lens: &impl RadialLens, half: f64, rings: u32) -> Vec<f64> {
    let width = 2.0 * half / SIZE as f64;
    let center = DVec2::splat(0.5 * SIZE as f64);
    let mut sum = PixelSum::new(SIZE);
    let step = lens.max_angle() / f64::from(rings);
    for ring in 0..rings {
        let angle = (f64::from(ring) + 0.5) * step;
        let Some(landing) = lens.land(angle) else {
            continue;
        };
        let radius = landing.position.abs();
        if radius > half * 2.0f64.sqrt() {
            continue;
        }
        let area = PI * lens.curvature_radius().powi(2) * (2.0 * angle).sin() * step;
        let flux = lens.irradiance() * area * landing.transmittance;
        sum.add_circle(center, radius / width, flux / (width * width));
    }
    sum.into_flux()
}

/// The order of convergence: minus the slope of the error's logarithm over the count's, fitted.
#[must_use]
pub fn fitted_order(points: &[(u32, f64)]) -> f64 {
    let logs: Vec<DVec2> = points
        .iter()
        .map(|&(count, error)| DVec2::new(f64::from(count).ln(), error.ln()))
        .collect();
    let mean = logs.iter().copied().sum::<DVec2>() / logs.len() as f64;
    let (mut covariance, mut variance) = (0.0, 0.0);
    for point in &logs {
        let off = *point - mean;
        covariance += off.x * off.y;
        variance += off.x * off.x;
    }
    -covariance / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_a_power_is_its_exponent() {
        let points = [1u32 << 10, 1 << 14, 1 << 20].map(|n| (n, 3.0 * f64::from(n).powf(-0.7)));
        assert!((fitted_order(&points) - 0.7).abs() < 1e-12);
    }

    #[test]
    fn errors_are_ranked_over_lit_pixels_alone() {
        // A quarter of the pixels dark, the others even, and two of them wrong: by all of the mean in a pixel
        // that is 9 times as bright, and by half of it in an even one.
        let mut irradiance = vec![4.0; SIZE * SIZE];
        irradiance[..SIZE * SIZE / 4].fill(0.0);
        let (bright, even) = (SIZE * SIZE - 3, SIZE * SIZE / 2 + 7);
        irradiance[bright] = 36.0;
        let picture = ExactPicture {
            name: "even",
            scene: Scene::new(),
            events: 1,
            center: DVec2::ZERO,
            half: 1.0,
            height: 0.0,
            is_lit_from_below: false,
            distance: 1.0,
            irradiance,
        };
        let mean = picture.irradiance.iter().sum::<f64>() / (SIZE * SIZE) as f64;
        let mut test: Vec<f64> = picture
            .irradiance
            .iter()
            .map(|it| it + 0.01 * mean)
            .collect();
        // What is not lit counts for the mean error alone.
        test[3] = 0.2 * mean;
        test[bright] = 36.0 + mean;
        test[even] = 4.0 + 0.5 * mean;
        let found = picture.error(&test);
        let is_near = |one: f64, other: f64| (one - other).abs() < 1e-9;
        assert!(is_near(found.median, 0.01), "{found:?}");
        // Of 12,288 lit pixels the 99.99th percentile is the second largest error: the bright pixel's is the
        // largest in the mean, but not in what the pixel has.
        assert!(is_near(found.outliers, 0.5), "{found:?}");
        assert_eq!(found.worst, [bright % SIZE, bright / SIZE]);
        assert!(is_near(found.off_by, mean / (36.0 + mean)), "{found:?}");
        let (all, steady) = ((SIZE * SIZE) as f64, 0.01 * mean * mean);
        let alike = (0.25 * all - 1.0) / steady + (0.75 * all - 2.0) / (16.0 + steady);
        let expected = (0.01 * mean).powi(2) * alike
            + (0.2 * mean).powi(2) / steady
            + (0.5 * mean).powi(2) / (16.0 + steady)
            + mean.powi(2) / (36.0 * 36.0 + steady);
        assert!(is_near(found.relative_mse, expected / all), "{found:?}");
    }

    #[test]
    fn rings_add_up_to_the_flux_of_the_lens() -> Result<(), TestError> {
        let picture = ExactPicture::sphere_lens()?;
        let area = (2.0 * picture.half / SIZE as f64).powi(2);
        let lens = SphereLens {
            radius: 1.0,
            ior: 1.5,
            floor_distance: 1.2,
            irradiance: 2.0,
        };
        // The whole pixels in a disc, against the closed form of two discs around them.
        let inside = |radius: f64| {
            let pixels = picture.irradiance.iter().zip(0usize..);
            pixels
                .filter(|(_, pixel)| {
                    let at = DVec2::new((pixel % SIZE) as f64, (pixel / SIZE) as f64) + 0.5;
                    (at / SIZE as f64 - 0.5).length() < radius
                })
                .map(|(value, _)| value * area)
                .sum::<f64>()
        };
        let found = inside(0.4);
        assert!(
            found > lens.flux_within(0.39) && found < lens.flux_within(0.41),
            "{found}"
        );
        Ok(())
    }
}
