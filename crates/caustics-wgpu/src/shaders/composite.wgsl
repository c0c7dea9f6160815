// Adds the radiance of the caustics to what the host has drawn.

// Rust mirror: `Composite`.
struct Composite {
    // Where the view starts in the host's target, in pixels.
    origin: vec2<i32>,
    has_albedo: u32,
    // Multiplies radiance: the host's exposure.
    exposure: f32,
}

@group(0) @binding(0) var<uniform> composite: Composite;
@group(0) @binding(1) var irradiance: texture_2d<f32>;
@group(0) @binding(2) var albedo: texture_2d<f32>;

@vertex
fn composite_corner(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    let at = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u));
    return vec4<f32>(4.0 * at - 1.0, 0.0, 1.0);
}

@fragment
fn composite_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy) - composite.origin;
    if any(pixel < vec2<i32>(0)) || any(pixel >= vec2<i32>(textureDimensions(irradiance))) {
        return vec4<f32>(0.0);
    }
    var reflectance = vec3<f32>(1.0);
    if composite.has_albedo != 0u {
        reflectance = textureLoad(albedo, pixel, 0).xyz;
    }
    let radiance = 0.31830989 * reflectance * textureLoad(irradiance, pixel, 0).xyz;
    return vec4<f32>(composite.exposure * radiance, 0.0);
}
