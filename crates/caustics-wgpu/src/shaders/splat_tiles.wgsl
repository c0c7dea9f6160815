// Sums the footprints of each tile of 16 by 16 pixels in workgroup memory, in fixed point: the sum
// does not depend on the order, so the same frame gives the same bits.
//
// One count is the 2^32nd part of the sum of the peaks of all footprints on the tile, which no pixel
// can exceed: nothing overflows. A pixel errs by half a count for each footprint on it.
// CPU twin: `BandTask` of caustics-render's `splat_band.rs`.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> step: SplatStep;
@group(0) @binding(2) var<storage, read> densities: array<StoredDensity>;
@group(0) @binding(3) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(4) var<storage, read> tile_starts: array<u32>;
@group(0) @binding(5) var<storage, read> pairs: array<u32>;
@group(0) @binding(6) var texels: texture_2d<u32>;
@group(0) @binding(7) var before: texture_2d_array<f32>;
@group(0) @binding(8) var irradiance_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(9) var objects: texture_2d<u32>;
@group(0) @binding(10) var<storage, read> surroundings: array<SurroundingTile>;

// Footprints that fill up to so many pixels of a tile are summed by one thread each, larger ones by
// all threads together, each for its pixel.
const SMALL_AREA: u32 = 64u;

// Parts of the brightest footprint in which all are counted: 2^21 of them fit.
const BOUND_PARTS: f32 = 2047.0;

// Positions, as bits, and objects.
var<workgroup> seen: array<vec4<u32>, 256>;
var<workgroup> normals: array<vec3<f32>, 256>;
var<workgroup> sums: array<atomic<u32>, 768>;
var<workgroup> largest_bits: array<atomic<u32>, 3>;
var<workgroup> part_sums: array<atomic<u32>, 3>;
var<workgroup> large: array<u32, 256>;
var<workgroup> large_count: atomic<u32>;
var<workgroup> list: vec2<u32>;
var<workgroup> is_mine: u32;

// The pixels of the tile that a footprint may light: from, and up to but not at.
fn clipped(place: SplatPlace, corner: vec2<u32>) -> vec4<u32> {
    let columns = clamp(range_of(place.columns), vec2<u32>(corner.x), vec2<u32>(corner.x + TILE));
    let rows = clamp(range_of(place.rows), vec2<u32>(corner.y), vec2<u32>(corner.y + TILE));
    return vec4<u32>(columns - corner.x, rows - corner.y);
}

// The shape that a footprint has in the tile.
fn shape_in_tile(place: SplatPlace, index: u32, its: vec2<u32>) -> u32 {
    if place.shape != SHAPE_BY_TILE {
        return place.shape;
    }
    let what = relation(surroundings[its.x], its.y != 0u, densities[index]);
    return select(SHAPE_BOX, SHAPE_ELLIPSE, what == RELATION_FLAT);
}

// The pixels of a row of the tile that a footprint may light.
fn row_span(
    place: SplatPlace,
    shape: u32,
    box: vec4<u32>,
    corner: vec2<u32>,
    row: u32,
    cut: f32,
) -> vec2<u32> {
    let y = f32(corner.y + row);
    var ends = vec2<f32>(0.0);
    if shape == SHAPE_INTEGRAL {
        ends = pixel_gaussian_span(integral_of(place), y, y + 1.0);
    } else if shape == SHAPE_ELLIPSE {
        // With a pixel to spare on each side: a pixel's receiver need not lie under its middle.
        ends = ellipse_span(place, y + 0.5 - place.center.y, cut)
            + (place.center.x + vec2<f32>(-0.5, 0.5));
    } else {
        return box.xy;
    }
    if ends.y < ends.x {
        return vec2<u32>(box.x);
    }
    let places = ends - f32(corner.x);
    let low = clamp(floor(places.x), f32(box.x), f32(box.y));
    let high = clamp(ceil(places.y), low, f32(box.y));
    return vec2<u32>(u32(low), u32(high));
}

// What a footprint adds to a pixel, over its strength.
fn weight_at(
    stored: StoredDensity,
    place: SplatPlace,
    plane: vec3<f32>,
    incoming: vec3<f32>,
    at: vec4<u32>,
    normal: vec3<f32>,
    pixel: vec2<u32>,
) -> f32 {
    let position = bitcast<vec3<f32>>(at.xyz);
    let is_own = view.has_objects == 0u || at.w == object_of(stored.object);
    let cosine = density_cosine(stored, plane, incoming, position, normal, is_own);
    if cosine == 0.0 {
        return 0.0;
    }
    if place.shape >= SHAPE_INTEGRAL {
        return kernel_peak(view.truncation) * integral_weight(
            stored, place, plane, incoming, position, normal, is_own, cosine, vec2<f32>(pixel),
        );
    }
    return cosine * density_kernel(stored, position, view.truncation);
}

@compute @workgroup_size(256)
fn splat_tiles(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let level = view.levels[step.level];
    let corner = TILE * group.xy;
    let pixel = corner + vec2<u32>(local % TILE, local / TILE);
    let is_inside = all(pixel < level.xy);
    var own_seen = vec4<u32>(0u);
    var normal = vec3<f32>(0.0);
    if is_inside {
        let texel = textureLoad(texels, vec2<i32>(pixel), 0);
        if texel.w != NO_RECEIVER {
            let object = textureLoad(objects, vec2<i32>(pixel), 0).x;
            own_seen = vec4<u32>(texel.xyz, object);
            normal = decode_octahedral(texel.w);
        }
    }
    seen[local] = own_seen;
    normals[local] = normal;
    if local == 0u {
        let tile = level.w + group.y * level.z + group.x;
        let room = arrayLength(&pairs);
        let each = round_pairs(room, arrayLength(&places));
        let starts = vec2<u32>(tile_starts[tile], tile_starts[tile + 1u]);
        is_mine = u32(round_of(starts.x, each) == step.round);
        list = min(starts - step.round * each, vec2<u32>(room));
        atomicStore(&large_count, 0u);
        for (var channel = 0u; channel < 3u; channel++) {
            atomicStore(&largest_bits[channel], 0u);
            atomicStore(&part_sums[channel], 0u);
        }
    }
    atomicStore(&sums[local], 0u);
    atomicStore(&sums[local + 256u], 0u);
    atomicStore(&sums[local + 512u], 0u);
    if workgroupUniformLoad(&is_mine) == 0u {
        return;
    }
    let range = workgroupUniformLoad(&list);
    let count = range.y - range.x;

    var result = vec3<f32>(0.0);
    if count > 0u {
        // The brightest footprint of each channel, then their sum in parts of it, rounded up: whole
        // numbers, so that the bound and the unit do not depend on the order either.
        var largest = vec3<f32>(0.0);
        for (var i = range.x + local; i < range.y; i += 256u) {
            largest = max(largest, densities[pairs[i]].strength);
        }
        for (var channel = 0u; channel < 3u; channel++) {
            // Numbers that are not negative are ordered as their bits are.
            atomicMax(&largest_bits[channel], bitcast<u32>(largest[channel]));
        }
        workgroupBarrier();
        largest = bitcast<vec3<f32>>(vec3<u32>(
            atomicLoad(&largest_bits[0]),
            atomicLoad(&largest_bits[1]),
            atomicLoad(&largest_bits[2]),
        ));
        let part = select(vec3<f32>(0.0), BOUND_PARTS / largest, largest > vec3<f32>(0.0));
        var parts = vec3<u32>(0u);
        for (var i = range.x + local; i < range.y; i += 256u) {
            parts += vec3<u32>(ceil(part * densities[pairs[i]].strength));
        }
        for (var channel = 0u; channel < 3u; channel++) {
            atomicAdd(&part_sums[channel], parts[channel]);
        }
        workgroupBarrier();
        let bound = kernel_peak(view.truncation) * largest / BOUND_PARTS * vec3<f32>(vec3<u32>(
            atomicLoad(&part_sums[0]),
            atomicLoad(&part_sums[1]),
            atomicLoad(&part_sums[2]),
        ));
        // A little less, for the rounding of this sum and of each part.
        let room = 4294000000.0 - 2.0 * f32(count);
        let unit = select(vec3<f32>(0.0), room / bound, bound > vec3<f32>(0.0));

        let its = surrounding_of_tile(step.level, group.xy);
        var own = vec3<u32>(0u);
        for (var base = range.x; base < range.y; base += 256u) {
            if base + local < range.y {
                let index = pairs[base + local];
                let place = places[index];
                let box = clipped(place, corner);
                let shape = shape_in_tile(place, index, its);
                let cut = kernel_cut(truncation_of(view.truncation, densities[index].object));
                var area = 0u;
                for (var y = box.z; y < box.w; y++) {
                    let span = row_span(place, shape, box, corner, y, cut);
                    area += span.y - span.x;
                }
                if area <= SMALL_AREA {
                    let stored = densities[index];
                    let plane = decode_octahedral(stored.normal);
                    let incoming = stored_incoming(stored);
                    for (var y = box.z; y < box.w; y++) {
                        let span = row_span(place, shape, box, corner, y, cut);
                        for (var x = span.x; x < span.y; x++) {
                            let at = TILE * y + x;
                            let weight = weight_at(
                                stored, place, plane, incoming,
                                seen[at], normals[at], corner + vec2<u32>(x, y),
                            );
                            if weight > 0.0 {
                                let part = vec3<u32>(unit * stored.strength * weight + 0.5);
                                atomicAdd(&sums[at], part.x);
                                atomicAdd(&sums[at + 256u], part.y);
                                atomicAdd(&sums[at + 512u], part.z);
                            }
                        }
                    }
                } else {
                    large[atomicAdd(&large_count, 1u)] = index;
                }
            }
            workgroupBarrier();
            let larges = atomicLoad(&large_count);
            for (var i = 0u; i < larges; i++) {
                let stored = densities[large[i]];
                let plane = decode_octahedral(stored.normal);
                let incoming = stored_incoming(stored);
                let weight = weight_at(
                    stored, places[large[i]], plane, incoming, own_seen, normal, pixel,
                );
                own += vec3<u32>(unit * stored.strength * weight + 0.5);
            }
            workgroupBarrier();
            if local == 0u {
                atomicStore(&large_count, 0u);
            }
            workgroupBarrier();
        }
        own.x += atomicLoad(&sums[local]);
        own.y += atomicLoad(&sums[local + 256u]);
        own.z += atomicLoad(&sums[local + 512u]);
        result = select(vec3<f32>(0.0), vec3<f32>(own) / unit, unit > vec3<f32>(0.0));
    }
    if is_inside {
        if step.is_first == 0u {
            result += textureLoad(before, vec2<i32>(pixel), 0, 0).xyz;
        }
        textureStore(irradiance_out, vec2<i32>(pixel), vec4<f32>(result, 0.0));
    }
}
