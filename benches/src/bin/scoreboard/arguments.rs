use std::path::PathBuf;

use caustics::render::Estimate;
use caustics_benches::stage::{Failure, SCENES};
use caustics_benches::timing::Patience;

pub(crate) const USAGE: &str = "\
Times and scores every estimate on the public scenes, and writes the tables and charts of it.

    cargo run --release -p caustics-benches --bin scoreboard -- [options]

  --scenes A,B         scenes (default: all ten)
  --estimates A,B      estimates (default: all)
  --photons N,N        photons emitted (default: 65536,262144,2000000)
  --ladder N,N         further counts, for the default estimate alone
                       (default: powers of the root of two from 512 to 46341, then
                       1048576,4194304; `none` for none)
  --counted N          photons of the picture that tells a reference's noise from errors, not timed
                       (default: 16000000; 0 for none)
  --runs N             runs that a median is taken of, at most (default: 5)
  --patience S         seconds after which no further run starts (default: 3)
  --threads N          threads (default: as many as there are cores)
  --machine TEXT       class of the machine, for the tables
  --csv FILE           rows (default: benches/data/accuracy.csv); what is measured again replaces
                       the row of the same scene, estimate and count
  --document FILE      Markdown whose marked tables are rewritten (default: docs/accuracy.md)
  --svg FOLDER         folder of the charts (default: docs)
  --images FOLDER      keeps the pictures as EXR
  --noise-csv FILE     the references' noise (default: benches/data/noise.csv)
  --peers FILE         other renderers' rows (default: benches/data/peers.csv)
  --renderers yes      has other renderers render the scenes as well: Mitsuba 3 (PyPI, with a libLLVM of 16
                       or newer) and POV-Ray, whichever is installed
  --renderers-csv FILE their rows (default: benches/data/renderers.csv)
  --measure no         measures nothing, rewrites tables and charts from the CSV
  --full yes           measures caustics seen through glass and in mirrors, too, on the scenes that
                       have a reference of them (p01, p08, p10), at the counts of --photons
  --full-csv FILE      its rows (default: benches/data/full.csv)
";

/// What the user asked for.
pub(crate) struct Arguments {
    pub(crate) scenes: Vec<String>,
    pub(crate) estimates: Vec<Estimate>,
    pub(crate) photons: Vec<u32>,
    pub(crate) ladder: Vec<u32>,
    pub(crate) counted: u32,
    pub(crate) patience: Patience,
    pub(crate) threads: Option<usize>,
    pub(crate) machine: String,
    pub(crate) csv: PathBuf,
    pub(crate) document: PathBuf,
    pub(crate) svg: PathBuf,
    pub(crate) images: Option<PathBuf>,
    pub(crate) peers: PathBuf,
    pub(crate) noise_csv: PathBuf,
    pub(crate) measures: bool,
    pub(crate) measures_renderers: bool,
    pub(crate) renderers_csv: PathBuf,
    pub(crate) measures_full: bool,
    pub(crate) full_csv: PathBuf,
}

impl Arguments {
    fn new() -> Self {
        let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        Self {
            scenes: SCENES.map(str::to_owned).to_vec(),
            estimates: Estimate::ALL.to_vec(),
            photons: vec![65_536, 262_144, 2_000_000],
            ladder: vec![
                512, 724, 1024, 1448, 2048, 2896, 4096, 5793, 8192, 11_585, 16_384, 23_170, 32_768,
                46_341, 1_048_576, 4_194_304,
            ],
            counted: 16_000_000,
            patience: Patience {
                runs: 5,
                seconds: 3.0,
            },
            threads: None,
            machine: "unnamed".to_owned(),
            csv: root.join("benches/data/accuracy.csv"),
            document: root.join("docs/accuracy.md"),
            svg: root.join("docs"),
            images: None,
            peers: root.join("benches/data/peers.csv"),
            noise_csv: root.join("benches/data/noise.csv"),
            measures: true,
            measures_renderers: false,
            renderers_csv: root.join("benches/data/renderers.csv"),
            measures_full: false,
            full_csv: root.join("benches/data/full.csv"),
        }
    }

    /// Reads the command line; `None` if the user wants to know how.
    pub(crate) fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Self>, Failure> {
        let mut arguments = Self::new();
        while let Some(option) = words.next() {
            if option == "--help" || option == "-h" {
                return Ok(None);
            }
            let value = words
                .next()
                .ok_or_else(|| format!("{option} wants a value"))?;
            arguments.set(&option, &value)?;
        }
        Ok(Some(arguments))
    }

    fn set(&mut self, option: &str, value: &str) -> Result<(), Failure> {
        match option {
            "--scenes" => {
                self.scenes = value.split(',').map(str::to_owned).collect();
                if let Some(name) = self
                    .scenes
                    .iter()
                    .find(|name| !SCENES.contains(&name.as_str()))
                {
                    return Err(format!("no scene {name}; there are {}", SCENES.join(", ")).into());
                }
            }
            "--estimates" => {
                let find =
                    |name| Estimate::from_name(name).ok_or_else(|| format!("no estimate {name}"));
                self.estimates = value.split(',').map(find).collect::<Result<_, _>>()?;
            }
            "--photons" => self.photons = counts(value)?,
            "--ladder" => self.ladder = counts(value)?,
            "--counted" => self.counted = value.parse()?,
            "--runs" => self.patience.runs = value.parse()?,
            "--patience" => self.patience.seconds = value.parse()?,
            "--threads" => self.threads = Some(value.parse()?),
            "--machine" => value.clone_into(&mut self.machine),
            "--csv" => self.csv = value.into(),
            "--document" => self.document = value.into(),
            "--svg" => self.svg = value.into(),
            "--images" => self.images = Some(value.into()),
            "--peers" => self.peers = value.into(),
            "--noise-csv" => self.noise_csv = value.into(),
            "--renderers" => self.measures_renderers = value != "no",
            "--renderers-csv" => self.renderers_csv = value.into(),
            "--full" => self.measures_full = value != "no",
            "--full-csv" => self.full_csv = value.into(),
            "--measure" => self.measures = value != "no",
            _ => return Err(format!("no option {option} (try --help)").into()),
        }
        Ok(())
    }

    /// The photon counts of an estimate, in rising order.
    pub(crate) fn counts_of(&self, estimate: Estimate) -> Vec<u32> {
        let mut counts = self.photons.clone();
        if estimate == Estimate::default() {
            counts.extend(&self.ladder);
        }
        counts.sort_unstable();
        counts.dedup();
        counts
    }
}

fn counts(value: &str) -> Result<Vec<u32>, Failure> {
    if value == "none" {
        return Ok(Vec::new());
    }
    Ok(value.split(',').map(str::parse).collect::<Result<_, _>>()?)
}
