//! Tracing by the GPU beside tracing by the CPU, on the scenes of the tests, turn by turn.
//!
//! `cargo run --release -p caustics-benches --bin gpu_trace_table -- [photons] [scene ...]`
//!
//! Runs on the adapter that wgpu prefers: a real GPU where there is one, else a software one. With
//! 20,000 photons a scene if no number is given, on all scenes if none is named. Before anything is
//! timed, what landed is compared record by record; the numbers of records may differ by one in a
//! thousand.
//!
//! Writes its tables into the section `trace` of `docs/gpu.md`, if all scenes were measured, and
//! prints them. Bytes are those of the buffers, each counted once; a dispatch writes its records and
//! reads the scene through caches.

use std::path::PathBuf;

use caustics_benches::conditions::conditions;
use caustics_benches::document::rewrite;
use caustics_benches::gpu::Gpu;
use caustics_benches::stage::{Failure, SCENES, Stage};
use caustics_scene::World;
use caustics_trace::{EmissionPlan, Photon, PhotonMap, TraceOptions, trace_plan};
use caustics_wgpu::glam::Vec3;
use caustics_wgpu::{
    FootprintRecord, Hierarchy, PhotonBuffers, PhotonTracer, SceneBuffers, TraceCounters, TracePlan,
};

const ROUNDS: usize = 5;

/// What is measured of a scene.
struct Row {
    name: &'static str,
    photons: u32,
    rays: u64,
    parity: Parity,
    replaced: u64,
    divided: u64,
    dispatches: u32,
    scene_bytes: u64,
    batch_bytes: u64,
    /// Seconds, medians.
    cpu: f64,
    gpu: [f64; 2],
    /// By the wide hierarchy with no photon divided.
    whole: f64,
}

/// How far the two sides are apart.
#[derive(Default)]
struct Parity {
    records: usize,
    /// Records of which every bit is the same.
    equal: usize,
    /// The largest distance between landing points, relative to the size of the scene.
    position: f32,
    /// The largest relative difference of a flux.
    flux: f32,
    /// The largest difference of a footprint's axis, relative to the longer one.
    axes: f32,
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let photons = arguments.next().map_or(Ok(20_000), |it| it.parse())?;
    let asked: Vec<String> = arguments.collect();
    let gpu = Gpu::new()?;
    // One for each.
    let tracers = Hierarchy::ALL.map(|it| PhotonTracer::with_hierarchy(&gpu.device, it));
    let mut rows = Vec::new();
    for scene in SCENES {
        if asked.is_empty() || asked.iter().any(|it| it == scene) {
            eprintln!("{scene}");
            rows.push(measured(&gpu, &tracers, scene, photons)?);
        }
    }
    let now = conditions(&gpu.name);
    let section = format!(
        "{photons} photons a scene, medians of {ROUNDS} runs of each in turn: {}, beside {} threads \
         of the CPU; {}, commit {}.\n\n{}",
        now.machine,
        now.threads,
        now.date,
        now.commit,
        tables(&rows)
    );
    println!("{section}");
    if rows.len() == SCENES.len() {
        let path = [env!("CARGO_MANIFEST_DIR"), "../docs/gpu.md"];
        rewrite(&path.iter().collect::<PathBuf>(), &[("trace", section)])?;
    }
    Ok(())
}

fn measured(
    gpu: &Gpu,
    tracers: &[PhotonTracer; 2],
    name: &'static str,
    photons: u32,
) -> Result<Row, Failure> {
    let Stage {
        world,
        intersector: rays,
        ..
    } = Stage::load(name)?;
    let options = TraceOptions {
        photons,
        ..TraceOptions::default()
    };
    let emission = EmissionPlan::new(&world, &rays, &options)?;
    let plan = TracePlan::of(&world, &emission, &options)?;
    let whole_options = TraceOptions {
        divide_edges: false,
        ..options
    };
    let whole_plan = TracePlan::of(&world, &emission, &whole_options)?;
    let scene = SceneBuffers::new(&gpu.device, &world)?;
    let capacity = u64::from(photons) * 4;
    let buffers = PhotonBuffers::new(&gpu.device, photons, capacity.min(1_600_000) as u32)?;

    let by_cpu = || trace_plan(&world, &rays, &emission, &options, &|_| {});
    let on_gpu = |tracer: &PhotonTracer, plan: &TracePlan| -> Result<u32, Failure> {
        let work = gpu.run(|encoder| {
            buffers.clear(encoder);
            let all = 0..plan.photons();
            Ok(tracer.trace(&gpu.device, encoder, &scene, plan, all, &buffers)?)
        })?;
        Ok(work.dispatches)
    };
    let expected = by_cpu()?;
    let mut dispatches = 0;
    let mut parity = Parity::default();
    let mut replaced = 0;
    let mut divided = 0;
    // The first run also compiles the shader on some adapters.
    for tracer in tracers {
        dispatches = on_gpu(tracer, &plan)?;
        let words = gpu.read(buffers.counters(), 4 * TraceCounters::WORDS as u64)?;
        let counters = TraceCounters::new(&bytemuck::pod_collect_to_vec(&words), &plan)?;
        let bytes = u64::from(counters.stored) * size_of::<FootprintRecord>() as u64;
        let stored: Vec<FootprintRecord> =
            bytemuck::pod_collect_to_vec(&gpu.read(buffers.records(), bytes)?);
        replaced = counters.ledger.replaced_differentials;
        divided = counters.ledger.divided_photons;
        parity = compared(&world, &expected, &stored).map_err(|it| format!("{name}: {it}"))?;
    }
    let mut seconds = [const { Vec::new() }; 4];
    for _ in 0..ROUNDS {
        seconds[0].push(timed(|| Ok(by_cpu()?))?);
        for (seconds, tracer) in seconds[1..].iter_mut().zip(tracers) {
            seconds.push(timed(|| on_gpu(tracer, &plan))?);
        }
        seconds[3].push(timed(|| on_gpu(&tracers[1], &whole_plan))?);
    }
    let [cpu, binary, wide, whole] = seconds.map(|mut all| {
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    });
    Ok(Row {
        name,
        photons: plan.photons(),
        rays: expected.ledger.rays,
        parity,
        replaced,
        divided,
        dispatches,
        scene_bytes: scene.bytes(),
        batch_bytes: buffers.bytes(),
        cpu,
        gpu: [binary, wide],
        whole,
    })
}

fn timed<T>(run: impl FnOnce() -> Result<T, Failure>) -> Result<f64, Failure> {
    let start = std::time::Instant::now();
    run()?;
    Ok(start.elapsed().as_secs_f64())
}

/// Photons and records are in the same order. Where one is missing, those after it are compared with
/// others, so that all differ.
fn compared(
    world: &World,
    expected: &PhotonMap,
    found: &[FootprintRecord],
) -> Result<Parity, String> {
    let photons = &expected.photons;
    if 1000 * photons.len().abs_diff(found.len()) > photons.len() {
        return Err(format!(
            "{} records, but {} on the CPU",
            found.len(),
            photons.len()
        ));
    }
    let size = world.bounds().diagonal().length();
    let mut parity = Parity {
        records: found.len(),
        ..Parity::default()
    };
    for (photon, record) in photons.iter().zip(found) {
        let photon: &Photon = photon;
        let same = FootprintRecord::numbered(photon, record.photon);
        parity.equal += usize::from(same == *record);
        let distance = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(b.into());
        let longer = photon.axes[0].length().max(photon.axes[1].length());
        let axes = distance(record.axis_u, same.axis_u).max(distance(record.axis_v, same.axis_v));
        if axes > 0.0 {
            parity.axes = parity.axes.max(axes / longer);
        }
        let position = distance(record.position, same.position) / size;
        parity.position = parity.position.max(position);
        let flux = (record.flux() - photon.flux).abs().max_element();
        parity.flux = parity.flux.max(flux / photon.flux.max_element());
    }
    Ok(parity)
}

/// As Markdown.
fn tables(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | 10⁶ rays | CPU, 10⁶ rays/s | GPU, 10⁶ rays/s | 10³ photons/s | GPU / CPU | wide / binary hierarchy | divided / whole, time |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let rays = row.rays as f64 / 1e6;
        let [binary, wide] = row.gpu;
        text += &format!(
            "| {} | {rays:.2} | {:.2} | {:.2} | {:.0} | {:.2} | {:.2} | {:.2} |\n",
            row.name,
            rays / row.cpu,
            rays / wide,
            f64::from(row.photons) / wide / 1e3,
            row.cpu / wide,
            binary / wide,
            wide / row.whole,
        );
    }
    let mean = |ratio: fn(&Row) -> f64| {
        let sum: f64 = rows.iter().map(|row| ratio(row).ln()).sum();
        (sum / rows.len().max(1) as f64).exp()
    };
    text += &format!(
        "| geometric mean | | | | | {:.2} | {:.2} | {:.2} |\n\n",
        mean(|row| row.cpu / row.gpu[1]),
        mean(|row| row.gpu[0] / row.gpu[1]),
        mean(|row| row.gpu[1] / row.whole),
    );
    text += "| scene | records | equal in every bit | position | flux | axes | from neighbours | divided | dispatches | scene, MB | batch, MB |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for row in rows {
        let parity = &row.parity;
        text += &format!(
            "| {} | {} | {} | {:.0e} | {:.0e} | {:.0e} | {} | {} | {} | {:.1} | {:.1} |\n",
            row.name,
            parity.records,
            parity.equal,
            parity.position,
            parity.flux,
            parity.axes,
            row.replaced,
            row.divided,
            row.dispatches,
            row.scene_bytes as f64 / 1e6,
            row.batch_bytes as f64 / 1e6,
        );
    }
    text += "\n*wide / binary* is the speed of the wide hierarchy over that of the binary one, in the same\n\
             run; *divided / whole* is the time with photons divided at the edges of sheets of light over that\n\
             without. Parity is between the records of the GPU and the photons of `trace_plan` with the same\n\
             options, neighbours checked and photons divided on both sides: the largest distance of landing\n\
             points relative to the scene, of fluxes, and of footprints' axes relative to the longer one; *from neighbours* are\n\
             footprints that the check replaced. *Batch* is all memory that tracing these photons occupies\n\
             besides the scene.\n";
    text
}
