//! Caustics in an engine's frame, without a window: writes a picture and says how long each pass
//! took.
//!
//! `cargo run --release -p caustics-gpu-examples --example embed -- --help` lists the options.

use std::path::PathBuf;
use std::process::ExitCode;

use caustics::prelude::{Camera, Scene, TraceOptions};
use caustics::scene::{builtin, gltf};
use caustics_gpu_examples::engine::Look;
use caustics_gpu_examples::picture::{Snapshot, main_light};
use caustics_gpu_examples::{Failure, picture};
use caustics_wgpu::{SplatMethod, SplatOptions};

const HELP: &str = "\
Draws the caustics of a glTF file, or of the built-in cognac glass, in a small engine's frame.

embed [scene.glb] [--out FILE.png] [--width N] [--height N] [--photons N] [--exposure EV] [--quads]
";

struct Arguments {
    scene: Option<PathBuf>,
    out: PathBuf,
    size: [u32; 2],
    photons: u32,
    exposure_ev: f32,
    splat: SplatOptions,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("embed: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), Failure> {
    let Some(arguments) = parse()? else {
        print!("{HELP}");
        return Ok(());
    };
    let scene = match &arguments.scene {
        Some(path) => gltf::load_path(path)?.scene,
        None => builtin::cognac_glass(),
    };
    let look = Look {
        camera: first_camera(&scene)?,
        light: main_light(&scene).ok_or("the scene has no light that the engine knows")?,
        exposure_ev: arguments.exposure_ev,
    };
    let trace = TraceOptions {
        photons: arguments.photons,
        ..TraceOptions::default()
    };
    let snapshot = Snapshot::take(scene, &look, arguments.size, trace, arguments.splat)?;
    picture::write_png(&arguments.out, arguments.size, &snapshot.pixels)?;
    println!("{}, {:?}", snapshot.adapter, snapshot.capabilities);
    println!("{:?}\n{:?}", snapshot.stats, snapshot.work);
    for (pass, milliseconds) in &snapshot.times {
        println!("{pass:>16} {milliseconds:9.3} ms");
    }
    println!("wrote {}", arguments.out.display());
    Ok(())
}

fn first_camera(scene: &Scene) -> Result<Camera, Failure> {
    Ok(scene
        .cameras()
        .first()
        .ok_or("the scene has no camera")?
        .clone())
}

fn parse() -> Result<Option<Arguments>, Failure> {
    use lexopt::prelude::*;
    let mut arguments = Arguments {
        scene: None,
        out: "embed.png".into(),
        size: [1024, 768],
        photons: 1 << 17,
        exposure_ev: 0.0,
        splat: SplatOptions::default(),
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") | Short('h') => return Ok(None),
            Long("out") => arguments.out = parser.value()?.into(),
            Long("width") => arguments.size[0] = parser.value()?.parse()?,
            Long("height") => arguments.size[1] = parser.value()?.parse()?,
            Long("photons") => arguments.photons = parser.value()?.parse()?,
            Long("exposure") => arguments.exposure_ev = parser.value()?.parse()?,
            Long("quads") => arguments.splat.method = SplatMethod::Quads,
            Value(path) if arguments.scene.is_none() => arguments.scene = Some(path.into()),
            other => return Err(other.unexpected().into()),
        }
    }
    Ok(Some(arguments))
}
