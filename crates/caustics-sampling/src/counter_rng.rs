use glam::Vec2;

use crate::unit_interval;

/// A random number generator without a history: number `n` of a stream is a hash of the seed, the
/// stream and `n`.
///
/// Give every photon a stream of its own (its index) and it draws the same numbers on any thread,
/// in any order, in any frame. The hash is four-dimensional PCG of Jarzynski and Olano, *Hash
/// Functions for GPU Rendering* (2020), which needs 32-bit integers only, so that a shader can draw
/// the same numbers.
///
/// ```
/// use caustics_sampling::CounterRng;
///
/// let mut photon = CounterRng::new(7, 123);
/// let first = photon.next_f32();
/// assert!((0.0..1.0).contains(&first));
/// assert_ne!(photon.next_f32(), first);
/// assert_eq!(CounterRng::new(7, 123).next_f32(), first);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CounterRng {
    key: [u32; 4],
    counter: u32,
}

impl CounterRng {
    /// The generator of one stream, at its first number.
    #[must_use]
    pub const fn new(seed: u64, stream: u64) -> Self {
        let words = [
            seed as u32,
            (seed >> 32) as u32,
            stream as u32,
            (stream >> 32) as u32,
        ];
        Self {
            key: pcg4d(words),
            counter: 0,
        }
    }

    /// The next 32 random bits. A stream repeats itself after 2^32 numbers.
    #[must_use]
    pub const fn next_u32(&mut self) -> u32 {
        let bits = self.at(self.counter);
        self.counter = self.counter.wrapping_add(1);
        bits
    }

    /// The next number, uniform on the multiples of 2^-24 in `[0, 1)`.
    #[must_use]
    pub const fn next_f32(&mut self) -> f32 {
        unit_interval::from_bits(self.next_u32())
    }

    /// The next two numbers as a point of the unit square.
    #[must_use]
    pub const fn next_vec2(&mut self) -> Vec2 {
        let u = self.next_f32();
        Vec2::new(u, self.next_f32())
    }

    /// Number `counter` of the stream, as 32 bits, whatever has been drawn.
    #[must_use]
    pub const fn at(&self, counter: u32) -> u32 {
        pcg4d([
            self.key[0],
            self.key[1],
            self.key[2],
            self.key[3].wrapping_add(counter),
        ])[0]
    }
}

/// Hashes four words into four.
pub(crate) const fn pcg4d(words: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = words;
    x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    y = y.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    z = z.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    w = w.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    w ^= w >> 16;
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_access_equals_drawing_in_order() {
        let mut drawn = CounterRng::new(u64::MAX, 3);
        let fixed = drawn;
        for counter in 0..100 {
            assert_eq!(drawn.next_u32(), fixed.at(counter));
        }
    }

    #[test]
    fn every_word_of_seed_and_stream_counts() {
        let first = |seed, stream| CounterRng::new(seed, stream).next_u32();
        let plain = first(1, 1);
        for other in [
            first(2, 1),
            first(1, 2),
            first(1 | 1 << 32, 1),
            first(1, 1 | 1 << 32),
        ] {
            assert_ne!(plain, other);
        }
    }
}
