// Reads the host's depth and normals into one texture of receivers, and halves it level by level.
// CPU twins: `gbuffer.rs` and `TexelLevel::coarser` of caustics-render.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var host_surface: texture_2d<f32>;
@group(0) @binding(2) var host_normals: texture_2d<f32>;
@group(0) @binding(3) var host_objects: texture_2d<u32>;
@group(0) @binding(4) var texels_out: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(5) var objects_out: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(16, 16)
fn splat_texels(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let pixel = vec2<i32>(id.xy);
    let surface = textureLoad(host_surface, pixel, 0);
    var normal = textureLoad(host_normals, pixel, 0).xyz;
    if view.normal_encoding == 1u {
        normal = 2.0 * normal - 1.0;
    }
    var position = surface.xyz;
    var is_seen = true;
    if view.has_positions == 0u {
        let middle = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(view.size);
        let clip = vec4<f32>(2.0 * middle.x - 1.0, 1.0 - 2.0 * middle.y, surface.x, 1.0);
        let point = view.inverse_view_projection * clip;
        position = point.xyz / point.w;
        is_seen = surface.x != view.background_depth;
    }
    let length_squared = dot(normal, normal);
    is_seen = is_seen && length_squared > 0.25 && length_squared < 2.25 && is_finite_vector(position);
    var packed = NO_RECEIVER;
    if is_seen {
        packed = encode_octahedral(normal * inverseSqrt(length_squared));
    } else {
        position = vec3<f32>(0.0);
    }
    textureStore(texels_out, pixel, vec4<u32>(bitcast<vec3<u32>>(position), packed));
    var object = 0u;
    if view.has_objects != 0u {
        object = textureLoad(host_objects, pixel, 0).x;
    }
    textureStore(objects_out, pixel, vec4<u32>(object, 0u, 0u, 0u));
}
