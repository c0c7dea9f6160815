use crate::counter_rng::pcg4d;
use crate::unit_interval::from_bits;

/// How many dimensions are drawn from one Sobol' sequence; later ones are padded.
const DIMENSIONS: u32 = 4;

/// Degree, inner coefficients of the primitive polynomial, and initial direction integers of the
/// dimensions after the first (Joe and Kuo, *Constructing Sobol Sequences with Better
/// Two-Dimensional Projections*, 2008).
const POLYNOMIALS: [(usize, u32, [u32; 3]); DIMENSIONS as usize - 1] = [
    (1, 0b0, [1, 0, 0]),
    (2, 0b1, [1, 3, 0]),
    (3, 0b01, [1, 3, 1]),
];

const DIRECTIONS: [[u32; 32]; DIMENSIONS as usize] = directions();

/// Coordinate `dimension` of point `index` of Sobol's sequence, Owen-scrambled, in `[0, 1)`.
///
/// The first two dimensions put exactly one of every `2^(i + j)` successive points (from a multiple
/// of that on) into each of the `2^i` by `2^j` equal boxes of the unit square. Four dimensions are
/// one sequence; each further four are that sequence again, in another scramble and with its
/// points shuffled, so that there is no limit to the dimensions (Burley, *Practical Hash-based
/// Owen Scrambling*, 2020). A seed of zero leaves the first four as Sobol' has them.
///
/// ```
/// use caustics_sampling::sobol;
///
/// let points: Vec<_> = (0..4).map(|index| [sobol(index, 0, 0), sobol(index, 1, 0)]).collect();
/// assert_eq!(points, [[0.0, 0.0], [0.5, 0.5], [0.25, 0.75], [0.75, 0.25]]);
/// ```
#[must_use]
#[inline]
pub fn sobol(index: u32, dimension: u32, seed: u64) -> f32 {
    let (group, member) = (dimension / DIMENSIONS, dimension % DIMENSIONS);
    let hash = |salt: u32| pcg4d([seed as u32, (seed >> 32) as u32, dimension, salt])[0];
    let group_hash = || pcg4d([seed as u32, (seed >> 32) as u32, group, 1])[0];
    if group == 0 {
        let bits = reversed_point(index, member);
        return from_bits(if seed == 0 {
            bits
        } else {
            nested_scramble(bits, hash(0))
        });
    }
    // A nested scramble of the index permutes it inside every block of 2^n, and the blocks.
    let shuffled = nested_scramble(index, group_hash());
    from_bits(nested_scramble(reversed_point(shuffled, member), hash(0)))
}

/// The point's binary digits, the first after the point in the highest bit.
fn reversed_point(mut index: u32, member: u32) -> u32 {
    if member == 0 {
        return index.reverse_bits();
    }
    let mut bits = 0;
    while index != 0 {
        bits ^= DIRECTIONS[member as usize][index.trailing_zeros() as usize];
        index &= index - 1;
    }
    bits
}

/// Flips every bit by a hash of the bits above it: Owen's scramble in base 2.
///
/// In the mirrored number, multiplications and sums carry only from lower to higher bits (Laine and
/// Karras 2011); the constants are Vegdahl's (*Building a Better LK Hash*, 2021).
fn nested_scramble(bits: u32, seed: u32) -> u32 {
    let mut x = bits.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// Direction numbers by Sobol's recurrence (Bratley and Fox, Algorithm 659, 1988).
const fn directions() -> [[u32; 32]; DIMENSIONS as usize] {
    let mut all = [[0; 32]; DIMENSIONS as usize];
    let mut bit = 0;
    while bit < 32 {
        all[0][bit] = 1 << (31 - bit);
        bit += 1;
    }
    let mut dimension = 1;
    while dimension < DIMENSIONS as usize {
        let (degree, coefficients, initial) = POLYNOMIALS[dimension - 1];
        let mut bit = 0;
        while bit < 32 {
            all[dimension][bit] = if bit < degree {
                initial[bit] << (31 - bit)
            } else {
                let mut value = all[dimension][bit - degree];
                value ^= value >> degree;
                let mut term = 1;
                while term < degree {
                    if coefficients >> (degree - 1 - term) & 1 == 1 {
                        value ^= all[dimension][bit - term];
                    }
                    term += 1;
                }
                value
            };
            bit += 1;
        }
        dimension += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_points_by_hand() {
        // The recurrence by hand gives the direction integers 1 1 1 1, 1 3 5 15, 1 3 3 9 and
        // 1 3 1 5. In eighths:
        let expected = [
            [0, 4, 2, 6, 1, 5, 3, 7],
            [0, 4, 6, 2, 5, 1, 3, 7],
            [0, 4, 6, 2, 3, 7, 5, 1],
            [0, 4, 6, 2, 1, 5, 7, 3],
        ];
        for (dimension, values) in expected.iter().enumerate() {
            for (index, &value) in values.iter().enumerate() {
                let found = sobol(index as u32, dimension as u32, 0);
                assert_eq!(
                    found,
                    value as f32 / 8.0,
                    "point {index}, dimension {dimension}"
                );
            }
        }
        assert_eq!(
            [0, 1, 2, 3].map(|d| sobol(8, d, 0) * 16.0),
            [1.0, 15.0, 9.0, 5.0]
        );
    }

    #[test]
    fn scramble_is_nested() {
        // Numbers that agree in their first n bits still do so afterwards, and differ in the next.
        for bit in 0..32 {
            for (number, seed) in [(0_u32, 1), (0xDEAD_BEEF, 77), (u32::MAX, 0x8000_0001)] {
                let other = number ^ 1 << (31 - bit);
                let differ = nested_scramble(number, seed) ^ nested_scramble(other, seed);
                assert_eq!(differ.leading_zeros(), bit);
            }
        }
    }
}
