//! Building a gather over photon footprints and asking it, at the points that the camera sees, on
//! scenes whose footprints are regular, long, and long and wide. What it finds is compared with
//! the scene's reference first, and prints how many pieces and bytes it takes.

use std::hint::black_box;
use std::time::Duration;

use caustics::CausticsOptions;
use caustics::filter::relative_mse;
use caustics::render::{Estimate, FootprintGather};
use caustics::trace::trace_photons;
use caustics_benches::receivers::{gather, receivers};
use caustics_benches::stage::{Failure, Stage};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;

const SCENES: [&str; 3] = ["p06_wave_plane", "p01_sphere", "p03_cognac"];

const PHOTONS: u32 = 65_536;

/// Points asked in one round.
const POINTS: usize = 16_384;

/// An edge of a pixel, in metres: about that of the scenes' own cameras.
const PIXEL: f32 = 0.01;

/// Of what error a picture is taken for the reference's at all: a black one has nearly 1 here.
const MOST_ERROR: f64 = 0.5;

fn bench_scene(criterion: &mut Criterion, name: &str) -> Result<(), Failure> {
    let stage = Stage::load(name)?;
    let (width, height) = (stage.reference.width(), stage.reference.height());
    let mut options = CausticsOptions::for_estimate(Estimate::default());
    options.trace.photons = PHOTONS;
    let map = trace_photons(&stage.world, &stage.intersector, &options.trace, &|_| {})?;
    let light = FootprintGather::new(&map.photons, &options.footprint)?;
    println!(
        "{name}: {} footprints, {} pieces, {} bytes a footprint, {:?}",
        light.len(),
        light.pieces(),
        light.memory_bytes() / light.len().max(1),
        light.stats()
    );

    let points = receivers(&stage, width, height);
    let picture = gather(
        &points,
        width,
        height,
        || (),
        |at, ()| light.irradiance(at.position, at.normal),
    )?;
    let error = relative_mse(&picture, &stage.reference)?;
    if error > MOST_ERROR {
        return Err(format!("{name}: the gather is off by a relMSE of {error}").into());
    }

    let mut group = criterion.benchmark_group(name);
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(4));
    group.throughput(Throughput::Elements(map.photons.len() as u64));
    group.bench_function("build", |bencher| {
        bencher.iter(|| FootprintGather::new(black_box(&map.photons), &options.footprint));
    });
    let stride = points.len().div_ceil(POINTS);
    let asked: Vec<_> = points.iter().step_by(stride).collect();
    group.throughput(Throughput::Elements(asked.len() as u64));
    group.bench_function("irradiance", |bencher| {
        bencher.iter(|| -> Vec3 {
            let lit = asked
                .iter()
                .map(|at| light.irradiance(at.position, at.normal));
            lit.sum()
        });
    });
    group.bench_function("irradiance over a pixel", |bencher| {
        bencher.iter(|| -> Vec3 {
            let lit = asked.iter().map(|at| {
                let (tangent, bitangent) = at.normal.any_orthonormal_pair();
                light.irradiance_over(at.position, at.normal, [PIXEL * tangent, PIXEL * bitangent])
            });
            lit.sum()
        });
    });
    group.finish();
    Ok(())
}

fn bench(criterion: &mut Criterion) {
    for name in SCENES {
        if let Err(failure) = bench_scene(criterion, name) {
            panic!("{failure}");
        }
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
