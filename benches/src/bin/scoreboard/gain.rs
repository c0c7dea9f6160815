//! The default estimate against the nearest photons, with the references' noise and without.

use std::fmt::Write as _;

use caustics::render::Estimate;
use caustics_benches::score::Row;

use crate::tables::{common_counts, figure, find, scenes, thousands};

/// The table of `docs/accuracy.md`: by what factors error and seconds fall, at the same counts.
pub(crate) fn table(rows: &[Row]) -> String {
    let counts = common_counts(rows);
    let mut text = String::from("| scene |");
    for count in &counts {
        let _ = write!(
            text,
            " {}: relMSE | without noise | trimmed | seconds |",
            thousands(u64::from(*count))
        );
    }
    text.push_str("\n| --- |");
    text.push_str(&" ---: | ---: | ---: | ---: |".repeat(counts.len()));
    text.push('\n');
    for scene in scenes(rows) {
        let _ = write!(text, "| {scene} |");
        for &count in &counts {
            let of = |estimate: Estimate| find(rows, scene, estimate.name(), count);
            match (of(Estimate::Nearest), of(Estimate::default())) {
                (Some(base), Some(ours)) => {
                    let _ = write!(
                        text,
                        " {} | {} | {} | {} |",
                        figure(base.relative_mse / ours.relative_mse),
                        gain_without_noise(base, ours),
                        figure(base.relative_mse_trimmed / ours.relative_mse_trimmed),
                        figure(base.seconds() / ours.seconds()),
                    );
                }
                _ => text.push_str(" – | – | – | – |"),
            }
        }
        text.push('\n');
    }
    text
}

/// By what factor the error falls without the reference's noise. Where ours cannot be told from
/// none, what it is at most (twice its standard error) makes the factor a bound; where the other
/// cannot be told from none either, there is no factor.
fn gain_without_noise(base: &Row, ours: &Row) -> String {
    let (Some(base), Some(ours)) = (base.noise_free, ours.noise_free) else {
        return "–".to_owned();
    };
    let least = 2.0 * ours.standard_error;
    if base.value < 2.0 * base.standard_error {
        "–".to_owned()
    } else if ours.value < least {
        format!("> {}", figure(base.value / least))
    } else {
        figure(base.value / ours.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_benches::noise::Estimated;
    use caustics_benches::score::Conditions;

    /// The default and `nearest` at one count, with errors without noise and their standard errors.
    fn rows(base: Option<[f64; 2]>, ours: Option<[f64; 2]>) -> Vec<Row> {
        let of = |estimate: Estimate, relative_mse: f64, noise_free: Option<[f64; 2]>| Row {
            scene: "s".into(),
            estimate: estimate.name().into(),
            setting: String::new(),
            photons: 1024,
            stored: 1,
            trace_seconds: 1.0,
            trace_runs: 1,
            estimate_seconds: 1.0,
            estimate_runs: 1,
            look_seconds: 0.0,
            load_seconds: 0.0,
            energy_ratio: 1.0,
            relative_mse,
            relative_mse_trimmed: relative_mse,
            noise_free: noise_free.map(|[value, standard_error]| Estimated {
                value,
                standard_error,
            }),
            p999_relative: 0.0,
            flip: None,
            conditions: Conditions {
                threads: 1,
                machine: "m".into(),
                date: "d".into(),
                commit: "c".into(),
            },
        };
        vec![
            of(Estimate::Nearest, 0.5, base),
            of(Estimate::default(), 0.25, ours),
        ]
    }

    #[test]
    fn the_gain_is_given_with_and_without_noise() {
        let line = |base, ours| table(&rows(base, ours)).lines().last().unwrap().to_owned();
        let told = line(Some([0.4, 0.01]), Some([0.1, 0.01]));
        assert_eq!(told, "| s | 2.00 | 4.00 | 2.00 | 1.00 |");
        // Ours is 0.02 at most.
        let bound = line(Some([0.4, 0.01]), Some([-0.001, 0.01]));
        assert_eq!(bound, "| s | 2.00 | > 20.0 | 2.00 | 1.00 |");
        let lost = line(Some([0.01, 0.01]), Some([-0.001, 0.01]));
        assert_eq!(lost, "| s | 2.00 | – | 2.00 | 1.00 |");
        for unmeasured in [
            line(None, None),
            line(None, Some([0.1, 0.01])),
            line(Some([0.4, 0.01]), None),
        ] {
            assert_eq!(unmeasured, "| s | 2.00 | – | 2.00 | 1.00 |");
        }
        let all = table(&rows(None, None));
        let columns = |line: &str| line.matches('|').count();
        assert!(
            all.lines()
                .all(|line| columns(line) == columns(all.lines().next().unwrap()))
        );
    }
}
