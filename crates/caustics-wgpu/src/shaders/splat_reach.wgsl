// What there is around a footprint for it to light.
// CPU twin: `Surroundings::in_reach` of caustics-render's `surroundings.rs`.

// What of a part of the picture a footprint may light.
struct InReach {
    // Where it lies, in metres before the footprint's plane: from and to; the end before the start
    // where there is nothing.
    heights: vec2<f32>,
    // Whether it all belongs to the footprint's own receiver.
    is_own: bool,
}

// What a footprint may light of the pixels in some bounds.
fn in_reach(d: Density, gate: Gate, object: u32, bounds: Bounds) -> InReach {
    // The level at which it takes two or three tiles along each side at most.
    let extents = (bounds.high - bounds.low) / f32(2u * SURROUNDING_TILE);
    let most = f32(view.surrounding_levels - 1u);
    let number = clamp(ceil(log2(max(extents.x, extents.y))), 0.0, most);
    let level = surrounding_level(u32(number));
    let side = f32(SURROUNDING_TILE) * exp2(number);
    let last = vec2<f32>(level.xy - 1u);
    let first_tile = vec2<u32>(clamp(floor(bounds.low / side), vec2<f32>(0.0), last));
    let last_tile = vec2<u32>(clamp(floor(bounds.high / side), vec2<f32>(0.0), last));
    var found = InReach(vec2<f32>(1e30, -1e30), true);
    for (var row = first_tile.y; row <= last_tile.y; row++) {
        for (var column = first_tile.x; column <= last_tile.x; column++) {
            let tile = surroundings[level.z + row * level.x + column];
            if surrounding_is_empty(tile) {
                continue;
            }
            let heights = surrounding_heights(tile, d.center, d.normal);
            if heights.y < -gate.plane_distance || heights.x > gate.reach {
                continue;
            }
            found.heights.x = min(found.heights.x, max(heights.x, -gate.plane_distance));
            found.heights.y = max(found.heights.y, min(heights.y, gate.reach));
            found.is_own = found.is_own && surrounding_is_own(tile, object);
        }
    }
    return found;
}

// How far, in pixels, what lies a metre before a footprint's plane is seen from where its light
// meets the plane; 1e30 where that cannot be seen.
fn pixels_per_height(d: Density) -> vec2<f32> {
    let height = 0.1 * density_radius(d);
    let start = project(d.center);
    let shifted = project(d.center + height * towards_light(d.incoming, d.normal));
    if start.z > 0.0 && shifted.z > 0.0 {
        return (shifted.xy - start.xy) / height;
    }
    return vec2<f32>(1e30);
}
