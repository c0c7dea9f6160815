// What one dispatch of the tracer is told. Twin: trace_params.rs.

const MAX_EMITTERS: u32 = 64u;

// The rays of a light to a caster as an image of the unit square, and the photons that it has.
// Twins: `EmissionDomain` and `EmissionBatch` in caustics-trace.
struct Emitter {
    kind: u32,
    // Number of its first photon among all, and how many it has.
    first: u32,
    count: u32,
    // Points of the whole set that its photons are made from.
    points: u32,
    // Where in a cell of the grid the point lies; or the rotation of a lattice.
    place: vec2<f32>,
    // Generator of its Fibonacci lattice.
    generator: u32,
    // 1 / points.
    share: f32,
    // The media around its start, as in `MediumStack`.
    media: vec4<u32>,
    // The point that rays start from, the corner of a rectangle or a triangle, or the middle of a disc
    // or a ball.
    origin: vec3<f32>,
    // Of the cone or the sphere.
    solid_angle: f32,
    // Of the cone's, the disc's or the cap's frame, or the first edge of a rectangle or a triangle.
    tangent: vec3<f32>,
    // 1 - cosine of the cone's or the cap's half angle.
    height: f32,
    // The frame's other axis, or the other edge from the corner.
    bitangent: vec3<f32>,
    // Of the spot light's cones; below -1 where all directions are alike.
    inner_cosine: f32,
    // Of the frame, or the rectangle's rays, or the normal of a surface that shines.
    axis: vec3<f32>,
    outer_cosine: f32,
    // Radiant intensity, irradiance or radiance; of a sky the most that a texel's radiance is of its
    // density.
    intensity: vec3<f32>,
    // Of the rectangle or the surface that shines, or across the sky's target.
    area: f32,
    // Of the spot light.
    spot_axis: vec3<f32>,
    // 1 where an object's front emits, -1 for its back.
    side: f32,
    // The sphere that an area light or a sky aims at; its radius is negative where there is none.
    target_center: vec3<f32>,
    target_radius: f32,
    // An emissive object's primitives and the place of their cumulative areas.
    first_primitive: u32,
    primitive_count: u32,
    first_cumulative: u32,
    media_count: u32,
    // The two shortest vectors of its Fibonacci lattice.
    basis: vec4<f32>,
    // Rows of its grid.
    rows: u32,
    // Which random streams are its photons'.
    stream: u32,
    // What it is aimed at; `NO_CASTER` where everything counts.
    caster: u32,
    // The first emitter of the same light.
    first_of_light: u32,
    // The runs of points that photons are made from, pairs of the first point and the photons before;
    // none where all points are used.
    first_span: u32,
    span_count: u32,
    // The cells of the unit square that send photons; `NO_MAP` where all do.
    first_map: u32,
    // Which kind of surface shines.
    surface: u32,
    // Of the disc or the ball; or how far before its target the sky's rays start.
    radius: f32,
    // Where the environment's rows and texels begin, and how many there are; see sky_emission.wgsl.
    sky_first: u32,
    sky_width: u32,
    sky_height: u32,
    // How dense its points are: where that is in `emission_lists`, and cells along each side; none where
    // they are evenly spread. See guide.wgsl.
    first_density: u32,
    density_cells: u32,
    unused_a: u32,
    unused_b: u32,
}

struct TraceParams {
    // Always 0, which no compiler knows; see rounding.wgsl.
    zero: u32,
    // The photons of this dispatch, and the number of the first photon of the batch.
    first: u32,
    count: u32,
    batch_first: u32,
    emitter_count: u32,
    sequence: u32,
    seed_low: u32,
    seed_high: u32,
    max_depth: u32,
    branching: u32,
    min_weight: f32,
    // Units of the ledger's sums in a watt.
    flux_scale: f32,
    // Where in `links` the records' entries begin.
    first_link: u32,
    root: u32,
    flags: u32,
    // Photons that are traced for the batch: its own, and those beside them.
    slots: u32,
    // Where in `links` the places of records to be divided begin.
    first_edge: u32,
    // Where in `emission_lists` the boundaries begin; `NO_BOUNDARIES` where there are none.
    first_boundary: u32,
    unused_b: u32,
    unused_c: u32,
    emitters: array<Emitter, MAX_EMITTERS>,
}

// Footprints are checked against where neighbours landed.
const FLAG_CHECKS: u32 = 1u;
// These photons are of other batches, and are traced as neighbours of this one's.
const FLAG_NEIGHBOURS_ONLY: u32 = 2u;

const EMITTER_SPHERE: u32 = 0u;
const EMITTER_CONE: u32 = 1u;
const EMITTER_RECTANGLE: u32 = 2u;
const EMITTER_AREA: u32 = 3u;
const EMITTER_SKY: u32 = 4u;

const SURFACE_OBJECT: u32 = 0u;
const SURFACE_RECTANGLE: u32 = 1u;
const SURFACE_DISC: u32 = 2u;
const SURFACE_CAP: u32 = 3u;
const SURFACE_TRIANGLE: u32 = 4u;

const NO_CASTER: u32 = 0xffffffffu;
const NO_MAP: u32 = 0xffffffffu;

const SEQUENCE_HALTON: u32 = 0u;
const SEQUENCE_SOBOL: u32 = 1u;
const SEQUENCE_GRID: u32 = 2u;
const SEQUENCE_FIBONACCI: u32 = 3u;
const SEQUENCE_KRONECKER: u32 = 4u;

const BRANCHING_ROULETTE: u32 = 0u;
const BRANCHING_SPLIT_FIRST: u32 = 1u;
const BRANCHING_SPLIT_ALL: u32 = 2u;

@group(0) @binding(0) var<uniform> trace: TraceParams;
