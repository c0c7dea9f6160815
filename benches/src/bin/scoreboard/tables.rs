//! The tables of `docs/accuracy.md`, from the scoreboard's rows.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use caustics::render::Estimate;
use caustics_benches::score::{PeerRow, Row};

use crate::gain;
use crate::metric::Metric;

/// All tables, by the names of their marks.
pub(crate) fn all(rows: &[Row], peers: &[PeerRow]) -> Vec<(&'static str, String)> {
    vec![
        ("conditions", conditions(rows)),
        ("baseline", baseline(rows)),
        ("gain", gain::table(rows)),
        ("winners", winners(rows)),
        ("estimates", estimates(rows)),
        ("peers", peer_table(rows, peers, Metric::RelativeMse)),
        ("peers-trimmed", peer_table(rows, peers, Metric::Trimmed)),
        ("peers-best", strongest_peers(rows, peers)),
    ]
}

/// The tables of other renderers that were measured in the same run.
pub(crate) fn of_renderers(rows: &[Row], renderers: &[PeerRow]) -> Vec<(&'static str, String)> {
    let table = |metric| peer_table(rows, renderers, metric);
    vec![
        ("renderers", table(Metric::RelativeMse)),
        ("renderers-trimmed", table(Metric::Trimmed)),
        ("renderers-best", strongest_peers(rows, renderers)),
    ]
}

/// Three significant figures.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if magnitude < -4 {
        return format!("{value:.2e}");
    }
    format!("{value:.*}", (2 - magnitude).max(0) as usize)
}

pub(crate) fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), figure)
}

pub(crate) fn scenes(rows: &[Row]) -> BTreeSet<&str> {
    rows.iter().map(|row| row.scene.as_str()).collect()
}

/// The photon counts at which estimates other than the default were measured too.
pub(crate) fn common_counts(rows: &[Row]) -> BTreeSet<u32> {
    rows.iter()
        .filter(|row| row.estimate != Estimate::default().name())
        .map(|row| row.photons)
        .collect()
}

fn conditions(rows: &[Row]) -> String {
    let mut text = String::from(
        "| rows | date | sources | machine | threads | runs of a median |\n\
         | ---: | --- | --- | --- | ---: | --- |\n",
    );
    let mut seen: Vec<&caustics_benches::score::Conditions> = Vec::new();
    for row in rows {
        if !seen.contains(&&row.conditions) {
            seen.push(&row.conditions);
        }
    }
    for of in seen {
        let alike: Vec<&Row> = rows.iter().filter(|row| row.conditions == *of).collect();
        let runs = || {
            alike
                .iter()
                .flat_map(|row| [row.trace_runs, row.estimate_runs])
        };
        let (least, most) = (runs().min().unwrap_or(0), runs().max().unwrap_or(0));
        let _ = writeln!(
            text,
            "| {} | {} | `{}` | {} | {} | {least} to {most} |",
            alike.len(),
            of.date,
            of.commit,
            of.machine,
            of.threads,
        );
    }
    text
}

fn baseline(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | photons taken, kernel | relMSE | trimmed | FLIP | energy | trace s | gather s |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    let most = common_counts(rows).last().copied().unwrap_or(0);
    for row in rows {
        if row.estimate == Estimate::Nearest.name() && row.photons == most {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {:.4} | {} | {} |",
                row.scene,
                row.setting.trim_start_matches("k "),
                figure(row.relative_mse),
                figure(row.relative_mse_trimmed),
                optional(row.flip),
                row.energy_ratio,
                figure(row.trace_seconds),
                figure(row.estimate_seconds),
            );
        }
    }
    text
}

pub(crate) fn find<'a>(
    rows: &'a [Row],
    scene: &str,
    estimate: &str,
    photons: u32,
) -> Option<&'a Row> {
    rows.iter()
        .find(|row| row.scene == scene && row.estimate == estimate && row.photons == photons)
}

/// Which estimate has the least error, and the least error times seconds, where all had the same
/// number of photons.
fn winners(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | photons | least relMSE | least trimmed | least relMSE x s | least trimmed x s |\n\
         | --- | ---: | --- | --- | --- | --- |\n",
    );
    let default = Estimate::default().name();
    for scene in scenes(rows) {
        for count in common_counts(rows) {
            let alike: Vec<&Row> = rows
                .iter()
                .filter(|row| row.scene == scene && row.photons == count)
                .collect();
            let winner = |value: &dyn Fn(&Row) -> f64| {
                let best = alike.iter().min_by(|a, b| value(a).total_cmp(&value(b)));
                let Some(best) = best else {
                    return "–".to_owned();
                };
                if best.estimate == default {
                    return "default".to_owned();
                }
                match alike.iter().find(|row| row.estimate == default) {
                    Some(ours) => format!(
                        "**{}**, by {}",
                        best.estimate,
                        figure(value(ours) / value(best))
                    ),
                    None => best.estimate.clone(),
                }
            };
            let _ = writeln!(
                text,
                "| {scene} | {} | {} | {} | {} | {} |",
                thousands(u64::from(count)),
                winner(&|row| row.relative_mse),
                winner(&|row| row.relative_mse_trimmed),
                winner(&|row| row.relative_mse * row.seconds()),
                winner(&|row| row.relative_mse_trimmed * row.seconds()),
            );
        }
    }
    text
}

fn estimates(rows: &[Row]) -> String {
    let mut text = String::new();
    for scene in scenes(rows) {
        let _ = write!(
            text,
            "{}### {scene}\n\n\
             | estimate | photons | stored | relMSE | trimmed | p99.9 | FLIP | energy | trace s \
             | estimate s |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
            if text.is_empty() { "" } else { "\n" },
        );
        for row in rows.iter().filter(|row| row.scene == scene) {
            let name = [row.estimate.as_str(), row.setting.as_str()].join(" ");
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {:.4} | {} | {} |",
                name.trim(),
                thousands(u64::from(row.photons)),
                thousands(row.stored),
                figure(row.relative_mse),
                figure(row.relative_mse_trimmed),
                figure(row.p999_relative),
                optional(row.flip),
                row.energy_ratio,
                figure(row.trace_seconds),
                figure(row.estimate_seconds),
            );
        }
    }
    text
}

/// A peer at its best on a scene, and the quickest of the default estimate's rows that is as good.
struct Race<'a> {
    peer: &'a PeerRow,
    ours: Option<&'a Row>,
}

impl Race<'_> {
    /// How many times the peer's seconds are ours.
    fn ratio(&self) -> Option<f64> {
        self.ours.map(|ours| self.peer.seconds / ours.seconds())
    }
}

fn races<'a>(rows: &'a [Row], peers: &'a [PeerRow], metric: Metric) -> Vec<Race<'a>> {
    let cases: BTreeSet<(&str, &str)> = peers
        .iter()
        .map(|row| (row.scene.as_str(), row.peer.as_str()))
        .collect();
    let mut races = Vec::new();
    for (scene, peer) in cases {
        let best = peers
            .iter()
            .filter(|row| row.scene == scene && row.peer == peer)
            .min_by(|a, b| metric.of_peer(a).total_cmp(&metric.of_peer(b)));
        let Some(peer) = best else { continue };
        let ours = rows
            .iter()
            .filter(|row| row.scene == scene && row.estimate == Estimate::default().name())
            .filter(|row| metric.of(row) <= metric.of_peer(peer))
            .min_by(|a, b| a.seconds().total_cmp(&b.seconds()));
        if rows.iter().any(|row| row.scene == scene) {
            races.push(Race { peer, ours });
        }
    }
    races
}

fn peer_table(rows: &[Row], peers: &[PeerRow], metric: Metric) -> String {
    let mut text = format!(
        "| scene | renderer | its best {} | at | its seconds | our seconds | our photons | ratio |\n\
         | --- | --- | ---: | --- | ---: | ---: | ---: | ---: |\n",
        metric.name(),
    );
    for race in races(rows, peers, metric) {
        let peer = race.peer;
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} |",
            peer.scene,
            peer.peer,
            figure(metric.of_peer(peer)),
            peer.setting,
            figure(peer.seconds),
        );
        let _ = match race.ours {
            Some(ours) => writeln!(
                text,
                " {} | {} | {} |",
                figure(ours.seconds()),
                thousands(u64::from(ours.photons)),
                optional(race.ratio()),
            ),
            None => writeln!(text, " not reached | – | – |"),
        };
    }
    text
}

/// Per scene the peer against which the ratio is least, and the one whose error is.
fn strongest_peers(rows: &[Row], peers: &[PeerRow]) -> String {
    let mut text = String::from(
        "| scene | least relMSE | of | ratio | least ratio, relMSE | against | least ratio, trimmed | against |\n\
         | --- | ---: | --- | ---: | ---: | --- | ---: | --- |\n",
    );
    let scenes: BTreeSet<&str> = peers.iter().map(|row| row.scene.as_str()).collect();
    let ratio_of = |race: &Race<'_>| {
        let ratio = race.ratio();
        ratio.map_or_else(|| "not reached".to_owned(), figure)
    };
    for scene in scenes {
        let by_error = races(rows, peers, Metric::RelativeMse);
        let of_scene = by_error.iter().filter(|race| race.peer.scene == scene);
        let error = |race: &Race<'_>| race.peer.relative_mse;
        let Some(best) = of_scene.min_by(|a, b| error(a).total_cmp(&error(b))) else {
            continue;
        };
        let strongest = |metric: Metric| {
            let races = races(rows, peers, metric);
            let of_scene = races.iter().filter(|race| race.peer.scene == scene);
            // Not being reached at all counts as a ratio of nought.
            let worst = of_scene.min_by(|a, b| {
                a.ratio()
                    .unwrap_or(0.0)
                    .total_cmp(&b.ratio().unwrap_or(0.0))
            });
            worst.map_or_else(
                || "– | –".to_owned(),
                |race| format!("{} | {}", ratio_of(race), race.peer.peer),
            )
        };
        let _ = writeln!(
            text,
            "| {scene} | {} | {} | {} | {} | {} |",
            figure(error(best)),
            best.peer.peer,
            ratio_of(best),
            strongest(Metric::RelativeMse),
            strongest(Metric::Trimmed),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits_that_count() {
        assert_eq!(figure(1234.4), "1234");
        assert_eq!(figure(12.345), "12.3");
        assert_eq!(figure(0.012_345), "0.0123");
        assert_eq!(figure(0.000_012_345), "1.23e-5");
        assert_eq!(figure(0.0), "0");
    }

    #[test]
    fn thousands_are_grouped() {
        assert_eq!(thousands(0), "0");
        assert_eq!(thousands(999), "999");
        assert_eq!(thousands(65_536), "65,536");
        assert_eq!(thousands(2_000_000), "2,000,000");
    }
}
