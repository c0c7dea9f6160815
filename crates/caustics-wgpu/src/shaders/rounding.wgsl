// Rounding that compilers must not undo. Twin: the f32 arithmetic of Rust, in which every operation
// rounds.

const UNIT_ROUNDOFF: f32 = 5.9604645e-8;
const SMALLEST_NORMAL: f32 = 1.17549435e-38;

// `x`, which the compiler cannot fuse with what comes next: it does not know that `trace.zero` is 0.
// Where a difference of products must not get its sign wrong, each product goes through here.
fn rounded(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ trace.zero);
}

fn rounded_vector(v: vec3<f32>) -> vec3<f32> {
    return vec3(rounded(v.x), rounded(v.y), rounded(v.z));
}

fn rounded_dot(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let parts = rounded_vector(a * b);
    return parts.x + parts.y + parts.z;
}

// Twin: `gamma` in caustics-geometry's spawn.rs.
fn gamma(roundings: f32) -> f32 {
    let error = roundings * UNIT_ROUNDOFF;
    return error / (1.0 - error);
}

// The next number in the direction of `offset`. Twin: `away` in spawn.rs.
fn away(coordinate: f32, offset: f32) -> f32 {
    if offset == 0.0 {
        return coordinate;
    }
    if coordinate == 0.0 {
        return select(-SMALLEST_NORMAL, SMALLEST_NORMAL, offset > 0.0);
    }
    let bits = bitcast<u32>(coordinate);
    let grows = (coordinate > 0.0) == (offset > 0.0);
    return bitcast<f32>(select(bits - 1u, bits + 1u, grows));
}

// Not infinite, and a number. By bits, since compilers may assume that every number is one.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn all_finite(v: vec3<f32>) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}
