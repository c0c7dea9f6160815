// Random numbers without a history. Twin: counter_rng.rs in caustics-sampling.

// Four-dimensional PCG (Jarzynski and Olano 2020).
fn pcg4d(words: vec4<u32>) -> vec4<u32> {
    var v = words * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The upper 24 bits as a number in [0, 1). Twin: unit_interval.rs.
fn unit_from_bits(bits: u32) -> f32 {
    return f32(bits >> 8u) * (1.0 / 16777216.0);
}

const BELOW_ONE: f32 = 0.99999994;

// The nearest number of [0, 1).
fn unit_nearest(x: f32) -> f32 {
    return clamp(x, 0.0, BELOW_ONE);
}

var<private> random_key: vec4<u32>;
var<private> random_counter: u32;

// Starts a stream of an emitter.
fn random_start(point: u32, stream: u32) {
    random_key = pcg4d(vec4(trace.seed_low, trace.seed_high, point, stream));
    random_counter = 0u;
}

fn random_next() -> f32 {
    let words = vec4(random_key.xyz, random_key.w + random_counter);
    random_counter += 1u;
    return unit_from_bits(pcg4d(words).x);
}
