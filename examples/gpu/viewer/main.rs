//! Looks at caustics in a window.
//!
//! `cargo run --release -p caustics-gpu-examples --example viewer -- --help` lists keys and options.
//!
//! Left drag orbits, right drag moves the light; what each pass takes stands in the upper left
//! corner, where the device can tell. To run it without a display, in the X server that draws into
//! memory (Debian's packages `xvfb`, `libxkbcommon-x11-0`, `libx11-xcb1` and `mesa-vulkan-drivers`):
//!
//! ```text
//! xvfb-run -a cargo run --release -p caustics-gpu-examples --example viewer -- \
//!     --frames 30 --screenshot viewer.png
//! ```
//!
//! `--headless` needs no X server either, and draws into a texture.

mod arguments;
mod orbit;
mod window;

use std::process::ExitCode;
use std::time::Instant;

use caustics_gpu_examples::picture::{FrameNotes, offscreen, write_png};
use caustics_gpu_examples::stage::Stage;
use caustics_gpu_examples::{Failure, headless};
use caustics_gpu_readback::read_texture;

use arguments::Arguments;
use orbit::Orbit;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("viewer: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), Failure> {
    let Some(arguments) = arguments::parse()? else {
        print!("{}", arguments::HELP);
        return Ok(());
    };
    if arguments.is_headless {
        without_window(arguments)
    } else {
        window::run(arguments)
    }
}

/// The same frames without a window: the camera goes round and the light with it.
fn without_window(mut arguments: Arguments) -> Result<(), Failure> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let (adapter, device, queue) = headless::device(&instance, None)?;
    arguments.fit(&adapter);
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let scene = arguments.scene()?;
    let mut orbit = Orbit::new(&scene)?;
    let size = arguments.size;
    let mut stage = Stage::new(&device, &queue, scene, size, format, arguments.trace())?;
    stage.set_splat(&device, arguments.splat)?;
    let texture = offscreen(&device, size, format);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    println!("{}", adapter.get_info().name);
    for frame in 0..arguments.frames.unwrap_or(1) {
        let start = Instant::now();
        if frame > 0 {
            orbit.turn(12.0, 0.0);
            orbit.drag_light(6.0, 0.0);
            stage.aim(orbit.light(), arguments.trace())?;
        }
        let look = orbit.look(arguments.exposure_ev)?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let prepared = stage.draw(&device, &queue, &mut encoder, &look, &view)?;
        let notes = FrameNotes::record(&device, &mut encoder, &prepared)?;
        queue.submit([encoder.finish()]);
        let (stats, times) = notes.read(&device, &prepared)?;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        println!(
            "frame {frame}: {milliseconds:.1} ms, {} splats",
            stats.splatted
        );
        if arguments.frames == Some(frame + 1) {
            for (pass, milliseconds) in times {
                println!("{pass:>16} {milliseconds:9.3} ms");
            }
        }
    }
    if let Some(path) = &arguments.screenshot {
        let pixels = read_texture(&device, &queue, &texture, 4)?;
        write_png(path, size, &pixels)?;
        println!("wrote {}", path.display());
    }
    Ok(())
}
