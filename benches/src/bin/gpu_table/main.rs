//! Draws the public scenes on the GPU, scores and times them beside the CPU, and writes the tables and
//! the chart of it.
//!
//! `cargo run --release -p caustics-benches --bin gpu_table -- --help` lists the options.

mod chart;
mod measure;
mod receivers;
mod rows;
mod tables;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use caustics_benches::command::exit_code;
use caustics_benches::conditions::conditions;
use caustics_benches::document::rewrite;
use caustics_benches::stage::{Failure, SCENES, Stage};
use caustics_benches::timing::Patience;

use crate::measure::Bench;
use crate::rows::{Row, from_csv, to_csv};

const USAGE: &str = "\
Draws the public scenes on the GPU, scores and times them beside the CPU, and writes the tables and
the chart of it.

    cargo run --release -p caustics-benches --bin gpu_table -- [options]

  --scenes A,B         scenes (default: all ten)
  --photons N,N        photons emitted (default: 65536,262144)
  --runs N             runs that a median is taken of, at most (default: 5)
  --patience S         seconds after which no further run starts (default: 2)
  --machine TEXT       class of the machine, for the tables
  --csv FILE           rows (default: benches/data/gpu.csv); what is measured again replaces the
                       rows of the same scene and count
  --document FILE      Markdown whose marked tables are rewritten (default: docs/gpu.md)
  --svg FILE           the chart (default: docs/gpu-accuracy.svg)
  --measure no         measures nothing, rewrites tables and chart from the CSV
";

/// What the user asked for.
struct Arguments {
    scenes: Vec<String>,
    photons: Vec<u32>,
    patience: Patience,
    machine: String,
    csv: PathBuf,
    document: PathBuf,
    svg: PathBuf,
    measures: bool,
}

fn main() -> ExitCode {
    let options = Arguments::parse(std::env::args().skip(1));
    exit_code("gpu_table", USAGE, options, run)
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut rows = if arguments.csv.exists() {
        from_csv(&fs::read_to_string(&arguments.csv)?)?
    } else {
        Vec::new()
    };
    if arguments.measures {
        let mut bench = Bench::new(arguments.patience, conditions(&arguments.machine))?;
        for name in &arguments.scenes {
            let measured = bench.measure(&Stage::load(name)?, &arguments.photons)?;
            replace(&mut rows, measured);
            // After every scene, so that little is lost when the program is stopped.
            fs::write(&arguments.csv, to_csv(&rows))?;
        }
    }
    fs::write(&arguments.svg, chart::chart(&rows))?;
    rewrite(&arguments.document, &tables::all(&rows))
}

/// Takes over new rows, in place of old ones of the same scene and count.
fn replace(rows: &mut Vec<Row>, measured: Vec<Row>) {
    let case = |row: &Row| (row.scene.clone(), row.photons);
    rows.retain(|old| !measured.iter().any(|new| case(new) == case(old)));
    rows.extend(measured);
    rows.sort_by(|a, b| (&a.scene, a.photons, a.way).cmp(&(&b.scene, b.photons, b.way)));
}

impl Arguments {
    fn new() -> Self {
        let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        Self {
            scenes: SCENES.map(str::to_owned).to_vec(),
            photons: vec![65_536, 262_144],
            patience: Patience {
                runs: 5,
                seconds: 2.0,
            },
            machine: "unnamed".to_owned(),
            csv: root.join("benches/data/gpu.csv"),
            document: root.join("docs/gpu.md"),
            svg: root.join("docs/gpu-accuracy.svg"),
            measures: true,
        }
    }

    /// Reads the command line; `None` if the user wants to know how.
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Self>, Failure> {
        let mut arguments = Self::new();
        while let Some(option) = words.next() {
            if option == "--help" || option == "-h" {
                return Ok(None);
            }
            let value = words
                .next()
                .ok_or_else(|| format!("{option} wants a value"))?;
            match option.as_str() {
                "--scenes" => arguments.scenes = value.split(',').map(str::to_owned).collect(),
                "--photons" => {
                    arguments.photons =
                        value.split(',').map(str::parse).collect::<Result<_, _>>()?;
                }
                "--runs" => arguments.patience.runs = value.parse()?,
                "--patience" => arguments.patience.seconds = value.parse()?,
                "--machine" => arguments.machine = value,
                "--csv" => arguments.csv = value.into(),
                "--document" => arguments.document = value.into(),
                "--svg" => arguments.svg = value.into(),
                "--measure" => arguments.measures = value != "no",
                _ => return Err(format!("no option {option} (try --help)").into()),
            }
        }
        Ok(Some(arguments))
    }
}
