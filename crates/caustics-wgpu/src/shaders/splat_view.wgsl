// One view's map between the world and its pixels, and the sizes of its levels of resolution.
// CPU twins: `screen.rs` and `texel_level.rs` of caustics-render.

const LEVELS: u32 = 7u;
const TILE: u32 = 16u;

// Rust mirror: `GpuSplatView`.
struct SplatView {
    view_projection: mat4x4<f32>,
    inverse_view_projection: mat4x4<f32>,
    // Homogeneous: a place in perspective, minus the view direction (w = 0) else.
    eye: vec4<f32>,
    size: vec2<u32>,
    // 0: signed, 1: from 0..1.
    normal_encoding: u32,
    // 0: the first input is depth, 1: it is a world-space position.
    has_positions: u32,
    // Depth of a pixel at which nothing was drawn.
    background_depth: f32,
    // Standard deviation of the kernel along a footprint's axis, in sample spacings.
    scale: f32,
    // 0 for no limit.
    max_anisotropy: f32,
    has_objects: u32,
    // Whether footprints as small as pixels are integrated over them.
    integrate_pixels: u32,
    surrounding_levels: u32,
    pad: vec2<u32>,
    // See `Truncations`.
    truncation: vec4<f32>,
    // Width, height, tiles across, first tile.
    levels: array<vec4<u32>, 8>,
    // Levels of what tiles of the picture show: width, height, first tile.
    surroundings: array<vec4<u32>, 12>,
}

// Rust mirror: `GpuSplatStep`.
struct SplatStep {
    level: u32,
    // Whether nothing has been accumulated before.
    is_first: u32,
    // Layers of the accumulated irradiance.
    layers: u32,
    // Tiles whose pairs do not fit together are summed in as many rounds as it takes.
    round: u32,
}

// One pixel's receiver: position, and the normal (octahedral); `NO_RECEIVER` where there is none.
const NO_RECEIVER: u32 = 0x80008000u;

// The least cosine between the normals of two pixels of one smooth surface.
const SMOOTH_COSINE: f32 = 0.98;
