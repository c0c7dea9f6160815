use std::ops::Range;

use crate::GpuError;
use crate::error_scope::filled_buffer;
use crate::pass_layout::{PassLayout, Slot};
use crate::photon_buffers::PhotonBuffers;
use crate::photon_order::{PhotonOrder, dispatch};
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::{SceneBuffers, fits};
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};
use crate::trace_params::{MAX_EMITTERS, TraceParams};
use crate::trace_plan::{PlannedEmitter, TracePlan};

/// Photons of one workgroup. Mirrors `WORKGROUP_SIZE` in `shaders/tracer.wgsl`.
const WORKGROUP_SIZE: u32 = 64;

/// Which hierarchy rays traverse. Both give the same hits.
///
/// Chosen by measurement on a software adapter (8 invocations in lockstep), as the speed of tracing
/// 10,000 photons, relative to a loop over binary nodes with every test of a leaf in it; the forms ran
/// in turn in one process, on `p01_sphere`, `p03_cognac` and `p06_wave_plane` of the tests' scenes:
///
/// | form | speed |
/// | --- | --- |
/// | binary, all tests in the loop, entry distances on the stack | 1, 1, 1 |
/// | binary, spheres and exact edges apart, nodes alone on the stack ([`Binary`](Self::Binary)) | 2.18, 2.15, 1.48 |
/// | wide, leaves in the loop over nodes | 2.72, 2.40, 1.77 |
/// | wide, leaves after a loop over nodes ([`Wide`](Self::Wide)) | 2.71, 2.67, 2.00 |
///
/// On top of the last, pushing children unsorted made 0.87 to 0.99 of its speed, and an invocation that begins another photon when it is done
/// with one 0.64 to 1.01, the less coherent its photons were. `docs/gpu.md` has both hierarchies on
/// all scenes. What a GPU prefers is not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Hierarchy {
    /// Two children a node, 32 bytes each, in full precision.
    Binary,
    /// Four children a node, 64 bytes for all, with boxes in 255 steps along each axis.
    #[default]
    Wide,
}

impl Hierarchy {
    /// All hierarchies.
    pub const ALL: [Self; 2] = [Self::Binary, Self::Wide];
}

/// The pieces of a tracer's shader, but for those that say how many parameters a ray has and how its
/// hits are found.
macro_rules! pieces {
    ($parameters:literal, $nodes:literal, $traverse:literal) => {
        &[
            shader_piece!($parameters),
            FOOTPRINT_RECORD,
            shader_piece!("trace_params"),
            shader_piece!("scene"),
            shader_piece!("scene_bindings"),
            shader_piece!($nodes),
            shader_piece!("rounding"),
            shader_piece!("vector"),
            shader_piece!("double_float"),
            shader_piece!("random"),
            shader_piece!("wide_integer"),
            shader_piece!("sobol"),
            shader_piece!("halton"),
            shader_piece!("grid"),
            shader_piece!("lattice"),
            shader_piece!("point_set"),
            shader_piece!("warp"),
            shader_piece!("warp_inverse"),
            shader_piece!("ray"),
            shader_piece!("watertight"),
            shader_piece!("sphere"),
            shader_piece!("leaf_test"),
            shader_piece!($traverse),
            shader_piece!("spawn"),
            shader_piece!("surface"),
            shader_piece!("optics"),
            shader_piece!("media"),
            shader_piece!("scatter"),
            shader_piece!("differential"),
            shader_piece!("emission"),
            shader_piece!("area_emission"),
            shader_piece!("overlap"),
            shader_piece!("ledger"),
            shader_piece!("photon_links"),
            shader_piece!("photon_store"),
            shader_piece!("tracer"),
        ]
    };
}

/// For lights without area, whose rays have two parameters, and for area lights, whose rays have
/// four.
const BINARY: [Shader; 2] = [
    Shader {
        label: "tracer of 2 parameters, binary",
        pieces: pieces!("parameters_2", "binary_nodes", "traverse"),
    },
    Shader {
        label: "tracer of 4 parameters, binary",
        pieces: pieces!("parameters_4", "binary_nodes", "traverse"),
    },
];

/// Likewise.
const WIDE: [Shader; 2] = [
    Shader {
        label: "tracer of 2 parameters",
        pieces: pieces!("parameters_2", "wide_nodes", "traverse_wide"),
    },
    Shader {
        label: "tracer of 4 parameters",
        pieces: pieces!("parameters_4", "wide_nodes", "traverse_wide"),
    },
];

/// What the shader binds, in the order of its bindings.
const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Write,
    Slot::Write,
    Slot::Write,
];

/// Traces photons on the GPU: emission, flight and landing in one dispatch, one photon to an
/// invocation; then their records are put in order, and their footprints checked.
///
/// It binds eight storage buffers, as many as WebGPU's default limits allow.
#[derive(Clone, Debug)]
pub struct PhotonTracer {
    layout: PassLayout,
    /// For rays of 2 and of 4 parameters.
    pipelines: [wgpu::ComputePipeline; 2],
    hierarchy: Hierarchy,
    order: PhotonOrder,
}

impl PhotonTracer {
    /// Compiles the shaders. What the device has against them it tells its error scopes.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_hierarchy(device, Hierarchy::default())
    }

    /// Likewise, with a choice.
    #[must_use]
    pub fn with_hierarchy(device: &wgpu::Device, hierarchy: Hierarchy) -> Self {
        let layout = PassLayout::new(device, "photon tracer", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let shaders = match hierarchy {
            Hierarchy::Binary => BINARY,
            Hierarchy::Wide => WIDE,
        };
        Self {
            pipelines: shaders.map(|shader| layout.compute(device, &shader, "trace_photons", &[])),
            layout,
            hierarchy,
            order: PhotonOrder::new(device),
        }
    }

    /// Records the tracing of a range of the plan's photons, whose records fill the buffers.
    ///
    /// Before the first batch of a frame call [`PhotonBuffers::clear`]; before every other,
    /// [`PhotonBuffers::forget_records`]. With
    /// [`TraceOptions::check_footprints`](caustics_trace::TraceOptions::check_footprints), photons
    /// beside the range are traced again with it, so that batches have the footprints of one run.
    ///
    /// # Errors
    /// [`GpuError::PhotonRange`], as [`RendererError::Gpu`]; [`RendererError::DeviceLost`].
    pub fn trace(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        scene: &SceneBuffers,
        plan: &TracePlan,
        photons: Range<u32>,
        into: &PhotonBuffers,
    ) -> Result<RecordedWork, RendererError> {
        let mut recorder = Recorder::new(encoder, None);
        self.record(device, &mut recorder, scene, plan, photons, into)?;
        Ok(recorder.finish().1)
    }

    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        scene: &SceneBuffers,
        plan: &TracePlan,
        photons: Range<u32>,
        into: &PhotonBuffers,
    ) -> Result<(), RendererError> {
        if photons.end > plan.photons() || photons.len() as u64 > u64::from(into.photons()) {
            return Err(RendererError::Gpu(GpuError::PhotonRange {
                first: photons.start,
                end: photons.end,
                photons: plan.photons(),
                batch: into.photons(),
            }));
        }
        let scratch = &into.scratch;
        let wider = plan.with_neighbours(&photons);
        let slots = wider.len() as u32;
        if slots > scratch.slots {
            return Err(RendererError::Gpu(GpuError::PhotonRange {
                first: wider.start,
                end: wider.end,
                photons: plan.photons(),
                batch: scratch.slots,
            }));
        }
        // A photon that no dispatch is for has no records.
        recorder.encoder.clear_buffer(&scratch.links, 0, None);
        fits(device, "lists of emitters", 4 * plan.lists.len() as u64)?;
        let lists = filled_buffer(
            device,
            "lists of emitters",
            wgpu::BufferUsages::STORAGE,
            bytemuck::cast_slice(&plan.lists),
        )?;
        // The batch's own photons first: if there is no room for all, neighbours go without.
        let ranges = [
            photons.clone(),
            wider.start..photons.start,
            photons.end..wider.end,
        ];
        let mut dispatches = Vec::new();
        for (number, range) in ranges.iter().enumerate() {
            for part in dispatches_of(&plan.emitters, range) {
                let mut params = params(scene, plan, &part, into);
                params.batch_first = photons.start;
                params.slots = slots;
                if number > 0 {
                    params.flags |= TraceParams::NEIGHBOURS_ONLY;
                }
                let uniform = filled_buffer(
                    device,
                    "trace params",
                    wgpu::BufferUsages::UNIFORM,
                    bytemuck::bytes_of(&params),
                )?;
                let resources = [
                    &uniform,
                    match self.hierarchy {
                        Hierarchy::Binary => &scene.nodes,
                        Hierarchy::Wide => &scene.wide_nodes,
                    },
                    &scene.vertices,
                    &scene.triangles,
                    &scene.bodies,
                    &lists,
                    &scratch.appended,
                    &into.counters,
                    &scratch.links,
                ]
                .map(wgpu::Buffer::as_entire_binding);
                let group = self.layout.bind(device, &resources);
                dispatches.push((part, uniform, group, number == 0));
            }
        }
        let mut pass = recorder.compute("trace", dispatches.len() as u32);
        for (part, _, group, _) in &dispatches {
            pass.set_pipeline(&self.pipelines[usize::from(part.dimensions > 2)]);
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, part.photons.len() as u32, WORKGROUP_SIZE);
        }
        drop(pass);
        let own = dispatches.iter().filter(|(.., is_own)| *is_own);
        let parts: Vec<_> = own
            .map(|(part, uniform, ..)| (uniform, part.photons.len() as u32))
            .collect();
        let count = photons.len() as u32;
        self.order
            .record(device, recorder, count, &parts, &lists, into)
    }
}

/// What a dispatch is told, but for what it has in common with the others of its batch.
fn params(
    scene: &SceneBuffers,
    plan: &TracePlan,
    part: &Dispatch,
    into: &PhotonBuffers,
) -> TraceParams {
    let checks = plan.checks_footprints(part.dimensions);
    let mut params = TraceParams {
        zero: 0,
        first: part.photons.start,
        count: part.photons.len() as u32,
        batch_first: 0,
        emitter_count: part.emitters.len() as u32,
        sequence: plan.sequence(),
        seed_low: plan.options.seed as u32,
        seed_high: (plan.options.seed >> 32) as u32,
        max_depth: plan.options.max_depth,
        branching: plan.branching(),
        min_weight: plan.options.min_weight,
        flux_scale: plan.flux_scale,
        first_link: into.scratch.slots,
        root: scene.root,
        flags: if checks { TraceParams::CHECKS } else { 0 },
        slots: 0,
        emitters: [crate::trace_params::Emitter::default(); MAX_EMITTERS],
    };
    let emitters = &plan.emitters[part.emitters.clone()];
    for (slot, emitter) in params.emitters.iter_mut().zip(emitters) {
        *slot = emitter.mirror;
        slot.first_of_light -= part.emitters.start as u32;
    }
    params
}

/// Consecutive photons of emitters that are all of one kind.
#[derive(Clone, Debug, PartialEq)]
struct Dispatch {
    photons: Range<u32>,
    emitters: Range<usize>,
    dimensions: u32,
}

/// The fewest dispatches for a range of photons. Those of one light stay together, since each emitter
/// asks what the light's earlier ones cover.
fn dispatches_of(emitters: &[PlannedEmitter], photons: &Range<u32>) -> Vec<Dispatch> {
    let mut all: Vec<Dispatch> = Vec::new();
    let mut index = 0;
    for light in emitters.chunk_by(|a, b| a.mirror.first_of_light == b.mirror.first_of_light) {
        let of_light = index..index + light.len();
        index = of_light.end;
        let [first, last] = [&light[0].mirror, &light[light.len() - 1].mirror];
        let start = first.first.max(photons.start);
        let end = (last.first + last.count).min(photons.end);
        if start >= end {
            continue;
        }
        let dimensions = light[0].dimensions;
        match all.last_mut() {
            Some(before)
                if before.dimensions == dimensions
                    && before.photons.end == start
                    && before.emitters.end == of_light.start
                    && of_light.end - before.emitters.start <= MAX_EMITTERS =>
            {
                before.photons.end = end;
                before.emitters.end = of_light.end;
            }
            _ => all.push(Dispatch {
                photons: start..end,
                emitters: of_light,
                dimensions,
            }),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TraceCounters;
    use crate::gpu_scene::{
        Body, LEAF_BIT, NO_PRIMITIVE, Node, SPHERE_BIT, Triangle, Vertex, WideNode,
    };
    use crate::scene_hierarchy::MAX_WAITING;
    use crate::shader::ShaderPiece;
    use crate::shader::{assert_layout, reflection};
    use crate::trace_params::{Emitter, NO_CASTER};
    use caustics_trace::ProjectionMap;

    #[test]
    fn every_variant_is_valid_and_agrees_with_rust() {
        let all = BINARY.into_iter().chain(WIDE);
        for (shader, parameters) in all.zip([2, 4, 2, 4]) {
            let (module, _) = reflection::validated(&shader).unwrap_or_else(|it| panic!("{it}"));
            let slots: Vec<(u32, Slot)> = (0..).zip(SLOTS).collect();
            assert_eq!(reflection::buffers(&module), slots);
            let size = reflection::workgroup_size(&module, "trace_photons");
            assert_eq!(size, [WORKGROUP_SIZE, 1, 1]);
            let constant = |name| reflection::constant(&module, name);
            assert_eq!(constant("PARAMETERS"), parameters);
            assert_eq!(constant("MAX_EMITTERS"), MAX_EMITTERS as u32);
            assert_eq!(constant("MAX_WAITING"), MAX_WAITING);
            assert_eq!(constant("LEAF_BIT"), LEAF_BIT);
            assert_eq!(constant("SPHERE_BIT"), SPHERE_BIT);
            assert_eq!(constant("NO_PRIMITIVE"), NO_PRIMITIVE);
            assert_eq!(constant("COUNTERS"), TraceCounters::WORDS as u32);
            assert_eq!(constant("BODY_RECEIVER"), Body::RECEIVER);
            assert_eq!(constant("BODY_DIELECTRIC"), Body::DIELECTRIC);
            assert_eq!(constant("BODY_METAL"), Body::METAL);
            assert_eq!(constant("EMITTER_SPHERE"), Emitter::SPHERE);
            assert_eq!(constant("EMITTER_CONE"), Emitter::CONE);
            assert_eq!(constant("EMITTER_RECTANGLE"), Emitter::RECTANGLE);
            assert_eq!(constant("EMITTER_AREA"), Emitter::AREA);
            assert_eq!(constant("SURFACE_OBJECT"), Emitter::SURFACE_OBJECT);
            assert_eq!(constant("SURFACE_RECTANGLE"), Emitter::SURFACE_RECTANGLE);
            assert_eq!(constant("SURFACE_DISC"), Emitter::SURFACE_DISC);
            assert_eq!(constant("SURFACE_CAP"), Emitter::SURFACE_CAP);
            assert_eq!(constant("NO_CASTER"), NO_CASTER);
            assert_eq!(constant("NO_MAP"), Emitter::NO_MAP);
            assert_eq!(
                constant("FLAG_NEIGHBOURS_ONLY"),
                TraceParams::NEIGHBOURS_ONLY
            );
            assert_eq!(constant("MAP_RESOLUTION"), ProjectionMap::RESOLUTION);
        }
    }

    #[test]
    fn structs_are_laid_out_as_in_rust() {
        let (module, _) = reflection::validated(&WIDE[0]).unwrap();
        assert_layout!(
            &module,
            Node {
                low,
                first,
                high,
                is_leaf
            }
        );
        assert_layout!(
            &module,
            WideNode {
                origin,
                exponents,
                low,
                unused_a,
                high,
                unused_b,
                children
            }
        );
        assert_layout!(
            &module,
            Vertex {
                position,
                normal_x,
                normal_y,
                normal_z,
                unused_a,
                unused_b
            }
        );
        assert_layout!(&module, Triangle { a, b, c, body });
        assert_layout!(
            &module,
            Body {
                color,
                kind,
                channel_ior,
                ior,
                center,
                radius,
                object,
                priority,
                disperses,
                caster
            }
        );
        assert_layout!(
            &module,
            Emitter {
                kind,
                first,
                count,
                points,
                place,
                generator,
                share,
                media,
                origin,
                solid_angle,
                tangent,
                height,
                bitangent,
                inner_cosine,
                axis,
                outer_cosine,
                intensity,
                area,
                spot_axis,
                side,
                target_center,
                target_radius,
                first_primitive,
                primitive_count,
                first_cumulative,
                media_count,
                basis,
                rows,
                stream,
                caster,
                first_of_light,
                first_span,
                span_count,
                first_map,
                surface,
                radius,
                unused_a,
                unused_b,
                unused_c,
            }
        );
        assert_layout!(
            &module,
            TraceParams {
                zero,
                first,
                count,
                batch_first,
                emitter_count,
                sequence,
                seed_low,
                seed_high,
                max_depth,
                branching,
                min_weight,
                flux_scale,
                first_link,
                root,
                flags,
                slots,
                emitters,
            }
        );
    }

    #[test]
    fn counters_lie_where_rust_reads_them() {
        let (module, _) = reflection::validated(&WIDE[0]).unwrap();
        let words = [
            ("COUNTER_STORED", TraceCounters::STORED),
            ("COUNTER_LINES", TraceCounters::LINES),
            ("COUNTER_RAYS", TraceCounters::RAYS),
            ("COUNTER_FALLBACKS", TraceCounters::FALLBACKS),
            ("COUNTER_BOUNDED", TraceCounters::BOUNDED),
            ("COUNTER_REPLACED", TraceCounters::REPLACED),
            ("COUNTER_SUMS", TraceCounters::SUMS),
            ("FATE_CROWDED", TraceCounters::CROWDED),
            ("LINE_EMITTED", TraceCounters::EMITTED),
            ("LINE_ROULETTE_GAIN", TraceCounters::ROULETTE_GAIN),
        ];
        for (name, word) in words {
            assert_eq!(reflection::constant(&module, name), word as u32, "{name}");
        }
        for (line, fate) in TraceCounters::FATES.into_iter().enumerate() {
            let name = format!("FATE_{}", fate.name().to_uppercase().replace(' ', "_"));
            assert_eq!(reflection::constant(&module, &name), line as u32);
        }
        let sums = TraceCounters::WORDS - TraceCounters::SUMS;
        assert_eq!(sums as u32, 6 * reflection::constant(&module, "LINES"));
    }

    /// The variant for area lights with a piece after the others.
    fn with_piece(source: &'static str) -> Shader {
        let mut pieces = WIDE[1].pieces.to_vec();
        pieces.push(ShaderPiece {
            name: "last",
            source,
        });
        Shader {
            label: "changed",
            pieces: pieces.leak(),
        }
    }

    #[test]
    fn a_broken_variant_is_rejected() {
        assert!(reflection::validated(&with_piece("fn whole() -> u32 { return 1u; }\n")).is_ok());
        for broken in [
            "fn wrong_type() -> u32 { return trace.min_weight; }\n",
            "fn no_such_member() -> f32 { return trace.max_weight; }\n",
            "const SPHERE_BIT: u32 = 1u;\n",
            "fn writes_the_scene() { wide_nodes[0].exponents = 1u; }\n",
        ] {
            assert!(
                reflection::validated(&with_piece(broken)).is_err(),
                "{broken}"
            );
        }
    }

    #[test]
    fn a_layout_that_differs_is_seen() {
        let moved = "struct Moved { a: f32, position: vec3<f32> }\n\
                     fn first_of(it: Moved) -> f32 { return it.a; }\n";
        let (module, _) = reflection::validated(&with_piece(moved)).unwrap();
        let (members, size) = reflection::layout(&module, "Moved");
        assert_eq!(members[1], ("position".to_owned(), 16));
        assert_eq!(size, 32);
    }

    #[test]
    fn photons_of_one_kind_share_a_dispatch() {
        let emitter = |first, count, first_of_light, dimensions| PlannedEmitter {
            mirror: Emitter {
                first,
                count,
                first_of_light,
                ..Emitter::default()
            },
            dimensions,
        };
        // Two emitters of one light, one of which has no photons; others of one each.
        let emitters = vec![
            emitter(0, 0, 0, 2),
            emitter(0, 10, 0, 2),
            emitter(10, 5, 2, 2),
            emitter(15, 7, 3, 4),
            emitter(22, 3, 4, 2),
        ];
        let expected = |photons, emitters, dimensions| Dispatch {
            photons,
            emitters,
            dimensions,
        };
        assert_eq!(
            dispatches_of(&emitters, &(0..25)),
            [
                expected(0..15, 0..3, 2),
                expected(15..22, 3..4, 4),
                expected(22..25, 4..5, 2)
            ]
        );
        assert_eq!(
            dispatches_of(&emitters, &(12..17)),
            [expected(12..15, 2..3, 2), expected(15..17, 3..4, 4)]
        );
        assert_eq!(dispatches_of(&emitters, &(4..9)), [expected(4..9, 0..2, 2)]);
        assert_eq!(dispatches_of(&emitters, &(5..5)), []);
        let many: Vec<_> = (0..130).map(|first| emitter(first, 1, first, 2)).collect();
        assert_eq!(dispatches_of(&many, &(0..130)).len(), 3);
    }
}
