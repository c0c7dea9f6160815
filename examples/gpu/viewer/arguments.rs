use std::path::PathBuf;

use caustics::prelude::{Scene, TraceOptions};
use caustics::scene::{builtin, gltf};
use caustics_gpu_examples::Failure;
use caustics_wgpu::{SplatMethod, SplatOptions};

pub(crate) const HELP: &str = "\
Looks at the caustics of a glTF file, or of the built-in cognac glass.

viewer [scene.glb] [--width N] [--height N] [--photons N] [--exposure EV] [--quads]
       [--frames N] [--screenshot FILE.png] [--headless]

--frames ends after so many, and --screenshot writes the last of them. --headless needs no display:
then the camera and the light go round by themselves. Without --photons there are 65536 of them, and
4096 on an adapter that is software.

drag with the left button    orbit the camera
drag with the right button   move the light
wheel                        closer, farther
T, Q                         splat by tiles, by quads
I                            integrate small footprints over pixels, or not
H                            hide the timings, or show them
1, 2, 3, 4                   the kernel: Gaussian, ellipse, disc, tent
+, -                         twice as many photons, half as many
Escape                       end
";

#[derive(Clone, Debug)]
pub(crate) struct Arguments {
    scene: Option<PathBuf>,
    pub(crate) size: [u32; 2],
    photons: Option<u32>,
    pub(crate) exposure_ev: f32,
    pub(crate) splat: SplatOptions,
    pub(crate) frames: Option<u32>,
    pub(crate) screenshot: Option<PathBuf>,
    pub(crate) is_headless: bool,
}

impl Arguments {
    pub(crate) fn scene(&self) -> Result<Scene, Failure> {
        Ok(match &self.scene {
            Some(path) => gltf::load_path(path)?.scene,
            None => builtin::cognac_glass(),
        })
    }

    /// Chooses the number of photons, where the user has not, by what the adapter is.
    pub(crate) fn fit(&mut self, adapter: &wgpu::Adapter) {
        let is_software = adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let default = if is_software { 1 << 12 } else { 1 << 16 };
        self.photons.get_or_insert(default);
    }

    pub(crate) fn photons(&self) -> u32 {
        self.photons.unwrap_or(1 << 16)
    }

    pub(crate) fn set_photons(&mut self, photons: u32) {
        self.photons = Some(photons.clamp(1 << 10, 1 << 22));
    }

    pub(crate) fn trace(&self) -> TraceOptions {
        TraceOptions {
            photons: self.photons(),
            ..TraceOptions::default()
        }
    }
}

pub(crate) fn parse() -> Result<Option<Arguments>, Failure> {
    use lexopt::prelude::*;
    let mut arguments = Arguments {
        scene: None,
        size: [960, 720],
        photons: None,
        exposure_ev: 0.0,
        splat: SplatOptions::default(),
        frames: None,
        screenshot: None,
        is_headless: false,
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") | Short('h') => return Ok(None),
            Long("width") => arguments.size[0] = parser.value()?.parse()?,
            Long("height") => arguments.size[1] = parser.value()?.parse()?,
            Long("photons") => arguments.photons = Some(parser.value()?.parse()?),
            Long("exposure") => arguments.exposure_ev = parser.value()?.parse()?,
            Long("quads") => arguments.splat.method = SplatMethod::Quads,
            Long("frames") => arguments.frames = Some(parser.value()?.parse()?),
            Long("screenshot") => arguments.screenshot = Some(parser.value()?.into()),
            Long("headless") => arguments.is_headless = true,
            Value(path) if arguments.scene.is_none() => arguments.scene = Some(path.into()),
            other => return Err(other.unexpected().into()),
        }
    }
    Ok(Some(arguments))
}
