//! The tables of the document, in Markdown.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::rows::{Row, Way};

/// Each table with its name.
pub(crate) fn all(rows: &[Row]) -> Vec<(&'static str, String)> {
    vec![
        ("conditions", conditions(rows)),
        ("accuracy", accuracy(rows)),
        ("times", times(rows)),
        ("work", work(rows)),
    ]
}

fn conditions(rows: &[Row]) -> String {
    let mut kinds = BTreeSet::new();
    for row in rows {
        let of = &row.conditions;
        kinds.insert((&of.date, &of.commit, &of.machine, of.threads, &row.adapter));
    }
    let mut table = "| date | sources | machine | CPU threads | adapter |\n\
                     | --- | --- | --- | ---: | --- |\n"
        .to_owned();
    for (date, commit, machine, threads, adapter) in kinds {
        let _ = writeln!(
            table,
            "| {date} | `{commit}` | {machine} | {threads} | {adapter} |"
        );
    }
    table
}

fn accuracy(rows: &[Row]) -> String {
    let mut table = "| scene | photons | way | relMSE | trimmed | FLIP | energy | off |\n\
                     | --- | ---: | --- | ---: | ---: | ---: | ---: | ---: |\n"
        .to_owned();
    for row in rows {
        let flip = row.flip.map_or_else(String::new, |it| format!("{it:.4}"));
        let off = if row.way == Way::Cpu {
            String::new()
        } else {
            format!("{:.1e}", row.off)
        };
        let _ = writeln!(
            table,
            "| {} | {} | {} | {} | {} | {flip} | {:.4} | {off} |",
            row.scene,
            row.photons,
            row.way.name(),
            figures(row.relative_mse),
            figures(row.trimmed),
            row.energy,
        );
    }
    table
}

/// Ratios of the GPU's times to the CPU's, turn by turn in one process.
fn times(rows: &[Row]) -> String {
    let mut table = "| pass | photons | scenes | CPU ms | GPU ms | GPU / CPU, geometric mean | least | most |\n\
                     | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n"
        .to_owned();
    let counts: BTreeSet<u32> = rows.iter().map(|row| row.photons).collect();
    type Pass = (&'static str, Way, fn(&Row) -> f64);
    let passes: [Pass; 6] = [
        ("trace", Way::Tiles, |row| row.trace),
        ("splat by tiles", Way::Tiles, |row| row.splat),
        ("splat by quads", Way::Quads, |row| row.splat),
        ("splat by quads in half floats", Way::HalfFloats, |row| {
            row.splat
        }),
        ("gather: sort", Way::Tiles, |row| row.build),
        ("gather: 16,384 points at most", Way::Tiles, |row| {
            row.gather
        }),
    ];
    for (name, way, seconds) in passes {
        for &photons in &counts {
            let of = |way: Way| {
                rows.iter()
                    .filter(move |it| it.photons == photons && it.way == way)
            };
            let pairs: Vec<[f64; 2]> = of(way)
                .filter_map(|gpu| {
                    let cpu = of(Way::Cpu).find(|cpu| cpu.scene == gpu.scene)?;
                    Some([seconds(cpu), seconds(gpu)])
                })
                .filter(|pair| pair.iter().all(|&it| it > 0.0))
                .collect();
            if pairs.is_empty() {
                continue;
            }
            let ratios = pairs.iter().map(|[cpu, gpu]| gpu / cpu);
            let mean = |values: &mut dyn Iterator<Item = f64>| {
                (values.map(f64::ln).sum::<f64>() / pairs.len() as f64).exp()
            };
            let _ = writeln!(
                table,
                "| {name} | {photons} | {} | {:.1} | {:.1} | {:.2} | {:.2} | {:.2} |",
                pairs.len(),
                1e3 * mean(&mut pairs.iter().map(|it| it[0])),
                1e3 * mean(&mut pairs.iter().map(|it| it[1])),
                mean(&mut ratios.clone()),
                ratios.clone().fold(f64::INFINITY, f64::min),
                ratios.fold(0.0, f64::max),
            );
        }
    }
    table
}

/// What a frame asks of the GPU.
fn work(rows: &[Row]) -> String {
    let mut table =
        "| scene | photons | way | landings | passes | dispatches | draws | MB moved | \
                     ms | of it without light |\n\
                     | --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n"
            .to_owned();
    for row in rows.iter().filter(|row| row.way != Way::Cpu) {
        let _ = writeln!(
            table,
            "| {} | {} | {} | {} | {} | {} | {} | {:.0} | {:.0} | {:.0} |",
            row.scene,
            row.photons,
            row.way.name(),
            row.stored,
            row.passes,
            row.dispatches,
            row.draws,
            row.moved,
            1e3 * row.splat,
            1e3 * row.empty,
        );
    }
    table
}

/// Three figures.
fn figures(value: f64) -> String {
    if !(value > 0.0 && value.is_finite()) {
        return value.to_string();
    }
    let decimals = 2 - value.log10().floor() as i32;
    format!("{value:.*}", decimals.clamp(0, 9) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_figures_are_shown() {
        assert_eq!(figures(0.001_234_5), "0.00123");
        assert_eq!(figures(12.345), "12.3");
        assert_eq!(figures(0.0), "0");
    }
}
