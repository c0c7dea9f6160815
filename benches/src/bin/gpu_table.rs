//! How long the GPU takes for a frame's caustics, beside the CPU, in one process and turn by turn.
//!
//! Prints Markdown: for each scene and number of photons the wall-clock time of tracing and of
//! splatting by tiles, by quads and by quads in half floats, each with its ratio to the CPU; what
//! the frame asks of the GPU; how far each picture is from the CPU's; and, where the device can
//! tell, its own time for each pass.
//!
//! `cargo run --release -p caustics-benches --bin gpu_table -- [scene] [photons]`

use std::time::Instant;

use caustics::accel::Intersect;
use caustics::prelude::*;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::scene::{BvhOptions, SceneIntersector, gltf};
use caustics::trace::trace_photons;
use caustics_wgpu::{
    CausticsRenderer, FootprintBatch, FootprintRecord, FrameLight, FrameParams, PhotonBuffers,
    PhotonTracer, PreparedFrame, RendererOptions, SceneBuffers, SplatMethod, SplatOptions,
    SplatStats, SurfaceInput, TracePlan, ViewParams, camera_matrix,
};

type Failure = Box<dyn std::error::Error>;

const SIZE: [u32; 2] = [640, 480];
const ROUNDS: usize = 5;
const SCENES: [&str; 3] = ["p03_cognac", "p07_pool", "p09_cornell"];
const PHOTONS: [u32; 2] = [20_000, 100_000];

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let filter = arguments.next().unwrap_or_default();
    let photons: Option<u32> = arguments.next().map(|it| it.parse()).transpose()?;
    let gpu = Gpu::new()?;
    println!(
        "{}, {} x {} pixels, median of {ROUNDS}\n",
        gpu.name, SIZE[0], SIZE[1]
    );
    for name in SCENES.iter().filter(|name| name.contains(&filter)) {
        for count in PHOTONS
            .iter()
            .filter(|&&it| photons.is_none_or(|most| it <= most))
        {
            measure(&gpu, name, *count)?;
        }
    }
    Ok(())
}

struct Gpu {
    name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Gpu {
    fn new() -> Result<Self, Failure> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions::default();
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: CausticsRenderer::used_features() & adapter.features(),
            required_limits: CausticsRenderer::required_limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        Ok(Self {
            name: adapter.get_info().name,
            device,
            queue,
        })
    }

    /// Milliseconds until the GPU has done what is recorded.
    fn run<T>(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<T, Failure>,
    ) -> Result<(T, f64), Failure> {
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let start = Instant::now();
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.device.create_command_encoder(&descriptor);
        let value = record(&mut encoder)?;
        self.queue.submit([encoder.finish()]);
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok((value, 1e3 * start.elapsed().as_secs_f64()))
    }

    fn read(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Failure> {
        let target = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("reading"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.run(|encoder| {
            encoder.copy_buffer_to_buffer(source, 0, &target, 0, bytes);
            Ok(())
        })?;
        self.map(&target)
    }

    fn map(&self, target: &wgpu::Buffer) -> Result<Vec<u8>, Failure> {
        let (sender, receiver) = std::sync::mpsc::channel();
        target
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                // Nobody waits any more: nothing to tell.
                let _ = sender.send(result);
            });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receiver.recv()??;
        Ok(target.slice(..).get_mapped_range()?.to_vec())
    }

    fn buffer(&self, bytes: &[u8]) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("light"),
            size: bytes.len().max(80) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    fn texture(&self, format: wgpu::TextureFormat, bytes: &[u8]) -> wgpu::TextureView {
        let size = wgpu::Extent3d {
            width: SIZE[0],
            height: SIZE[1],
            depth_or_array_layers: 1,
        };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("receivers"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(bytes.len() as u32 / SIZE[1]),
            rows_per_image: None,
        };
        self.queue
            .write_texture(texture.as_image_copy(), bytes, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }
}

/// What a camera sees, for the GPU and to compare with.
struct Receivers {
    positions: wgpu::TextureView,
    normals: wgpu::TextureView,
    objects: wgpu::TextureView,
    albedo: Vec<[f32; 3]>,
}

impl Receivers {
    fn new(gpu: &Gpu, world: &World, rays: &SceneIntersector, camera: &Camera) -> Self {
        let count = (SIZE[0] * SIZE[1]) as usize;
        let mut positions = vec![[0.0f32; 4]; count];
        let mut normals = positions.clone();
        let mut objects = vec![0u32; count];
        let mut albedo = vec![[0.0f32; 3]; count];
        for (pixel, number) in (0..count).zip(0u32..) {
            let (x, y) = (number % SIZE[0], number / SIZE[0]);
            let ray = camera.ray(x as f32 + 0.5, y as f32 + 0.5, SIZE[0], SIZE[1]);
            let hit = rays.closest_hit(&ray);
            let Some(point) = hit.and_then(|hit| world.surface(&ray, &hit)) else {
                continue;
            };
            let surface = world.materials()[point.material as usize].surface;
            if let Surface::Diffuse { albedo: reflected } = surface {
                let side = if point.from_outside { 1.0 } else { -1.0 };
                positions[pixel] = point.spawn.position.extend(0.0).to_array();
                normals[pixel] = (side * point.geometric_normal).extend(0.0).to_array();
                objects[pixel] = point.object;
                albedo[pixel] = reflected.to_array();
            }
        }
        let wide = wgpu::TextureFormat::Rgba32Float;
        Self {
            positions: gpu.texture(wide, bytes_of(&positions)),
            normals: gpu.texture(wide, bytes_of(&normals)),
            objects: gpu.texture(wgpu::TextureFormat::R32Uint, bytes_of(&objects)),
            albedo,
        }
    }

    fn view(&self, camera: &Camera) -> ViewParams<'_> {
        let matrix = camera_matrix(camera, SIZE, 0.01, 100.0);
        let surface = SurfaceInput::Position(&self.positions);
        ViewParams {
            objects: Some(&self.objects),
            ..ViewParams::new(SIZE, matrix, surface, &self.normals)
        }
    }
}

fn bytes_of<T: bytemuck::NoUninit>(values: &[T]) -> &[u8] {
    bytemuck::cast_slice(values)
}

fn measure(gpu: &Gpu, name: &str, photons: u32) -> Result<(), Failure> {
    let path = format!("{}/../tests/scenes/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    let scene = gltf::load_path(path)?.scene;
    let world = World::new(&scene)?;
    let rays = world.intersector(&BvhOptions::default())?;
    let camera = scene.cameras().first().ok_or("no camera")?.clone();
    let options = TraceOptions {
        photons,
        ..TraceOptions::default()
    };

    let tracer = PhotonTracer::new(&gpu.device);
    let buffers = SceneBuffers::new(&gpu.device, &world)?;
    let plan = TracePlan::new(&world, &rays, &options)?;
    let into = PhotonBuffers::new(&gpu.device, photons, 4 * photons)?;
    let mut cpu_trace = Vec::new();
    let mut gpu_trace = Vec::new();
    let mut map = trace_photons(&world, &rays, &options, &|_| {})?;
    for _ in 0..2 {
        let start = Instant::now();
        map = trace_photons(&world, &rays, &options, &|_| {})?;
        cpu_trace.push(1e3 * start.elapsed().as_secs_f64());
        let (_, time) = gpu.run(|encoder| {
            into.clear(encoder);
            let work = tracer.trace(&gpu.device, encoder, &buffers, &plan, 0..photons, &into)?;
            Ok(work)
        })?;
        gpu_trace.push(time);
    }

    let receivers = Receivers::new(gpu, &world, &rays, &camera);
    let buffer = GBuffer::new(&world, &rays, &camera, SIZE[0], SIZE[1])?;
    let records: Vec<FootprintRecord> = map.photons.iter().map(FootprintRecord::from).collect();
    let light = (
        gpu.buffer(bytes_of(&records)),
        gpu.buffer(bytes_of(&[records.len() as u32])),
    );
    let quads = SplatOptions {
        method: SplatMethod::Quads,
        ..SplatOptions::default()
    };
    let half_floats = SplatOptions {
        prefer_half_floats: true,
        ..quads
    };
    let mut ways = Vec::new();
    for (way, splat) in [
        ("tiles", SplatOptions::default()),
        ("quads", quads),
        ("quads, half floats", half_floats),
    ] {
        let options = RendererOptions {
            splat,
            times_passes: true,
            ..RendererOptions::default()
        };
        ways.push(Way {
            name: way,
            renderer: CausticsRenderer::new(&gpu.device, &options)?,
            times: Vec::new(),
            frame: None,
        });
    }
    let mut cpu_splat = Vec::new();
    let mut expected = Vec::new();
    for _ in 0..ROUNDS {
        let start = Instant::now();
        let (image, _) = splat(
            &buffer,
            &map.photons,
            &FootprintOptions {
                integrate_pixels: false,
                ..FootprintOptions::default()
            },
        )?;
        cpu_splat.push(1e3 * start.elapsed().as_secs_f64());
        expected = image.into_pixels();
        for way in &mut ways {
            way.run(gpu, &receivers.view(&camera), &light)?;
        }
    }

    let (cpu_trace, gpu_trace) = (median(&mut cpu_trace), median(&mut gpu_trace));
    let cpu_splat = median(&mut cpu_splat);
    println!(
        "### {name}, {photons} photons, {} landings\n",
        records.len()
    );
    println!(
        "| what | milliseconds | times the CPU's | passes | dispatches | draws | MB moved | off |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    println!("| CPU trace | {cpu_trace:.1} | 1 | | | | | |");
    let ratio = gpu_trace / cpu_trace;
    println!("| GPU trace | {gpu_trace:.1} | {ratio:.2} | 1 | 1 | | | |");
    println!("| CPU splat | {cpu_splat:.1} | 1 | | | | | |");
    for way in &mut ways {
        way.report(gpu, cpu_splat, &receivers, &expected, records.len() as u64)?;
    }
    println!();
    for way in &ways {
        way.report_passes(gpu)?;
    }
    println!();
    Ok(())
}

/// A way to splat, and how long it took.
struct Way {
    name: &'static str,
    renderer: CausticsRenderer,
    times: Vec<f64>,
    frame: Option<PreparedFrame>,
}

impl Way {
    fn run(
        &mut self,
        gpu: &Gpu,
        view: &ViewParams<'_>,
        (records, count): &(wgpu::Buffer, wgpu::Buffer),
    ) -> Result<(), Failure> {
        let batches = [FootprintBatch { records, count }];
        let frame = FrameParams {
            light: FrameLight::Footprints(&batches),
            views: &[*view],
        };
        let (frame, time) = gpu.run(|encoder| {
            let renderer = &mut self.renderer;
            Ok(renderer.prepare(&gpu.device, &gpu.queue, encoder, &frame)?)
        })?;
        // The first has the buffers made and the shaders translated.
        if self.frame.replace(frame).is_some() {
            self.times.push(time);
        }
        Ok(())
    }

    fn frame(&self) -> Result<&PreparedFrame, Failure> {
        Ok(self.frame.as_ref().ok_or("no frame")?)
    }

    fn report(
        &mut self,
        gpu: &Gpu,
        cpu: f64,
        receivers: &Receivers,
        expected: &[[f32; 3]],
        landings: u64,
    ) -> Result<(), Failure> {
        let time = median(&mut self.times);
        let frame = self.frame()?;
        let work = frame.work();
        let stats = SplatStats::from_bytes(&gpu.read(frame.stats(0)?, SplatStats::BYTES)?);
        let stats = stats.ok_or("no stats")?;
        let texture = frame.irradiance(0)?.texture();
        let row = 16 * SIZE[0];
        let target = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("reading"),
            size: u64::from(row * SIZE[1]),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.run(|encoder| {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row),
                rows_per_image: None,
            };
            let into = wgpu::TexelCopyBufferInfo {
                buffer: &target,
                layout,
            };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), into, texture.size());
            Ok(())
        })?;
        let irradiance: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.map(&target)?);
        println!(
            "| GPU {} | {time:.1} | {:.2} | {} | {} | {} | {:.1} | {:.1e} |",
            self.name,
            time / cpu,
            work.passes,
            work.dispatches,
            work.draws,
            1e-6 * moved(&self.renderer, &stats, landings) as f64,
            difference(&irradiance, &receivers.albedo, expected),
        );
        Ok(())
    }

    fn report_passes(&self, gpu: &Gpu) -> Result<(), Failure> {
        let Some(timestamps) = self.frame()?.timestamps() else {
            return Ok(());
        };
        let bytes = gpu.read(timestamps.buffer(), timestamps.bytes())?;
        let mut sums: Vec<(&str, f64)> = Vec::new();
        for time in timestamps.pass_times(&bytes) {
            let milliseconds = 1e-6 * time.nanoseconds;
            match sums.iter_mut().find(|(pass, _)| *pass == time.pass) {
                Some((_, sum)) => *sum += milliseconds,
                None => sums.push((time.pass, milliseconds)),
            }
        }
        let passes: Vec<String> = sums
            .iter()
            .map(|(pass, milliseconds)| format!("{pass} {milliseconds:.2}"))
            .collect();
        println!("- {} by timestamps, ms: {}", self.name, passes.join(", "));
        Ok(())
    }
}

/// Bytes that the passes read and write at least, each buffer and texture once a pass.
fn moved(renderer: &CausticsRenderer, stats: &SplatStats, landings: u64) -> u64 {
    let pixels = u64::from(SIZE[0] * SIZE[1]);
    // A third more for the coarser levels.
    let with_levels = |bytes: u64| pixels * bytes * 4 / 3;
    let capabilities = renderer.capabilities();
    // Host's position, normal and object; receivers and objects, written and read once.
    let receivers = pixels * 36 + with_levels(20 + 20);
    // Records, densities and places.
    let prepare = landings * (80 + 64 + 40);
    let pairs = u64::from(stats.pairs);
    let sum_bytes = match capabilities.sum_format {
        wgpu::TextureFormat::Rgba16Float => 8 * u64::from(capabilities.sum_layers),
        _ => 16,
    };
    let splat = match capabilities.splat_method {
        // Places twice for the lists, which are written once and read three times; a density and
        // a place for each pair, and its strength twice.
        SplatMethod::Tiles => landings * 80 + pairs * (16 + 104 + 24) + with_levels(16 + sum_bytes),
        // Places and order; the blended target is not counted, which caches decide on.
        _ => landings * (40 + 8) + with_levels(16 + 2 * sum_bytes),
    };
    // Sums, receivers and objects of two levels, totals.
    let upsample = with_levels(sum_bytes + 20 + 20 + 16 + 16);
    receivers + prepare + splat + upsample
}

/// The sum of the differences over the sum of what is expected; the CPU divides pixels with edges,
/// the GPU does not.
fn difference(irradiance: &[[f32; 4]], albedo: &[[f32; 3]], expected: &[[f32; 3]]) -> f64 {
    let (mut off, mut sum) = (0.0, 0.0);
    for ((irradiance, albedo), expected) in irradiance.iter().zip(albedo).zip(expected) {
        for channel in 0..3 {
            let found = albedo[channel] * irradiance[channel] / std::f32::consts::PI;
            off += f64::from((found - expected[channel]).abs());
            sum += f64::from(expected[channel]);
        }
    }
    off / sum
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
