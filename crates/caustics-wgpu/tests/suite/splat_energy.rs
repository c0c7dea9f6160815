//! What a splat deposits, against closed forms: all of a footprint's flux, whatever its size; and
//! neither too much light nor too little breaks the arithmetic.

use crate::stage;

use caustics_scene::{Camera, Projection};
use caustics_trace::Photon;
use caustics_wgpu::glam::{Affine3A, Vec3};
use caustics_wgpu::{RendererOptions, SplatKernel, SplatMethod, SplatOptions, wgpu};
use stage::{Picture, Seen, TestError, device_with, irradiance};

const SIZE: u32 = 128;

/// A floor of one square metre, seen from above: a pixel is 1/128 m wide.
fn floor() -> Result<Picture, TestError> {
    let looking_down =
        Affine3A::from_cols_array(&[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.5, 1.0, 0.5]);
    let projection = Projection::Orthographic {
        xmag: 0.5,
        ymag: 0.5,
    };
    let count = SIZE * SIZE;
    let seen = (0..count).map(|pixel| {
        let (x, y) = (pixel % SIZE, pixel / SIZE);
        Some(Seen {
            position: Vec3::new(x as f32 + 0.5, 0.0, y as f32 + 0.5) / SIZE as f32,
            normal: Vec3::Y,
            albedo: Vec3::ONE,
            object: 0,
        })
    });
    Ok(Picture {
        camera: Camera::new("above", looking_down, projection)?,
        size: [SIZE; 2],
        seen: seen.collect(),
        is_edge: vec![false; count as usize],
    })
}

fn photon(x: f32, z: f32, size: f32, flux: f32) -> Photon {
    Photon {
        position: Vec3::new(x, 0.0, z),
        incoming: Vec3::NEG_Y,
        flux: flux * Vec3::new(1.0, 0.5, 0.25),
        normal: Vec3::Y,
        axes: [size * Vec3::X, size * Vec3::Z],
        object: 0,
        events: 1,
        source: caustics_trace::FootprintSource::Differential,
        coverage: caustics_trace::Coverage::Cell,
    }
}

/// The flux of the red channel that all pixels get.
fn flux(irradiance: &[[f32; 4]]) -> f64 {
    let sum: f64 = irradiance.iter().map(|it| f64::from(it[0])).sum();
    sum / f64::from(SIZE * SIZE)
}

fn ways() -> [(wgpu::Features, SplatMethod, f64); 3] {
    [
        (wgpu::Features::empty(), SplatMethod::Tiles, 1e-3),
        (wgpu::Features::FLOAT32_BLENDABLE, SplatMethod::Quads, 1e-3),
        (wgpu::Features::empty(), SplatMethod::Quads, 1e-2),
    ]
}

fn options(method: SplatMethod, kernel: SplatKernel) -> RendererOptions {
    RendererOptions {
        splat: SplatOptions {
            method,
            kernel,
            ..SplatOptions::default()
        },
        ..RendererOptions::default()
    }
}

#[test]
fn a_footprint_deposits_its_flux_whatever_its_size() -> Result<(), TestError> {
    let picture = floor()?;
    for (features, method, tolerance) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        for kernel in SplatKernel::ALL {
            let options = options(method, kernel);
            // From far less than a pixel to a fifth of the picture.
            for size in [1e-6, 1e-3, 0.004, 0.01, 0.03, 0.08] {
                // Off the pixels' middles.
                let photons = [photon(0.5031, 0.4987, size, 2.0)];
                let (found, stats) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
                assert_eq!(stats.splatted, 1);
                let found = flux(&found);
                // A disc and an ellipse end abruptly: sums over pixels only approach the integral.
                let slack = if kernel == SplatKernel::Disc {
                    0.03
                } else {
                    0.004
                };
                assert!(
                    (found / 2.0 - 1.0).abs() < tolerance + slack,
                    "{method:?} {kernel:?} {size}: {found}"
                );
            }
        }
    }
    Ok(())
}

/// They end sooner, and are drawn where pixels are wider: each for itself is off by some percent, by
/// where in its pixel it is, and all together are not.
#[test]
fn footprints_that_overlap_keep_their_flux() -> Result<(), TestError> {
    let picture = floor()?;
    for (features, method, tolerance) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let options = options(method, SplatKernel::Gaussian);
        for size in [1e-3, 0.01, 0.02, 0.04, 0.08] {
            let photons: Vec<Photon> = (0..1000)
                .map(|index| {
                    // The generalised golden ratio's multiples.
                    let place = |step: f32| 0.3 + 0.4 * (index as f32 * step).fract();
                    Photon {
                        coverage: caustics_trace::Coverage::Overlap,
                        ..photon(place(0.754_877_7), place(0.569_840_3), size, 2.0)
                    }
                })
                .collect();
            let (found, stats) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
            assert_eq!(stats.splatted, 1000);
            let found = flux(&found) / 2000.0;
            println!("{method:?} {size} {found}");
            assert!(
                (found - 1.0).abs() < 0.3 * tolerance,
                "{method:?} {size}: {found}"
            );
        }
    }
    Ok(())
}

#[test]
fn a_hundred_thousand_footprints_on_a_pixel_neither_overflow_nor_stop_to_add_up()
-> Result<(), TestError> {
    let picture = floor()?;
    let photons = vec![photon(0.5031, 0.4987, 1e-3, 1.0); 100_000];
    for (features, method, tolerance) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let options = options(method, SplatKernel::Gaussian);
        let (found, _) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
        let found = flux(&found);
        assert!((found / 1e5 - 1.0).abs() < tolerance, "{method:?}: {found}");
    }
    Ok(())
}

/// Numbers from 0 up to 1 that spread evenly (the golden ratio's multiples).
fn spread(index: u32) -> f32 {
    (index.wrapping_mul(0x9e37_79b9) >> 8) as f32 / 16_777_216.0
}

#[test]
fn a_focus_of_hundreds_of_thousands_of_footprints_is_right_in_every_pixel() -> Result<(), TestError>
{
    let picture = floor()?;
    // Equal ones on a pixel, of the middle pixel of an odd number so that no binary fraction is exact.
    let equal = vec![photon(0.5031, 0.4987, 1e-3, 0.7); 300_000];
    // Others around it, each with another flux and place, in rows that land together.
    let around = (0..100_000).map(|index| {
        let row = (index / 1000) as f32 / 100.0;
        let place = 0.4 + 0.2 * row;
        photon(
            place,
            0.45 + 0.1 * spread(index),
            0.004,
            0.1 + spread(3 * index),
        )
    });
    let around: Vec<_> = around.collect();
    for (features, method, tolerance) in [
        (wgpu::Features::FLOAT32_BLENDABLE, SplatMethod::Quads, 1e-4),
        (wgpu::Features::empty(), SplatMethod::Quads, 1e-2),
    ] {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        // Tiles sum each batch in integers, of which two thousand footprints have plenty.
        let tiles = options(SplatMethod::Tiles, SplatKernel::Gaussian);
        for (photons, parts, times) in
            [(&equal, &equal[..2000], 150.0), (&around, &around[..], 1.0)]
        {
            let batches: Vec<_> = parts.chunks(2000).collect();
            let (part, _) = irradiance(&device, &queue, &tiles, &picture, &batches)?;
            let expected: Vec<_> = part.iter().map(|it| times * it[0]).collect();
            let quads = options(method, SplatKernel::Gaussian);
            let (found, _) = irradiance(&device, &queue, &quads, &picture, &[photons])?;
            let most = expected.iter().copied().fold(0.0, f32::max);
            let lit = expected
                .iter()
                .zip(&found)
                .filter(|(it, _)| **it > 1e-3 * most);
            let off = lit.map(|(expected, found)| (found[0] / expected - 1.0).abs());
            let off = off.fold(0.0, f32::max);
            println!("{method:?} {features:?}: off by {off:e}");
            assert!(off < tolerance, "{method:?} {features:?}: {off:e}");
        }
    }
    Ok(())
}

#[test]
fn faint_footprints_are_not_lost_beside_bright_ones() -> Result<(), TestError> {
    let picture = floor()?;
    // In one tile of 16 pixels, five apart: a million times as bright, and half floats' range.
    let faint = photon(0.5 + 3.2 / 128.0, 0.5 + 3.1 / 128.0, 1e-3, 1e-6);
    let bright = photon(0.5 + 11.2 / 128.0, 0.5 + 11.4 / 128.0, 1e-3, 1.0);
    for (features, method, _) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let options = options(method, SplatKernel::Gaussian);
        let (both, _) = irradiance(&device, &queue, &options, &picture, &[&[faint, bright]])?;
        let pixel = (67 * SIZE + 67) as usize;
        let (alone, _) = irradiance(&device, &queue, &options, &picture, &[&[faint]])?;
        let (found, expected) = (both[pixel][0], alone[pixel][0]);
        assert!(
            expected > 0.0 && (found / expected - 1.0).abs() < 0.02,
            "{method:?}: {found} {expected}"
        );
    }
    Ok(())
}

#[test]
fn fluxes_at_the_ends_of_the_numbers_stay_right() -> Result<(), TestError> {
    let picture = floor()?;
    for (features, method, tolerance) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let options = options(method, SplatKernel::Gaussian);
        for watts in [1e-20, 1e-9, 1e9, 1e20] {
            let photons = [photon(0.5031, 0.4987, 0.01, watts)];
            let (found, _) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
            let found = flux(&found) / f64::from(watts);
            assert!(
                (found - 1.0).abs() < tolerance + 0.004,
                "{method:?} {watts}: {found}"
            );
        }
    }
    Ok(())
}

#[test]
fn footprints_that_end_beside_the_picture_add_nothing_to_it() -> Result<(), TestError> {
    let picture = floor()?;
    // Light that slants over the picture could reach it above its plane, but not on it.
    let beside = |pixels: f32| {
        let out = -pixels / SIZE as f32;
        let toward_x = Photon {
            incoming: Vec3::new(-0.8, -0.6, 0.0),
            ..photon(out, 0.4987, 1e-3, 1.0)
        };
        let toward_z = Photon {
            incoming: Vec3::new(0.0, -0.6, -0.8),
            ..photon(0.5031, out, 1e-3, 1.0)
        };
        [toward_x, toward_z]
    };
    let mut photons = vec![photon(0.5031, 0.4987, 1e-3, 1.0)];
    photons.extend([1.2, 1.4, 1.7, 2.5].map(beside).as_flattened().repeat(10));
    for (features, method, tolerance) in ways() {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let options = options(method, SplatKernel::Gaussian);
        let (found, stats) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
        let found = flux(&found);
        assert!((found - 1.0).abs() < tolerance, "{method:?}: {found}");
        assert_eq!((stats.splatted, stats.outside), (1, 80), "{method:?}");
    }
    Ok(())
}

#[test]
fn footprints_that_are_not_finite_or_not_seen_are_counted() -> Result<(), TestError> {
    let picture = floor()?;
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let good = photon(0.5, 0.5, 0.01, 1.0);
    let turned = Photon {
        normal: Vec3::NEG_Y,
        incoming: Vec3::Y,
        ..good
    };
    let infinite = Photon {
        flux: Vec3::splat(f32::INFINITY),
        ..good
    };
    let nowhere = Photon {
        axes: [Vec3::splat(f32::NAN); 2],
        ..good
    };
    let photons = [good, turned, infinite, nowhere, photon(5.0, 0.5, 0.01, 1.0)];
    let options = options(SplatMethod::Tiles, SplatKernel::Gaussian);
    let (found, stats) = irradiance(&device, &queue, &options, &picture, &[&photons])?;
    assert_eq!((stats.splatted, stats.turned_away), (1, 1), "{stats:?}");
    assert_eq!((stats.invalid, stats.outside), (2, 1), "{stats:?}");
    assert!(found.iter().flatten().all(|it| it.is_finite()));
    Ok(())
}
