//! Times and scores every estimate on the public scenes, and writes the tables and charts of it.
//!
//! `cargo run --release -p caustics-benches --bin scoreboard -- --help` lists the options.

mod arguments;
mod chart;
mod full;
mod gain;
mod measure;
mod metric;
mod nearest_search;
mod noise;
mod tables;

use std::fs;
use std::process::ExitCode;

use caustics_benches::command::exit_code;
use caustics_benches::conditions::conditions;
use caustics_benches::counted::Counted;
use caustics_benches::document::rewrite;
use caustics_benches::score::{Row, from_csv, peers_from_csv, to_csv};
use caustics_benches::stage::{Failure, Stage};

use crate::arguments::{Arguments, USAGE};
use crate::metric::Metric;

fn main() -> ExitCode {
    let options = Arguments::parse(std::env::args().skip(1));
    exit_code("scoreboard", USAGE, options, run)
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()?;
    }
    for folder in arguments.images.iter().chain([&arguments.svg]) {
        fs::create_dir_all(folder)?;
    }
    let mut rows = if arguments.csv.exists() {
        from_csv(&fs::read_to_string(&arguments.csv)?)?
    } else {
        Vec::new()
    };
    let conditions = conditions(&arguments.machine);
    let full = full::rows(arguments, &conditions)?;
    let mut noises = noise::rows(arguments)?;
    if arguments.measures {
        for name in &arguments.scenes {
            let stage = Stage::load(name)?;
            let counted = match arguments.counted {
                0 => None,
                photons => Some(Counted::new(&stage, photons)?),
            };
            if let Some(counted) = &counted {
                noise::measure(&mut noises, &stage, counted, arguments, &conditions)?;
            }
            let measured = measure::measure(&stage, counted.as_ref(), arguments, &conditions)?;
            replace(&mut rows, measured);
            // After every scene, so that little is lost when the program is stopped.
            fs::write(&arguments.csv, to_csv(&rows))?;
        }
    }
    let peers = peers_from_csv(&fs::read_to_string(&arguments.peers)?)?;
    for metric in Metric::ALL {
        fs::write(
            arguments.svg.join(metric.file()),
            chart::chart(&rows, &peers, metric),
        )?;
    }
    let mut all = tables::all(&rows, &peers);
    all.push(("full", full::table(&full)));
    all.push(("noise", noise::table(&noises, &rows)));
    rewrite(&arguments.document, &all)
}

/// Takes over new rows, in place of old ones of the same cases.
fn replace(rows: &mut Vec<Row>, measured: Vec<Row>) {
    rows.retain(|old| !measured.iter().any(|new| new.is_of_same_case(old)));
    rows.extend(measured);
    rows.sort_by(|a, b| {
        (&a.scene, &a.estimate, a.photons).cmp(&(&b.scene, &b.estimate, b.photons))
    });
}
