//! Other renderers, run and scored beside this project's estimates.
//!
//! A script of `benches/scripts/renderers` for each knows how to put a scene to it, and prints a line for
//! every picture. What pictures have in common is here: which pixels count, and what is taken off.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use caustics::filter::{Comparison, read_exr};

use crate::fields::Fields;
use crate::receivers::receivers;
use crate::score::{Conditions, PeerRow};
use crate::stage::{Failure, Stage, scene_folder};

/// The scripts that put scenes to renderers.
const SCRIPTS: [&str; 2] = ["mitsuba_light_tracing.py", "povray_photons.py"];

/// Another renderer's picture, timed and scored.
#[derive(Clone, Debug, PartialEq)]
pub struct RendererRow {
    /// Who took how long, and its error.
    pub result: PeerRow,
    /// The renderer's version.
    pub version: String,
    /// Sum of the picture over that of the reference.
    pub energy_ratio: f64,
    /// Under what it was measured.
    pub conditions: Conditions,
}

const HEADER: &str = "peer,scene,setting,seconds,relmse,relmse_trim1,version,energy_ratio,\
threads,machine,date,commit";

impl RendererRow {
    fn line(&self) -> String {
        let PeerRow {
            peer,
            scene,
            setting,
            seconds,
            relative_mse,
            relative_mse_trimmed,
        } = &self.result;
        let Conditions {
            threads,
            machine,
            date,
            commit,
        } = &self.conditions;
        format!(
            "{peer},{scene},{setting},{seconds:.4},{relative_mse:.6e},{relative_mse_trimmed:.6e},{},\
             {:.5},{threads},{machine},{date},{commit}",
            self.version, self.energy_ratio,
        )
    }

    fn parse(line: &str) -> Result<Self, Failure> {
        let fields = Fields::of(line, HEADER)?;
        Ok(Self {
            result: PeerRow {
                peer: fields.text(0).to_owned(),
                scene: fields.text(1).to_owned(),
                setting: fields.text(2).to_owned(),
                seconds: fields.number(3)?,
                relative_mse: fields.number(4)?,
                relative_mse_trimmed: fields.number(5)?,
            },
            version: fields.text(6).to_owned(),
            energy_ratio: fields.number(7)?,
            conditions: Conditions {
                threads: fields.number(8)?,
                machine: fields.text(9).to_owned(),
                date: fields.text(10).to_owned(),
                commit: fields.text(11).to_owned(),
            },
        })
    }
}

/// Writes rows as CSV.
#[must_use]
pub fn to_csv(rows: &[RendererRow]) -> String {
    let lines = rows.iter().map(RendererRow::line);
    let all = std::iter::once(HEADER.to_owned()).chain(lines);
    all.map(|line| line + "\n").collect()
}

/// Reads rows that [`to_csv`] wrote.
///
/// # Errors
/// At the first malformed line.
pub fn from_csv(text: &str) -> Result<Vec<RendererRow>, Failure> {
    if text.lines().next() != Some(HEADER) {
        return Err("the first line does not name the columns of other renderers".into());
    }
    text.lines().skip(1).map(RendererRow::parse).collect()
}

/// Has every renderer that is installed render a scene, and scores its pictures.
///
/// What a script says where it cannot goes to standard error.
///
/// # Errors
/// If a picture cannot be read or has another size than the reference.
pub fn measure(stage: &Stage, conditions: &Conditions) -> Result<Vec<RendererRow>, Failure> {
    let scored = scored_pixels(stage);
    let folder = std::env::temp_dir().join(format!("renderers-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let mut rows = Vec::new();
    for script in SCRIPTS {
        for line in run(script, stage, &folder)?.lines() {
            let picture = Picture::parse(line)?;
            let row = picture.scored(stage, &scored, conditions)?;
            eprintln!(
                "{:<40} {:8.3} s  relMSE {:.5}  trimmed {:.5}  energy {:.4}",
                format!("{}-{}-{}", stage.name, row.result.peer, row.result.setting),
                row.result.seconds,
                row.result.relative_mse,
                row.result.relative_mse_trimmed,
                row.energy_ratio,
            );
            rows.push(row);
        }
    }
    fs::remove_dir_all(&folder)?;
    Ok(rows)
}

/// What a script prints for a scene; nothing where it cannot run.
fn run(script: &str, stage: &Stage, folder: &Path) -> Result<String, Failure> {
    let scripts = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/renderers"));
    let output = Command::new("python3")
        // No compiled copies beside the scripts.
        .arg("-B")
        .arg(scripts.join(script))
        .arg(scene_folder().join(format!("{}.glb", stage.name)))
        .arg(folder)
        .arg(stage.reference.width().to_string())
        .arg(stage.reference.height().to_string())
        .output();
    let output = match output {
        Ok(output) => output,
        Err(error) => {
            eprintln!("{script}: python3: {error}");
            return Ok(String::new());
        }
    };
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        let last = message.trim().lines().last().unwrap_or_default();
        eprintln!("{script}: {}: {last}", stage.name);
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// A picture, as a script's line has it.
#[derive(Clone, Debug, PartialEq)]
struct Picture {
    renderer: String,
    version: String,
    setting: String,
    seconds: f64,
    file: PathBuf,
    /// The light in it that is no caustic.
    other: PathBuf,
}

impl Picture {
    fn parse(line: &str) -> Result<Self, Failure> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [renderer, version, setting, seconds, file, other] = words[..] else {
            return Err(format!("a script printed: {line}").into());
        };
        Ok(Self {
            renderer: renderer.to_owned(),
            version: version.to_owned(),
            setting: setting.to_owned(),
            seconds: seconds.parse()?,
            file: file.into(),
            other: other.into(),
        })
    }

    /// Scores it where pixels are to be, as though the others had no error.
    fn scored(
        &self,
        stage: &Stage,
        scored: &[bool],
        conditions: &Conditions,
    ) -> Result<RendererRow, Failure> {
        let reference = &stage.reference;
        let mut image = read_exr(&self.file)?;
        let other = read_exr(&self.other)?;
        if [&image, &other].map(|it| it.pixels().len()) != [reference.pixels().len(); 2] {
            return Err(format!("{}: not of the reference's size", self.file.display()).into());
        }
        for (pixel, other) in image.pixels_mut().iter_mut().zip(other.pixels()) {
            for (value, other) in pixel.iter_mut().zip(other) {
                *value -= other;
            }
        }
        let pixels = image.pixels_mut().iter_mut().zip(reference.pixels());
        for ((pixel, of_reference), &is_scored) in pixels.zip(scored) {
            if !is_scored {
                *pixel = *of_reference;
            }
        }
        let comparison = Comparison::new(&image, reference)?;
        Ok(RendererRow {
            result: PeerRow {
                peer: self.renderer.clone(),
                scene: stage.name.clone(),
                setting: self.setting.clone(),
                seconds: self.seconds,
                relative_mse: comparison.relative_mse,
                relative_mse_trimmed: comparison.relative_mse_trimmed,
            },
            version: self.version.clone(),
            energy_ratio: comparison.energy_ratio,
            conditions: conditions.clone(),
        })
    }
}

/// The pixels that see a receiver, as all around them do: what glass and mirrors show is in other
/// renderers' pictures, and a little of it in the pixels at their edges.
fn scored_pixels(stage: &Stage) -> Vec<bool> {
    let (width, height) = (stage.reference.width(), stage.reference.height());
    let mut sees = vec![false; (width * height) as usize];
    for receiver in receivers(stage, width, height) {
        sees[receiver.pixel as usize] = true;
    }
    eroded(&sees, width as usize)
}

/// Those of a picture's marked pixels whose neighbours are all marked.
fn eroded(marked: &[bool], width: usize) -> Vec<bool> {
    let height = marked.len() / width;
    let inner = |index: usize| {
        let (x, y) = (index % width, index / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
            .all(|neighbour| marked[neighbour])
    };
    (0..marked.len()).map(inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_their_file_and_are_read_as_those_of_other_tables() {
        let row = RendererRow {
            result: PeerRow {
                peer: "povray-photons".into(),
                scene: "s".into(),
                setting: "100k".into(),
                seconds: 1.5,
                relative_mse: 0.25,
                relative_mse_trimmed: 0.125,
            },
            version: "3.7".into(),
            energy_ratio: 1.0,
            conditions: Conditions {
                threads: 2,
                machine: "m".into(),
                date: "2000-01-01".into(),
                commit: "c".into(),
            },
        };
        let text = to_csv(std::slice::from_ref(&row));
        assert_eq!(from_csv(&text).unwrap(), std::slice::from_ref(&row));
        assert_eq!(crate::score::peers_from_csv(&text).unwrap(), [row.result]);
        assert!(from_csv(&text.replace(",100k", "")).is_err());
        assert!(from_csv(&text.replace("1.00000", "all")).is_err());
        assert!(from_csv("peer,scene\n").is_err());
    }

    #[test]
    fn lines_of_scripts_are_read_and_others_refused() {
        let picture = Picture::parse("p 3.7 20k 0.5 a.exr b.exr").unwrap();
        assert_eq!(picture.seconds, 0.5);
        assert_eq!(picture.other, Path::new("b.exr"));
        assert!(Picture::parse("p 3.7 20k 0.5 a.exr").is_err());
        assert!(Picture::parse("p 3.7 20k soon a.exr b.exr").is_err());
    }

    #[test]
    fn pixels_beside_unmarked_ones_are_left_out() {
        let picture = ["####", "####", "###.", "####"].concat();
        let marked: Vec<bool> = picture.chars().map(|it| it == '#').collect();
        let found: String = eroded(&marked, 4)
            .iter()
            .map(|&it| if it { '#' } else { '.' })
            .collect();
        assert_eq!(found, ["####", "##..", "##..", "##.."].concat());
    }
}
