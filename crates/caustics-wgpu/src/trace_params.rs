//! Mirrors of the structs of `shaders/trace_params.wgsl`.

use bytemuck::{Pod, Zeroable};

/// The number of no caster.
pub(crate) const NO_CASTER: u32 = u32::MAX;

/// Emitters that one dispatch can be told of.
pub(crate) const MAX_EMITTERS: usize = 64;

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Emitter {
    pub(crate) kind: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) points: u32,
    pub(crate) place: [f32; 2],
    pub(crate) generator: u32,
    pub(crate) share: f32,
    pub(crate) media: [u32; 4],
    pub(crate) origin: [f32; 3],
    pub(crate) solid_angle: f32,
    pub(crate) tangent: [f32; 3],
    pub(crate) height: f32,
    pub(crate) bitangent: [f32; 3],
    pub(crate) inner_cosine: f32,
    pub(crate) axis: [f32; 3],
    pub(crate) outer_cosine: f32,
    pub(crate) intensity: [f32; 3],
    pub(crate) area: f32,
    pub(crate) spot_axis: [f32; 3],
    pub(crate) side: f32,
    pub(crate) target_center: [f32; 3],
    pub(crate) target_radius: f32,
    pub(crate) first_primitive: u32,
    pub(crate) primitive_count: u32,
    pub(crate) first_cumulative: u32,
    pub(crate) media_count: u32,
    pub(crate) basis: [f32; 4],
    pub(crate) rows: u32,
    pub(crate) stream: u32,
    pub(crate) caster: u32,
    pub(crate) first_of_light: u32,
    pub(crate) first_span: u32,
    pub(crate) span_count: u32,
    pub(crate) first_map: u32,
    pub(crate) surface: u32,
    pub(crate) radius: f32,
    pub(crate) sky_first: u32,
    pub(crate) sky_width: u32,
    pub(crate) sky_height: u32,
    pub(crate) first_density: u32,
    pub(crate) density_cells: u32,
    pub(crate) unused_a: u32,
    pub(crate) unused_b: u32,
}

impl Emitter {
    pub(crate) const SPHERE: u32 = 0;
    pub(crate) const CONE: u32 = 1;
    pub(crate) const RECTANGLE: u32 = 2;
    pub(crate) const AREA: u32 = 3;
    pub(crate) const SKY: u32 = 4;

    pub(crate) const SURFACE_OBJECT: u32 = 0;
    pub(crate) const SURFACE_RECTANGLE: u32 = 1;
    pub(crate) const SURFACE_DISC: u32 = 2;
    pub(crate) const SURFACE_CAP: u32 = 3;
    pub(crate) const SURFACE_TRIANGLE: u32 = 4;

    pub(crate) const NO_MAP: u32 = u32::MAX;
}

#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TraceParams {
    pub(crate) zero: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) batch_first: u32,
    pub(crate) emitter_count: u32,
    pub(crate) sequence: u32,
    pub(crate) seed_low: u32,
    pub(crate) seed_high: u32,
    pub(crate) max_depth: u32,
    pub(crate) branching: u32,
    pub(crate) min_weight: f32,
    pub(crate) flux_scale: f32,
    pub(crate) first_link: u32,
    pub(crate) root: u32,
    pub(crate) flags: u32,
    pub(crate) slots: u32,
    pub(crate) first_edge: u32,
    /// Where in the lists the boundaries begin; [`NO_BOUNDARIES`](Self::NO_BOUNDARIES) where there are none.
    pub(crate) first_boundary: u32,
    pub(crate) unused_b: u32,
    pub(crate) unused_c: u32,
    pub(crate) emitters: [Emitter; MAX_EMITTERS],
}

impl TraceParams {
    pub(crate) const CHECKS: u32 = 1;
    pub(crate) const NEIGHBOURS_ONLY: u32 = 2;

    pub(crate) const NO_BOUNDARIES: u32 = u32::MAX;
}
