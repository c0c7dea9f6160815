//! AVX2 instructions.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::{Lanes, Row, WIDTH};

/// Proof that the processor has AVX2: there is no other way to make one than [`Avx2::detect`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    pub(super) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        found.then_some(Self(()))
    }

    /// Runs a kernel compiled for AVX2.
    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,bmi1,lzcnt,popcnt")]
        fn compiled<K: Kernel>(avx2: Avx2, kernel: K) -> K::Output {
            kernel.run(avx2)
        }
        // SAFETY: an `Avx2` exists only where all these features were detected.
        unsafe { compiled(self, kernel) }
    }
}

// SAFETY, of all blocks below: `self` proves that the processor has AVX2, which includes AVX.
// None of the intrinsics but loads and stores takes a pointer.
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
    fn select(self, mask: __m256, yes: __m256, no: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(no, yes, mask) }
    }

    #[inline(always)]
    fn bits(self, mask: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    fn pack(self, a: __m256, tags: &[u32; WIDTH], bits: u32, out: &mut [u64; WIDTH]) {
        let order = &GATHERED[bits as usize & 255];
        // SAFETY: the loads read eight numbers of 32 bits each, the stores write four of 64 each to
        // the halves of `out`; none needs alignment.
        unsafe {
            let order = _mm256_loadu_si256(order.as_ptr().cast());
            let tags = _mm256_loadu_si256(tags.as_ptr().cast());
            let high = _mm256_castps_si256(_mm256_permutevar8x32_ps(a, order));
            let low = _mm256_permutevar8x32_epi32(tags, order);
            // Pairs 0, 1, 4, 5 and 2, 3, 6, 7.
            let (outer, inner) = (
                _mm256_unpacklo_epi32(low, high),
                _mm256_unpackhi_epi32(low, high),
            );
            let (first, second) = out.split_at_mut(WIDTH / 2);
            _mm256_storeu_si256(
                first.as_mut_ptr().cast(),
                _mm256_permute2x128_si256::<0x20>(outer, inner),
            );
            _mm256_storeu_si256(
                second.as_mut_ptr().cast(),
                _mm256_permute2x128_si256::<0x31>(outer, inner),
            );
        }
    }
}

/// For each set of lanes their numbers, in order and without gaps.
static GATHERED: [[u32; WIDTH]; 256] = gathered();

const fn gathered() -> [[u32; WIDTH]; 256] {
    let mut table = [[0; WIDTH]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut lane, mut place) = (0, 0);
        while lane < WIDTH {
            if bits >> lane & 1 == 1 {
                table[bits][place] = lane as u32;
                place += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    table
}
