use bytemuck::{Pod, Zeroable};

use crate::buffers::{bound_buffer, filled_buffer};
use crate::error_scope::caught;
use crate::gather_counts::GatherCounts;
use crate::gather_options::GatherOptions;
use crate::pass_layout::{PassLayout, Slot, compute_pipeline};
use crate::prefix_sum::PrefixSumPass;
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};
use crate::splat_scratch::{DENSITY_BYTES, FootprintBatch, GROUP};
use crate::truncation;
use crate::{FootprintRecord, GpuError};

const BUILD: Shader = Shader {
    label: "gather_build",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        FOOTPRINT_RECORD,
        shader_piece!("gather_grid"),
        shader_piece!("gather_build"),
    ],
};

const POINTS: Shader = Shader {
    label: "gather_points",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("gather_grid"),
        shader_piece!("gather_lookup"),
        shader_piece!("gather_points"),
    ],
};

/// The pieces that a shader of the host's includes.
const LOOKUP: Shader = Shader {
    label: "gather_lookup",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("gather_grid"),
        shader_piece!("gather_lookup"),
    ],
};

/// Threads of a workgroup that evaluates points.
const POINT_GROUP: u32 = 64;

/// Lists for each footprint that there is room for.
const LISTS_PER_FOOTPRINT: u32 = 2;

/// The smallest cells' edge, relative to the least extent of a footprint: the box around a Gaussian
/// that ends at three standard deviations is no smaller.
const CELL_OF_EXTENT: f32 = 6.0;

/// Mirror of the struct of the same name in `shaders/gather_grid.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct GatherGrid {
    cell: f32,
    lists: u32,
    scale: f32,
    max_anisotropy: f32,
    least_extent: f32,
    most_extent: f32,
    pad: [f32; 2],
    truncation: [f32; 4],
}

/// A point of a surface at which light is asked for, as the GPU's buffers hold it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GatherPoint {
    /// Where, in metres.
    pub position: [f32; 3],
    /// Not used.
    pub pad_a: f32,
    /// Unit normal on the side that is lit.
    pub normal: [f32; 3],
    /// Index of its object among the world's, plus one: light stays off what stands close to its
    /// receiver. 0 where the object is not known.
    pub object_plus_one: u32,
}

/// The caustics at any point of the scene, from the same footprints that a splat draws: for what
/// is seen in a mirror or through glass, for baking, and for whatever asks.
///
/// [`build`](Self::build) sorts the footprints into a hash grid. Then a shader of the host's calls
/// `caustics_irradiance(position, normal)` of [`source`](Self::source) with what
/// [`bindings`](Self::bindings) gives, or [`evaluate`](Self::evaluate) fills a buffer.
///
/// # Cost
/// A lookup visits one list for each power of two among the sizes of footprints, at most 32, and
/// in it the footprints whose boxes touch the point's cell. Sums are in the order of the lists,
/// which is not the same in every run: the last bits differ.
#[derive(Debug)]
pub struct Gather {
    options: GatherOptions,
    grid: wgpu::Buffer,
    build: PassLayout,
    count: wgpu::ComputePipeline,
    scatter: wgpu::ComputePipeline,
    prefix_sum: PrefixSumPass,
    lookup: PassLayout,
    points: PassLayout,
    evaluate: wgpu::ComputePipeline,
    lists: u32,
    densities: wgpu::Buffer,
    list_counts: wgpu::Buffer,
    list_starts: wgpu::Buffer,
    entries: wgpu::Buffer,
    counts: wgpu::Buffer,
}

impl Gather {
    /// Compiles the shaders and makes the buffers.
    ///
    /// # Errors
    /// Options out of range, more than the device binds, or a device that is lost or out of memory.
    pub fn new(device: &wgpu::Device, options: &GatherOptions) -> Result<Self, RendererError> {
        options.validate()?;
        caught(device, || Self::made(device, options))
    }

    fn made(device: &wgpu::Device, options: &GatherOptions) -> Result<Self, RendererError> {
        let make = |what, bytes, usage| bound_buffer(device, what, bytes, usage);
        let capacity = u64::from(options.capacity);
        let lists = options
            .capacity
            .saturating_mul(LISTS_PER_FOOTPRINT)
            .clamp(1024, 1 << 24)
            .next_power_of_two();
        let grid = GatherGrid {
            cell: CELL_OF_EXTENT * options.least_extent,
            lists,
            scale: options.scale,
            max_anisotropy: if options.max_anisotropy.is_finite() {
                options.max_anisotropy
            } else {
                0.0
            },
            least_extent: options.least_extent,
            most_extent: options.most_extent,
            pad: [0.0; 2],
            truncation: truncation::uniform(options.truncation, options.overlap_truncation),
        };
        let stages = wgpu::ShaderStages::COMPUTE;
        let kernel = [options.kernel.constant()];
        let build = [
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Write,
            Slot::Write,
            Slot::Read,
            Slot::Write,
            Slot::Write,
        ];
        let build = PassLayout::new(device, "gather_build", stages, &build);
        let lookup = [
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Read,
            Slot::Read,
        ];
        let lookup = PassLayout::new(device, "gather_lookup", stages, &lookup);
        let points = PassLayout::new(device, "gather_points", stages, &[Slot::Read, Slot::Write]);
        let none = wgpu::BufferUsages::empty();
        let list_bytes = 4 * (u64::from(lists) + 1);
        let entries = 4 * capacity * u64::from(options.entries_per_footprint);
        Ok(Self {
            options: *options,
            grid: filled_buffer(
                device,
                "gather grid",
                wgpu::BufferUsages::UNIFORM,
                bytemuck::bytes_of(&grid),
            )?,
            count: build.compute(device, &BUILD, "gather_count", &kernel),
            scatter: build.compute(device, &BUILD, "gather_scatter", &kernel),
            prefix_sum: PrefixSumPass::new(device),
            evaluate: compute_pipeline(
                device,
                &[&lookup, &points],
                &POINTS,
                "gather_points",
                &kernel,
            ),
            build,
            lookup,
            points,
            lists,
            densities: make("prepared footprints", capacity * DENSITY_BYTES, none)?,
            list_counts: make("counts of lists", list_bytes, wgpu::BufferUsages::COPY_DST)?,
            list_starts: make("starts of lists", list_bytes, none)?,
            entries: make("entries of lists", entries, none)?,
            counts: make(
                "counts of footprints",
                GatherCounts::BYTES,
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            )?,
        })
    }

    /// WGSL to put before a shader of the host's. It declares `caustics_irradiance`, and
    /// `caustics_irradiance_on` for points whose object is known. Besides, it declares names that
    /// begin with `caustics_`, `gather_`, `gate_`, `density_`, `kernel_` and `covariance_`, and those
    /// in `shaders/gate.wgsl` and `shaders/density.wgsl`; its bindings are `first` to `first + 4` of `group`: a
    /// uniform buffer, then four read-only storage buffers, as [`bindings`](Self::bindings) gives
    /// them. The host's pipeline sets the constant that [`constant`](Self::constant) names.
    ///
    /// ```
    /// let source = caustics_wgpu::Gather::source(2, 3);
    /// assert!(source.contains("@group(2) @binding(7)"));
    /// assert!(source.contains("fn caustics_irradiance(position: vec3<f32>, normal: vec3<f32>)"));
    /// ```
    #[must_use]
    pub fn source(group: u32, first: u32) -> String {
        let mut source = LOOKUP.source();
        for binding in 0..5 {
            source = source.replace(
                &format!("@group(0) @binding({binding}) var"),
                &format!("@group({group}) @binding ({}) var", first + binding),
            );
        }
        // Two steps, so that no binding is replaced twice.
        source.replace("@binding (", "@binding(")
    }

    /// The pipeline constant that says which kernel it is: its name and its value.
    #[must_use]
    pub fn constant(&self) -> (&'static str, f64) {
        self.options.kernel.constant()
    }

    /// What a shader with [`source`](Self::source) binds, in order.
    #[must_use]
    pub fn bindings(&self) -> [wgpu::BindingResource<'_>; 5] {
        [
            self.grid.as_entire_binding(),
            self.densities.as_entire_binding(),
            self.list_starts.as_entire_binding(),
            self.entries.as_entire_binding(),
            self.counts.as_entire_binding(),
        ]
    }

    /// The counts, [`GatherCounts::BYTES`] for the host to copy.
    #[must_use]
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// Records the sorting of a batch of footprints, instead of what was there before.
    ///
    /// # Errors
    /// A batch with room for more footprints than this has, or a device that is lost or out of
    /// memory.
    pub fn build(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        batch: &FootprintBatch<'_>,
    ) -> Result<(), RendererError> {
        if batch.capacity() > self.options.capacity {
            let record = size_of::<FootprintRecord>() as u64;
            return Err(RendererError::Gpu(GpuError::BufferTooLarge {
                what: "the footprints to gather",
                bytes: u64::from(batch.capacity()) * record,
                limit: u64::from(self.options.capacity) * record,
            }));
        }
        caught(device, || {
            let mut recorder = Recorder::new(encoder, None);
            recorder.encoder.clear_buffer(&self.list_counts, 0, None);
            recorder.encoder.clear_buffer(&self.counts, 0, None);
            let group = self.build.bind(
                device,
                &[
                    self.grid.as_entire_binding(),
                    batch.records.as_entire_binding(),
                    batch.count.as_entire_binding(),
                    self.densities.as_entire_binding(),
                    self.list_counts.as_entire_binding(),
                    self.list_starts.as_entire_binding(),
                    self.entries.as_entire_binding(),
                    self.counts.as_entire_binding(),
                ],
            );
            let sum = self.prefix_sum.prepare(
                device,
                &self.list_counts,
                &self.list_starts,
                self.lists,
            )?;
            let groups = batch.capacity().div_ceil(GROUP).max(1);
            let mut pass = recorder.compute("gather_build", 5);
            pass.set_bind_group(0, &group, &[]);
            pass.set_pipeline(&self.count);
            pass.dispatch_workgroups(groups, 1, 1);
            self.prefix_sum.record(&mut pass, &sum);
            pass.set_bind_group(0, &group, &[]);
            pass.set_pipeline(&self.scatter);
            pass.dispatch_workgroups(groups, 1, 1);
            Ok(())
        })
    }

    /// Records the irradiance, in W/m² for each channel and a 0, at each [`GatherPoint`] of a
    /// buffer, into another of four floats each.
    ///
    /// # Errors
    /// A device that is lost or out of memory, or a buffer without the usage `STORAGE`.
    pub fn evaluate(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        points: &wgpu::Buffer,
        irradiance: &wgpu::Buffer,
    ) -> Result<(), RendererError> {
        caught(device, || {
            let lookup = self.lookup.bind(device, &self.bindings());
            let resources = [points.as_entire_binding(), irradiance.as_entire_binding()];
            let group = self.points.bind(device, &resources);
            let count = points.size() / size_of::<GatherPoint>() as u64;
            let groups = count.div_ceil(u64::from(POINT_GROUP)).max(1);
            let mut recorder = Recorder::new(encoder, None);
            let mut pass = recorder.compute("gather_points", 1);
            pass.set_pipeline(&self.evaluate);
            pass.set_bind_group(0, &lookup, &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups(u32::try_from(groups).unwrap_or(u32::MAX), 1, 1);
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};

    #[test]
    fn the_shaders_are_valid_and_agree_with_rust() {
        let (module, _) = reflection::validated(&BUILD).unwrap();
        assert_layout!(
            &module,
            GatherGrid {
                cell,
                lists,
                scale,
                max_anisotropy,
                least_extent,
                most_extent,
                pad,
                truncation,
            }
        );
        let (module, _) = reflection::validated(&POINTS).unwrap();
        assert_layout!(
            &module,
            GatherPoint {
                position,
                pad_a,
                normal,
                object_plus_one
            }
        );
    }

    #[test]
    fn a_shader_can_include_the_source_at_any_binding() {
        let main = "@group(0) @binding(0) var<storage, read_write> out: vec3<f32>;
            @compute @workgroup_size(1)
            fn main() { out = caustics_irradiance(vec3<f32>(0.0), vec3<f32>(0.0, 1.0, 0.0)); }";
        let source = Gather::source(0, 1) + main;
        let module = naga::front::wgsl::parse_str(&source).unwrap();
        let mut bindings: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(_, it)| it.binding)
            .map(|it| (it.group, it.binding))
            .collect();
        bindings.sort_unstable();
        assert_eq!(bindings, [(0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (0, 5)]);
    }
}
