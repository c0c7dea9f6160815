//! Photons per second of the GPU's tracer beside the CPU's, on the scenes of the tests.
//!
//! Runs on the adapter that wgpu prefers: a real GPU where there is one, else a software one. Takes
//! the number of photons as its argument (100,000 if none is given). Before anything is timed, the
//! two tracers have to store the same numbers of photons, but for one in a thousand.
//!
//! Prints a Markdown table: photons a second on both sides, their ratio, and what a frame asks of the
//! GPU. Bytes are those of the buffers, each counted once; a dispatch writes its records and reads
//! the scene through caches.

use std::error::Error;

use caustics_benches::timing::{Patience, median_of};
use caustics_scene::gltf::load_path;
use caustics_scene::{BvhOptions, World};
use caustics_trace::{EmissionPlan, Fate, TraceOptions, trace_plan};
use caustics_wgpu::{PhotonBuffers, PhotonTracer, SceneBuffers, TraceCounters, TracePlan};

const PATIENCE: Patience = Patience {
    runs: 7,
    seconds: 4.0,
};

const SCENES: [&str; 10] = [
    "p01_sphere",
    "p02_sphere_box",
    "p03_cognac",
    "p04_sphere_in_box",
    "p05_brass_ring",
    "p06_wave_plane",
    "p07_pool",
    "p08_square",
    "p09_cornell",
    "p10_torus_cube",
];

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    tracer: PhotonTracer,
}

fn main() -> Result<(), Box<dyn Error>> {
    let photons = std::env::args()
        .nth(1)
        .map_or(Ok(100_000), |it| it.parse())?;
    let (gpu, name) = pollster::block_on(open())?;
    println!(
        "{photons} photons; {name}; CPU: {} threads",
        rayon::current_num_threads()
    );
    println!();
    println!(
        "| scene | records | CPU, 10⁶/s | GPU, 10⁶/s | GPU / CPU | dispatches | scene, MB | records, MB |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut ratios = Vec::new();
    for scene in SCENES {
        ratios.push(row(&gpu, scene, photons)?);
    }
    let mean = ratios.iter().map(|it: &f64| it.ln()).sum::<f64>() / ratios.len() as f64;
    println!();
    println!("geometric mean of GPU / CPU: {:.2}", mean.exp());
    Ok(())
}

async fn open() -> Result<(Gpu, String), Box<dyn Error>> {
    let instance = wgpu::Instance::default();
    let adapter = instance
        .request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        })
        .await?;
    let info = adapter.get_info();
    let (device, queue) = adapter
        .request_device(&wgpu::DeviceDescriptor::default())
        .await?;
    let tracer = PhotonTracer::new(&device);
    let gpu = Gpu {
        device,
        queue,
        tracer,
    };
    Ok((gpu, format!("{} ({:?})", info.name, info.backend)))
}

/// Measures a scene, prints its row, and returns the ratio.
fn row(gpu: &Gpu, name: &str, photons: u32) -> Result<f64, Box<dyn Error>> {
    let path = format!("{}/../tests/scenes/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    let world = World::new(&load_path(path)?.scene)?;
    let rays = world.intersector(&BvhOptions::default())?;
    let options = TraceOptions {
        photons,
        ..TraceOptions::default()
    };
    let emission = EmissionPlan::new(&world, &rays, &options)?;
    let plan = TracePlan::of(&world, &emission, &options)?;
    let scene = SceneBuffers::new(&gpu.device, &world)?;
    let capacity = u64::from(photons) * 4;
    let buffers = PhotonBuffers::new(&gpu.device, photons, capacity.min(1_600_000) as u32)?;

    let by_cpu = || trace_plan(&world, &rays, &emission, &options, &|_| {});
    let mut dispatches = 0;
    let mut on_gpu = || -> Result<(), Box<dyn Error>> {
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        buffers.clear(&mut encoder);
        let all = 0..plan.photons();
        let work = gpu
            .tracer
            .trace(&gpu.device, &mut encoder, &scene, &plan, all, &buffers)?;
        dispatches = work.dispatches;
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    };
    // The first run also compiles the shader on some adapters.
    on_gpu()?;
    let counters = TraceCounters::new(&read(gpu, buffers.counters())?, &plan)?;
    let expected = by_cpu()?.ledger.entry(Fate::Stored).count;
    let stored = u64::from(counters.stored);
    if 1000 * stored.abs_diff(expected) > u64::from(photons) {
        return Err(format!("{name}: {stored} records, but {expected} on the CPU").into());
    }
    let cpu = median_of(PATIENCE, by_cpu)?.seconds;
    let gpu_seconds = median_of(PATIENCE, on_gpu)?.seconds;
    let speed = |seconds: f64| f64::from(plan.photons()) / seconds / 1e6;
    let ratio = cpu / gpu_seconds;
    println!(
        "| {name} | {stored} | {:.3} | {:.3} | {ratio:.2} | {dispatches} | {:.1} | {:.1} |",
        speed(cpu),
        speed(gpu_seconds),
        scene.bytes() as f64 / 1e6,
        (stored * 88) as f64 / 1e6,
    );
    Ok(ratio)
}

/// The words of a buffer.
fn read(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u32>, Box<dyn Error>> {
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
    let view = staging.get_mapped_range(..)?;
    Ok(bytemuck::cast_slice(&view).to_vec())
}
