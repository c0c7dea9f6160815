//! The GPU's splats against the CPU's, for the same photons.

mod stage;

use caustics_render::{FootprintKernel, FootprintOptions};
use caustics_wgpu::{RendererOptions, SplatKernel, SplatMethod, SplatOptions, wgpu};
use stage::{Stage, TestError, device_with, differences, irradiance};

const SIZE: [u32; 2] = [200, 150];

fn with(splat: SplatOptions) -> RendererOptions {
    RendererOptions {
        splat,
        ..RendererOptions::default()
    }
}

/// Asserts that a way of splatting draws the CPU's picture to within a hundredth.
fn assert_parity(
    features: wgpu::Features,
    splat: SplatOptions,
    names: &[&str],
) -> Result<(), TestError> {
    let Some((device, queue)) = device_with(features) else {
        return Ok(());
    };
    for name in names {
        let stage = Stage::load(name, 20_000)?;
        let picture = stage.picture(&stage.camera, SIZE);
        let expected = stage.splat(&picture, &FootprintOptions::default())?;
        let (found, stats) =
            irradiance(&device, &queue, &with(splat), &picture, &[&stage.photons])?;
        let (off, wrong) = differences(&picture, &picture.radiance(&found), &expected);
        println!("{name}: off by {off:.2e}, {wrong:.2e} of the pixels, {stats:?}");
        assert!(
            off < 0.01,
            "{name}: off by {off}, {wrong} of the pixels, {stats:?}"
        );
    }
    Ok(())
}

const NAMES: [&str; 10] = [
    "p01_sphere",
    "p02_sphere_box",
    "p03_cognac",
    "p04_sphere_in_box",
    "p05_brass_ring",
    "p06_wave_plane",
    "p07_pool",
    "p08_square",
    "p09_cornell",
    "p10_torus_cube",
];

#[test]
fn tiles_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    assert_parity(wgpu::Features::empty(), SplatOptions::default(), &NAMES)
}

#[test]
fn quads_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    assert_parity(wgpu::Features::FLOAT32_BLENDABLE, quads, &NAMES)
}

#[test]
fn quads_in_half_floats_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    assert_parity(wgpu::Features::empty(), quads, &NAMES)
}

#[test]
fn every_kernel_draws_the_picture_of_the_cpu() -> Result<(), TestError> {
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let stage = Stage::load("p03_cognac", 20_000)?;
    let picture = stage.picture(&stage.camera, SIZE);
    for (kernel, twin) in SplatKernel::ALL.into_iter().zip(FootprintKernel::ALL) {
        for (scale, max_anisotropy) in [(0.55, f32::INFINITY), (0.8, 4.0)] {
            let options = FootprintOptions {
                kernel: twin,
                scale,
                max_anisotropy,
                ..FootprintOptions::default()
            };
            let expected = stage.splat(&picture, &options)?;
            let options = with(SplatOptions {
                kernel,
                scale,
                max_anisotropy,
                ..SplatOptions::default()
            });
            let (found, _) = irradiance(&device, &queue, &options, &picture, &[&stage.photons])?;
            let (off, wrong) = differences(&picture, &picture.radiance(&found), &expected);
            println!("{kernel:?} {scale}: off by {off:.2e}, {wrong:.2e} of the pixels");
            assert!(
                off < 0.01,
                "{kernel:?}: off by {off}, {wrong} of the pixels"
            );
        }
    }
    Ok(())
}

#[test]
fn batches_add_up() -> Result<(), TestError> {
    let stage = Stage::load("p01_sphere", 20_000)?;
    let picture = stage.picture(&stage.camera, SIZE);
    let photons = stage.photons.as_slice();
    let parts: [&[_]; 3] = [&photons[..5000], &photons[5000..5001], &photons[5001..]];
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    for (features, splat, tolerance) in [
        (wgpu::Features::empty(), SplatOptions::default(), 1e-5),
        // Two pictures that are dithered differently, each within a hundredth.
        (wgpu::Features::empty(), quads, 2e-2),
        (wgpu::Features::FLOAT32_BLENDABLE, quads, 1e-5),
    ] {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let run = |batches: &[&[_]]| irradiance(&device, &queue, &with(splat), &picture, batches);
        let (whole, whole_stats) = run(&[photons])?;
        let (sum, stats) = run(&parts)?;
        assert_eq!(stats.splatted, whole_stats.splatted);
        let total: f32 = whole.iter().map(|it| it[0]).sum();
        let off: f32 = whole
            .iter()
            .zip(&sum)
            .map(|(a, b)| (a[0] - b[0]).abs())
            .sum();
        assert!(total > 0.0 && off < tolerance * total, "{off} of {total}");
    }
    Ok(())
}

#[test]
fn pairs_that_do_not_fit_together_are_summed_in_rounds() -> Result<(), TestError> {
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let stage = Stage::load("p03_cognac", 10_000)?;
    let picture = stage.picture(&stage.camera, [400, 300]);
    let run = |pairs_per_footprint| {
        let options = with(SplatOptions {
            pairs_per_footprint,
            ..SplatOptions::default()
        });
        irradiance(&device, &queue, &options, &picture, &[&stage.photons])
    };
    let (once, once_stats) = run(64)?;
    let footprints = once_stats.splatted;
    assert!(once_stats.pairs > 4 * footprints, "{once_stats:?}");
    let (rounds, stats) = run(4)?;
    assert_eq!(stats.dropped_pairs, 0, "{stats:?}");
    assert_eq!(stats, once_stats);
    assert!(once == rounds);
    // What does not fit in four rounds is counted, and missing.
    let (less, stats) = run(2)?;
    assert!(
        stats.dropped_pairs > 0 && stats.pairs == once_stats.pairs,
        "{stats:?}"
    );
    let sum = |of: &[[f32; 4]]| of.iter().map(|it| it[0]).sum::<f32>();
    assert!(sum(&less) < sum(&once));
    Ok(())
}
