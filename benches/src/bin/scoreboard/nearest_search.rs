//! The number of nearest photons and the kernel that suit a scene best.

use caustics::accel::{NearestScratch, PhotonTree};
use caustics::filter::{Image, Kernel, relative_mse};
use caustics::glam::Vec3;
use caustics::render::{NearestEstimate, NearestOptions};
use caustics::trace::Photon;
use caustics_benches::receivers::{Receiver, gather};
use caustics_benches::stage::{Failure, Stage};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Numbers of photons that are tried.
const COUNTS: [usize; 5] = [20, 50, 100, 200, 400];

/// The search looks at every pixel whose coordinates leave a certain remainder by this.
const STRIDE: u32 = 4;

/// How many of the best on those pixels are compared on the whole picture.
const FINALISTS: usize = 3;

/// The options with the least relative mean squared error, as found on a part of the pixels by one
/// search for the largest count, whose photons in their order give the sums of all smaller ones;
/// the best few are then compared on all pixels.
pub(crate) fn best_options(
    stage: &Stage,
    photons: &[Photon],
    receivers: &[Receiver],
) -> Result<NearestOptions, Failure> {
    let (width, height) = (stage.reference.width(), stage.reference.height());
    let is_searched = |pixel: u32| {
        (pixel % width) % STRIDE == STRIDE / 2 && (pixel / width) % STRIDE == STRIDE / 2
    };
    let searched: Vec<Receiver> = receivers
        .iter()
        .filter(|receiver| is_searched(receiver.pixel))
        .copied()
        .collect();
    let thinned = |image: &Image| -> Result<Image, Failure> {
        let pixels = image.pixels().iter().zip(0u32..);
        let kept: Vec<[f32; 3]> = pixels
            .filter(|&(_, pixel)| is_searched(pixel))
            .map(|(color, _)| *color)
            .collect();
        Ok(Image::from_pixels(kept.len() as u32, 1, kept)?)
    };
    let reference = thinned(&stage.reference)?;

    let candidates: Vec<NearestOptions> = COUNTS
        .into_iter()
        .flat_map(|count| {
            Kernel::ALL.map(|kernel| NearestOptions {
                count,
                kernel,
                ..NearestOptions::default()
            })
        })
        .collect();
    let radiances = radiances_of_all(photons, &searched, &candidates)?;
    let mut ranked = Vec::new();
    for (index, options) in candidates.iter().enumerate() {
        let mut image = Image::new(width, height)?;
        for (receiver, radiances) in searched.iter().zip(&radiances) {
            let pixel = &mut image.pixels_mut()[receiver.pixel as usize];
            *pixel = (Vec3::from(*pixel) + radiances[index]).to_array();
        }
        ranked.push((relative_mse(&thinned(&image)?, &reference)?, *options));
    }
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));

    let mut best: Option<(f64, NearestOptions)> = None;
    for (_, options) in ranked.into_iter().take(FINALISTS) {
        let image = image_of(stage, photons, receivers, &options)?;
        let error = relative_mse(&image, &stage.reference)?;
        if best.is_none_or(|(least, _)| error < least) {
            best = Some((error, options));
        }
    }
    Ok(best.map(|(_, options)| options).unwrap_or_default())
}

/// The picture that the estimate makes.
pub(crate) fn image_of(
    stage: &Stage,
    photons: &[Photon],
    receivers: &[Receiver],
    options: &NearestOptions,
) -> Result<Image, Failure> {
    let estimate = NearestEstimate::new(photons, options)?;
    let (width, height) = (stage.reference.width(), stage.reference.height());
    Ok(gather(
        receivers,
        width,
        height,
        NearestScratch::new,
        |receiver, scratch| estimate.irradiance(receiver.position, receiver.normal, scratch),
    )?)
}

/// For each receiver the radiance by each candidate.
fn radiances_of_all(
    photons: &[Photon],
    receivers: &[Receiver],
    candidates: &[NearestOptions],
) -> Result<Vec<Vec<Vec3>>, Failure> {
    let reach = NearestEstimate::new(photons, &NearestOptions::default())?.max_radius();
    let positions: Vec<Vec3> = photons.iter().map(|photon| photon.position).collect();
    let tree = PhotonTree::new(&positions)?;
    let most = COUNTS.into_iter().max().unwrap_or(1);
    let of_one = |scratch: &mut NearestScratch, receiver: &Receiver| {
        let accept = |index: u32| receiver.accepts(&photons[index as usize], reach);
        let found = tree.nearest_where(receiver.position, most, reach, accept, scratch);
        // The tree puts only the farthest in its place.
        let mut found = found.to_vec();
        found.sort_unstable_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared));
        let irradiance = |options: &NearestOptions| {
            let taken = &found[..found.len().min(options.count)];
            let radius_squared = match taken.last() {
                Some(last) if taken.len() == options.count => last.distance_squared,
                _ => reach * reach,
            };
            let sum: Vec3 = taken
                .iter()
                .filter(|neighbour| neighbour.distance_squared < radius_squared)
                .map(|neighbour| {
                    let relative = neighbour.distance_squared / radius_squared;
                    options.kernel.density(relative) * photons[neighbour.index as usize].flux
                })
                .sum();
            if radius_squared > 0.0 {
                sum / radius_squared
            } else {
                Vec3::ZERO
            }
        };
        candidates
            .iter()
            .map(|options| receiver.albedo * FRAC_1_PI * irradiance(options))
            .collect()
    };
    Ok(receivers
        .par_iter()
        .map_init(NearestScratch::new, of_one)
        .collect())
}
