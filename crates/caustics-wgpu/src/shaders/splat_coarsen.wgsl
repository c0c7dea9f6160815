// One level of receivers at half the resolution of the one before: each stands for four pixels, by
// the first of them, moved in its plane to where their middle sees it.
// CPU twin: `TexelLevel::coarser` of caustics-render.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<uniform> step: SplatStep;
@group(0) @binding(2) var fine_texels: texture_2d<u32>;
@group(0) @binding(3) var fine_objects: texture_2d<u32>;
@group(0) @binding(4) var texels_out: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(5) var objects_out: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn splat_coarsen(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = view.levels[step.level].xy;
    if any(id.xy >= size) {
        return;
    }
    let fine_size = view.levels[step.level - 1u].xy;
    var nearest = vec4<u32>(0u, 0u, 0u, NO_RECEIVER);
    var object = 0u;
    var normal = vec3<f32>(0.0);
    var sum = vec3<f32>(0.0);
    var count = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let at = 2u * id.xy + vec2<u32>(i & 1u, i >> 1u);
        if any(at >= fine_size) {
            continue;
        }
        let texel = textureLoad(fine_texels, vec2<i32>(at), 0);
        if texel.w == NO_RECEIVER {
            continue;
        }
        let its_object = textureLoad(fine_objects, vec2<i32>(at), 0).x;
        let its_normal = decode_octahedral(texel.w);
        if count == 0.0 {
            nearest = texel;
            object = its_object;
            normal = its_normal;
        }
        if its_object == object && dot(its_normal, normal) > SMOOTH_COSINE {
            sum += bitcast<vec3<f32>>(texel.xyz);
            count += 1.0;
        }
    }
    if count > 0.0 {
        var position = sum / count;
        // Where only a part of the four sees it, or the picture ends, the mean is not the middle.
        if count < 4.0 {
            let middle = (vec2<f32>(id.xy) + 0.5) * exp2(f32(step.level));
            position = on_plane(middle, position, normal);
        }
        nearest = vec4<u32>(bitcast<vec3<u32>>(position), nearest.w);
    }
    textureStore(texels_out, vec2<i32>(id.xy), nearest);
    textureStore(objects_out, vec2<i32>(id.xy), vec4<u32>(object, 0u, 0u, 0u));
}
