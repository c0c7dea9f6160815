// The example engine's own shading: a G-buffer, one light with a shadow map, glass and metal on top,
// and a tone map.

struct Globals {
    view_projection: mat4x4<f32>,
    inverse_view_projection: mat4x4<f32>,
    light_projection: mat4x4<f32>,
    eye: vec4<f32>,
    // A place (w = 1), or the direction of travel (w = 0).
    light: vec4<f32>,
    light_axis: vec4<f32>,
    light_color: vec4<f32>,
    // Cosines of the inner and the outer angle of a spot, exposure, and nothing.
    settings: vec4<f32>,
}

@group(0) @binding(0) var<uniform> globals: Globals;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
    @location(3) object: u32,
}

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
    @location(3) @interpolate(flat) object: u32,
}

@vertex
fn surface(vertex: Vertex) -> Fragment {
    let clip = globals.view_projection * vec4<f32>(vertex.position, 1.0);
    return Fragment(clip, vertex.position, vertex.normal, vertex.albedo, vertex.object);
}

struct Texel {
    @location(0) normal: vec4<f32>,
    @location(1) albedo: vec4<f32>,
    @location(2) object: u32,
}

@fragment
fn gbuffer(it: Fragment, @builtin(front_facing) is_front: bool) -> Texel {
    let normal = normalize(it.normal) * select(-1.0, 1.0, is_front);
    return Texel(vec4<f32>(normal, 0.0), vec4<f32>(it.albedo, 1.0), it.object);
}

@vertex
fn shadow(vertex: Vertex) -> @builtin(position) vec4<f32> {
    return globals.light_projection * vec4<f32>(vertex.position, 1.0);
}

@vertex
fn whole_picture(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(4.0 * f32(index & 1u) - 1.0, 4.0 * f32(index >> 1u) - 1.0, 0.0, 1.0);
}

@group(1) @binding(0) var depths: texture_depth_2d;
@group(1) @binding(1) var normals: texture_2d<f32>;
@group(1) @binding(2) var albedos: texture_2d<f32>;
@group(1) @binding(3) var shadows: texture_depth_2d;
@group(1) @binding(4) var shadow_sampler: sampler_comparison;

fn sky(direction: vec3<f32>) -> vec3<f32> {
    return mix(vec3<f32>(0.012, 0.013, 0.016), vec3<f32>(0.05, 0.06, 0.08), 0.5 + 0.5 * direction.y);
}

fn direct_light(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let place = globals.light_projection * vec4<f32>(position + 2e-3 * length(globals.eye.xyz - position) * normal, 1.0);
    let at = place.xyz / place.w;
    let uv = vec2<f32>(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y);
    let texel = 1.0 / vec2<f32>(textureDimensions(shadows));
    var lit = 0.0;
    for (var i = 0; i < 9; i++) {
        let aside = vec2<f32>(f32(i % 3 - 1), f32(i / 3 - 1)) * texel;
        lit += textureSampleCompareLevel(shadows, shadow_sampler, uv + aside, at.z) / 9.0;
    }
    var towards = -globals.light.xyz;
    var strength = globals.light_color.xyz;
    if globals.light.w > 0.5 {
        let way = globals.light.xyz - position;
        towards = normalize(way);
        strength /= dot(way, way);
        let cosine = dot(-towards, globals.light_axis.xyz);
        let fall = (cosine - globals.settings.y) / (globals.settings.x - globals.settings.y);
        let part = clamp(fall, 0.0, 1.0);
        strength *= part * part;
    }
    return lit * strength * max(dot(normal, towards), 0.0);
}

@fragment
fn lighting(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let depth = textureLoad(depths, pixel, 0);
    let size = vec2<f32>(textureDimensions(depths));
    let clip = vec4<f32>(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, depth, 1.0);
    let point = globals.inverse_view_projection * clip;
    let position = point.xyz / point.w;
    if depth == 1.0 {
        return vec4<f32>(sky(normalize(position - globals.eye.xyz)), 1.0);
    }
    let normal = textureLoad(normals, pixel, 0).xyz;
    let albedo = textureLoad(albedos, pixel, 0).xyz;
    let ambient = 0.4 * sky(normal);
    return vec4<f32>(albedo * (0.31830989 * direct_light(position, normal) + ambient), 1.0);
}

// Glass and metal: what they mirror of the sky, over what is behind. Glass has albedo 0.
@fragment
fn shining(it: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    let view = normalize(it.position - globals.eye.xyz);
    let normal = normalize(it.normal) * select(-1.0, 1.0, is_front);
    let cosine = clamp(-dot(view, normal), 0.0, 1.0);
    let grazing = pow(1.0 - cosine, 5.0);
    let is_glass = all(it.albedo == vec3<f32>(0.0));
    let f0 = select(it.albedo, vec3<f32>(0.04), is_glass);
    let fresnel = f0 + (1.0 - f0) * grazing;
    let mirrored = sky(reflect(view, normal)) * 2.0;
    return vec4<f32>(fresnel * mirrored, select(1.0, 0.04 + 0.5 * grazing, is_glass));
}

@group(1) @binding(0) var lit: texture_2d<f32>;

@fragment
fn tone_map(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let color = textureLoad(lit, vec2<i32>(at.xy), 0).xyz;
    return vec4<f32>(globals.settings.z * color, 1.0);
}
