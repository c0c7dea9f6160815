//! Renders the caustics of a glTF file, or of the built-in cognac glass.
//!
//! `cargo run --release --example render -- --help` lists the options.

mod arguments;
mod default_view;
mod outputs;
mod report;
mod reporter;

use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

use caustics::prelude::*;
use caustics::scene::{builtin, gltf};

use arguments::{Arguments, Request};
use report::{Report, Seconds};
use reporter::Reporter;

/// What a user can have done wrong, or the machine; one line.
type Failure = String;

fn main() -> ExitCode {
    match arguments::parse(std::env::args_os().skip(1)) {
        Ok(Request::Print(text)) => {
            // A reader that has seen enough, such as `head`, closes the pipe: no failure of ours.
            let _ = writeln!(std::io::stdout(), "{text}");
            ExitCode::SUCCESS
        }
        Ok(Request::Render(arguments)) => match run(&arguments) {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => fail(&message),
        },
        Err(message) => fail(&format!("{message} (try --help)")),
    }
}

/// One line, whatever is in the message, and the exit status of bad usage or bad input.
fn fail(message: &str) -> ExitCode {
    eprintln!("render: {}", message.replace(['\n', '\r'], " "));
    ExitCode::from(2)
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|error| format!("--threads {threads}: {error}"))?;
    }
    let start = Instant::now();
    let (name, mut scene, warnings) = load(arguments)?;
    let notices = default_view::complete(&mut scene).map_err(|error| format!("{name}: {error}"))?;
    let camera = scene
        .cameras()
        .get(arguments.camera)
        .cloned()
        .ok_or_else(|| {
            let count = scene.cameras().len();
            format!(
                "{name}: there is no camera {}, the scene has {count}",
                arguments.camera
            )
        })?;
    outputs::check(arguments)?;
    // Only now, so that a failure is the one line that it says it is.
    for warning in warnings {
        eprintln!("warning: {name}: {warning}");
    }
    for notice in notices {
        eprintln!("note: {notice}");
    }
    let load_seconds = start.elapsed().as_secs_f64();

    let reporter = Reporter::new();
    let caustics = Caustics::with_progress(&scene, &arguments.caustics, &|progress| {
        reporter.advance(progress);
    })
    .map_err(|error| format!("{name}: {error}"))?;
    if caustics.map().photons.is_empty() && arguments.caustics.trace.photons > 0 {
        eprintln!("note: no photon landed after meeting glass or metal, so there is no caustic");
    }
    let start = Instant::now();
    let picture = caustics
        .render_with_progress(&camera, &arguments.picture, &|progress| {
            reporter.advance(progress);
        })
        .map_err(|error| format!("{name}: {error}"))?;
    let render_seconds = start.elapsed().as_secs_f64();
    reporter.finish();

    let start = Instant::now();
    outputs::write(arguments, &picture)?;
    let seconds = Seconds {
        load: load_seconds,
        build: caustics.seconds().build,
        trace: caustics.seconds().trace,
        render: render_seconds,
        write: start.elapsed().as_secs_f64(),
    };
    let report = Report::new(&name, arguments, &caustics, &picture, seconds);
    if let Some(path) = &arguments.stats {
        std::fs::write(path, report.to_json())
            .map_err(|error| format!("{}: cannot write: {error}", path.display()))?;
    }
    let _ = writeln!(
        std::io::stdout(),
        "{report}wrote {}",
        arguments.out.display()
    );
    Ok(())
}

fn load(arguments: &Arguments) -> Result<(String, Scene, Vec<gltf::Warning>), Failure> {
    let Some(path) = &arguments.scene else {
        return Ok((
            "the built-in cognac glass".into(),
            builtin::cognac_glass(),
            Vec::new(),
        ));
    };
    let name = path.display().to_string();
    let loaded =
        gltf::load_path_with(path, &arguments.load).map_err(|error| format!("{name}: {error}"))?;
    Ok((name, loaded.scene, loaded.warnings))
}
