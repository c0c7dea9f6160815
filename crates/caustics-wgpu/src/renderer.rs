use glam::UVec2;

use crate::buffers::{filled_buffer, largest_binding};
use crate::capabilities::{self, Capabilities, REQUIRED_FEATURES, USED_FEATURES};
use crate::composite::{Composite, CompositePass, CompositeTarget};
use crate::error_scope::caught;
use crate::pass_times::{FrameTimestamps, PassTimer};
use crate::photon_buffers::PhotonBuffers;
use crate::photon_tracer::PhotonTracer;
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::SceneBuffers;
use crate::splat::Splat;
use crate::splat_options::SplatOptions;
use crate::splat_receivers::Receivers;
use crate::splat_scratch::{DENSITY_BYTES, FootprintBatch, SPLATS_PER_FOOTPRINT, SplatScratch};
use crate::splat_targets::{SplatTargets, SumFormat};
use crate::splat_view::levels;
use crate::trace_plan::TracePlan;
use crate::view_params::{SurfaceInput, ViewParams};
use crate::{FootprintRecord, GpuError};

/// How a renderer is made.
#[derive(Clone, Debug)]
pub struct RendererOptions {
    /// How footprints become pixels.
    pub splat: SplatOptions,
    /// The targets that caustics will be drawn into. A host that reads the irradiance instead needs
    /// none.
    pub targets: Vec<CompositeTarget>,
    /// Whether passes write timestamps, where the device can.
    pub times_passes: bool,
    /// Room for landings of each traced photon: a photon is split where glass both reflects and
    /// refracts, and stores two to four in common scenes. What has no room is counted as crowded
    /// by [`TraceCounters`](crate::TraceCounters).
    pub records_per_photon: u32,
    /// Whether scenes with glossy receivers may be traced. What is summed is irradiance, which says
    /// all of a matt receiver's light but not where a glossy one reflects it to: as if it were matt.
    /// Else such a scene is refused.
    pub glossy_as_matt: bool,
}

impl Default for RendererOptions {
    fn default() -> Self {
        Self {
            splat: SplatOptions::default(),
            targets: Vec::new(),
            times_passes: false,
            records_per_photon: 4,
            glossy_as_matt: false,
        }
    }
}

/// Where a frame's light comes from.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum FrameLight<'a> {
    /// Footprints that the host has in buffers.
    Footprints(&'a [FootprintBatch<'a>]),
    /// Photons that are traced on the GPU in this frame.
    Traced {
        /// What they are traced through.
        scene: &'a SceneBuffers,
        /// The photons of all lights. A light that moves needs a new plan.
        plan: &'a TracePlan,
    },
}

/// What changes from frame to frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameParams<'a> {
    /// The light.
    pub light: FrameLight<'a>,
    /// Every view of the frame, in the same order each frame: a view's textures are kept by its
    /// place, and made anew when its size changes.
    pub views: &'a [ViewParams<'a>],
}

/// Caustics inside a host's own frame.
///
/// [`prepare`](Self::prepare) records everything up to the irradiance of each view into the host's
/// encoder; [`draw`](Self::draw) adds it to a pass of the host's, or the host reads
/// [`PreparedFrame::irradiance`] in a shader of its own. Nothing is submitted or waited for.
#[derive(Debug)]
pub struct CausticsRenderer {
    splat: Splat,
    composite: CompositePass,
    tracer: Option<PhotonTracer>,
    records_per_photon: u32,
    glossy_as_matt: bool,
    photons: Vec<PhotonBuffers>,
    views: Vec<SplatTargets>,
    scratch: Option<SplatScratch>,
    timer: Option<PassTimer>,
    capabilities: Capabilities,
}

/// A frame that is recorded and can be drawn.
#[derive(Debug)]
pub struct PreparedFrame {
    views: Vec<PreparedView>,
    photons: Vec<PhotonBuffers>,
    timestamps: Option<FrameTimestamps>,
    work: RecordedWork,
}

#[derive(Debug)]
struct PreparedView {
    irradiance: wgpu::TextureView,
    composite: wgpu::BindGroup,
    counts: wgpu::Buffer,
}

impl CausticsRenderer {
    /// Features without which there is no renderer: none.
    #[must_use]
    pub fn required_features() -> wgpu::Features {
        REQUIRED_FEATURES
    }

    /// Features that it makes use of, where the adapter has them and the host asks for them: 32-bit
    /// blending and timestamps.
    #[must_use]
    pub fn used_features() -> wgpu::Features {
        USED_FEATURES
    }

    /// Limits without which there is no renderer: WebGPU's defaults.
    #[must_use]
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// Compiles the shaders.
    ///
    /// # Errors
    /// [`RendererError::Missing`] lists all that the device lacks. Further, options out of range, a
    /// target that cannot be blended into, and a device that is lost or out of memory.
    pub fn new(device: &wgpu::Device, options: &RendererOptions) -> Result<Self, RendererError> {
        options.splat.validate()?;
        if !(1..=64).contains(&options.records_per_photon) {
            return Err(RendererError::OptionOutOfRange {
                name: "records_per_photon",
                value: options.records_per_photon as f32,
                range: "1 to 64",
            });
        }
        capabilities::check(device)?;
        caught(device, || {
            let splat = Splat::new(device, &options.splat)?;
            let timer = options.times_passes.then(|| PassTimer::new(device));
            let timer = timer.flatten();
            let capabilities = Capabilities {
                splat_method: options.splat.method,
                sum_format: splat.format().format,
                sum_layers: splat.format().layers,
                has_timestamps: timer.is_some(),
                footprints_per_batch: footprints_per_batch(&device.limits()),
            };
            Ok(Self {
                composite: CompositePass::new(device, &options.targets)?,
                splat,
                tracer: None,
                records_per_photon: options.records_per_photon,
                glossy_as_matt: options.glossy_as_matt,
                photons: Vec::new(),
                views: Vec::new(),
                scratch: None,
                timer,
                capabilities,
            })
        })
    }

    /// Compiles the shaders that trace photons, which else happens when the first frame with
    /// [`FrameLight::Traced`] is prepared.
    ///
    /// # Errors
    /// A device that is lost or out of memory.
    pub fn compile_tracer(&mut self, device: &wgpu::Device) -> Result<(), RendererError> {
        if self.tracer.is_none() {
            self.tracer = Some(caught(device, || Ok(PhotonTracer::new(device)))?);
        }
        Ok(())
    }

    /// What was chosen by what the device can do.
    #[must_use]
    pub fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    /// Records a frame's caustics into the encoder, before the passes that draw them.
    ///
    /// The same renderer may prepare several frames in one encoder, but the textures of a view are
    /// those of the frame that was prepared last: draw each before the next is prepared.
    ///
    /// # Errors
    /// A traced scene with glossy receivers, unless
    /// [`glossy_as_matt`](RendererOptions::glossy_as_matt) allows them
    /// ([`GpuError::Unsupported`]); a view's size or projection out of range, more footprints in a
    /// batch than the device binds,
    /// a texture of the host's that does not fit its use, or a device that is lost or out of
    /// memory. Then nothing of the frame can be drawn, but the renderer stays as it was.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        frame: &FrameParams<'_>,
    ) -> Result<PreparedFrame, RendererError> {
        if let FrameLight::Traced { scene, .. } = frame.light
            && scene.is_glossy
            && !self.glossy_as_matt
        {
            let what = "light that glossy receivers reflect";
            return Err(GpuError::Unsupported { what }.into());
        }
        let max_texture = device.limits().max_texture_dimension_2d;
        let options = *self.splat.options();
        let uniforms = (0..)
            .zip(frame.views)
            .map(|(index, view)| view.uniform(index, &options, max_texture))
            .collect::<Result<Vec<_>, _>>()?;
        caught(device, || {
            if let FrameLight::Traced { plan, .. } = frame.light {
                self.fit_photons(device, plan.photons())?;
                self.tracer.get_or_insert_with(|| PhotonTracer::new(device));
            }
            let traced: Vec<_> = self.photons.iter().map(FootprintBatch::from).collect();
            let footprints = match frame.light {
                FrameLight::Footprints(batches) => batches,
                FrameLight::Traced { .. } => &traced,
            };
            fit_scratch(&mut self.scratch, &self.splat, device, frame, footprints)?;
            fit_views(&mut self.views, self.splat.format(), device, frame)?;
            let Some(scratch) = &self.scratch else {
                return Err(RendererError::OutOfMemory);
            };
            let queries = self.timer.as_ref().map(|timer| &timer.queries);
            let mut recorder = Recorder::new(encoder, queries);
            if let (FrameLight::Traced { scene, plan }, Some(tracer)) = (frame.light, &self.tracer)
            {
                let mut first = 0;
                for into in &self.photons {
                    into.clear(recorder.encoder);
                    let last = plan.photons().min(first + into.photons());
                    tracer.record(device, &mut recorder, scene, plan, first..last, into)?;
                    first = last;
                }
            }
            let mut views = Vec::with_capacity(frame.views.len());
            for ((view, uniform), targets) in frame.views.iter().zip(&uniforms).zip(&mut self.views)
            {
                let uniform = filled_buffer(
                    device,
                    "caustics view",
                    wgpu::BufferUsages::UNIFORM,
                    bytemuck::bytes_of(uniform),
                )?;
                let (SurfaceInput::Depth(surface) | SurfaceInput::Position(surface)) = view.surface;
                let receivers = Receivers {
                    surface,
                    normals: view.normals,
                    objects: view.objects,
                };
                self.splat.record(
                    device,
                    &mut recorder,
                    &uniform,
                    &receivers,
                    targets,
                    scratch,
                    footprints,
                )?;
                let composite = Composite {
                    origin: view.origin,
                    has_albedo: u32::from(view.albedo.is_some()),
                    exposure: view.exposure,
                };
                let irradiance = targets.totals[0].clone();
                views.push(PreparedView {
                    composite: self
                        .composite
                        .bind(device, &composite, &irradiance, view.albedo)?,
                    irradiance,
                    counts: targets.counts.clone(),
                });
            }
            let (passes, work) = recorder.finish();
            let period = queue.get_timestamp_period();
            Ok(PreparedFrame {
                views,
                photons: match frame.light {
                    FrameLight::Footprints(_) => Vec::new(),
                    FrameLight::Traced { .. } => self.photons.clone(),
                },
                timestamps: self
                    .timer
                    .as_ref()
                    .map(|timer| timer.resolve(encoder, passes, period)),
                work,
            })
        })
    }

    /// Adds a view's caustics to a pass of the host's: radiance times exposure, onto what is there.
    ///
    /// # Errors
    /// If there is no such view, or the renderer was not made for the target.
    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        frame: &PreparedFrame,
        view: usize,
        target: &CompositeTarget,
    ) -> Result<(), RendererError> {
        self.composite
            .draw(pass, &frame.view(view)?.composite, target)
    }

    /// Makes room for the landings of so many photons, in as few batches as bindings allow.
    fn fit_photons(&mut self, device: &wgpu::Device, photons: u32) -> Result<(), RendererError> {
        let (batch, count) = photon_batches(&device.limits(), self.records_per_photon, photons);
        let room: u32 = self.photons.iter().map(PhotonBuffers::photons).sum();
        let is_right = self.photons.len() == count as usize
            && self.photons.iter().all(|it| it.photons() <= batch)
            && room >= photons
            && room <= photons.saturating_mul(2).max(1);
        if !is_right {
            self.photons.clear();
            let records = batch.saturating_mul(self.records_per_photon);
            let first = PhotonBuffers::new(device, batch, records)?;
            let others = (1..count).map(|_| first.another(device));
            self.photons = others.collect();
            self.photons.push(first);
        }
        Ok(())
    }
}

/// Makes the textures of views that are new or have another size.
fn fit_views(
    views: &mut Vec<SplatTargets>,
    format: SumFormat,
    device: &wgpu::Device,
    frame: &FrameParams<'_>,
) -> Result<(), RendererError> {
    views.truncate(frame.views.len());
    for (index, view) in frame.views.iter().enumerate() {
        let size = UVec2::from(view.size);
        if views.get(index).is_none_or(|it| it.size != size) {
            let targets = SplatTargets::new(device, size, format)?;
            if let Some(place) = views.get_mut(index) {
                *place = targets;
            } else {
                views.push(targets);
            }
        }
    }
    Ok(())
}

/// Makes room for the largest batch and the largest view, if there is less.
fn fit_scratch(
    scratch: &mut Option<SplatScratch>,
    splat: &Splat,
    device: &wgpu::Device,
    frame: &FrameParams<'_>,
    footprints: &[FootprintBatch<'_>],
) -> Result<(), RendererError> {
    let capacity = footprints.iter().map(FootprintBatch::capacity);
    let capacity = capacity.max().unwrap_or(0).max(1);
    let limits = device.limits();
    let most = footprints_per_batch(&limits);
    if capacity > most {
        let record = size_of::<FootprintRecord>() as u64;
        return Err(RendererError::Gpu(GpuError::BufferTooLarge {
            what: "the footprints of a batch",
            bytes: u64::from(capacity) * record,
            limit: u64::from(most) * record,
        }));
    }
    let mut tiles = 0;
    for view in frame.views {
        let size = UVec2::from(view.size);
        tiles = tiles.max(levels(size, limits.max_texture_dimension_2d)?.1);
    }
    let fits = |it: &SplatScratch| it.capacity >= capacity && it.tiles >= tiles;
    if !scratch.as_ref().is_some_and(fits) {
        let pairs = SplatScratch::pairs(splat.options(), capacity);
        // Before the new one is made, so that there is memory for it.
        *scratch = None;
        let layers = splat.format().layers;
        *scratch = Some(SplatScratch::new(device, capacity, tiles, pairs, layers)?);
    }
    Ok(())
}

impl PreparedFrame {
    fn view(&self, view: usize) -> Result<&PreparedView, RendererError> {
        self.views.get(view).ok_or(RendererError::NoSuchView {
            view,
            views: self.views.len(),
        })
    }

    /// The irradiance of a view in W/m² for each channel, as `Rgba32Float` of the view's size.
    ///
    /// # Errors
    /// If there is no such view.
    pub fn irradiance(&self, view: usize) -> Result<&wgpu::TextureView, RendererError> {
        Ok(&self.view(view)?.irradiance)
    }

    /// What became of a view's footprints: [`SplatStats::BYTES`](crate::SplatStats::BYTES) for the host to copy, and to give
    /// to [`SplatStats::from_bytes`](crate::SplatStats::from_bytes).
    ///
    /// # Errors
    /// If there is no such view.
    pub fn stats(&self, view: usize) -> Result<&wgpu::Buffer, RendererError> {
        Ok(&self.view(view)?.counts)
    }

    /// Where the photons of a traced frame landed: records for a gather, and counters for
    /// [`TraceCounters`](crate::TraceCounters). None where the host gave footprints.
    #[must_use]
    pub fn photons(&self) -> &[PhotonBuffers] {
        &self.photons
    }

    /// When each pass began and ended, where that was asked for and the device can tell.
    #[must_use]
    pub fn timestamps(&self) -> Option<&FrameTimestamps> {
        self.timestamps.as_ref()
    }

    /// How much was recorded.
    #[must_use]
    pub fn work(&self) -> RecordedWork {
        self.work
    }
}

/// In how many batches so many photons are traced, and the photons of each.
fn photon_batches(limits: &wgpu::Limits, records_per_photon: u32, photons: u32) -> (u32, u32) {
    let most = footprints_per_batch(limits);
    let batch = (most / records_per_photon).clamp(1, photons.max(1));
    (batch, photons.div_ceil(batch).max(1))
}

/// Footprints whose records and densities one binding holds, and one dispatch reaches.
fn footprints_per_batch(limits: &wgpu::Limits) -> u32 {
    let bytes = largest_binding(limits);
    let densities = DENSITY_BYTES * u64::from(SPLATS_PER_FOOTPRINT);
    let each = (size_of::<FootprintRecord>() as u64).max(densities);
    let dispatched = 128 * u64::from(limits.max_compute_workgroups_per_dimension);
    u32::try_from((bytes / each).min(dispatched)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splat_scratch::SplatSizes;

    #[test]
    fn two_million_photons_fit_bindings_of_128_mib() {
        let limits = wgpu::Limits::default();
        assert_eq!(limits.max_storage_buffer_binding_size, 128 << 20);
        let records_per_photon = RendererOptions::default().records_per_photon;
        let photons = 2_000_000;
        let (batch, count) = photon_batches(&limits, records_per_photon, photons);
        assert!(u64::from(batch) * u64::from(count) >= u64::from(photons));
        assert_eq!(count, 10);
        let capacity = batch * records_per_photon;
        assert!(capacity <= footprints_per_batch(&limits));
        let records = u64::from(capacity) * size_of::<FootprintRecord>() as u64;
        let (_, tiles) = levels(UVec2::new(3840, 2160), limits.max_texture_dimension_2d).unwrap();
        for method in [crate::SplatMethod::Tiles, crate::SplatMethod::Quads] {
            let options = SplatOptions {
                method,
                ..SplatOptions::default()
            };
            let pairs = SplatScratch::pairs(&options, capacity);
            let sizes = SplatSizes::of(capacity, tiles, pairs, 8).all();
            for bytes in sizes.into_iter().chain([records]) {
                assert!(bytes <= limits.max_storage_buffer_binding_size, "{bytes}");
            }
        }
        // The largest batch is as large as can be: one footprint more would not fit.
        let most = footprints_per_batch(&limits);
        let densities = |capacity| SplatSizes::of(capacity, 0, 0, 1).densities;
        assert!(densities(most) <= limits.max_storage_buffer_binding_size);
        assert!(densities(most + 1) > limits.max_storage_buffer_binding_size);
    }
}
