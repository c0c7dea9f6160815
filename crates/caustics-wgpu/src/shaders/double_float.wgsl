// Numbers of two floats, the second what the first leaves out: 48 bits (Dekker 1971, "A
// Floating-Point Technique for Extending the Available Precision"; Knuth's sum). Twin: f64 of Rust.
//
// Each step goes through `rounded`, so that no compiler simplifies the errors to zero.

struct Double {
    high: f32,
    low: f32,
}

// Exactly a + b.
fn exact_sum(a: f32, b: f32) -> Double {
    let sum = rounded(a + b);
    let of_b = rounded(sum - a);
    let of_a = rounded(sum - of_b);
    return Double(sum, rounded(a - of_a) + rounded(b - of_b));
}

// The same where |a| is at least |b|.
fn joined(a: f32, b: f32) -> Double {
    let sum = rounded(a + b);
    return Double(sum, b - rounded(sum - a));
}

// The upper 12 bits.
fn upper_half(a: f32) -> f32 {
    let shifted = rounded(4097.0 * a);
    return rounded(shifted - rounded(shifted - a));
}

// Exactly a * b, where that neither overflows nor underflows.
fn exact_product(a: f32, b: f32) -> Double {
    let product = rounded(a * b);
    let a_high = upper_half(a);
    let b_high = upper_half(b);
    let a_low = rounded(a - a_high);
    let b_low = rounded(b - b_high);
    let high = rounded(rounded(a_high * b_high) - product);
    let middle = rounded(rounded(high + rounded(a_high * b_low)) + rounded(a_low * b_high));
    return Double(product, middle + rounded(a_low * b_low));
}

fn double_of(a: f32) -> Double {
    return Double(a, 0.0);
}

fn double_negated(a: Double) -> Double {
    return Double(-a.high, -a.low);
}

fn double_sum(a: Double, b: Double) -> Double {
    let high = exact_sum(a.high, b.high);
    let low = exact_sum(a.low, b.low);
    let first = joined(high.high, rounded(high.low + low.high));
    return joined(first.high, rounded(first.low + low.low));
}

fn double_product(a: Double, b: Double) -> Double {
    let product = exact_product(a.high, b.high);
    let rest = rounded(a.high * b.low) + rounded(a.low * b.high);
    return joined(product.high, rounded(product.low + rest));
}

fn double_quotient(a: Double, b: Double) -> Double {
    let first = a.high / b.high;
    let rest = double_sum(a, double_negated(double_product(b, double_of(first))));
    let second = rest.high / b.high;
    let rest_2 = double_sum(rest, double_negated(double_product(b, double_of(second))));
    let both = joined(first, second);
    return double_sum(both, double_of(rest_2.high / b.high));
}

// Of a number that is not negative.
fn double_root(a: Double) -> Double {
    if a.high <= 0.0 {
        return Double(0.0, 0.0);
    }
    let first = sqrt(a.high);
    let rest = double_sum(a, double_negated(exact_product(first, first)));
    return joined(first, rest.high / (2.0 * first));
}

struct DoubleVector {
    x: Double,
    y: Double,
    z: Double,
}

// Exactly a - b.
fn double_difference(a: vec3<f32>, b: vec3<f32>) -> DoubleVector {
    return DoubleVector(exact_sum(a.x, -b.x), exact_sum(a.y, -b.y), exact_sum(a.z, -b.z));
}

fn double_dot(a: DoubleVector, b: DoubleVector) -> Double {
    return double_sum(
        double_sum(double_product(a.x, b.x), double_product(a.y, b.y)),
        double_product(a.z, b.z),
    );
}

fn double_vector(v: vec3<f32>) -> DoubleVector {
    return DoubleVector(double_of(v.x), double_of(v.y), double_of(v.z));
}

fn double_scaled(v: DoubleVector, by: Double) -> DoubleVector {
    return DoubleVector(
        double_product(v.x, by), double_product(v.y, by), double_product(v.z, by));
}

fn double_vector_sum(a: DoubleVector, b: DoubleVector) -> DoubleVector {
    return DoubleVector(double_sum(a.x, b.x), double_sum(a.y, b.y), double_sum(a.z, b.z));
}

fn single_vector(v: DoubleVector) -> vec3<f32> {
    return vec3(v.x.high, v.y.high, v.z.high);
}
