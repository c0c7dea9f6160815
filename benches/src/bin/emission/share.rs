//! What a weak light's caustic gets beside a strong one.

use std::fmt::Write as _;

use caustics::filter::relative_mse;
use caustics::prelude::*;
use caustics::trace::{EmissionPlan, trace_plan};
use caustics_benches::stage::Failure;
use glam::Vec3;

use crate::view::{View, balls, camera_over};

const PHOTONS: u32 = 1 << 16;
const TRUE_PHOTONS: u32 = 1 << 20;
const SIZE: u32 = 256;

/// Balls so far apart that neither lamp's caustic reaches the other's floor.
const CENTERS: [Vec3; 2] = [Vec3::new(0.0, 0.8, 0.0), Vec3::new(30.0, 0.8, 0.0)];

fn lamp(over: Vec3, intensity: f32) -> Result<Light, Failure> {
    let position = over + Vec3::new(0.5, 2.5, 0.3);
    Ok(Light::spot(
        position,
        over - position,
        [intensity; 3],
        0.3,
        0.4,
    )?)
}

pub(crate) fn section() -> Result<String, Failure> {
    let [strong, weak] = CENTERS;
    let lamps = [lamp(strong, 1000.0)?, lamp(weak, 1.0)?];
    let both = balls(&CENTERS, 0.5, &lamps)?;
    let mut views = Vec::new();
    for center in CENTERS {
        let camera = camera_over(center.with_y(0.0))?;
        views.push(View::new(&both, &camera, SIZE)?);
    }
    let mut truths = Vec::new();
    for (view, lamp) in views.iter().zip(lamps) {
        let alone = balls(&CENTERS, 0.5, &[lamp])?;
        let camera = camera_over(Vec3::ZERO)?;
        let alone = View::new(&alone, &camera, SIZE)?;
        let options = TraceOptions {
            photons: TRUE_PHOTONS,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&alone.world, &alone.rays, &options)?;
        let map = trace_plan(&alone.world, &alone.rays, &plan, &options, &|_| {})?;
        truths.push(view.caustics(&map.photons)?);
    }
    let mut text = format!(
        "## A strong light beside a weak one\n\n\
        Two glass balls, each under a spot light of its own, one a thousand times as bright as the \
        other; {PHOTONS} photons. relMSE of each caustic to {TRUE_PHOTONS} photons of its light \
        alone, by the floor of the shares (`TraceOptions::share_floor`; the default is 0.25).\n\n\
        | floor | photons of the strong | of the weak | relMSE, strong | relMSE, weak |\n\
        | --: | --: | --: | --: | --: |\n"
    );
    for floor in [0.0, 0.05, 0.1, 0.25, 0.5, 1.0] {
        let options = TraceOptions {
            photons: PHOTONS,
            share_floor: floor,
            ..TraceOptions::default()
        };
        let view = &views[0];
        let plan = EmissionPlan::new(&view.world, &view.rays, &options)?;
        let map = trace_plan(&view.world, &view.rays, &plan, &options, &|_| {})?;
        let mut counts = [0; 2];
        for batch in plan.batches() {
            if let caustics::trace::LightSource::Light { index } = batch.emitter().source() {
                counts[index as usize] += batch.count();
            }
        }
        let error = |index: usize| -> Result<f64, Failure> {
            Ok(relative_mse(
                &views[index].caustics(&map.photons)?,
                &truths[index],
            )?)
        };
        writeln!(
            text,
            "| {floor} | {} | {} | {:.5} | {:.5} |",
            counts[0],
            counts[1],
            error(0)?,
            error(1)?
        )?;
    }
    Ok(text)
}
