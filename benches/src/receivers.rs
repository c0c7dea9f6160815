//! What each pixel of a picture sees, for estimates that are asked point by point.

use caustics::accel::Intersect;
use caustics::filter::{Image, ImageError};
use caustics::scene::Brdf;
use caustics::trace::Photon;
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

use crate::stage::Stage;

/// Samples along each side of a pixel that an edge goes through.
const EDGE_SAMPLES: u32 = 2;

/// The least cosine between the normals of neighbouring pixels of one smooth surface.
const SMOOTH_COSINE: f32 = 0.98;

/// A point of a diffuse surface that the camera sees without a glass or a mirror between.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The pixel, row by row.
    pub pixel: u32,
    /// Where it is, in metres.
    pub position: Vec3,
    /// Unit geometric normal on the side that is seen.
    pub normal: Vec3,
    /// Reflectance for each channel, times the part of the pixel that the sample stands for.
    pub albedo: Vec3,
    object: u32,
}

/// Normals of photons and receivers that are taken for one face's, as `NearestEstimate` has it.
const MIN_NORMAL_COSINE: f32 = 0.7;

/// How far off the tangent plane a photon may lie, relative to the reach, as `NearestEstimate` has
/// it.
const MAX_PLANE_DISTANCE: f32 = 0.2;

impl Receiver {
    /// Whether a photon counts in a search within `reach` metres, as `NearestEstimate` has it.
    #[inline]
    #[must_use]
    pub fn accepts(&self, photon: &Photon, reach: f32) -> bool {
        photon.normal.dot(self.normal) > MIN_NORMAL_COSINE
            && photon.incoming.dot(self.normal) < 0.0
            && (photon.position - self.position).dot(self.normal).abs() < MAX_PLANE_DISTANCE * reach
    }
}

/// The receivers of a picture of `width` x `height` pixels: one at each pixel's middle, four in a
/// pixel that an edge goes through.
#[must_use]
pub fn receivers(stage: &Stage, width: u32, height: u32) -> Vec<Receiver> {
    let look = |x: f32, y: f32, pixel: u32, share: f32| -> Option<Receiver> {
        let ray = stage.camera.ray(x, y, width, height);
        let hit = stage.intersector.closest_hit(&ray)?;
        let point = stage.world.surface(&ray, &hit)?;
        let albedo = stage.world.materials()[point.material as usize]
            .surface
            .brdf()
            .filter(Brdf::is_lambertian)?
            .base();
        let side = if point.from_outside { 1.0 } else { -1.0 };
        Some(Receiver {
            pixel,
            position: point.spawn.position,
            normal: side * point.geometric_normal,
            albedo: share * albedo,
            object: point.object,
        })
    };
    let centers: Vec<Option<Receiver>> = (0..width * height)
        .into_par_iter()
        .map(|pixel| {
            look(
                (pixel % width) as f32 + 0.5,
                (pixel / width) as f32 + 0.5,
                pixel,
                1.0,
            )
        })
        .collect();
    (0..width * height)
        .into_par_iter()
        .flat_map_iter(|pixel| {
            let (x, y) = (pixel % width, pixel / width);
            let center = centers[pixel as usize];
            let neighbours = [
                (x > 0, pixel.wrapping_sub(1)),
                (x + 1 < width, pixel + 1),
                (y > 0, pixel.wrapping_sub(width)),
                (y + 1 < height, pixel + width),
            ];
            let on_edge = neighbours
                .iter()
                .any(|&(exists, other)| exists && !is_smooth(&center, &centers[other as usize]));
            let side = if on_edge { EDGE_SAMPLES } else { 1 };
            (0..side * side).filter_map(move |sample| {
                if !on_edge {
                    return center;
                }
                let step = 1.0 / side as f32;
                let column = (sample % side) as f32 + 0.5;
                let row = (sample / side) as f32 + 0.5;
                look(
                    x as f32 + column * step,
                    y as f32 + row * step,
                    pixel,
                    step * step,
                )
            })
        })
        .collect()
}

fn is_smooth(one: &Option<Receiver>, other: &Option<Receiver>) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => {
            one.object == other.object && one.normal.dot(other.normal) > SMOOTH_COSINE
        }
        _ => false,
    }
}

/// Asks an estimate for the irradiance at every receiver, in parallel, and returns the radiance
/// that reaches the camera.
///
/// # Errors
/// If the picture's size is out of range.
pub fn gather<S>(
    receivers: &[Receiver],
    width: u32,
    height: u32,
    scratch: impl Fn() -> S + Sync + Send,
    irradiance: impl Fn(&Receiver, &mut S) -> Vec3 + Sync + Send,
) -> Result<Image, ImageError> {
    let radiance: Vec<Vec3> = receivers
        .par_iter()
        .with_min_len(512)
        .map_init(scratch, |scratch, receiver| {
            receiver.albedo * FRAC_1_PI * irradiance(receiver, scratch)
        })
        .collect();
    let mut image = Image::new(width, height)?;
    let pixels = image.pixels_mut();
    for (receiver, radiance) in receivers.iter().zip(radiance) {
        let pixel = &mut pixels[receiver.pixel as usize];
        *pixel = (Vec3::from(*pixel) + radiance).to_array();
    }
    Ok(image)
}
