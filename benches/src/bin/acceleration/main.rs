//! Times rays, builds and photon searches against the named peers, and writes the tables of it.
//!
//! `cargo run --release -p caustics-benches --features embree,nanoflann-cpp --bin acceleration -- --help`
//! lists the options.

mod arguments;
mod builds;
mod contest;
mod instances;
mod searches;
mod tables;
mod traces;

use std::fs;
use std::process::ExitCode;

use caustics_benches::conditions::conditions;
use caustics_benches::document::with_tables;
use caustics_benches::stage::Failure;

use crate::arguments::{Arguments, USAGE};

fn main() -> ExitCode {
    let outcome = match Arguments::parse(std::env::args().skip(1)) {
        Ok(Some(arguments)) => run(&arguments),
        Ok(None) => {
            print!("{USAGE}");
            Ok(())
        }
        Err(failure) => Err(failure),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("acceleration: {failure}");
            ExitCode::from(2)
        }
    }
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
    for (name, table) in &tables {
        println!("{name}\n\n{table}");
    }
    if let Some(path) = &arguments.document {
        let document =
            fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        fs::write(path, with_tables(&document, &tables)?)?;
    }
    Ok(())
}
