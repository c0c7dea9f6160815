use glam::{DVec2, Vec2};

use crate::unit_interval::nearest;

/// `1 / phi` of the golden ratio, the number that fractions approach worst.
const INVERSE_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

/// Generators tried on either side of `count / phi`: enough for the distance that
/// [`Rank1Lattice::fibonacci`] promises.
const SEARCH: i64 = 48;

/// A rank-1 lattice: points `(i, i g) / N + 1 / (2 N)` modulo one, for a generator `g`.
///
/// It is a lattice on the torus, without rows along the axes: each coordinate takes every value
/// `(k + 1/2) / N` once, where a square grid's have `sqrt(N)` values only.
///
/// ```
/// use caustics_sampling::Rank1Lattice;
///
/// // Fibonacci numbers: 21 points, generator 13.
/// let lattice = Rank1Lattice::fibonacci(21);
/// assert_eq!(lattice.generator(), 13);
/// // The two vectors to the nearest neighbours span the area of one point.
/// let [first, second] = lattice.basis();
/// assert!((first.perp_dot(second).abs() - 1.0 / 21.0).abs() < 1e-7);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rank1Lattice {
    count: u32,
    generator: u32,
    basis: [Vec2; 2],
}

impl Rank1Lattice {
    /// The Fibonacci lattice, extended to any number of points.
    ///
    /// For `N` a Fibonacci number the generator of the lattice is the one before it (Niederreiter
    /// and Sloan 1994). Here generators about `N / phi` that have no factor in common with `N` are
    /// tried, and the one whose lattice has the farthest nearest neighbours is taken, which for
    /// some Fibonacci numbers is a slightly better one. From 57 points on neighbours are at least
    /// `0.86 / sqrt(N)` apart, below that at least `0.57 / sqrt(N)`; a square grid has 1. A count
    /// of zero is taken as one.
    #[must_use]
    pub fn fibonacci(count: u32) -> Self {
        let count = count.max(1);
        let start = (f64::from(count) * INVERSE_GOLDEN_RATIO).round() as i64;
        // The start first, then by distance: only a longer vector displaces an earlier one.
        let candidates = (0..=SEARCH).flat_map(|offset| [start - offset, start + offset]);
        let mut best = (0, 0, [(0, 0); 2]);
        for candidate in candidates {
            let candidate = candidate.rem_euclid(i64::from(count));
            if greatest_common_divisor(candidate as u32, count) != 1 {
                continue;
            }
            let basis = reduced_basis(i64::from(count), candidate);
            if squared_length(basis[0]) > best.0 {
                best = (squared_length(basis[0]), candidate as u32, basis);
            }
        }
        let [first, second] = best.2;
        let scaled =
            |(x, y): (i64, i64)| (DVec2::new(x as f64, y as f64) / f64::from(count)).as_vec2();
        Self {
            count,
            generator: best.1,
            basis: [scaled(first), scaled(second)],
        }
    }

    /// Number of points, at least one.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// The generator `g`, without a common factor with the count.
    #[must_use]
    pub const fn generator(&self) -> u32 {
        self.generator
    }

    /// Point `index`; indices from [`count`](Self::count) on start anew.
    #[must_use]
    pub fn point(&self, index: u32) -> Vec2 {
        let index = index % self.count;
        let product = u64::from(index) * u64::from(self.generator);
        let place =
            |multiple: u64| nearest((2 * multiple + 1) as f32 / (2 * u64::from(self.count)) as f32);
        Vec2::new(
            place(u64::from(index)),
            place(product % u64::from(self.count)),
        )
    }

    /// The vectors to the two nearest neighbours of every point, the nearest first, at 60 to 90
    /// degrees (or 90 to 120); they span an area of `1 / count`.
    #[must_use]
    pub const fn basis(&self) -> [Vec2; 2] {
        self.basis
    }
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

/// The shortest basis of the lattice of `(1, generator)` and `(0, count)`, by Lagrange's reduction.
///
/// The first vectors may have 2^32 on either axis, so that products want more than 64 bits.
fn reduced_basis(count: i64, generator: i64) -> [(i64, i64); 2] {
    let (mut long, mut short) = ((0, count), (1, generator));
    if squared_length(long) < squared_length(short) {
        std::mem::swap(&mut long, &mut short);
    }
    loop {
        let product =
            i128::from(long.0) * i128::from(short.0) + i128::from(long.1) * i128::from(short.1);
        let multiple = rounded_quotient(product, squared_length(short));
        long = (long.0 - multiple * short.0, long.1 - multiple * short.1);
        if squared_length(long) >= squared_length(short) {
            return [short, long];
        }
        std::mem::swap(&mut long, &mut short);
    }
}

fn squared_length((x, y): (i64, i64)) -> i128 {
    i128::from(x) * i128::from(x) + i128::from(y) * i128::from(y)
}

/// `dividend / divisor` rounded to nearest; the divisor is above zero.
fn rounded_quotient(dividend: i128, divisor: i128) -> i64 {
    (2 * dividend + divisor).div_euclid(2 * divisor) as i64
}
