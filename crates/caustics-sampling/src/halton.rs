use crate::counter_rng::pcg4d;
use crate::unit_interval::from_bits;

/// How many dimensions of the Halton sequence have a prime base of their own.
pub const HALTON_DIMENSIONS: u32 = 32;

const PRIMES: [u32; HALTON_DIMENSIONS as usize] = [
    2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97,
    101, 103, 107, 109, 113, 127, 131,
];

/// An `f32` in `[0.5, 1)` is a multiple of 2^-24: digits that would go beyond it are left out.
const RESOLUTION: u32 = 1 << 24;

/// Coordinate `dimension` of point `index` of the Halton sequence, in `[0, 1)`.
///
/// Dimension `d` is the [radical inverse](radical_inverse) in the base of prime number `d`,
/// starting with 2 (Halton 1960). The first two dimensions put exactly one of every
/// `2^i 3^j` successive points into each of the `2^i` by `3^j` equal boxes of the unit square.
/// Dimensions from [`HALTON_DIMENSIONS`] on are independent random numbers, since the points of
/// still larger bases line up in any usable number of samples.
///
/// ```
/// use caustics_sampling::halton;
///
/// let points: Vec<_> = (0..4).map(|index| [halton(index, 0), halton(index, 1)]).collect();
/// assert_eq!(points, [[0.0, 0.0], [0.5, 1.0 / 3.0], [0.25, 2.0 / 3.0], [0.75, 1.0 / 9.0]]);
/// ```
#[must_use]
#[inline]
pub fn halton(index: u32, dimension: u32) -> f32 {
    match PRIMES.get(dimension as usize) {
        Some(&base) => radical_inverse(index, base),
        None => from_bits(pcg4d([index, dimension, 0, 0])[0]),
    }
}

/// As [`halton`], with the digits scrambled by the seed.
///
/// The scramble is Owen's nested one (Owen 1995), restricted to affine permutations
/// `a digit + b modulo base`, whose `a` and `b` are hashed from the seed, the dimension and the
/// digits before. It keeps the elementary intervals, makes each point uniform on the square, and
/// breaks up the stripes of large bases.
#[must_use]
#[inline]
pub fn halton_scrambled(index: u32, dimension: u32, seed: u64) -> f32 {
    let key = [seed as u32, (seed >> 32) as u32, dimension];
    match PRIMES.get(dimension as usize) {
        Some(&base) => scrambled_radical_inverse(index, base, key),
        None => from_bits(pcg4d([index, key[0], key[1], key[2]])[0]),
    }
}

/// The digits of `index` in the given base, mirrored at the radix point, in `[0, 1)`.
///
/// Digits beyond the resolution of an `f32` are left out (the value then repeats every
/// `base^n` indices, for the largest `base^n` up to 2^24). What remains is rounded *up*: for every
/// index the result lies in the same interval `[k, k + 1) / base^m` as the exact value, down to
/// the width 2^-24, which rounding to nearest does not grant for bases other than 2.
/// A base outside `2..=2^24` is taken as the nearest of those.
#[must_use]
#[inline]
pub fn radical_inverse(index: u32, base: u32) -> f32 {
    // A constant base lets the compiler replace the divisions.
    match base {
        0..=2 => from_bits(index.reverse_bits()),
        3 => mirrored(index, 3),
        5 => mirrored(index, 5),
        7 => mirrored(index, 7),
        _ => mirrored(index, base.min(RESOLUTION)),
    }
}

#[inline(always)]
fn mirrored(mut index: u32, base: u32) -> f32 {
    let (mut numerator, mut denominator) = (0, 1);
    while index > 0 && denominator <= RESOLUTION / base {
        numerator = numerator * base + index % base;
        denominator *= base;
        index /= base;
    }
    ratio_rounded_up(numerator, denominator)
}

fn scrambled_radical_inverse(mut index: u32, base: u32, key: [u32; 3]) -> f32 {
    let (mut numerator, mut denominator) = (0, 1);
    // All digits, the zeros too: the scramble changes them as well.
    while denominator <= RESOLUTION / base {
        let [hash_a, hash_b, ..] = pcg4d([key[0], key[1] ^ denominator, key[2], numerator]);
        let factor = 1 + scaled(hash_a, base - 1);
        let digit = (factor * (index % base) + scaled(hash_b, base)) % base;
        numerator = numerator * base + digit;
        denominator *= base;
        index /= base;
    }
    ratio_rounded_up(numerator, denominator)
}

/// A hash as an integer below `limit`.
fn scaled(hash: u32, limit: u32) -> u32 {
    ((u64::from(hash) * u64::from(limit)) >> 32) as u32
}

/// The smallest `f32` not below `numerator / denominator`.
///
/// Both are at most 2^24. Then the result is below `(numerator + 1) / denominator`, hence below
/// one: numbers under one are at most 2^-24 apart.
fn ratio_rounded_up(numerator: u32, denominator: u32) -> f32 {
    let nearest = numerator as f32 / denominator as f32;
    // A product of two 24-bit numbers is exact in f64, so that the comparison is, too.
    if f64::from(nearest) * f64::from(denominator) < f64::from(numerator) {
        nearest.next_up()
    } else {
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_two_is_bit_reversal() {
        let expected = [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875];
        for (index, value) in expected.into_iter().enumerate() {
            assert_eq!(radical_inverse(index as u32, 2), value);
        }
    }

    #[test]
    fn primes_are_the_first_ones() {
        let is_prime = |n: u32| n > 1 && (2..n).all(|divisor| !n.is_multiple_of(divisor));
        let expected: Vec<u32> = (2..).filter(|&n| is_prime(n)).take(PRIMES.len()).collect();
        assert_eq!(PRIMES.as_slice(), expected);
    }

    #[test]
    fn extreme_arguments_stay_in_range() {
        for base in [0, 1, 2, 3, 131, RESOLUTION - 1, RESOLUTION, u32::MAX] {
            for index in [0, 1, u32::MAX / 2, u32::MAX - 1, u32::MAX] {
                let value = radical_inverse(index, base);
                assert!(
                    (0.0..1.0).contains(&value),
                    "index {index} base {base}: {value}"
                );
            }
        }
    }

    #[test]
    fn all_ones_digits_do_not_round_to_one() {
        // 3^15 - 1 is fifteen digits two: the value nearest to one that base 3 can make.
        assert!(radical_inverse(14_348_906, 3) < 1.0);
        assert_eq!(radical_inverse(u32::MAX, 2), 1.0 - f32::EPSILON / 2.0);
    }
}
