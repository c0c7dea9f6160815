// Adds the light of the coarser level, interpolated over pixels that see the same surface.
// CPU twin: `Level::add_coarser` of caustics-render's `splat_level.rs`.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> step: SplatStep;
@group(0) @binding(2) var own: texture_2d_array<f32>;
@group(0) @binding(3) var texels: texture_2d<u32>;
@group(0) @binding(4) var objects: texture_2d<u32>;
@group(0) @binding(5) var coarse: texture_2d<f32>;
@group(0) @binding(6) var coarse_texels: texture_2d<u32>;
@group(0) @binding(7) var coarse_objects: texture_2d<u32>;
@group(0) @binding(8) var irradiance_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(9) var<storage, read> splat_scale: SplatScale;

fn interpolate(at: vec2<f32>, normal: vec3<f32>, object: u32) -> vec3<f32> {
    let size = vec2<i32>(view.levels[step.level + 1u].xy);
    let base = vec2<i32>(floor(at));
    // The four around the point; where none sees the surface, the next ones out.
    for (var ring = 0; ring < 2; ring++) {
        var sum = vec3<f32>(0.0);
        var weights = 0.0;
        for (var y = -ring; y <= ring + 1; y++) {
            for (var x = -ring; x <= ring + 1; x++) {
                let corner = base + vec2<i32>(x, y);
                if any(corner < vec2<i32>(0)) || any(corner >= size) {
                    continue;
                }
                let packed = textureLoad(coarse_texels, corner, 0).w;
                let its_object = textureLoad(coarse_objects, corner, 0).x;
                if packed == NO_RECEIVER || its_object != object
                    || dot(decode_octahedral(packed), normal) <= SMOOTH_COSINE {
                    continue;
                }
                let tent = max(1.0 - abs(at - vec2<f32>(corner)) / f32(ring + 1), vec2<f32>(1e-3));
                let weight = tent.x * tent.y;
                sum += weight * textureLoad(coarse, corner, 0).xyz;
                weights += weight;
            }
        }
        if weights > 0.0 {
            return sum / weights;
        }
    }
    return vec3<f32>(0.0);
}

@compute @workgroup_size(8, 8)
fn splat_upsample(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.levels[step.level].xy) {
        return;
    }
    let pixel = vec2<i32>(id.xy);
    var sum = vec3<f32>(0.0);
    for (var layer = 0u; layer < step.layers; layer++) {
        sum += textureLoad(own, pixel, SUM_LIMBS * layer, 0).xyz;
        if SUM_LIMBS > 1u {
            sum += textureLoad(own, pixel, SUM_LIMBS * layer + 1u, 0).xyz / LOW_SCALE;
        }
    }
    sum /= splat_scale.scale;
    let packed = textureLoad(texels, pixel, 0).w;
    if packed == NO_RECEIVER {
        sum = vec3<f32>(0.0);
    } else if step.level + 1u < LEVELS {
        let object = textureLoad(objects, pixel, 0).x;
        let at = (vec2<f32>(id.xy) + 0.5) * 0.5 - 0.5;
        sum += interpolate(at, decode_octahedral(packed), object);
    }
    textureStore(irradiance_out, pixel, vec4<f32>(sum, 1.0));
}
