// A hash grid of footprints: which cell a place lies in at each of 32 sizes, and which list a cell
// has. A footprint stands in the lists of the up to eight cells that its box touches, at the size
// at which a cell is at least as large as the box; so a place looks at one list for each size.

const NO_FOOTPRINT: u32 = 0xffffffffu;

// An entry of a list is a footprint's number, and from this bit on its size: lists are shared by
// cells of different sizes, and a footprint must be found by its own alone.
const GATHER_SIZE_SHIFT: u32 = 27u;

// Rust mirror: `GatherGrid`.
struct GatherGrid {
    // Edge of a cell of the first size, in metres; each next is twice as large.
    cell: f32,
    // The number of lists, a power of two.
    lists: u32,
    // Standard deviation of the kernel along a footprint's axis, in sample spacings.
    scale: f32,
    // 0 for no limit.
    max_anisotropy: f32,
    // Bounds of a footprint's standard deviation, in metres.
    least_extent: f32,
    most_extent: f32,
    pad: vec2<f32>,
    // See `Truncations`.
    truncation: vec4<f32>,
}

fn gather_cell(position: vec3<f32>, edge: f32) -> vec3<i32> {
    return vec3<i32>(floor(clamp(position / edge, vec3<f32>(-2e9), vec3<f32>(2e9))));
}

fn gather_list(cell: vec3<i32>, size: u32, lists: u32) -> u32 {
    let at = bitcast<vec3<u32>>(cell);
    var h = at.x * 0x8da6b343u ^ at.y * 0xd8163841u ^ at.z * 0xcb1ab31fu ^ size * 0x9e3779b9u;
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    return h & (lists - 1u);
}
