// Draws each footprint as a quad and lets the blending unit add them.
// CPU twin: `Splat::irradiance` of caustics-render's `splat.rs`.

// Rust mirror: `SplatDraw`.
struct SplatDraw {
    level: u32,
    layer: u32,
    layers: u32,
    pad: u32,
}

// 0: sums of 32 bits. 1: half floats, each footprint by its share as the estimate says. 2: the
// estimate, from a sample of the footprints.
override QUADS_ROUNDING: u32 = 0u;

// A part of a pixel's sum, in bits, of which everything added is a multiple: two bits less than half
// floats have, since the estimate may be too low.
const ROUNDED_BITS: f32 = 9.0;

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> quads: SplatDraw;
@group(0) @binding(2) var<storage, read> densities: array<StoredDensity>;
@group(0) @binding(3) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> level_counts: array<u32>;
@group(0) @binding(6) var texels: texture_2d<u32>;
@group(0) @binding(7) var<storage, read> splat_scale: SplatScale;
@group(0) @binding(8) var estimate: texture_2d<f32>;
@group(0) @binding(9) var objects: texture_2d<u32>;

// Where `by_level` starts in `SplatCounts`, in words.
const BY_LEVEL: u32 = 10u;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) index: u32,
}

// All footprints of the level are drawn, or a sample for the estimate.
fn drawn_stride() -> u32 {
    if QUADS_ROUNDING == 2u {
        return sample_stride(level_counts[BY_LEVEL + quads.level]);
    }
    return 1u;
}

// A parallelogram around all pixels of a footprint, from its middle to the middles of its sides.
struct Slanted {
    middle: vec2<f32>,
    u: vec2<f32>,
    v: vec2<f32>,
}

fn slanted(place: SplatPlace, truncation: Truncation) -> Slanted {
    if place.shape == SHAPE_INTEGRAL {
        let g = integral_of(place);
        let is_wide = g.strips < 0.0;
        // With a pixel to spare: a pixel is drawn if its middle is in it.
        let along = INTEGRAL_CUT * g.long + 1.0;
        let u = along * vec2<f32>(1.0, g.slope);
        let v = vec2<f32>(0.0, INTEGRAL_CUT * g.short + 1.0 + abs(g.slope));
        return Slanted(
            select(g.center.yx, g.center, is_wide),
            select(u.yx, u, is_wide),
            select(v.yx, v, is_wide),
        );
    }
    let determinant = place.step_x.x * place.step_y.y - place.step_x.y * place.step_y.x;
    if place.shape == SHAPE_ELLIPSE && determinant != 0.0 {
        // With a pixel to spare: a pixel's receiver need not lie under its middle.
        let half = vec2<f32>(kernel_outer_reach(truncation)) + abs(place.step_x) + abs(place.step_y);
        let u = vec2<f32>(place.step_y.y, -place.step_x.y) / determinant;
        let v = vec2<f32>(-place.step_y.x, place.step_x.x) / determinant;
        return Slanted(place.center, half.x * u, half.y * v);
    }
    // None that is smaller than the box.
    return Slanted(place.center, vec2<f32>(1e9, 0.0), vec2<f32>(0.0, 1e9));
}

@vertex
fn splat_corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Corner {
    let count = level_counts[BY_LEVEL + quads.level];
    var first = (count + quads.layers - 1u) / quads.layers * quads.layer;
    for (var level = 0u; level < quads.level; level++) {
        first += level_counts[BY_LEVEL + level];
    }
    let index = order[first + drawn_stride() * instance];
    let place = places[index];
    let size = vec2<f32>(view.levels[quads.level].xy);
    let side = vec2<f32>(vec2<u32>(vertex & 1u, vertex >> 1u));
    let columns = vec2<f32>(range_of(place.columns));
    let rows = vec2<f32>(range_of(place.rows));
    // The box around it, or the slanted square around its ellipse where that is less.
    var at = vec2<f32>(mix(columns.x, columns.y, side.x), mix(rows.x, rows.y, side.y));
    let frame = slanted(place, truncation_of(view.truncation, densities[index].object));
    let box = (columns.y - columns.x) * (rows.y - rows.x);
    if 4.0 * abs(frame.u.x * frame.v.y - frame.u.y * frame.v.x) < box {
        at = frame.middle + (2.0 * side.x - 1.0) * frame.u + (2.0 * side.y - 1.0) * frame.v;
    }
    let ndc = vec2<f32>(2.0, -2.0) * at / size + vec2<f32>(-1.0, 1.0);
    return Corner(vec4<f32>(ndc, 0.5, 1.0), index);
}

// A footprint's share of a pixel as a multiple of a unit, of which the pixel's sum has at most 2^11:
// then no addition rounds, on whatever hardware. It is rounded up or down so that the mean is
// right, by a sequence that spreads evenly over the footprints of a pixel.
fn rounded(share: vec3<f32>, pixel: vec2<u32>, index: u32) -> vec3<f32> {
    let whole = textureLoad(estimate, vec2<i32>(pixel), 0).xyz / f32(quads.layers);
    // No less than a half float's own last bits.
    let exponent = ceil(log2(max(max(whole, share), vec3<f32>(1e-6)))) - ROUNDED_BITS;
    let unit = exp2(max(exponent, vec3<f32>(-24.0)));
    let start = (pixel.x * 0x9e3779b9u) ^ (pixel.y * 0x85ebca6bu);
    // The golden ratio's fractional part in 32 bits.
    let place = f32((start + index * 0x9e3779b9u) >> 8u) / 16777216.0;
    return unit * floor(share / unit + place);
}

@fragment
fn splat_fragment(corner: Corner) -> @location(0) vec4<f32> {
    let texel = textureLoad(texels, vec2<i32>(corner.position.xy), 0);
    if texel.w == NO_RECEIVER {
        return vec4<f32>(0.0);
    }
    let stored = densities[corner.index];
    let position = bitcast<vec3<f32>>(texel.xyz);
    let object = textureLoad(objects, vec2<i32>(corner.position.xy), 0).x;
    let is_own = view.has_objects == 0u || object == object_of(stored.object);
    let cosine = density_cosine(
        stored,
        decode_octahedral(stored.normal),
        stored_incoming(stored),
        position,
        decode_octahedral(texel.w),
        is_own,
    );
    if cosine == 0.0 {
        return vec4<f32>(0.0);
    }
    let place = places[corner.index];
    var weight = cosine;
    if place.shape == SHAPE_INTEGRAL {
        let part = pixel_gaussian_weight(integral_of(place), floor(corner.position.xy));
        weight *= kernel_peak(view.truncation) * part;
    } else {
        weight *= density_kernel(stored, position, view.truncation);
    }
    let share = splat_scale.scale * weight * stored.strength;
    if QUADS_ROUNDING == 0u {
        return vec4<f32>(share, 0.0);
    }
    if QUADS_ROUNDING == 2u {
        return vec4<f32>(f32(drawn_stride()) * share, 0.0);
    }
    return vec4<f32>(rounded(share, vec2<u32>(corner.position.xy), corner.index), 0.0);
}
