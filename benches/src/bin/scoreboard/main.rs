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
use caustics_benches::renderers;
use caustics_benches::score::{PeerRow, Row, from_csv, peers_from_csv, to_csv};
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
    let mut others = if arguments.renderers_csv.exists() {
        renderers::from_csv(&fs::read_to_string(&arguments.renderers_csv)?)?
    } else {
        Vec::new()
    };
    for name in &arguments.scenes {
        if !arguments.measures && !arguments.measures_renderers {
            break;
        }
        let stage = Stage::load(name)?;
        if arguments.measures {
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
        if arguments.measures_renderers {
            let measured = renderers::measure(&stage, &conditions)?;
            others.retain(|old| old.result.scene != *name);
            others.extend(measured);
            fs::write(&arguments.renderers_csv, renderers::to_csv(&others))?;
        }
    }
    let peers = peers_from_csv(&fs::read_to_string(&arguments.peers)?)?;
    let same_run: Vec<PeerRow> = others.iter().map(|row| row.result.clone()).collect();
    let charted = with_newer(&same_run, &peers);
    for metric in Metric::ALL {
        fs::write(
            arguments.svg.join(metric.file()),
            chart::chart(&rows, &charted, metric),
        )?;
    }
    let mut all = tables::all(&rows, &peers);
    all.extend(tables::of_renderers(&rows, &same_run));
    all.push(("full", full::table(&full)));
    all.push(("noise", noise::table(&noises, &rows)));
    rewrite(&arguments.document, &all)
}

/// Other renderers' rows of this machine, and of those that were not measured on it the others.
fn with_newer(same_run: &[PeerRow], peers: &[PeerRow]) -> Vec<PeerRow> {
    let is_new = |old: &&PeerRow| {
        let same = |new: &PeerRow| new.peer == old.peer && new.scene == old.scene;
        !same_run.iter().any(same)
    };
    let old = peers.iter().filter(is_new).cloned();
    same_run.iter().cloned().chain(old).collect()
}

/// Takes over new rows, in place of old ones of the same cases.
fn replace(rows: &mut Vec<Row>, measured: Vec<Row>) {
    rows.retain(|old| !measured.iter().any(|new| new.is_of_same_case(old)));
    rows.extend(measured);
    rows.sort_by(|a, b| {
        (&a.scene, &a.estimate, a.photons).cmp(&(&b.scene, &b.estimate, b.photons))
    });
}
