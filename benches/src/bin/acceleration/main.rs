//! Times rays, builds and photon searches against the named peers, and writes the tables of it.
//!
//! `cargo run --release -p caustics-benches --features embree,nanoflann-cpp --bin acceleration -- --help`
//! lists the options.

mod arguments;
mod builds;
mod contest;
mod instances;
mod pictures;
mod searchers;
mod searches;
mod tables;
mod traces;

use std::process::ExitCode;

use caustics_benches::command::exit_code;
use caustics_benches::conditions::conditions;
use caustics_benches::document::rewrite;
use caustics_benches::stage::Failure;

use crate::arguments::{Arguments, USAGE};

fn main() -> ExitCode {
    let options = Arguments::parse(std::env::args().skip(1));
    exit_code("acceleration", USAGE, options, run)
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut tables = vec![(
        "conditions",
        tables::conditions(&conditions(&arguments.machine), arguments.is_quick),
    )];
    if arguments.does("traces") {
        tables.extend(traces::measure(arguments)?);
    }
    if arguments.does("instances") {
        tables.extend(instances::measure(arguments)?);
    }
    if arguments.does("builds") {
        tables.extend(builds::measure(arguments)?);
    }
    if arguments.does("searches") {
        tables.extend(searches::measure(arguments)?);
    }
    if arguments.does("pictures") {
        tables.extend(pictures::measure(arguments)?);
    }
    for (name, table) in &tables {
        println!("{name}\n\n{table}");
    }
    if let Some(path) = &arguments.document {
        rewrite(path, &tables)?;
    }
    Ok(())
}
