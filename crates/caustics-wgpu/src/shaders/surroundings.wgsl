// What tiles of a picture show, in a pyramid: so that a footprint knows whether there is anything
// but its own receiver to light, without a look at every pixel.
// CPU twin: `Surroundings` of caustics-render's `surroundings.rs`.

// Pixels along the sides of the smallest tiles.
const SURROUNDING_TILE: u32 = 8u;

// A box around what a tile's pixels see, and the least and the greatest of their objects: the
// greatest less than the least where they see nothing. Rust mirror: 32 bytes.
struct SurroundingTile {
    low: vec3<f32>,
    least_object: u32,
    high: vec3<f32>,
    greatest_object: u32,
}

// What a tile is to a footprint: nothing that it may light, its receiver in its plane, or more.
const RELATION_DARK: u32 = 0u;
const RELATION_FLAT: u32 = 1u;
const RELATION_MIXED: u32 = 2u;

fn surrounding_is_empty(tile: SurroundingTile) -> bool {
    return tile.least_object > tile.greatest_object;
}

fn surrounding_joined(a: SurroundingTile, b: SurroundingTile) -> SurroundingTile {
    return SurroundingTile(
        min(a.low, b.low),
        min(a.least_object, b.least_object),
        max(a.high, b.high),
        max(a.greatest_object, b.greatest_object),
    );
}

// The middle and half of the extent of its coordinates along an axis from a point.
fn surrounding_extent(tile: SurroundingTile, axis: vec3<f32>, start: vec3<f32>) -> vec2<f32> {
    let middle = 0.5 * (tile.low + tile.high) - start;
    let half = 0.5 * (tile.high - tile.low);
    return vec2<f32>(dot(middle, axis), dot(half, abs(axis)));
}

// Between which heights before a footprint's plane it lies, in metres.
fn surrounding_heights(
    tile: SurroundingTile,
    center: vec3<f32>,
    normal: vec3<f32>,
) -> vec2<f32> {
    let extent = surrounding_extent(tile, normal, center);
    return vec2<f32>(extent.x - extent.y, extent.x + extent.y);
}

fn surrounding_is_own(tile: SurroundingTile, object: u32) -> bool {
    let is_one = tile.least_object == object && tile.greatest_object == object;
    return view.has_objects == 0u || is_one;
}

// Where a level's tiles stand: width, height and first.
fn surrounding_level(level: u32) -> vec3<u32> {
    return view.surroundings[min(level, view.surrounding_levels - 1u)].xyz;
}

// The number of a tile of 16 by 16 pixels of a level of resolution, and whether it is at the border.
fn surrounding_of_tile(level: u32, tile: vec2<u32>) -> vec2<u32> {
    let place = surrounding_level(level + 1u);
    let at = min(tile, place.xy - 1u);
    let is_border = any(at == vec2<u32>(0u)) || any(at + 1u == place.xy);
    return vec2<u32>(place.z + at.y * place.x + at.x, u32(is_border));
}

// What a tile is to a prepared footprint. A tile at the border also stands for what lies beyond it.
fn relation(tile: SurroundingTile, is_border: bool, stored: StoredDensity) -> u32 {
    if surrounding_is_empty(tile) {
        return RELATION_DARK;
    }
    let heights = surrounding_heights(tile, stored.center, decode_octahedral(stored.normal));
    if heights.y < -stored.plane_distance || heights.x > stored.reach {
        return RELATION_DARK;
    }
    if !is_border {
        let u = surrounding_extent(tile, stored.u_gradient, stored.center);
        let v = surrounding_extent(tile, stored.v_gradient, stored.center);
        let off = max(vec2<f32>(abs(u.x) - u.y, abs(v.x) - v.y), vec2<f32>(0.0));
        let reach = kernel_outer_reach(truncation_of(view.truncation, stored.object));
        if dot(off, off) > reach * reach {
            return RELATION_DARK;
        }
    }
    let is_flat = heights.x >= -stored.flat && heights.y <= stored.flat;
    let is_plain = is_flat && surrounding_is_own(tile, object_of(stored.object));
    return select(RELATION_MIXED, RELATION_FLAT, is_plain);
}
