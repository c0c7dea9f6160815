//! The command line.

use std::ffi::OsString;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use caustics::prelude::*;
use caustics::scene::gltf::LoadOptions;
use lexopt::{Arg, Parser, ValueExt};

const HELP: &str = "\
Renders the caustics of a glTF 2.0 file, or without one of the built-in cognac glass.

usage: render [options] [scene.glb | scene.gltf]

  --width N, --height N     size of the picture in pixels           (1024 x 768)
  --photons N               photons emitted, by all lights together (262144)
  --samples N               eye rays a pixel                        (4)
  --seed N                  chooses the random numbers              (0)
  --camera N                which camera of the file                (0)
  --estimate NAME           how photons become light                (grid-gaussian)
  --list-estimates          name all estimates
  --visibility direct|full  caustics only where the camera sees the receiver itself,
                            or also through glass and in mirrors    (full)
  --receivers lambertian|glossy
                            what is neither glass nor mirror: Lambertian, or as metallic and
                            rough as the file says                  (lambertian)
  --backend cpu             what computes                           (cpu)
  --threads N               threads to use                          (all)
  --exposure EV             brightness of the PNG, in stops         (0)
  --neighbours N            nearest photons an estimate takes       (50)
  --radius METRES           how far off they may lie                (from the scene)
  --kernel NAME             their weight by distance: box, cone, epanechnikov, gaussian,
                            silverman                               (epanechnikov)
  --branching NAME          what a photon does at glass: roulette, split-first, split-all
                                                                    (split-all)
  --emission guided|even    whether more photons go where their footprints would be wide (guided)
  --edges divided|whole     whether photons are divided where sheets of light end (divided)
  --aim NAME                where lights aim: casters, cones around them, everywhere
                                                                    (casters)
  --out FILE.png            the picture                             (caustics.png)
  --caustics-only FILE.exr  the caustics alone, linear radiance
  --direct-only FILE.exr    the direct light alone, linear radiance
  --stats FILE.json         what the closing table says, for programs
  --help                    this text";

/// What the user wants.
pub(crate) enum Request {
    /// Only this text.
    Print(String),
    /// A picture.
    Render(Box<Arguments>),
}

/// What to render and where to.
pub(crate) struct Arguments {
    pub scene: Option<PathBuf>,
    pub load: LoadOptions,
    pub camera: usize,
    pub caustics: CausticsOptions,
    pub picture: PictureOptions,
    pub threads: Option<usize>,
    pub exposure: f32,
    pub out: PathBuf,
    pub caustics_only: Option<PathBuf>,
    pub direct_only: Option<PathBuf>,
    pub stats: Option<PathBuf>,
}

impl Default for Arguments {
    fn default() -> Self {
        Self {
            scene: None,
            load: LoadOptions::default(),
            camera: 0,
            caustics: CausticsOptions::default(),
            picture: PictureOptions::default(),
            threads: None,
            exposure: 0.0,
            out: "caustics.png".into(),
            caustics_only: None,
            direct_only: None,
            stats: None,
        }
    }
}

/// Reads the arguments that follow the program's name.
pub(crate) fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Request, String> {
    let mut parser = Parser::from_args(arguments);
    let mut result = Arguments::default();
    while let Some(argument) = parser.next().map_err(|error| error.to_string())? {
        match argument {
            Arg::Long("help") | Arg::Short('h') => return Ok(Request::Print(HELP.into())),
            Arg::Long("list-estimates") => return Ok(Request::Print(list_estimates())),
            Arg::Long(name) => {
                let name = name.to_owned();
                result.set(&name, &mut parser)?;
            }
            Arg::Short(letter) => return Err(format!("unknown option -{letter}")),
            Arg::Value(path) if result.scene.is_none() => result.scene = Some(path.into()),
            Arg::Value(path) => {
                return Err(format!("{}: one scene at a time", path.to_string_lossy()));
            }
        }
    }
    result.picture.seed = result.caustics.trace.seed;
    result
        .picture
        .validate()
        .map_err(|error| format!("--width, --height: {error}"))?;
    Ok(Request::Render(Box::new(result)))
}

impl Arguments {
    fn set(&mut self, name: &str, parser: &mut Parser) -> Result<(), String> {
        let trace = &mut self.caustics.trace;
        match name {
            "width" => self.picture.width = positive(name, parser)?,
            "height" => self.picture.height = positive(name, parser)?,
            "photons" => trace.photons = number(name, parser)?,
            "samples" => self.picture.samples = positive(name, parser)?,
            "seed" => trace.seed = number(name, parser)?,
            "camera" => self.camera = number(name, parser)?,
            "threads" => self.threads = Some(positive(name, parser)?),
            "exposure" => self.exposure = finite(name, parser)?,
            "neighbours" => self.caustics.nearest.count = positive(name, parser)?,
            "radius" => {
                let radius = finite(name, parser)?;
                if radius <= 0.0 {
                    return Err(format!("--radius {radius}: not above 0"));
                }
                self.caustics.nearest.max_radius = Some(radius);
            }
            "estimate" => {
                let estimate = choice(name, parser, &Estimate::ALL.map(|it| (it.name(), it)))?;
                let preset = CausticsOptions::for_estimate(estimate);
                self.caustics.estimate = estimate;
                self.caustics.trace.sequence = preset.trace.sequence;
                self.caustics.footprint.kernel = preset.footprint.kernel;
            }
            "kernel" => {
                let kernels = Kernel::ALL.map(|it| (it.name(), it));
                self.caustics.nearest.kernel = choice(name, parser, &kernels)?;
            }
            "branching" => {
                trace.branching = choice(
                    name,
                    parser,
                    &[
                        ("roulette", Branching::Roulette),
                        ("split-first", Branching::SplitFirst),
                        ("split-all", Branching::SplitAll),
                    ],
                )?;
            }
            "edges" => {
                trace.divide_edges = choice(name, parser, &[("divided", true), ("whole", false)])?;
            }
            "emission" => {
                let choices = [("guided", true), ("even", false)];
                trace.guide_emission = choice(name, parser, &choices)?;
            }
            "aim" => {
                trace.aim = choice(
                    name,
                    parser,
                    &[
                        ("casters", Aim::Casters),
                        ("cones", Aim::Cones),
                        ("everywhere", Aim::Everywhere),
                    ],
                )?;
            }
            "visibility" => {
                self.picture.visibility = choice(
                    name,
                    parser,
                    &[("direct", Visibility::Direct), ("full", Visibility::Full)],
                )?;
            }
            "receivers" => {
                self.load.glossy_receivers =
                    choice(name, parser, &[("lambertian", false), ("glossy", true)])?;
            }
            "backend" => choice(name, parser, &[("cpu", ())])?,
            "out" => self.out = path(name, parser)?,
            "caustics-only" => self.caustics_only = Some(path(name, parser)?),
            "direct-only" => self.direct_only = Some(path(name, parser)?),
            "stats" => self.stats = Some(path(name, parser)?),
            _ => return Err(format!("unknown option --{name}")),
        }
        Ok(())
    }
}

fn text(name: &str, parser: &mut Parser) -> Result<String, String> {
    let value = parser
        .value()
        .map_err(|_| format!("--{name}: a value is missing"))?;
    value
        .string()
        .map_err(|_| format!("--{name}: the value is not valid text"))
}

fn path(name: &str, parser: &mut Parser) -> Result<PathBuf, String> {
    Ok(parser
        .value()
        .map_err(|_| format!("--{name}: a file name is missing"))?
        .into())
}

fn number<T: FromStr<Err: Display>>(name: &str, parser: &mut Parser) -> Result<T, String> {
    let text = text(name, parser)?;
    text.parse()
        .map_err(|error| format!("--{name} {text}: {error}"))
}

/// A whole number of which there is at least one.
fn positive<T>(name: &str, parser: &mut Parser) -> Result<T, String>
where
    T: FromStr<Err: Display> + Default + PartialEq,
{
    let value = number(name, parser)?;
    if value == T::default() {
        Err(format!("--{name} 0: at least 1"))
    } else {
        Ok(value)
    }
}

fn finite(name: &str, parser: &mut Parser) -> Result<f32, String> {
    let value: f32 = number(name, parser)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("--{name} {value}: not finite"))
    }
}

fn choice<T: Copy>(name: &str, parser: &mut Parser, all: &[(&str, T)]) -> Result<T, String> {
    let text = text(name, parser)?;
    all.iter()
        .find(|(known, _)| *known == text)
        .map(|&(_, value)| value)
        .ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|&(known, _)| known).collect();
            format!("--{name} {text}: not one of {}", names.join(", "))
        })
}

fn list_estimates() -> String {
    let lines: Vec<String> = Estimate::ALL
        .iter()
        .map(|it| format!("{:<12} {}", it.name(), it.summary()))
        .collect();
    lines.join("\n")
}
