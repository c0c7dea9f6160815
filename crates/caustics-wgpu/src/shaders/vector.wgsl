// Lengths and directions of vectors. Twins: glam's methods, unit_vector.rs, frame.rs in
// caustics-geometry.

fn largest(v: vec3<f32>) -> f32 {
    return max(max(v.x, v.y), v.z);
}

fn length_of(v: vec3<f32>) -> f32 {
    return sqrt(dot(v, v));
}

// Of a vector with a length.
fn normalized(v: vec3<f32>) -> vec3<f32> {
    return v * (1.0 / length_of(v));
}

fn normalized_or_zero(v: vec3<f32>) -> vec3<f32> {
    let reciprocal = 1.0 / length_of(v);
    if is_finite(reciprocal) && reciprocal > 0.0 {
        return v * reciprocal;
    }
    return vec3(0.0);
}

// 1 with the sign of `x`, that of a zero too.
fn sign_of(x: f32) -> f32 {
    return select(1.0, -1.0, (bitcast<u32>(x) >> 31u) != 0u);
}

// Two unit vectors perpendicular to each other and to the unit `normal` (Duff et al. 2017). Twins:
// `Frame::from_normal`, `any_orthonormal_pair`.
struct Tangents {
    first: vec3<f32>,
    second: vec3<f32>,
}

fn tangents_of(normal: vec3<f32>) -> Tangents {
    let side = sign_of(normal.z);
    let a = -1.0 / (side + normal.z);
    let b = normal.x * normal.y * a;
    return Tangents(
        vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x),
        vec3(b, side + normal.y * normal.y * a, -normal.y),
    );
}

// From coordinates in the frame around `normal` to the world's. Twin: `Frame::to_world`.
fn from_frame(tangents: Tangents, normal: vec3<f32>, local: vec3<f32>) -> vec3<f32> {
    return local.x * tangents.first + local.y * tangents.second + local.z * normal;
}
