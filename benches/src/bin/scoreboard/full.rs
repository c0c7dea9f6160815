//! Caustics seen through glass and in mirrors as well, against the references that show them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use caustics::CausticsOptions;
use caustics::filter::{Comparison, read_exr, write_exr};
use caustics::render::{
    CausticSource, Estimate, NearestEstimate, PictureOptions, Visibility, render,
};
use caustics::trace::trace_photons;
use caustics_benches::score::{Conditions, Row, from_csv, to_csv};
use caustics_benches::stage::{Failure, Stage, scene_folder};
use caustics_benches::timing::median_of;

use crate::arguments::Arguments;
use crate::tables::figure;

/// The scenes with such references.
const SCENES: [&str; 3] = ["p01_sphere", "p08_square", "p10_torus_cube"];

/// Eye rays a pixel.
const SAMPLES: u32 = 16;

/// The estimates that are compared.
const ESTIMATES: [Estimate; 2] = [Estimate::Nearest, Estimate::GridGaussian];

/// Measures what was asked for, and returns all rows there are.
pub(crate) fn rows(arguments: &Arguments, conditions: &Conditions) -> Result<Vec<Row>, Failure> {
    let mut rows = if arguments.full_csv.exists() {
        from_csv(&fs::read_to_string(&arguments.full_csv)?)?
    } else {
        Vec::new()
    };
    if arguments.measures_full {
        for name in SCENES {
            if arguments.scenes.iter().any(|scene| scene == name) {
                crate::replace(&mut rows, measure(name, arguments, conditions)?);
                fs::write(&arguments.full_csv, to_csv(&rows))?;
            }
        }
    }
    Ok(rows)
}

fn measure(
    name: &str,
    arguments: &Arguments,
    conditions: &Conditions,
) -> Result<Vec<Row>, Failure> {
    let mut stage = Stage::load(name)?;
    stage.reference = read_exr(scene_folder().join(format!("reference/{name}.full.exr")))?;
    let size = PictureOptions {
        width: stage.reference.width(),
        height: stage.reference.height(),
        samples: SAMPLES,
        visibility: Visibility::Full,
        ..PictureOptions::default()
    };
    let mut rows = Vec::new();
    for &photons in &arguments.photons {
        for estimate in ESTIMATES {
            let mut options = CausticsOptions::for_estimate(estimate);
            options.trace.photons = photons;
            let map = median_of(arguments.patience, || {
                trace_photons(&stage.world, &stage.intersector, &options.trace, &|_| {})
            })?;
            let photons_stored = &map.value.photons;
            let picture = median_of(arguments.patience, || {
                let nearest;
                let source = if estimate == Estimate::Nearest {
                    nearest = NearestEstimate::new(photons_stored, &options.nearest)?;
                    CausticSource::Nearest(&nearest)
                } else {
                    CausticSource::Footprints {
                        photons: photons_stored,
                        options: &options.footprint,
                    }
                };
                let (world, rays) = (&stage.world, &stage.intersector);
                render(world, rays, &stage.camera, source, &size, &|_| {})
            })?;
            let image = &picture.value.caustics;
            if let Some(folder) = &arguments.images {
                let file = format!("{name}.full-{}-{photons}.exr", estimate.name());
                write_exr(Path::new(folder).join(file), image)?;
            }
            let comparison = Comparison::new(image, &stage.reference)?;
            rows.push(Row {
                scene: name.to_owned(),
                estimate: estimate.name().to_owned(),
                setting: format!("{SAMPLES} samples"),
                photons,
                stored: photons_stored.len() as u64,
                trace_seconds: map.seconds,
                trace_runs: map.runs,
                estimate_seconds: picture.seconds,
                estimate_runs: picture.runs,
                look_seconds: 0.0,
                load_seconds: stage.load_seconds,
                energy_ratio: comparison.energy_ratio,
                relative_mse: comparison.relative_mse,
                relative_mse_trimmed: comparison.relative_mse_trimmed,
                noise_free: None,
                p999_relative: comparison.p999_relative,
                flip: None,
                conditions: conditions.clone(),
            });
        }
    }
    Ok(rows)
}

/// The table of `docs/accuracy.md`.
pub(crate) fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | photons | estimate | relMSE | trimmed | p99.9 | energy | trace s | picture s |\n\
         | --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    let mut rows: Vec<&Row> = rows.iter().collect();
    rows.sort_by_key(|row| (&row.scene, row.photons, &row.estimate));
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {:.4} | {} | {} |",
            row.scene,
            row.photons,
            row.estimate,
            figure(row.relative_mse),
            figure(row.relative_mse_trimmed),
            figure(row.p999_relative),
            row.energy_ratio,
            figure(row.trace_seconds),
            figure(row.estimate_seconds),
        );
    }
    text
}
