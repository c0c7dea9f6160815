//! One scene's rows.

use std::path::Path;

use caustics::CausticsOptions;
use caustics::filter::{Comparison, Image, write_exr};
use caustics::render::{Estimate, splat};
use caustics::trace::{PhotonMap, TraceOptions, trace_photons};
use caustics_benches::counted::Counted;
use caustics_benches::flip::Flip;
use caustics_benches::noise::{FLOOR, error_without_noise};
use caustics_benches::receivers::{Receiver, receivers};
use caustics_benches::score::{Conditions, Row};
use caustics_benches::stage::{Failure, Stage};
use caustics_benches::timing::{Patience, Timed, median_after, median_of};

use crate::arguments::Arguments;
use crate::nearest_search::{best_options, image_of};

/// What the pixels see as lookups want it, how long it took, and how long a G-buffer took.
struct Views {
    look_seconds: f64,
    receivers: Timed<Vec<Receiver>>,
}

impl Views {
    fn of(stage: &Stage, patience: Patience) -> Result<Self, Failure> {
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let look_seconds = median_of(patience, || stage.g_buffer())?.seconds;
        let receivers = median_of(patience, || {
            Ok::<_, Failure>(receivers(stage, width, height))
        })?;
        Ok(Self {
            look_seconds,
            receivers,
        })
    }
}

/// Times and scores the estimates that were asked for on one scene; with a counted picture of it,
/// without the reference's noise, too.
pub(crate) fn measure(
    stage: &Stage,
    counted: Option<&Counted>,
    arguments: &Arguments,
    conditions: &Conditions,
) -> Result<Vec<Row>, Failure> {
    let patience = arguments.patience;
    let views = Views::of(stage, patience)?;
    let mut flip = Flip::new(&stage.reference)?;
    let mut cases: Vec<(u32, Estimate)> = Vec::new();
    for &estimate in &arguments.estimates {
        cases.extend(
            arguments
                .counts_of(estimate)
                .into_iter()
                .map(|count| (count, estimate)),
        );
    }
    cases.sort_by_key(|&(count, estimate)| (count, estimate.sequence().name(), estimate.name()));

    let mut rows = Vec::new();
    let mut traced: Option<(TraceOptions, Timed<PhotonMap>)> = None;
    for (photons, estimate) in cases {
        let mut options = CausticsOptions::for_estimate(estimate);
        options.trace.photons = photons;
        // Estimates that trace alike share their photons.
        let map = match traced.take() {
            Some((of, map)) if of == options.trace => map,
            // What was traced before is let go first: millions of photons fill memory.
            _ => median_of(patience, || {
                trace_photons(&stage.world, &stage.intersector, &options.trace, &|_| {})
            })?,
        };
        let (image, setting, look_seconds) =
            estimated(stage, &views, &map.value, estimate, &options, patience)?;
        let name = format!("{}-{}-{photons}", stage.name, estimate.name());
        if let Some(folder) = &arguments.images {
            write_exr(Path::new(folder).join(format!("{name}.exr")), &image.value)?;
        }
        flip.add(&name, &image.value)?;
        let comparison = Comparison::new(&image.value, &stage.reference)?;
        if comparison.non_finite > 0 {
            eprintln!("{name}: {} values are not finite", comparison.non_finite);
        }
        let noise_free = counted
            .map(|counted| error_without_noise(&image.value, &stage.reference, counted, FLOOR))
            .transpose()?;
        let row = Row {
            scene: stage.name.clone(),
            estimate: estimate.name().to_owned(),
            setting,
            photons,
            stored: map.value.photons.len() as u64,
            trace_seconds: map.seconds,
            trace_runs: map.runs,
            estimate_seconds: image.seconds,
            estimate_runs: image.runs,
            look_seconds,
            load_seconds: stage.load_seconds,
            energy_ratio: comparison.energy_ratio,
            relative_mse: comparison.relative_mse,
            relative_mse_trimmed: comparison.relative_mse_trimmed,
            noise_free,
            p999_relative: comparison.p999_relative,
            flip: None,
            conditions: conditions.clone(),
        };
        eprintln!(
            "{name:<40} trace {:8.3} s  estimate {:8.3} s  relMSE {:.5}  trimmed {:.5}  \
             energy {:.4}  {}",
            row.trace_seconds,
            row.estimate_seconds,
            row.relative_mse,
            row.relative_mse_trimmed,
            row.energy_ratio,
            row.setting,
        );
        rows.push(row);
        traced = Some((options.trace, map));
    }
    for (row, value) in rows.iter_mut().zip(flip.evaluate()) {
        row.flip = value;
    }
    Ok(rows)
}

/// The picture, what was chosen for it, and how long it took to find out what the pixels see.
fn estimated(
    stage: &Stage,
    views: &Views,
    map: &PhotonMap,
    estimate: Estimate,
    options: &CausticsOptions,
    patience: Patience,
) -> Result<(Timed<Image>, String, f64), Failure> {
    if estimate == Estimate::Nearest {
        let receivers = &views.receivers.value;
        let best = best_options(stage, &map.photons, receivers)?;
        let image = median_of(patience, || image_of(stage, &map.photons, receivers, &best))?;
        let setting = format!("k {} {}", best.count, best.kernel);
        Ok((image, setting, views.receivers.seconds))
    } else {
        // Each into a buffer of its own, as in a game whose camera moves: the first splat into a buffer
        // takes longer, since it makes what those that follow find there.
        let image = median_after(
            patience,
            || stage.g_buffer(),
            |buffer| splat(buffer, &map.photons, &options.footprint).map(|(image, _)| image),
        )?;
        Ok((image, String::new(), views.look_seconds))
    }
}
