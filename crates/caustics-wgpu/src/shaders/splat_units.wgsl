// Chooses for each pixel and channel a power of two that the sum of a layer is not likely to exceed,
// by a sample of its footprints.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> step: SplatStep;
@group(0) @binding(2) var sums: texture_2d_array<f32>;
@group(0) @binding(3) var units_out: texture_storage_2d<rgba8uint, write>;

// From so many additions on half floats may have lost a good part of them: their last bit is a
// 2048th at most, and what is below that is cut off by some hardware.
const FULL: f32 = 256.0;

// Samples of a pixel that say enough of it alone; where there are fewer, those around it count, too.
const ENOUGH: f32 = 4.0;

// What all footprints add up to, if `sum.w` of one in sixteen add up to `sum.xyz`, and two standard
// deviations more.
fn likely_bound(sum: vec4<f32>) -> vec3<f32> {
    return f32(SAMPLE_STRIDE) * sum.xyz * (1.0 + 2.0 * inverseSqrt(max(sum.w, 1.0)));
}

// What a pixel and the eight around it hold.
fn around(pixel: vec2<i32>) -> vec4<f32> {
    let size = vec2<i32>(view.levels[step.level].xy);
    var sum = vec4<f32>(0.0);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let at = pixel + vec2<i32>(x, y);
            if all(at >= vec2<i32>(0)) && all(at < size) {
                sum += textureLoad(sums, at, 0, 0);
            }
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn splat_units(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.levels[step.level].xy) {
        return;
    }
    let pixel = vec2<i32>(id.xy);
    let all_samples = textureLoad(sums, pixel, 0, 0);
    var whole = vec3<f32>(0.0);
    if all_samples.w >= ENOUGH {
        whole = likely_bound(all_samples);
    } else {
        whole = likely_bound(around(pixel)) / 9.0;
    }
    if SUM_LIMBS > 1u && all_samples.w >= FULL {
        whole = max(whole, likely_bound(textureLoad(sums, pixel, 1, 0)));
    }
    // At least what is known to be there, and may be in one layer.
    let layer = max(whole / f32(step.layers), all_samples.xyz / max(all_samples.w, 1.0));
    let exponent = clamp(ceil(log2(max(layer, vec3<f32>(1e-37)))), vec3<f32>(-126.0), vec3<f32>(127.0));
    let codes = vec3<u32>(vec3<i32>(exponent) + UNIT_OFFSET);
    textureStore(units_out, pixel, vec4<u32>(select(vec3<u32>(0u), codes, layer > vec3<f32>(0.0)), 0u));
}
