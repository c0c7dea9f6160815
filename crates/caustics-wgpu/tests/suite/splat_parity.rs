//! The GPU's splats against the CPU's, for the same photons.

use crate::stage;

use caustics_geometry::shapes;
use caustics_render::{FootprintKernel, FootprintOptions};
use caustics_scene::{BvhOptions, Camera, Instance, Light, Material, Scene, Shape, World};
use caustics_trace::{Coverage, FootprintSource, Photon};
use caustics_wgpu::glam::{Vec2, Vec3};
use caustics_wgpu::{RendererOptions, SplatKernel, SplatMethod, SplatOptions, wgpu};
use stage::{Stage, TestError, device_with, differences, irradiance};

const SIZE: [u32; 2] = [200, 150];

fn with(splat: SplatOptions) -> RendererOptions {
    RendererOptions {
        splat,
        ..RendererOptions::default()
    }
}

/// The most that sums in 32 bits may be off, and those in half floats, which round.
const OFF: f64 = 1e-3;
const OFF_IN_HALF_FLOATS: f64 = 1e-2;

/// Asserts that a way of splatting draws the CPU's picture to within a tolerance.
fn assert_parity(
    features: wgpu::Features,
    splat: SplatOptions,
    names: &[&str],
    tolerance: f64,
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
            off < tolerance,
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
    let tiles = SplatOptions::default();
    assert_parity(wgpu::Features::empty(), tiles, &NAMES, OFF)
}

#[test]
fn quads_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    assert_parity(wgpu::Features::FLOAT32_BLENDABLE, quads, &NAMES, OFF)
}

#[test]
fn quads_in_half_floats_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    assert_parity(wgpu::Features::empty(), quads, &NAMES, OFF_IN_HALF_FLOATS)
}

/// The stage's camera, as near to the floor as a cat's eyes.
fn lowered(stage: &Stage) -> Result<Camera, TestError> {
    let (center, radius) = stage.world.specular_bounds().bounding_sphere();
    let mut away = stage.camera.position() - center;
    away.y = 0.1 * (away.x * away.x + away.z * away.z).sqrt() - 0.5 * radius;
    Ok(Camera::look_at("low", center + away, center, Vec3::Y, 0.7)?)
}

#[test]
fn planes_seen_edge_on_and_what_stands_before_them_are_lit_as_on_the_cpu() -> Result<(), TestError>
{
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    for (features, splat) in [
        (wgpu::Features::empty(), SplatOptions::default()),
        (wgpu::Features::FLOAT32_BLENDABLE, quads),
    ] {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        for name in ["p01_sphere", "p02_sphere_box"] {
            let stage = Stage::load(name, 10_000)?;
            let picture = stage.picture(&lowered(&stage)?, SIZE);
            let eye = picture.camera.position();
            let edge_on = stage.photons.iter().filter(|photon| {
                let to_eye = (eye - photon.position).normalize();
                photon.normal.dot(to_eye) < 0.3
            });
            assert!(2 * edge_on.count() > stage.photons.len(), "{name}");
            let expected = stage.splat(&picture, &FootprintOptions::default())?;
            let (found, stats) =
                irradiance(&device, &queue, &with(splat), &picture, &[&stage.photons])?;
            let (off, wrong) = differences(&picture, &picture.radiance(&found), &expected);
            println!("{name}: off by {off:.2e}, {wrong:.2e} of the pixels, {stats:?}");
            assert!(off < OFF, "{name}: {off}, {wrong} of the pixels, {stats:?}");
        }
    }
    Ok(())
}

/// Still water in slanting sun over ripples, seen from within.
fn ripples() -> Result<Stage, TestError> {
    let mut scene = Scene::new();
    let corner = Vec3::new(-0.5, 0.2, 0.5);
    let surface = shapes::quad(corner, Vec3::X, Vec3::NEG_Z)?;
    let (slope, number) = (0.6f32, 50.0f32);
    let bottom = shapes::heightfield_with_slope(
        [0.6, 0.6],
        [4096, 1],
        |x, _| slope / number * (number * x).sin(),
        |x, _| Vec2::new(slope * (number * x).cos(), 0.0),
    )?;
    let parts = [
        (surface, Material::dielectric("water", 1.33)),
        (bottom, Material::diffuse("sand", [0.5; 3])),
    ];
    for (mesh, material) in parts {
        let (mesh, material) = (scene.add_mesh(mesh), scene.add_material(material)?);
        scene.add_instance(Instance::new("part", Shape::Mesh(mesh), material))?;
    }
    scene.add_light(Light::directional([0.78, -0.62, 0.0], [1.0; 3])?)?;
    let eye = [0.05, 0.18, 0.2];
    scene.add_camera(Camera::look_at("within", eye, [0.0; 3], Vec3::Y, 0.8)?)?;
    Stage::of(&scene, 80_000)
}

#[test]
fn curved_receivers_are_followed_as_on_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    let stage = ripples()?;
    let picture = stage.picture(&stage.camera, SIZE);
    let expected = stage.splat(&picture, &FootprintOptions::default())?;
    for (features, splat) in [
        (wgpu::Features::empty(), SplatOptions::default()),
        (wgpu::Features::FLOAT32_BLENDABLE, quads),
    ] {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        let run = |photons: &[Photon]| {
            let (found, _) = irradiance(&device, &queue, &with(splat), &picture, &[photons])?;
            Ok::<_, TestError>(differences(&picture, &picture.radiance(&found), &expected))
        };
        let (off, wrong) = run(&stage.photons)?;
        println!("off by {off:.2e}, {wrong:.2e} of the pixels");
        assert!(off < OFF, "{off}, {wrong} of the pixels");
        // Control: light that falls straight on each footprint's plane makes another picture.
        let straight = |photon: &Photon| Photon {
            incoming: -photon.normal,
            ..*photon
        };
        let (plain, _) = run(&stage.photons.iter().map(straight).collect::<Vec<_>>())?;
        println!("plain planes: off by {plain:.2e}");
        assert!(plain > 2.0 * OFF, "{plain}");
    }
    Ok(())
}

/// A floor and a wall, each in small footprints of light that falls steeply along the wall, seen so low
/// that the pixels at the corner would have the light of either on the other.
fn corner() -> Result<Stage, TestError> {
    const STEP: f32 = 0.008;
    let mut scene = Scene::new();
    let chalk = scene.add_material(Material::diffuse("chalk", [1.0; 3]))?;
    let across = 8.0 * Vec3::NEG_Z;
    for (start, along, across) in [
        (Vec3::new(-4.0, 0.0, 4.0), 4.0 * Vec3::X, across),
        (Vec3::new(0.0, 0.0, 4.0), across, 4.0 * Vec3::Y),
    ] {
        let mesh = scene.add_mesh(shapes::quad(start, along, across)?);
        scene.add_instance(Instance::new("side", Shape::Mesh(mesh), chalk))?;
    }
    let eye = [-3.0, 1.3, 0.7];
    scene.add_camera(Camera::look_at("low", eye, [0.0; 3], Vec3::Y, 0.3)?)?;
    let world = World::new(&scene)?;
    let rays = world.intersector(&BvhOptions::default())?;
    let (sine, cosine) = 0.3f32.sin_cos();
    let one = |column: i32, row: i32| {
        // Off the ray through the corner. Before it, the floor is lit, behind it the wall.
        let off = (column as f32 + 0.37) * STEP;
        let z = (row as f32 + 0.5) * STEP;
        let (position, normal, along, object) = if off < 0.0 {
            let position = Vec3::new(off / cosine, 0.0, z);
            (position, Vec3::Y, STEP / cosine * Vec3::X, 0)
        } else {
            let position = Vec3::new(0.0, off / sine, z);
            (position, Vec3::NEG_X, STEP / sine * Vec3::Y, 1)
        };
        Photon {
            position,
            incoming: Vec3::new(sine, -cosine, 0.0),
            flux: Vec3::splat(STEP * STEP),
            normal,
            axes: [along, STEP * Vec3::Z],
            object,
            events: 1,
            source: FootprintSource::Differential,
            coverage: Coverage::Cell,
        }
    };
    let photons = (-40..40).flat_map(|row| (-40..40).map(move |column| one(column, row)));
    Ok(Stage {
        photons: photons.collect(),
        camera: scene.cameras().first().ok_or("no camera")?.clone(),
        world,
        rays,
    })
}

#[test]
fn light_is_followed_to_what_catches_it_as_on_the_cpu() -> Result<(), TestError> {
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    let mut stage = corner()?;
    let picture = stage.picture(&stage.camera, SIZE);
    // One whose light the wall catches in one pixel. The floor's pixels are larger: there is more in
    // this one than any of those would have, which is what sums are bounded by.
    let pixel = (SIZE[0] * (SIZE[1] / 2 - 2) + SIZE[0] / 2) as usize;
    let lit = picture.seen[pixel].ok_or("nothing is seen")?;
    assert!(lit.object == 1 && !picture.is_edge[pixel]);
    let one = stage.photons[0];
    let alone = Photon {
        position: lit.position - lit.position.y / one.incoming.y * one.incoming,
        axes: [1e-3 * Vec3::X, 1e-3 * Vec3::Z],
        ..one
    };
    let all = std::mem::take(&mut stage.photons);
    for photons in [all, vec![alone]] {
        stage.photons = photons;
        let expected = stage.splat(&picture, &FootprintOptions::default())?;
        for (features, splat, tolerance) in [
            (wgpu::Features::empty(), SplatOptions::default(), OFF),
            (wgpu::Features::FLOAT32_BLENDABLE, quads, OFF),
            (wgpu::Features::empty(), quads, OFF_IN_HALF_FLOATS),
        ] {
            let Some((device, queue)) = device_with(features) else {
                return Ok(());
            };
            let photons = [&stage.photons[..]];
            let (found, stats) = irradiance(&device, &queue, &with(splat), &picture, &photons)?;
            let (off, wrong) = differences(&picture, &picture.radiance(&found), &expected);
            println!("corner: off by {off:.2e}, {wrong:.2e} of the pixels, {stats:?}");
            assert_eq!(stats.splatted + stats.outside, photons[0].len() as u32);
            assert!(off < tolerance, "{off}, {wrong} of the pixels, {stats:?}");
        }
    }
    Ok(())
}

#[test]
fn small_footprints_are_blurred_where_that_is_asked_for() -> Result<(), TestError> {
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let stage = Stage::load("p05_brass_ring", 20_000)?;
    let picture = stage.picture(&stage.camera, SIZE);
    let options = FootprintOptions {
        integrate_pixels: false,
        ..FootprintOptions::default()
    };
    let blurred = stage.splat(&picture, &options)?;
    let run = |integrate_pixels| {
        let splat = SplatOptions {
            integrate_pixels,
            ..SplatOptions::default()
        };
        irradiance(&device, &queue, &with(splat), &picture, &[&stage.photons])
    };
    let off = |found: &[[f32; 4]]| differences(&picture, &picture.radiance(found), &blurred).0;
    assert!(off(&run(false)?.0) < OFF);
    // The two are not the same picture: what is compared with could be told from it.
    let integrated = off(&run(true)?.0);
    println!("integrated: off by {integrated:.2e}");
    assert!(integrated > 2.0 * OFF, "{integrated}");
    Ok(())
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
                off < 2.0 * OFF,
                "{kernel:?}: off by {off}, {wrong} of the pixels"
            );
        }
    }
    Ok(())
}

#[test]
fn every_truncation_draws_the_picture_of_the_cpu() -> Result<(), TestError> {
    // Footprints that are integrated over pixels always end at three standard deviations.
    let tiles = SplatOptions {
        integrate_pixels: false,
        ..SplatOptions::default()
    };
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..tiles
    };
    let read_at_middles = FootprintOptions {
        integrate_pixels: false,
        ..FootprintOptions::default()
    };
    for (features, splat) in [
        (wgpu::Features::empty(), tiles),
        (wgpu::Features::FLOAT32_BLENDABLE, quads),
    ] {
        let Some((device, queue)) = device_with(features) else {
            return Ok(());
        };
        // Footprints of a light without an area, and of one with an area, which overlap.
        for (name, overlap) in [("p03_cognac", false), ("p09_cornell", true)] {
            let stage = Stage::load(name, 20_000)?;
            let picture = stage.picture(&stage.camera, SIZE);
            let default = stage.splat(&picture, &read_at_middles)?;
            for end in [1.5, 2.65, 4.0] {
                let mut options = read_at_middles;
                let mut splat = splat;
                if overlap {
                    (options.overlap_truncation, splat.overlap_truncation) = (end, end);
                } else {
                    (options.truncation, splat.truncation) = (end, end);
                }
                let expected = stage.splat(&picture, &options)?;
                let options = with(splat);
                let photons = [&stage.photons[..]];
                let (found, _) = irradiance(&device, &queue, &options, &picture, &photons)?;
                let found = picture.radiance(&found);
                let (off, wrong) = differences(&picture, &found, &expected);
                let (from_default, _) = differences(&picture, &found, &default);
                println!(
                    "{name} {:?} {end}: off by {off:.2e}, {wrong:.2e} of the pixels, \
                     from the default {from_default:.2e}",
                    splat.method
                );
                assert!(
                    off < OFF,
                    "{name} {end}: off by {off}, {wrong} of the pixels"
                );
                // Control: the pictures can be told from the default's.
                assert!(from_default > 2.0 * OFF, "{name} {end}: {from_default}");
            }
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
