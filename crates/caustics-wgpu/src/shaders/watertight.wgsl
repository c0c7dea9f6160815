// The watertight triangle test of Woop, Benthin and Wald 2013. Twin: leaf_test.rs in caustics-accel.
//
// A product that is rounded by itself keeps the guarantee that a ray through a shared edge hits one
// of its triangles; see rounding.wgsl. Where all edge functions vanish, they are computed again, in
// 48 bits and in coordinates scaled to 1, as the twin does in f64.

struct ShearedRay {
    origin: vec3<f32>,
    shear: vec3<f32>,
    // The axis that becomes z: 0, 1 or 2.
    axis: u32,
}

fn to_z(p: vec3<f32>, axis: u32) -> vec3<f32> {
    if axis == 0u {
        return p.yzx;
    }
    if axis == 1u {
        return p.zxy;
    }
    return p;
}

fn sheared_ray(ray: Ray) -> ShearedRay {
    let size = abs(ray.direction);
    var axis = select(0u, 1u, size.y > size.x);
    axis = select(axis, 2u, size.z > max(size.x, size.y));
    let direction = to_z(ray.direction, axis);
    let shear = vec3(direction.x / direction.z, direction.y / direction.z, 1.0 / direction.z);
    return ShearedRay(ray.origin, shear, axis);
}

fn sheared(ray: ShearedRay, vertex: vec3<f32>) -> vec3<f32> {
    let p = to_z(vertex - ray.origin, ray.axis);
    return vec3(p.x - rounded(ray.shear.x * p.z), p.y - rounded(ray.shear.y * p.z), p.z);
}

fn edge_function(p: vec2<f32>, q: vec2<f32>) -> f32 {
    return rounded(p.x * q.y) - rounded(p.y * q.x);
}

fn exact_edge_function(p: vec2<f32>, q: vec2<f32>) -> f32 {
    return double_sum(exact_product(p.x, q.y), double_negated(exact_product(p.y, q.x))).high;
}

// What `intersect_triangle` gives for `t` where all edge functions vanish.
const DOUBTFUL: f32 = -2.0;

// Where the ray meets the triangle, with `t` not above 0 where it does not.
fn intersect_triangle(ray: ShearedRay, a_world: vec3<f32>, b_world: vec3<f32>, c_world: vec3<f32>) -> vec3<f32> {
    let missed = vec3(-1.0);
    let a = sheared(ray, a_world);
    let b = sheared(ray, b_world);
    let c = sheared(ray, c_world);
    let depth = vec3(a.z, b.z, c.z);
    let weights = vec3(
        edge_function(c.xy, b.xy),
        edge_function(a.xy, c.xy),
        edge_function(b.xy, a.xy),
    );
    if any(weights < vec3(0.0)) && any(weights > vec3(0.0)) {
        return missed;
    }
    let sum = weights.x + weights.y + weights.z;
    if abs(sum) < SMALLEST_NORMAL {
        return vec3(DOUBTFUL);
    }
    let along = weights.x * depth.x + weights.y * depth.y + weights.z * depth.z;
    return vec3(along * ray.shear.z / sum, weights.y / sum, weights.z / sum);
}

// The same where all edge functions vanish.
fn intersect_triangle_exactly(ray: ShearedRay, a_world: vec3<f32>, b_world: vec3<f32>, c_world: vec3<f32>) -> vec3<f32> {
    let missed = vec3(-1.0);
    let a = sheared(ray, a_world);
    let b = sheared(ray, b_world);
    let c = sheared(ray, c_world);
    let size = max(
        max(max(abs(a.x), abs(a.y)), max(abs(b.x), abs(b.y))),
        max(abs(c.x), abs(c.y)),
    );
    if !(size > 0.0) {
        return missed;
    }
    let scale = 1.0 / size;
    let weights = vec3(
        exact_edge_function(scale * c.xy, scale * b.xy),
        exact_edge_function(scale * a.xy, scale * c.xy),
        exact_edge_function(scale * b.xy, scale * a.xy),
    );
    let sum = weights.x + weights.y + weights.z;
    let crosses = any(weights < vec3(0.0)) && any(weights > vec3(0.0));
    if crosses || abs(sum) < SMALLEST_NORMAL {
        return missed;
    }
    let along = weights.x * a.z + weights.y * b.z + weights.z * c.z;
    return vec3(along * ray.shear.z / sum, weights.y / sum, weights.z / sum);
}
