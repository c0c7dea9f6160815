// Draws each footprint as a quad and lets the blending unit add them.
// CPU twin: `Splat::irradiance` of caustics-render's `splat.rs`.

// Rust mirror: `SplatDraw`.
struct SplatDraw {
    level: u32,
    layer: u32,
    layers: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> quads: SplatDraw;
@group(0) @binding(2) var<storage, read> densities: array<StoredDensity>;
@group(0) @binding(3) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> level_counts: array<u32>;
@group(0) @binding(6) var texels: texture_2d<u32>;
@group(0) @binding(7) var<storage, read> splat_scale: SplatScale;

// Where `by_level` starts in `SplatCounts`, in words.
const BY_LEVEL: u32 = 8u;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) index: u32,
}

@vertex
fn splat_corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Corner {
    let count = level_counts[BY_LEVEL + quads.level];
    var first = (count + quads.layers - 1u) / quads.layers * quads.layer;
    for (var level = 0u; level < quads.level; level++) {
        first += level_counts[BY_LEVEL + level];
    }
    let index = order[first + instance];
    let place = places[index];
    let size = vec2<f32>(view.levels[quads.level].xy);
    let side = vec2<f32>(vec2<u32>(vertex & 1u, vertex >> 1u));
    let columns = vec2<f32>(range_of(place.columns));
    let rows = vec2<f32>(range_of(place.rows));
    // The box around it, or the slanted square around its ellipse where that is less.
    var at = vec2<f32>(mix(columns.x, columns.y, side.x), mix(rows.x, rows.y, side.y));
    let determinant = place.step_x.x * place.step_y.y - place.step_x.y * place.step_y.x;
    if place.is_local != 0u && determinant != 0.0 {
        // With a pixel to spare: a pixel's receiver need not lie under its middle.
        let half = vec2<f32>(kernel_outer_reach()) + abs(place.step_x) + abs(place.step_y);
        let inverse_u = vec2<f32>(place.step_y.y, -place.step_x.y) / determinant;
        let inverse_v = vec2<f32>(-place.step_y.x, place.step_x.x) / determinant;
        let sized_u = half.x * inverse_u;
        let sized_v = half.y * inverse_v;
        let box = (columns.y - columns.x) * (rows.y - rows.x);
        if 4.0 * abs(sized_u.x * sized_v.y - sized_u.y * sized_v.x) < box {
            at = place.center + (2.0 * side.x - 1.0) * sized_u + (2.0 * side.y - 1.0) * sized_v;
        }
    }
    let ndc = vec2<f32>(2.0, -2.0) * at / size + vec2<f32>(-1.0, 1.0);
    return Corner(vec4<f32>(ndc, 0.5, 1.0), index);
}

@fragment
fn splat_fragment(corner: Corner) -> @location(0) vec4<f32> {
    let texel = textureLoad(texels, vec2<i32>(corner.position.xy), 0);
    if texel.w == NO_RECEIVER {
        return vec4<f32>(0.0);
    }
    let stored = densities[corner.index];
    let weight = density_weight(
        stored,
        decode_octahedral(stored.normal),
        decode_octahedral(stored.incoming),
        bitcast<vec3<f32>>(texel.xyz),
        decode_octahedral(texel.w),
    );
    return vec4<f32>(splat_scale.scale * weight * stored.strength, 0.0);
}
