//! The scoreboard's rows, as they are kept in a CSV file.

use std::fmt::Write as _;

use crate::fields::Fields;
use crate::noise::Estimated;
use crate::stage::Failure;

/// One measured picture: how long it took and how far it is from the reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// The estimate.
    pub estimate: String,
    /// What was chosen for it, such as the number of nearest photons and the kernel.
    pub setting: String,
    /// Photons emitted.
    pub photons: u32,
    /// Photons stored on receivers.
    pub stored: u64,
    /// Median seconds to trace the photons.
    pub trace_seconds: f64,
    /// Runs of which that is the median.
    pub trace_runs: u32,
    /// Median seconds from photons to radiance.
    pub estimate_seconds: f64,
    /// Runs of which that is the median.
    pub estimate_runs: u32,
    /// Seconds to find out what the pixels see, not among the others.
    pub look_seconds: f64,
    /// Seconds to load the scene and build what rays are shot at, not among the others.
    pub load_seconds: f64,
    /// Sum of the image over that of the reference.
    pub energy_ratio: f64,
    /// Relative mean squared error.
    pub relative_mse: f64,
    /// The same without the 1 % of pixels where it is largest.
    pub relative_mse_trimmed: f64,
    /// What of the relative mean squared error is not noise of the reference, where that was told
    /// apart.
    pub noise_free: Option<Estimated>,
    /// 99.9th percentile of a pixel's error over the reference's mean.
    pub p999_relative: f64,
    /// LDR-FLIP, where Python could be asked for it.
    pub flip: Option<f64>,
    /// Under what it was measured.
    pub conditions: Conditions,
}

/// When and where something was measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conditions {
    /// Threads that did the work.
    pub threads: usize,
    /// The machine's class, without commas.
    pub machine: String,
    /// The day, in UTC.
    pub date: String,
    /// The version of the sources.
    pub commit: String,
}

const HEADER: &str = "scene,estimate,setting,photons,stored,trace_seconds,trace_runs,\
estimate_seconds,estimate_runs,look_seconds,load_seconds,energy_ratio,relmse,relmse_trim1,\
relmse_noise_free,relmse_noise_free_se,p999_rel,flip_ldr,threads,machine,date,commit";

impl Row {
    /// Trace and estimate together, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.trace_seconds + self.estimate_seconds
    }

    /// Whether two rows measure the same thing.
    #[must_use]
    pub fn is_of_same_case(&self, other: &Self) -> bool {
        self.scene == other.scene
            && self.estimate == other.estimate
            && self.photons == other.photons
    }

    fn line(&self) -> String {
        let Conditions {
            threads,
            machine,
            date,
            commit,
        } = &self.conditions;
        let flip = self
            .flip
            .map_or_else(String::new, |flip| format!("{flip:.5}"));
        let noise_free = self.noise_free.map_or_else(
            || ",".to_owned(),
            |it| format!("{:.6e},{:.3e}", it.value, it.standard_error),
        );
        format!(
            "{},{},{},{},{},{:.5},{},{:.5},{},{:.5},{:.5},{:.5},{:.6e},{:.6e},{noise_free},{:.6e},{flip},\
             {threads},{machine},{date},{commit}",
            self.scene,
            self.estimate,
            self.setting,
            self.photons,
            self.stored,
            self.trace_seconds,
            self.trace_runs,
            self.estimate_seconds,
            self.estimate_runs,
            self.look_seconds,
            self.load_seconds,
            self.energy_ratio,
            self.relative_mse,
            self.relative_mse_trimmed,
            self.p999_relative,
        )
    }

    fn parse(line: &str) -> Result<Self, Failure> {
        let fields = Fields::of(line, HEADER)?;
        Ok(Self {
            scene: fields.text(0).to_owned(),
            estimate: fields.text(1).to_owned(),
            setting: fields.text(2).to_owned(),
            photons: fields.number(3)?,
            stored: fields.number(4)?,
            trace_seconds: fields.number(5)?,
            trace_runs: fields.number(6)?,
            estimate_seconds: fields.number(7)?,
            estimate_runs: fields.number(8)?,
            look_seconds: fields.number(9)?,
            load_seconds: fields.number(10)?,
            energy_ratio: fields.number(11)?,
            relative_mse: fields.number(12)?,
            relative_mse_trimmed: fields.number(13)?,
            noise_free: match (fields.text(14), fields.text(15)) {
                ("", "") => None,
                _ => Some(Estimated {
                    value: fields.number(14)?,
                    standard_error: fields.number(15)?,
                }),
            },
            p999_relative: fields.number(16)?,
            flip: match fields.text(17) {
                "" => None,
                _ => Some(fields.number(17)?),
            },
            conditions: Conditions {
                threads: fields.number(18)?,
                machine: fields.text(19).to_owned(),
                date: fields.text(20).to_owned(),
                commit: fields.text(21).to_owned(),
            },
        })
    }
}

/// Writes rows as CSV.
#[must_use]
pub fn to_csv(rows: &[Row]) -> String {
    let mut text = format!("{HEADER}\n");
    for row in rows {
        let _ = writeln!(text, "{}", row.line());
    }
    text
}

/// Reads rows that [`to_csv`] wrote.
///
/// # Errors
/// At the first malformed line.
pub fn from_csv(text: &str) -> Result<Vec<Row>, Failure> {
    if text.lines().next() != Some(HEADER) {
        return Err("the first line does not name the scoreboard's columns".into());
    }
    text.lines().skip(1).map(Row::parse).collect()
}

/// Another renderer's picture of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerRow {
    /// The renderer, and which of its methods.
    pub peer: String,
    /// The scene.
    pub scene: String,
    /// How much work it was given.
    pub setting: String,
    /// Wall-clock seconds, scene load excluded.
    pub seconds: f64,
    /// Relative mean squared error.
    pub relative_mse: f64,
    /// The same without the 1 % of pixels where it is largest.
    pub relative_mse_trimmed: f64,
}

/// Reads the table of other renderers.
///
/// # Errors
/// If a column is missing or a number malformed.
pub fn peers_from_csv(text: &str) -> Result<Vec<PeerRow>, Failure> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| {
        header
            .iter()
            .position(|it| *it == name)
            .ok_or_else(|| Failure::from(format!("no column {name}")))
    };
    let text_columns = [column("peer")?, column("scene")?, column("setting")?];
    let number_columns = [
        column("seconds")?,
        column("relmse")?,
        column("relmse_trim1")?,
    ];
    lines
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let field = |index: usize| fields.get(index).copied().unwrap_or_default();
            let number = |index: usize| -> Result<f64, Failure> {
                field(index)
                    .parse()
                    .map_err(|_| format!("not a number in: {line}").into())
            };
            let [peer, scene, setting] = text_columns.map(|index| field(index).to_owned());
            Ok(PeerRow {
                peer,
                scene,
                setting,
                seconds: number(number_columns[0])?,
                relative_mse: number(number_columns[1])?,
                relative_mse_trimmed: number(number_columns[2])?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> Row {
        Row {
            scene: "s".into(),
            estimate: "nearest".into(),
            setting: "k 50 cone".into(),
            photons: 65_536,
            stored: 60_000,
            trace_seconds: 0.25,
            trace_runs: 5,
            estimate_seconds: 0.5,
            estimate_runs: 3,
            look_seconds: 0.125,
            load_seconds: 1.0,
            energy_ratio: 1.0,
            relative_mse: 0.0625,
            relative_mse_trimmed: 0.03125,
            noise_free: None,
            p999_relative: 2.0,
            flip: None,
            conditions: Conditions {
                threads: 2,
                machine: "m".into(),
                date: "2000-01-01".into(),
                commit: "c".into(),
            },
        }
    }

    #[test]
    fn rows_survive_their_file() {
        let rows = [
            row(),
            Row {
                flip: Some(0.5),
                ..row()
            },
            Row {
                // Chance may take more from a small error than there is.
                noise_free: Some(Estimated {
                    value: -0.0625,
                    standard_error: 0.125,
                }),
                ..row()
            },
        ];
        assert_eq!(from_csv(&to_csv(&rows)).unwrap(), rows);
    }

    #[test]
    fn malformed_files_are_refused() {
        let text = to_csv(&[row()]);
        assert!(from_csv(&text.replace("65536", "many")).is_err());
        assert!(from_csv(&text.replace(",nearest", "")).is_err());
        assert!(from_csv("peer,scene\n").is_err());
        // A value wants its standard error.
        assert!(text.contains(",3.125000e-2,,,"));
        assert!(from_csv(&text.replace(",3.125000e-2,,,", ",3.125000e-2,1,,")).is_err());
        assert!(peers_from_csv("peer,scene,setting,seconds,relmse\n").is_err());
    }

    #[test]
    fn the_table_of_other_renderers_is_read() {
        let peers = peers_from_csv(include_str!("../data/peers.csv")).unwrap();
        let first = &peers[0];
        assert_eq!((first.peer.as_str(), first.seconds), ("cycles-mnee", 0.473));
        assert_eq!(
            (first.relative_mse, first.relative_mse_trimmed),
            (10.494, 0.46263)
        );
    }
}
