//! Eight-lane arithmetic with instructions chosen at run time.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod lanes;
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
}

impl Dispatch {
    pub(crate) fn new(instructions: Instructions) -> Self {
        #[cfg(target_arch = "x86_64")]
        if instructions == Instructions::Detect
            && let Some(avx2) = avx2::Avx2::detect()
        {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }

    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(kernel),
        }
    }
}
