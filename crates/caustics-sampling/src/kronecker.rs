use glam::Vec2;

use crate::unit_interval::from_bits;

/// `2^64 / rho` and `2^64 / rho^2` for the plastic number `rho`, the real root of `x^3 = x + 1`.
///
/// With 32 bits the first points to come too near each other would do so at a million; with 64,
/// not within the range of the index.
const STEP: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];

/// Point `index` of the Kronecker sequence of the plastic number: `(1/2 + index / rho, 1/2 + index
/// / rho^2)` modulo one.
///
/// A lattice that grows: the sequence's first `n` points are well spread for *every* `n`, and the
/// next ones fall into the gaps. The golden ratio's generalisation to two dimensions (Roberts, *The
/// Unreasonable Effectiveness of Quasirandom Sequences*, 2018, there called R2).
///
/// ```
/// use caustics_sampling::{glam::Vec2, kronecker};
///
/// assert_eq!(kronecker(0), Vec2::splat(0.5));
/// assert!((kronecker(1) - Vec2::new(0.254_877_67, 0.069_840_29)).length() < 1e-6);
/// ```
#[must_use]
#[inline]
pub const fn kronecker(index: u32) -> Vec2 {
    let half = 1 << 63;
    let x = (index as u64).wrapping_mul(STEP[0]).wrapping_add(half);
    let y = (index as u64).wrapping_mul(STEP[1]).wrapping_add(half);
    Vec2::new(from_bits((x >> 32) as u32), from_bits((y >> 32) as u32))
}
