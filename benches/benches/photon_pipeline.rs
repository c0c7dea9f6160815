//! Photons traced, footprints splatted and points looked up, a second, on two of the public scenes.
//!
//! What each timed stage makes is compared with the scene's reference first. Photons traced without
//! differentials must land where those with them do.

use std::hint::black_box;
use std::time::Duration;

use caustics::CausticsOptions;
use caustics::accel::NearestScratch;
use caustics::filter::{Comparison, Image};
use caustics::render::{Estimate, FootprintGather, GBuffer, NearestEstimate, splat};
use caustics::trace::trace_photons;
use caustics_benches::receivers::{gather, receivers};
use caustics_benches::stage::{Failure, Stage};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

const PHOTONS: u32 = 65_536;

/// The trimmed relMSE below which a picture is taken for the reference's at all: a black one is
/// above it.
const MOST_ERROR: f64 = 0.2;

fn bench_scene(criterion: &mut Criterion, name: &str) -> Result<(), Failure> {
    let stage = Stage::load(name)?;
    let (width, height) = (stage.reference.width(), stage.reference.height());
    let mut options = CausticsOptions::for_estimate(Estimate::default());
    options.trace.photons = PHOTONS;
    let trace = || trace_photons(&stage.world, &stage.intersector, &options.trace, &|_| {});
    let map = trace()?;
    // The check moves photons at the edges of light, and weighs the last one before a silhouette.
    let mut whole_options = options.trace;
    whole_options.divide_edges = false;
    let trace_whole = || trace_photons(&stage.world, &stage.intersector, &whole_options, &|_| {});
    let mut unchecked_options = whole_options;
    unchecked_options.check_footprints = false;
    unchecked_options.guide_emission = false;
    let trace_unchecked = || {
        trace_photons(
            &stage.world,
            &stage.intersector,
            &unchecked_options,
            &|_| {},
        )
    };
    let unchecked = trace_unchecked()?;
    let mut plain_options = unchecked_options;
    plain_options.differentials = false;
    let trace_plain = || trace_photons(&stage.world, &stage.intersector, &plain_options, &|_| {});
    let plain = trace_plain()?;
    let is_alike = plain.photons.len() == unchecked.photons.len()
        && (plain.photons.iter().zip(&unchecked.photons))
            .all(|(one, other)| one.position == other.position && one.flux == other.flux);
    if !is_alike {
        return Err(format!("{name}: photons without differentials land elsewhere").into());
    }
    let photons = &map.photons;
    let points = receivers(&stage, width, height);
    let footprints = FootprintGather::new(photons, &options.footprint)?;
    let nearest = NearestEstimate::new(photons, &options.nearest)?;
    let gathered = || {
        gather(
            &points,
            width,
            height,
            || (),
            |at, ()| footprints.irradiance(at.position, at.normal),
        )
    };
    let looked_up = || {
        gather(
            &points,
            width,
            height,
            NearestScratch::new,
            |at, scratch| nearest.irradiance(at.position, at.normal, scratch),
        )
    };
    let splatted =
        |buffer: &GBuffer| splat(buffer, photons, &options.footprint).map(|(image, _)| image);

    let check = |what: &str, image: &Image| {
        let error = Comparison::new(image, &stage.reference)?.relative_mse_trimmed;
        if error < MOST_ERROR {
            Ok(())
        } else {
            Err(Failure::from(format!(
                "{name}: {what}: a trimmed relMSE of {error}"
            )))
        }
    };
    if check("a black picture", &Image::new(width, height)?).is_ok() {
        return Err(format!("{name}: a black picture passes for the reference").into());
    }
    check("the splat", &splatted(&stage.g_buffer()?)?)?;
    check("the footprint gather", &gathered()?)?;
    check("the nearest photons", &looked_up()?)?;

    let mut group = criterion.benchmark_group(name);
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(5));
    group.throughput(Throughput::Elements(u64::from(PHOTONS)));
    group.bench_function("photons traced", |bencher| {
        bencher.iter(|| black_box(trace()));
    });
    group.bench_function("photons traced, whole at edges", |bencher| {
        bencher.iter(|| black_box(trace_whole()));
    });
    group.bench_function("photons traced, footprints unchecked", |bencher| {
        bencher.iter(|| black_box(trace_unchecked()));
    });
    group.bench_function("photons traced without differentials", |bencher| {
        bencher.iter(|| black_box(trace_plain()));
    });
    group.throughput(Throughput::Elements(photons.len() as u64));
    group.bench_function("footprints splatted", |bencher| {
        // Each into a buffer of its own, whose first splat makes what later ones would find there.
        bencher.iter_batched_ref(
            || stage.g_buffer().expect("a view that was made before"),
            |buffer| black_box(splatted(buffer)),
            BatchSize::PerIteration,
        );
    });
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("points gathered from footprints", |bencher| {
        bencher.iter(|| black_box(gathered()));
    });
    group.bench_function("points gathered from nearest photons", |bencher| {
        bencher.iter(|| black_box(looked_up()));
    });
    group.finish();
    Ok(())
}

fn photon_pipeline(criterion: &mut Criterion) {
    for name in ["p03_cognac", "p06_wave_plane"] {
        if let Err(failure) = bench_scene(criterion, name) {
            panic!("{failure}");
        }
    }
}

criterion_group!(benches, photon_pipeline);
criterion_main!(benches);
