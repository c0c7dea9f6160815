//! AVX2 instructions, chosen at run time, and the stack of the traversal: all the unsafe code of
//! this crate.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// A last-in-first-out list of at most `N` entries whose memory is not cleared for each ray.
pub(super) struct Stack<const N: usize> {
    entries: [MaybeUninit<u64>; N],
    /// All entries below this one have been written.
    height: usize,
}

impl<const N: usize> Stack<N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            entries: [const { MaybeUninit::uninit() }; N],
            height: 0,
        }
    }

    /// Adds an entry; panics when there are `N` already.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: u64) {
        self.entries[self.height].write(entry);
        self.height += 1;
    }

    /// Adds an entry below those of the last `pushed` ones that are smaller.
    #[inline(always)]
    pub(super) fn insert(&mut self, entry: u64, pushed: usize) {
        let bottom = self.height - pushed;
        self.push(entry);
        let mut at = self.height - 1;
        while at > bottom {
            // SAFETY: `at - 1 < height`, so the entry has been written.
            let below = unsafe { self.entries[at - 1].assume_init() };
            if below >= entry {
                break;
            }
            self.entries[at].write(below);
            at -= 1;
        }
        self.entries[at].write(entry);
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<u64> {
        self.height = self.height.checked_sub(1)?;
        // SAFETY: the index is below the former height, so the entry has been written.
        Some(unsafe { self.entries[self.height].assume_init() })
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86_64::{Avx2, closest_hit, is_occluded};

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use std::arch::x86_64::*;

    use caustics_geometry::{Hit, Ray};

    use crate::triangle_bvh::lanes::Lanes;
    use crate::triangle_bvh::layout::Row;
    use crate::triangle_bvh::traverse::{self, Tree};

    /// Proof that the processor has AVX2: there is no other way to make one than [`Avx2::detect`].
    #[derive(Clone, Copy, Debug)]
    pub(in crate::triangle_bvh) struct Avx2(());

    impl Avx2 {
        pub(in crate::triangle_bvh) fn detect() -> Option<Self> {
            let found = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            found.then_some(Self(()))
        }
    }

    /// The closest hit, compiled for AVX2.
    pub(in crate::triangle_bvh) fn closest_hit(
        avx2: Avx2,
        tree: Tree<'_>,
        ray: &Ray,
    ) -> Option<Hit> {
        #[target_feature(enable = "avx2,bmi1,lzcnt,popcnt")]
        fn compiled(avx2: Avx2, tree: Tree<'_>, ray: &Ray) -> Option<Hit> {
            traverse::closest_hit(avx2, tree, ray)
        }
        // SAFETY: an `Avx2` exists only where all these features were detected.
        unsafe { compiled(avx2, tree, ray) }
    }

    /// Occlusion, compiled for AVX2.
    pub(in crate::triangle_bvh) fn is_occluded(avx2: Avx2, tree: Tree<'_>, ray: &Ray) -> bool {
        #[target_feature(enable = "avx2,bmi1,lzcnt,popcnt")]
        fn compiled(avx2: Avx2, tree: Tree<'_>, ray: &Ray) -> bool {
            traverse::is_occluded(avx2, tree, ray)
        }
        // SAFETY: an `Avx2` exists only where all these features were detected.
        unsafe { compiled(avx2, tree, ray) }
    }

    // SAFETY, of all blocks below: `self` proves that the processor has AVX2, which includes AVX.
    // None of the intrinsics but the load takes a pointer.
    impl Lanes for Avx2 {
        type Floats = __m256;
        type Mask = __m256;

        #[inline(always)]
        fn load(self, row: &Row) -> __m256 {
            // SAFETY: a row is eight floats; the load needs no alignment.
            unsafe { _mm256_loadu_ps(row.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, a: __m256) -> Row {
            bytemuck::cast(a)
        }

        #[inline(always)]
        fn splat(self, a: f32) -> __m256 {
            unsafe { _mm256_set1_ps(a) }
        }

        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_add_ps(a, b) }
        }

        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_sub_ps(a, b) }
        }

        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_mul_ps(a, b) }
        }

        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_div_ps(a, b) }
        }

        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_min_ps(a, b) }
        }

        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_max_ps(a, b) }
        }

        #[inline(always)]
        fn less(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
        }

        #[inline(always)]
        fn at_most(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
        }

        #[inline(always)]
        fn and(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_and_ps(a, b) }
        }

        #[inline(always)]
        fn or(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_or_ps(a, b) }
        }

        #[inline(always)]
        fn bits(self, mask: __m256) -> u32 {
            unsafe { _mm256_movemask_ps(mask) as u32 }
        }
    }
}
