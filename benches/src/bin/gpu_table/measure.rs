//! One scene's rows.

use caustics::filter::{Comparison, Image};
use caustics::render::{FootprintGather, FootprintOptions, splat};
use caustics::trace::{PhotonMap, TraceOptions, trace_photons};
use caustics_benches::flip::Flip;
use caustics_benches::gpu::Gpu;
use caustics_benches::score::Conditions;
use caustics_benches::stage::{Failure, Stage};
use caustics_benches::timing::{Patience, Timed, median_after, median_of};
use caustics_gpu_readback::read_texture;
use caustics_wgpu::{
    CausticsRenderer, FootprintBatch, FrameLight, FrameParams, Gather, GatherOptions, GatherPoint,
    PhotonBuffers, PhotonTracer, RendererOptions, SceneBuffers, SplatMethod, SplatOptions,
    SplatStats, TracePlan,
};

use crate::receivers::Receivers;
use crate::rows::{Row, Way};

/// Photons of a batch: four landings of each fit a binding.
const BATCH: u32 = 1 << 17;

/// Every so many pixels along both axes one is asked for its light by a gather.
const GATHER_STRIDE: usize = 4;

/// What does not change from scene to scene.
pub(crate) struct Bench {
    pub(crate) gpu: Gpu,
    pub(crate) patience: Patience,
    pub(crate) conditions: Conditions,
    tracer: PhotonTracer,
    renderers: Vec<(Way, CausticsRenderer)>,
}

impl Bench {
    pub(crate) fn new(patience: Patience, conditions: Conditions) -> Result<Self, Failure> {
        let gpu = Gpu::new()?;
        let quads = SplatOptions {
            method: SplatMethod::Quads,
            ..SplatOptions::default()
        };
        let half_floats = SplatOptions {
            prefer_half_floats: true,
            ..quads
        };
        let ways = [
            (Way::Tiles, SplatOptions::default()),
            (Way::Quads, quads),
            (Way::HalfFloats, half_floats),
        ];
        let renderer = |(way, splat)| {
            let options = RendererOptions {
                splat,
                ..RendererOptions::default()
            };
            Ok((way, CausticsRenderer::new(&gpu.device, &options)?))
        };
        Ok(Self {
            renderers: ways
                .into_iter()
                .map(renderer)
                .collect::<Result<_, Failure>>()?,
            tracer: PhotonTracer::new(&gpu.device),
            gpu,
            patience,
            conditions,
        })
    }

    /// The scene's rows for each number of photons.
    pub(crate) fn measure(&mut self, stage: &Stage, counts: &[u32]) -> Result<Vec<Row>, Failure> {
        let receivers = Receivers::new(&self.gpu, stage);
        let scene = SceneBuffers::new(&self.gpu.device, &stage.world)?;
        let mut rows = Vec::new();
        let mut flip = Flip::new(&stage.reference)?;
        for &photons in counts {
            let options = TraceOptions {
                photons,
                ..TraceOptions::default()
            };
            let map = median_of(self.patience, || {
                trace_photons(&stage.world, &stage.intersector, &options, &|_| {})
            })?;
            let footprints = FootprintOptions::default();
            let image = median_after(
                self.patience,
                || stage.g_buffer(),
                |buffer| splat(buffer, &map.value.photons, &footprints).map(|(image, _)| image),
            )?;
            let (build, gather) = self.gather_by_cpu(&map.value, &receivers)?;
            let mut row = self.row(stage, photons, Way::Cpu, &image.value)?;
            row.stored = map.value.photons.len() as u64;
            (row.trace, row.splat) = (map.seconds, image.seconds);
            (row.build, row.gather) = (build, gather);
            flip.add(&format!("cpu-{photons}"), &image.value)?;
            rows.push(row);

            let traced = self.trace(stage, &scene, &options)?;
            let stored = self.stored(&traced.value)?;
            let (build, gather) = self.gather_by_gpu(&traced.value, &map.value, &receivers)?;
            for index in 0..self.renderers.len() {
                let mut row = self.splat(
                    stage,
                    photons,
                    index,
                    &traced.value,
                    &receivers,
                    &mut flip,
                    &image,
                )?;
                (row.stored, row.trace) = (stored, traced.seconds);
                (row.build, row.gather) = (build, gather);
                rows.push(row);
            }
            for row in &rows[rows.len() - 4..] {
                eprintln!(
                    "{:<18} {photons:>8} {:<21} trace {:8.3} s  splat {:8.3} s  relMSE {:.5}  \
                     energy {:.4}  off {:.1e}",
                    stage.name,
                    row.way.name(),
                    row.trace,
                    row.splat,
                    row.relative_mse,
                    row.energy,
                    row.off,
                );
            }
        }
        for (row, value) in rows.iter_mut().zip(flip.evaluate()) {
            row.flip = value;
        }
        Ok(rows)
    }

    /// A row with the errors of a picture.
    fn row(&self, stage: &Stage, photons: u32, way: Way, image: &Image) -> Result<Row, Failure> {
        let comparison = Comparison::new(image, &stage.reference)?;
        Ok(Row {
            scene: stage.name.clone(),
            photons,
            way,
            stored: 0,
            trace: 0.0,
            splat: 0.0,
            empty: 0.0,
            build: 0.0,
            gather: 0.0,
            energy: comparison.energy_ratio,
            relative_mse: comparison.relative_mse,
            trimmed: comparison.relative_mse_trimmed,
            flip: None,
            off: 0.0,
            passes: 0,
            dispatches: 0,
            draws: 0,
            moved: 0.0,
            adapter: self.gpu.name.clone(),
            conditions: self.conditions.clone(),
        })
    }

    fn trace(
        &self,
        stage: &Stage,
        scene: &SceneBuffers,
        options: &TraceOptions,
    ) -> Result<Timed<Vec<PhotonBuffers>>, Failure> {
        let gpu = &self.gpu;
        let plan = TracePlan::new(&stage.world, &stage.intersector, options)?;
        let firsts: Vec<u32> = (0..plan.photons()).step_by(BATCH as usize).collect();
        let batches = firsts
            .iter()
            .map(|_| PhotonBuffers::new(&gpu.device, BATCH, 4 * BATCH))
            .collect::<Result<Vec<_>, _>>()?;
        let run = |photons: u32| {
            gpu.run(|encoder| {
                let batches = firsts.iter().zip(&batches);
                for (&first, into) in batches.take_while(|it| *it.0 < photons) {
                    into.clear(encoder);
                    let range = first..photons.min(first + BATCH);
                    self.tracer
                        .trace(&gpu.device, encoder, scene, &plan, range, into)?;
                }
                Ok(())
            })
        };
        // The first run translates shaders.
        run(64.min(plan.photons()))?;
        let timed = median_of(self.patience, || run(plan.photons()))?;
        Ok(Timed {
            value: batches,
            seconds: timed.seconds,
            runs: timed.runs,
        })
    }

    fn stored(&self, batches: &[PhotonBuffers]) -> Result<u64, Failure> {
        let mut stored = 0;
        for batch in batches {
            let words: Vec<u32> =
                bytemuck::pod_collect_to_vec(&self.gpu.read(batch.counters(), 4)?);
            stored += u64::from(words[0]);
        }
        Ok(stored)
    }

    #[expect(clippy::too_many_arguments, reason = "one picture's worth")]
    fn splat(
        &mut self,
        stage: &Stage,
        photons: u32,
        index: usize,
        batches: &[PhotonBuffers],
        receivers: &Receivers,
        flip: &mut Flip,
        expected: &Timed<Image>,
    ) -> Result<Row, Failure> {
        let gpu = &self.gpu;
        let (way, renderer) = &mut self.renderers[index];
        let way = *way;
        let all: Vec<_> = batches.iter().map(FootprintBatch::from).collect();
        let views = [receivers.view(stage)];
        let mut draw = |batches: &[FootprintBatch<'_>]| {
            let frame = FrameParams {
                light: FrameLight::Footprints(batches),
                views: &views,
            };
            gpu.run(|encoder| Ok(renderer.prepare(&gpu.device, &gpu.queue, encoder, &frame)?))
        };
        let nothing = gpu.upload(&[]);
        let none = [FootprintBatch {
            records: &nothing,
            count: &nothing,
        }];
        // The first run makes textures and translates shaders.
        draw(&none)?;
        let empty = median_of(self.patience, || draw(&none))?.seconds;
        let frame = median_of(self.patience, || draw(&all))?;
        let seconds = frame.seconds;
        let frame = frame.value;
        let texture = frame.irradiance(0)?.texture();
        let texels = read_texture(&gpu.device, &gpu.queue, texture, 16)?;
        let irradiance: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&texels);
        let stats = SplatStats::from_bytes(&gpu.read(frame.stats(0)?, SplatStats::BYTES)?);
        let stats = stats.ok_or("no stats")?;
        if stats.dropped_pairs > 0 {
            eprintln!("{}: {} pairs dropped", stage.name, stats.dropped_pairs);
        }
        let radiance = receivers
            .albedo
            .iter()
            .zip(&irradiance)
            .map(|(albedo, it)| {
                std::array::from_fn(|channel| albedo[channel] * it[channel] / std::f32::consts::PI)
            });
        let [width, height] = receivers.size;
        let image = Image::from_pixels(width, height, radiance.collect())?;
        flip.add(
            &format!("{}-{photons}", way.name().replace(' ', "-")),
            &image,
        )?;
        let capabilities = renderer.capabilities();
        let landings = u64::from(stats.splatted);
        let moved = moved(receivers.size, &capabilities, &stats, landings);
        let mut row = self.row(stage, photons, way, &image)?;
        (row.splat, row.empty) = (seconds, empty);
        row.off = difference(receivers, &image, &expected.value);
        let work = frame.work();
        (row.passes, row.dispatches, row.draws) = (work.passes, work.dispatches, work.draws);
        row.moved = 1e-6 * moved as f64;
        Ok(row)
    }

    /// Seconds to sort footprints, and to look up the light of some pixels.
    fn gather_by_cpu(&self, map: &PhotonMap, receivers: &Receivers) -> Result<(f64, f64), Failure> {
        let options = FootprintOptions::default();
        let gather = median_of(self.patience, || {
            FootprintGather::new(&map.photons, &options)
        })?;
        let points = points(receivers);
        let found = median_of(self.patience, || {
            let light = points.iter().map(|it| {
                let (position, normal) = (it.position.into(), it.normal.into());
                gather.value.irradiance(position, normal)
            });
            Ok::<_, Failure>(light.map(|it| it.x).sum::<f32>())
        })?;
        Ok((gather.seconds, found.seconds))
    }

    fn gather_by_gpu(
        &self,
        batches: &[PhotonBuffers],
        map: &PhotonMap,
        receivers: &Receivers,
    ) -> Result<(f64, f64), Failure> {
        let gpu = &self.gpu;
        // A gather has one batch; the others' rows say nothing of it.
        let [batch] = batches else {
            return Ok((0.0, 0.0));
        };
        let least = FootprintGather::new(&map.photons, &FootprintOptions::default())?;
        let batch = FootprintBatch::from(batch);
        let options = GatherOptions {
            least_extent: least.least_extent(),
            most_extent: 1e7 * least.least_extent(),
            capacity: batch.capacity(),
            ..GatherOptions::default()
        };
        let gather = Gather::new(&gpu.device, &options)?;
        let points = points(receivers);
        let asked = gpu.upload(bytemuck::cast_slice(&points));
        let found = gpu.upload(&vec![0; 16 * points.len()]);
        let build = || gpu.run(|encoder| Ok(gather.build(&gpu.device, encoder, &batch)?));
        build()?;
        let built = median_of(self.patience, build)?;
        let look =
            || gpu.run(|encoder| Ok(gather.evaluate(&gpu.device, encoder, &asked, &found)?));
        look()?;
        Ok((built.seconds, median_of(self.patience, look)?.seconds))
    }
}

/// Points that a gather is asked for.
fn points(receivers: &Receivers) -> Vec<GatherPoint> {
    let width = receivers.size[0] as usize;
    let is_asked = |pixel: &usize| {
        (pixel % width).is_multiple_of(GATHER_STRIDE)
            && (pixel / width).is_multiple_of(GATHER_STRIDE)
            && receivers.points[*pixel][1] != [0.0; 3]
    };
    let asked = (0..receivers.points.len()).filter(is_asked);
    asked
        .map(|pixel| GatherPoint {
            position: receivers.points[pixel][0],
            normal: receivers.points[pixel][1],
            ..GatherPoint::default()
        })
        .collect()
}

/// Bytes that the passes of a splat read and write at least, each buffer and texture once a pass.
fn moved(
    size: [u32; 2],
    capabilities: &caustics_wgpu::Capabilities,
    stats: &SplatStats,
    landings: u64,
) -> u64 {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    // A third more for the coarser levels.
    let with_levels = |bytes: u64| pixels * bytes * 4 / 3;
    // Host's position, normal and object; receivers and objects, written and read once, and once
    // more for what tiles show.
    let receivers = pixels * (36 + 20) + with_levels(20 + 20);
    // Records, densities and places.
    let prepare = landings * (80 + 80 + 40);
    let pairs = u64::from(stats.pairs);
    let sum_bytes = match capabilities.sum_format {
        // Two half floats a channel of each layer.
        wgpu::TextureFormat::Rgba16Float => 16 * u64::from(capabilities.sum_layers),
        _ => 16,
    };
    let splat = match capabilities.splat_method {
        // Places twice for the lists, which are written once and read three times; a density and
        // a place for each pair, and its strength twice.
        SplatMethod::Tiles => landings * 80 + pairs * (16 + 120 + 24) + with_levels(20 + sum_bytes),
        // Places and order; the blended target is not counted, which caches decide on.
        _ => landings * (40 + 8) + with_levels(20 + 2 * sum_bytes),
    };
    // Sums, receivers and objects of two levels, totals.
    let upsample = with_levels(sum_bytes + 20 + 20 + 16 + 16);
    receivers + prepare + splat + upsample
}

/// The sum of the differences over the sum of what is expected, where no edge is: the CPU divides
/// pixels with edges, the GPU does not.
fn difference(receivers: &Receivers, found: &Image, expected: &Image) -> f64 {
    let (mut off, mut sum) = (0.0, 0.0);
    let pixels = found.pixels().iter().zip(expected.pixels());
    for (_, (found, expected)) in (0..).zip(pixels).filter(|(it, _)| receivers.is_inside(*it)) {
        for channel in 0..3 {
            off += f64::from((found[channel] - expected[channel]).abs());
            sum += f64::from(expected[channel]);
        }
    }
    off / sum
}
