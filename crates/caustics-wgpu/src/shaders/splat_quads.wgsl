// Draws each footprint as a quad and lets the blending unit add them.
// CPU twin: `Splat::irradiance` of caustics-render's `prepared_splat.rs`.

// Rust mirror: `SplatDraw`.
struct SplatDraw {
    level: u32,
    layer: u32,
    layers: u32,
    pad: u32,
}

// Whether a sample of the footprints is drawn instead of all.
override QUADS_SAMPLED: bool = false;

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> quads: SplatDraw;
@group(0) @binding(2) var<storage, read> densities: array<StoredDensity>;
@group(0) @binding(3) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> level_counts: array<u32>;
@group(0) @binding(6) var texels: texture_2d<u32>;
@group(0) @binding(7) var<storage, read> splat_scale: SplatScale;
@group(0) @binding(8) var units: texture_2d<u32>;
@group(0) @binding(9) var objects: texture_2d<u32>;

// Where `by_level` starts in `SplatCounts`, in words.
const BY_LEVEL: u32 = 10u;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) index: u32,
    // Of a sample, for how many it stands among the few; 0 if it is none of them.
    @location(1) @interpolate(flat, either) weight: f32,
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
    var first = 0u;
    for (var level = 0u; level < quads.level; level++) {
        first += level_counts[BY_LEVEL + level];
    }
    var at_order = 0u;
    var weight = 1.0;
    if QUADS_SAMPLED {
        at_order = sample_place(instance, count);
        weight = sparse_weight(instance, count);
    } else {
        at_order = layer_place(instance, quads.layer, quads.layers);
    }
    if at_order >= count {
        // No quad at all.
        return Corner(vec4<f32>(0.0, 0.0, 0.5, 1.0), 0u, 0.0);
    }
    let index = order[first + at_order];
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
    return Corner(vec4<f32>(ndc, 0.5, 1.0), index, weight);
}

// What a footprint adds to a pixel.
fn share_of(corner: Corner) -> vec3<f32> {
    let texel = textureLoad(texels, vec2<i32>(corner.position.xy), 0);
    if texel.w == NO_RECEIVER {
        return vec3<f32>(0.0);
    }
    let stored = densities[corner.index];
    let position = bitcast<vec3<f32>>(texel.xyz);
    let object = textureLoad(objects, vec2<i32>(corner.position.xy), 0).x;
    let is_own = view.has_objects == 0u || object == object_of(stored.object);
    let plane = decode_octahedral(stored.normal);
    let normal = decode_octahedral(texel.w);
    let incoming = stored_incoming(stored);
    let cosine = density_cosine(stored, plane, incoming, position, normal, is_own);
    if cosine == 0.0 {
        return vec3<f32>(0.0);
    }
    let place = places[corner.index];
    var weight = 0.0;
    if place.shape >= SHAPE_INTEGRAL {
        let pixel = floor(corner.position.xy);
        weight = kernel_peak(view.truncation) * integral_weight(
            stored, place, plane, incoming, position, normal, is_own, cosine, pixel,
        );
    } else {
        weight = cosine * density_kernel(stored, position, view.truncation);
    }
    return splat_scale.scale * weight * stored.strength;
}

@fragment
fn splat_single(corner: Corner) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(corner.position.xy);
    return vec4<f32>(single(share_of(corner), pixel, corner.index), 0.0);
}

@fragment
fn splat_double(corner: Corner) -> Limbs {
    let pixel = vec2<u32>(corner.position.xy);
    return limbs(share_of(corner), pixel, corner.index);
}

// A sample, and how many add to a pixel.
@fragment
fn splat_single_sample(corner: Corner) -> @location(0) vec4<f32> {
    let share = share_of(corner);
    return select(vec4<f32>(0.0), vec4<f32>(share, 1.0), any(share > vec3<f32>(0.0)));
}

// The same, and for itself the few, of which half floats lose nothing.
@fragment
fn splat_double_sample(corner: Corner) -> Limbs {
    let share = share_of(corner);
    let counted = select(vec4<f32>(0.0), vec4<f32>(share, 1.0), any(share > vec3<f32>(0.0)));
    let few = vec4<f32>(corner.weight * share, select(0.0, counted.w, corner.weight > 0.0));
    return Limbs(counted, few);
}
