use std::path::PathBuf;
use std::time::Duration;

use caustics_benches::stage::Failure;

pub(crate) const USAGE: &str = "\
Times rays, builds and photon searches against the named peers, and writes the tables of it.

    cargo run --release -p caustics-benches --features embree,nanoflann-cpp --bin acceleration -- [options]

  --quick              small meshes, few photons, few runs: half a minute, for a look
  --only A,B           parts: traces, instances, builds, searches, pictures (default: all)
  --machine TEXT       class of the machine, for the tables
  --document FILE      Markdown whose marked tables are rewritten (default: docs/acceleration.md;
                       none with --quick, or for `none`)

Without the feature `embree` (Debian's libembree-dev) obvhs is what ratios are relative to; without
the feature `nanoflann-cpp` (Debian's libnanoflann-dev) only nanoflann's port to Rust is compared.
";

/// The parts of the program.
const PARTS: [&str; 5] = ["traces", "instances", "builds", "searches", "pictures"];

/// What the user asked for.
pub(crate) struct Arguments {
    pub(crate) is_quick: bool,
    only: Vec<String>,
    pub(crate) machine: String,
    pub(crate) document: Option<PathBuf>,
}

impl Arguments {
    /// Reads the command line; `None` if the user wants to know how.
    pub(crate) fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Self>, Failure> {
        let mut arguments = Self {
            is_quick: false,
            only: PARTS.map(str::to_owned).to_vec(),
            machine: "unnamed".to_owned(),
            document: None,
        };
        let mut document = None;
        while let Some(option) = words.next() {
            let mut value = || {
                words
                    .next()
                    .ok_or_else(|| format!("{option} wants a value"))
            };
            match option.as_str() {
                "--help" | "-h" => return Ok(None),
                "--quick" => arguments.is_quick = true,
                "--only" => {
                    arguments.only = value()?.split(',').map(str::to_owned).collect();
                    if let Some(part) = arguments.only.iter().find(|p| !PARTS.contains(&p.as_str()))
                    {
                        return Err(
                            format!("no part {part}; there are {}", PARTS.join(", ")).into()
                        );
                    }
                }
                "--machine" => arguments.machine = value()?,
                "--document" => document = Some(value()?),
                _ => return Err(format!("no option {option} (try --help)").into()),
            }
        }
        arguments.document = match document {
            Some(path) if path == "none" => None,
            Some(path) => Some(path.into()),
            None if arguments.is_quick => None,
            None => {
                let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
                Some(root.join("docs/acceleration.md"))
            }
        };
        Ok(Some(arguments))
    }

    /// Whether a part is wanted.
    pub(crate) fn does(&self, part: &str) -> bool {
        self.only.iter().any(|wanted| wanted == part)
    }

    /// Thread counts to measure with.
    pub(crate) fn threads(&self) -> &'static [usize] {
        if self.is_quick { &[1] } else { &[1, 2] }
    }

    /// How long each contestant may take in all its rounds.
    pub(crate) fn patience(&self) -> Duration {
        Duration::from_millis(if self.is_quick { 60 } else { 350 })
    }
}
