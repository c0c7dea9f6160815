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

#[test]
fn tiles_draw_the_picture_of_the_cpu() -> Result<(), TestError> {
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    for name in [
        "p01_sphere",
        "p03_cognac",
        "p05_brass_ring",
        "p07_pool",
        "p09_cornell",
    ] {
        let stage = Stage::load(name, 20_000)?;
        let picture = stage.picture(&stage.camera, SIZE);
        let expected = stage.splat(&picture, &FootprintOptions::default())?;
        let options = with(SplatOptions::default());
        let (found, stats) = irradiance(&device, &queue, &options, &picture, &[&stage.photons])?;
        let (off, wrong) = differences(&picture, &picture.radiance(&found), &expected);
        println!("{name}: off by {off:.2e}, {wrong:.2e} of the pixels, {stats:?}");
        assert!(
            off < 0.01,
            "{name}: off by {off}, {wrong} of the pixels, {stats:?}"
        );
    }
    Ok(())
}
