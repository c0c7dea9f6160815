// Halton's sequence, plain and scrambled. Twin: halton.rs in caustics-sampling.

const RESOLUTION: u32 = 16777216u;

// The smallest number not below `numerator / denominator`, which is below 1; both are at most 2^24.
// By long division: that of floats need not be rounded well enough.
fn ratio_rounded_up(numerator: u32, denominator: u32) -> f32 {
    if numerator == 0u {
        return 0.0;
    }
    var rest = numerator;
    var exponent = 0;
    while rest < denominator {
        rest <<= 1u;
        exponent += 1;
    }
    var mantissa = 0u;
    for (var bit = 0u; bit < 24u; bit++) {
        mantissa <<= 1u;
        if rest >= denominator {
            mantissa |= 1u;
            rest -= denominator;
        }
        rest <<= 1u;
    }
    mantissa += select(0u, 1u, rest > 0u);
    return ldexp(f32(mantissa), -exponent - 23);
}

fn scrambled_radical_inverse(index: u32, base: u32, dimension: u32) -> f32 {
    var rest = index;
    var numerator = 0u;
    var denominator = 1u;
    while denominator <= RESOLUTION / base {
        let hash = pcg4d(vec4(trace.seed_low, trace.seed_high ^ denominator, dimension, numerator));
        let factor = 1u + multiply_high(hash.x, base - 1u);
        let digit = (factor * (rest % base) + multiply_high(hash.y, base)) % base;
        numerator = numerator * base + digit;
        denominator *= base;
        rest /= base;
    }
    return ratio_rounded_up(numerator, denominator);
}

// Of the first four dimensions.
fn halton(index: u32, dimension: u32) -> f32 {
    var primes = array<u32, 4>(2u, 3u, 5u, 7u);
    let base = primes[min(dimension, 3u)];
    if (trace.seed_low | trace.seed_high) != 0u {
        return scrambled_radical_inverse(index, base, dimension);
    }
    if base == 2u {
        return unit_from_bits(reverseBits(index));
    }
    var rest = index;
    var numerator = 0u;
    var denominator = 1u;
    while rest > 0u && denominator <= RESOLUTION / base {
        numerator = numerator * base + rest % base;
        denominator *= base;
        rest /= base;
    }
    return ratio_rounded_up(numerator, denominator);
}
