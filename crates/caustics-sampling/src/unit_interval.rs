//! Numbers of the half-open interval `[0, 1)`, in which all samples lie.

/// The largest `f32` below one.
pub(crate) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// The upper 24 bits as a number in `[0, 1)`: as many as an `f32` holds, so that it is exact.
pub(crate) const fn from_bits(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The sum of two numbers of the interval, modulo one, which is exact but for the sum: it is less than two.
pub(crate) const fn wrapped_sum(a: f32, b: f32) -> f32 {
    let sum = a + b;
    if sum >= 1.0 { sum - 1.0 } else { sum }
}

/// The nearest number of the interval; zero for a NaN.
pub(crate) const fn nearest(x: f32) -> f32 {
    if x > 0.0 { x.min(BELOW_ONE) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_bits_stay_below_one() {
        assert_eq!(from_bits(u32::MAX), BELOW_ONE);
        assert_eq!(from_bits(0), 0.0);
        assert_eq!(from_bits(1 << 31), 0.5);
    }

    #[test]
    fn everything_has_a_nearest_number() {
        assert!(BELOW_ONE < 1.0 && BELOW_ONE.next_up() == 1.0);
        for (x, expected) in [(0.25, 0.25), (1.0, BELOW_ONE), (f32::INFINITY, BELOW_ONE)] {
            assert_eq!(nearest(x), expected);
        }
        for x in [-0.0, -1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(nearest(x), 0.0);
        }
    }
}
