//! The references' own noise, told by a counted picture of each scene.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use caustics::filter::{energy_ratio, write_exr};
use caustics::render::Estimate;
use caustics_benches::counted::Counted;
use caustics_benches::fields::Fields;
use caustics_benches::noise::{Estimated, FLOOR, reference_noise};
use caustics_benches::score::{Conditions, Row};
use caustics_benches::stage::{Failure, Stage};

use crate::arguments::Arguments;
use crate::tables::{common_counts, figure, find};

/// The part of the mean that steadies the relMSE of [`BY_HALVES`].
const HALVES_FLOOR: f64 = 0.01;

/// The noise that came with each reference: as it follows from how far two halves of its photons
/// are apart.
const BY_HALVES: [(&str, f64); 10] = [
    ("p01_sphere", 0.000_774),
    ("p02_sphere_box", 0.001_38),
    ("p03_cognac", 0.002_95),
    ("p04_sphere_in_box", 0.001_73),
    ("p05_brass_ring", 0.000_294),
    ("p06_wave_plane", 0.000_641),
    ("p07_pool", 0.000_643),
    ("p08_square", 0.002_21),
    ("p09_cornell", 0.001_62),
    ("p10_torus_cube", 0.002_80),
];

/// One reference's noise.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NoiseRow {
    scene: String,
    /// Photons of the counted picture.
    photons: u32,
    /// Seconds that it took.
    seconds: f64,
    /// Its sum over the reference's.
    energy_ratio: f64,
    /// Steadied as relMSE is.
    noise: Estimated,
    /// Steadied as that from halves is.
    noise_as_halves: Estimated,
    date: String,
    commit: String,
}

const HEADER: &str = "scene,counted_photons,counted_seconds,energy_ratio,noise,noise_se,\
noise_floor001,noise_floor001_se,date,commit";

impl NoiseRow {
    fn line(&self) -> String {
        format!(
            "{},{},{:.1},{:.5},{:.6e},{:.3e},{:.6e},{:.3e},{},{}",
            self.scene,
            self.photons,
            self.seconds,
            self.energy_ratio,
            self.noise.value,
            self.noise.standard_error,
            self.noise_as_halves.value,
            self.noise_as_halves.standard_error,
            self.date,
            self.commit,
        )
    }

    fn parse(line: &str) -> Result<Self, Failure> {
        let fields = Fields::of(line, HEADER)?;
        let estimated = |index: usize| -> Result<Estimated, Failure> {
            Ok(Estimated {
                value: fields.number(index)?,
                standard_error: fields.number(index + 1)?,
            })
        };
        Ok(Self {
            scene: fields.text(0).to_owned(),
            photons: fields.number(1)?,
            seconds: fields.number(2)?,
            energy_ratio: fields.number(3)?,
            noise: estimated(4)?,
            noise_as_halves: estimated(6)?,
            date: fields.text(8).to_owned(),
            commit: fields.text(9).to_owned(),
        })
    }
}

fn to_csv(rows: &[NoiseRow]) -> String {
    let mut text = format!("{HEADER}\n");
    for row in rows {
        let _ = writeln!(text, "{}", row.line());
    }
    text
}

fn from_csv(text: &str) -> Result<Vec<NoiseRow>, Failure> {
    if text.lines().next() != Some(HEADER) {
        return Err("the first line does not name the columns of references' noise".into());
    }
    text.lines().skip(1).map(NoiseRow::parse).collect()
}

/// What has been measured before.
pub(crate) fn rows(arguments: &Arguments) -> Result<Vec<NoiseRow>, Failure> {
    if arguments.noise_csv.exists() {
        from_csv(&fs::read_to_string(&arguments.noise_csv)?)
    } else {
        Ok(Vec::new())
    }
}

/// Measures one reference's noise, and keeps it.
pub(crate) fn measure(
    rows: &mut Vec<NoiseRow>,
    stage: &Stage,
    counted: &Counted,
    arguments: &Arguments,
    conditions: &Conditions,
) -> Result<(), Failure> {
    let picture = counted.picture();
    if let Some(folder) = &arguments.images {
        let file = format!("{}-counted.exr", stage.name);
        write_exr(Path::new(folder).join(file), &picture)?;
    }
    let row = NoiseRow {
        scene: stage.name.clone(),
        photons: counted.photons,
        seconds: counted.seconds,
        energy_ratio: energy_ratio(&picture, &stage.reference)?,
        noise: reference_noise(&stage.reference, counted, FLOOR)?,
        noise_as_halves: reference_noise(&stage.reference, counted, HALVES_FLOOR)?,
        date: conditions.date.clone(),
        commit: conditions.commit.clone(),
    };
    eprintln!(
        "{} counted in {:.1} s: energy {:.5}, noise {:.6} +- {:.6}",
        row.scene, row.seconds, row.energy_ratio, row.noise.value, row.noise.standard_error,
    );
    rows.retain(|old| old.scene != row.scene);
    rows.push(row);
    rows.sort_by(|a, b| a.scene.cmp(&b.scene));
    fs::write(&arguments.noise_csv, to_csv(rows))?;
    Ok(())
}

/// The table of `docs/accuracy.md`.
///
/// The noise is the relMSE of the default estimate's best row less what that is without noise, which
/// is far surer than what counted pictures tell alone: its difference from the truth is small.
pub(crate) fn table(noises: &[NoiseRow], rows: &[Row]) -> String {
    let most = common_counts(rows).last().copied().unwrap_or(0);
    let mut text = String::from(
        "| scene | noise | of the default's relMSE | energy | counted alone | counted alone, floor \
         0.01 | from halves, floor 0.01 |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for (scene, by_halves) in BY_HALVES {
        let ours = find(rows, scene, Estimate::default().name(), most);
        let noise = ours.and_then(|ours| Some(noise_in(ours, ours.noise_free?)));
        let alone = noises.iter().find(|noise| noise.scene == scene);
        if noise.is_none() && alone.is_none() {
            continue;
        }
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        let share = noise
            .zip(ours)
            .map(|(noise, ours)| format!("{:.0} %", 100.0 * noise.value / ours.relative_mse));
        let _ = writeln!(
            text,
            "| {scene} | {} | {} | {} | {} | {} | {} |",
            or_none(noise.map(with_error)),
            or_none(share),
            or_none(alone.map(|it| format!("{:.4}", it.energy_ratio))),
            or_none(alone.map(|it| with_error(it.noise))),
            or_none(alone.map(|it| with_error(it.noise_as_halves))),
            figure(by_halves),
        );
    }
    text
}

/// What of a row's error is the reference's noise.
fn noise_in(row: &Row, noise_free: Estimated) -> Estimated {
    Estimated {
        value: row.relative_mse - noise_free.value,
        standard_error: noise_free.standard_error,
    }
}

/// A number with its standard error, to the error's second digit.
fn with_error(of: Estimated) -> String {
    if !(of.standard_error > 0.0 && of.standard_error.is_finite()) {
        return figure(of.value);
    }
    let places = (1.0 - of.standard_error.log10().floor()).max(0.0) as usize;
    format!("{:.places$} ± {:.places$}", of.value, of.standard_error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_benches::score;
    use caustics_benches::stage::SCENES;

    fn row() -> NoiseRow {
        NoiseRow {
            scene: "p06_wave_plane".into(),
            photons: 32_000_000,
            seconds: 20.0,
            energy_ratio: 1.0,
            noise: Estimated {
                value: 0.000_313,
                standard_error: 0.000_013,
            },
            noise_as_halves: Estimated {
                value: 0.000_38,
                standard_error: 0.000_25,
            },
            date: "2000-01-01".into(),
            commit: "c".into(),
        }
    }

    #[test]
    fn rows_survive_their_file() {
        assert_eq!(from_csv(&to_csv(&[row()])).unwrap(), [row()]);
    }

    #[test]
    fn malformed_files_are_refused() {
        let text = to_csv(&[row()]);
        assert!(from_csv(&text.replace("32000000", "many")).is_err());
        assert!(from_csv(&text.replace(",2000-01-01", "")).is_err());
        assert!(from_csv("scene,noise\n").is_err());
    }

    /// One row of the scoreboard, with its columns up to the conditions.
    fn scored(estimate: &str, noise_free: &str) -> String {
        format!(
            "p06_wave_plane,{estimate},,2000000,1,1,1,1,1,1,1,1,4e-4,3e-4,{noise_free},2e-1,,2,m,d,c"
        )
    }

    fn scoreboard(noise_free: &str) -> Vec<Row> {
        let header = score::to_csv(&[]);
        let lines = [
            header.trim_end().to_owned(),
            scored("grid-gaussian", noise_free),
            scored("nearest", ","),
        ];
        score::from_csv(&lines.join("\n")).unwrap()
    }

    fn last_line(noises: &[NoiseRow], rows: &[Row]) -> String {
        table(noises, rows).lines().last().unwrap().to_owned()
    }

    #[test]
    fn the_table_has_what_was_measured() {
        assert_eq!(
            last_line(&[row()], &scoreboard("1e-4,1.5e-5")),
            "| p06_wave_plane | 0.000300 ± 0.000015 | 75 % | 1.0000 | 0.000313 ± 0.000013 \
             | 0.00038 ± 0.00025 | 0.000641 |"
        );
        assert_eq!(
            last_line(&[row()], &scoreboard(",")),
            "| p06_wave_plane | – | – | 1.0000 | 0.000313 ± 0.000013 \
             | 0.00038 ± 0.00025 | 0.000641 |"
        );
        assert_eq!(
            last_line(&[], &scoreboard("1e-4,1.5e-5")),
            "| p06_wave_plane | 0.000300 ± 0.000015 | 75 % | – | – | – | 0.000641 |"
        );
        assert!(last_line(&[], &scoreboard(",")).starts_with("| --- |"));
    }

    #[test]
    fn every_reference_came_with_its_noise() {
        assert_eq!(BY_HALVES.map(|(scene, _)| scene), SCENES);
    }
}
