// Evaluates the irradiance of the caustics at an array of points.

struct GatherPoint {
    position: vec3<f32>,
    pad_a: f32,
    normal: vec3<f32>,
    // Index of its object plus one; 0 where it is not known.
    object_plus_one: u32,
}

@group(1) @binding(0) var<storage, read> points: array<GatherPoint>;
@group(1) @binding(1) var<storage, read_write> irradiance: array<vec4<f32>>;

@compute @workgroup_size(64)
fn gather_points(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < min(arrayLength(&points), arrayLength(&irradiance)) {
        let point = points[id.x];
        // 0 wraps around to any object.
        let object = point.object_plus_one - 1u;
        irradiance[id.x] = vec4<f32>(caustics_irradiance_on(object, point.position, point.normal), 0.0);
    }
}
