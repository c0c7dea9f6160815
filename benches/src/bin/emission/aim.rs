//! Rays for the same error, aimed and not.

use std::fmt::Write as _;
use std::time::Instant;

use caustics::accel::BvhOptions;
use caustics::filter::{Image, relative_errors, relative_mse, trimmed_mean};
use caustics::prelude::*;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::trace::{EmissionBatch, EmissionPlan, ProjectionMap, trace_photons};
use caustics_benches::stage::{Failure, SCENES, Stage};
use glam::Vec3;

use crate::view::{balls, camera_over};

/// Photons aimed at casters' outlines, whose error the others have to reach.
const PHOTONS: u32 = 1 << 14;

/// The most photons that are tried.
const LIMIT: u32 = 1 << 21;

/// Photons in the comparison with and without projection maps.
const MAPPED: u32 = 1 << 18;

/// Photons of the reference of the scene that is made here.
const TRUE_PHOTONS: u32 = 1 << 20;

/// The part of the worst pixels that is left out: single ones that no estimate finds would decide.
const TRIM: f64 = 0.01;

/// Pixels along each side of that scene's picture.
const SIZE: u32 = 256;

struct Traced {
    image: Image,
    error: f64,
    rays: u64,
    seconds: f64,
}

fn traced(stage: &Stage, buffer: &GBuffer, aim: Aim, photons: u32) -> Result<Traced, Failure> {
    let options = TraceOptions {
        photons,
        aim,
        ..TraceOptions::default()
    };
    let start = Instant::now();
    let map = trace_photons(&stage.world, &stage.intersector, &options, &|_| {})?;
    let seconds = start.elapsed().as_secs_f64();
    let (image, _) = splat(buffer, &map.photons, &FootprintOptions::default())?;
    Ok(Traced {
        error: trimmed_mean(&relative_errors(&image, &stage.reference)?, TRIM),
        image,
        rays: map.ledger.rays,
        seconds,
    })
}

/// The least of a doubling number of photons that reaches an error, its rays interpolated between
/// the last two on a logarithmic scale.
fn reaching(
    stage: &Stage,
    buffer: &GBuffer,
    aim: Aim,
    error: f64,
) -> Result<Option<(u64, f64)>, Failure> {
    let mut before: Option<Traced> = None;
    let mut photons = PHOTONS / 2;
    while photons <= LIMIT {
        let now = traced(stage, buffer, aim, photons)?;
        if now.error <= error {
            let Some(before) = before else {
                return Ok(Some((now.rays, now.seconds)));
            };
            let part = (before.error / error).ln() / (before.error / now.error).ln();
            let between = |a: f64, b: f64| a * (b / a).powf(part);
            let rays = between(before.rays as f64, now.rays as f64);
            return Ok(Some((rays as u64, between(before.seconds, now.seconds))));
        }
        before = Some(now);
        photons *= 2;
    }
    Ok(None)
}

/// Three glass balls of which each lamp sees some behind others, so that their cones overlap, and a
/// sun besides: no scene of the files has that.
fn row_of_balls() -> Result<Stage, Failure> {
    let centers = [-0.7f32, 0.0, 0.6].map(|x| Vec3::new(x, 0.6 + 0.3 * x, -0.2 * x));
    let lights = [
        Light::point([3.0, 2.6, 0.2], [40.0; 3])?,
        Light::spot([-2.0, 2.2, 0.8], [2.0, -1.6, -0.8], [60.0; 3], 0.5, 0.8)?,
        Light::directional([0.6, -1.0, -0.1], [2.0; 3])?,
    ];
    let scene = balls(&centers, 0.3, &lights)?;
    let camera = camera_over(Vec3::ZERO)?;
    let world = World::new(&scene)?;
    let intersector = world.intersector(&BvhOptions::default())?;
    let buffer = GBuffer::new(&world, &intersector, &camera, SIZE, SIZE)?;
    let options = TraceOptions {
        photons: TRUE_PHOTONS,
        ..TraceOptions::default()
    };
    let map = trace_photons(&world, &intersector, &options, &|_| {})?;
    let (reference, _) = splat(&buffer, &map.photons, &FootprintOptions::default())?;
    Ok(Stage {
        name: "three balls, overlapping".to_owned(),
        world,
        intersector,
        camera,
        reference,
        load_seconds: 0.0,
    })
}

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Aiming: rays for the same error\n\n\
        {PHOTONS} photons aimed at the casters (so few that projection maps do not pay), and how \
        many times as many rays and seconds reach the same relMSE (of all but the worst 1 % of pixels) into cones around each caster, \
        and everywhere. *Apart* is the relMSE between the pictures of aimed and of unaimed photons, \
        with as many of the latter as meet glass as often (at most {LIMIT}); the second is with \
        eight times as many of both. *Over* is more than {LIMIT} photons; \
        below 1, fewer photons happened to come out better. The last scene has three \
        balls, two lamps and a sun whose cones and rectangles overlap; its reference is \
        {TRUE_PHOTONS} aimed photons.\n\n\
        | scene | relMSE | million rays | seconds | rays, cones | rays, everywhere | \
        seconds, everywhere | apart | of 8 times as many |\n\
        | --- | --: | --: | --: | --: | --: | --: | --: | --: |\n"
    );
    let files = SCENES.iter().map(|name| Stage::load(name));
    for stage in files.chain([row_of_balls()]) {
        let stage = stage?;
        let name = &stage.name;
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let buffer = GBuffer::new(
            &stage.world,
            &stage.intersector,
            &stage.camera,
            width,
            height,
        )?;
        let aimed = traced(&stage, &buffer, Aim::Casters, PHOTONS)?;
        let options = TraceOptions {
            photons: PHOTONS,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&stage.world, &stage.intersector, &options)?;
        let (mut flux, mut power) = (0.0, 0.0);
        for batch in plan.batches() {
            let aimed = batch.emitter().aimed_power().element_sum();
            flux += aimed * f64::from(batch.map().map_or(1.0, ProjectionMap::coverage));
            power = batch.emitter().power().element_sum().max(power);
        }
        let times = |found: Option<(u64, f64)>| match found {
            Some((rays, seconds)) => (
                format!("{:.1}", rays as f64 / aimed.rays as f64),
                format!("{:.1}", seconds / aimed.seconds),
            ),
            None => ("over".to_owned(), "over".to_owned()),
        };
        let (cone_rays, _) = times(reaching(&stage, &buffer, Aim::Cones, aimed.error)?);
        let (all_rays, all_seconds) =
            times(reaching(&stage, &buffer, Aim::Everywhere, aimed.error)?);
        // As many photons as have the same density where they are aimed.
        let mut apart = Vec::new();
        for factor in [1.0, 8.0] {
            let count = f64::from(PHOTONS) * factor;
            let everywhere = (count * power / flux).min(f64::from(LIMIT));
            let one = traced(&stage, &buffer, Aim::Casters, count as u32)?;
            let other = traced(&stage, &buffer, Aim::Everywhere, everywhere as u32)?;
            apart.push(relative_mse(&one.image, &other.image)?);
        }
        writeln!(
            text,
            "| {name} | {:.4} | {:.2} | {:.2} | {cone_rays} | {all_rays} | \
            {all_seconds} | {:.4} | {:.4} |",
            aimed.error,
            aimed.rays as f64 / 1e6,
            aimed.seconds,
            apart[0],
            apart[1],
        )?;
        eprintln!("  {name}");
    }
    text.push_str(&maps()?);
    Ok(text)
}

/// What projection maps do where there are enough photons for them to pay.
fn maps() -> Result<String, Failure> {
    let mut text = format!(
        "\n{MAPPED} photons into cones and rectangles, and into the marked part of them where a map \
        pays (*marked* below 100 %):\n\n\
        | scene | marked | million rays, cones | with maps | seconds, cones | with maps | relMSE, \
        cones | with maps |\n\
        | --- | --: | --: | --: | --: | --: | --: | --: |\n"
    );
    let files = SCENES.iter().map(|name| Stage::load(name));
    for stage in files.chain([row_of_balls()]) {
        let stage = stage?;
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let (world, rays) = (&stage.world, &stage.intersector);
        let buffer = GBuffer::new(world, rays, &stage.camera, width, height)?;
        let options = TraceOptions {
            photons: MAPPED,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(world, rays, &options)?;
        let count = |of: fn(&EmissionBatch) -> u32| -> f64 {
            plan.batches().iter().map(|it| f64::from(of(it))).sum()
        };
        let marked = count(EmissionBatch::count) / count(|batch| batch.points().count());
        let cones = traced(&stage, &buffer, Aim::Cones, MAPPED)?;
        let mapped = traced(&stage, &buffer, Aim::Casters, MAPPED)?;
        writeln!(
            text,
            "| {} | {:.0} % | {:.2} | {:.2} | {:.2} | {:.2} | {:.5} | {:.5} |",
            stage.name,
            100.0 * marked,
            cones.rays as f64 / 1e6,
            mapped.rays as f64 / 1e6,
            cones.seconds,
            mapped.seconds,
            cones.error,
            mapped.error,
        )?;
    }
    eprintln!("  maps");
    Ok(text)
}
