//! Eight-lane arithmetic with instructions chosen at run time.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod lanes;
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
mod neon;
mod prefetch;
mod stack;

pub(crate) use lanes::{Lanes, Row, WIDTH, next_lane};
pub(crate) use prefetch::prefetch;
pub(crate) use stack::Stack;

use self::lanes::Portable;

/// Which processor instructions to use. All of them return the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Instructions {
    /// The widest that this processor has, found out when a structure is built.
    #[default]
    Detect,
    /// Only what the program was compiled for.
    Portable,
}

/// A computation that is compiled once for each set of instructions.
///
/// `run` and all that it calls on lanes must be `#[inline(always)]`, and must not call a lane
/// operation from a closure: closures are compiled for the base instructions before they are
/// inlined, and then call each operation as a function.
pub(crate) trait Kernel {
    type Output;

    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// The instructions that a structure uses.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Dispatch {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    Neon,
}

impl Dispatch {
    pub(crate) fn new(instructions: Instructions) -> Self {
        #[cfg(target_arch = "x86_64")]
        if instructions == Instructions::Detect
            && let Some(avx2) = avx2::Avx2::detect()
        {
            return Self::Avx2(avx2);
        }
        #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
        if instructions == Instructions::Detect {
            return Self::Neon;
        }
        Self::Portable
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(kernel),
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Self::Neon => kernel.run(neon::Neon),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on two rows, which returns the bits of all results.
    struct Everything(Row, Row);

    impl Kernel for Everything {
        type Output = (Vec<u32>, Vec<u32>);

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> Self::Output {
            let (a, b) = (lanes.load(&self.0), lanes.load(&self.1));
            let (less, at_most) = (lanes.less(a, b), lanes.at_most(a, b));
            let rows = [
                lanes.store(lanes.add(a, b)),
                lanes.store(lanes.sub(a, b)),
                lanes.store(lanes.mul(a, b)),
                lanes.store(lanes.div(a, b)),
                lanes.store(lanes.min(a, b)),
                lanes.store(lanes.max(a, b)),
                lanes.store(lanes.splat(self.0[3])),
                lanes.store(lanes.select(less, a, b)),
            ];
            let bits = vec![
                lanes.bits(less),
                lanes.bits(at_most),
                lanes.bits(lanes.and(less, lanes.at_most(b, a))),
                lanes.bits(lanes.or(less, lanes.at_most(b, a))),
            ];
            // Which of several NaNs comes out is not laid down.
            let of = |x: &f32| if x.is_nan() { 1 } else { x.to_bits() };
            (rows.as_flattened().iter().map(of).collect(), bits)
        }
    }

    /// Gathers the lanes of a set.
    struct Pack(Row, u32);

    impl Kernel for Pack {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> Vec<u64> {
            let mut out = [0; WIDTH];
            let tags = [9, 8, 7, 6, 5, 4, 3, 2];
            lanes.pack(lanes.load(&self.0), &tags, self.1, &mut out);
            out[..self.1.count_ones() as usize].to_vec()
        }
    }

    #[test]
    fn all_instructions_return_the_same_bits() {
        let numbers = [
            0.0,
            -0.0,
            1.0,
            -3.5,
            1e-40,
            f32::MIN_POSITIVE,
            f32::MAX,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            1.0 / 3.0,
            -7e20,
        ];
        let run = |instructions, a, b| Dispatch::new(instructions).run(Everything(a, b));
        for shift in 0..numbers.len() {
            for start in 0..numbers.len() {
                let a: Row = std::array::from_fn(|lane| numbers[(start + lane) % 12]);
                let b: Row = std::array::from_fn(|lane| numbers[(start + shift + 5 * lane) % 12]);
                let portable = run(Instructions::Portable, a, b);
                assert_eq!(run(Instructions::Detect, a, b), portable, "{a:?} {b:?}");
                // By hand, not by any of the implementations.
                assert_eq!(portable.0[0], {
                    let sum = a[0] + b[0];
                    if sum.is_nan() { 1 } else { sum.to_bits() }
                });
                let less = (0..WIDTH).filter(|&lane| a[lane] < b[lane]);
                assert_eq!(portable.1[0], less.map(|lane| 1 << lane).sum::<u32>());
            }
        }
        let row = std::array::from_fn(|lane| lane as f32 + 0.5);
        for bits in 0..256 {
            let pack = |instructions| Dispatch::new(instructions).run(Pack(row, bits));
            assert_eq!(pack(Instructions::Detect), pack(Instructions::Portable));
        }
    }

    #[test]
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    fn neon_is_found() {
        assert!(matches!(
            Dispatch::new(Instructions::Detect),
            Dispatch::Neon
        ));
    }
}
