//! NEON instructions, which every 64-bit Arm processor that this is compiled for has.
#![allow(unsafe_code)]

use std::arch::aarch64::*;

use super::lanes::{Lanes, Portable, Row, WIDTH};

/// Two registers of four lanes each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neon;

/// The lanes of a mask's half by bit, from 0.
const FIRST: [u32; WIDTH / 2] = [1, 2, 4, 8];

// SAFETY, of all blocks below: this module is compiled only where the target has NEON. None of the
// intrinsics but loads and stores takes a pointer.
#[allow(unused_unsafe)]
impl Lanes for Neon {
    type Floats = [float32x4_t; 2];
    type Mask = [uint32x4_t; 2];

    #[inline(always)]
    fn load(self, row: &Row) -> [float32x4_t; 2] {
        let (low, high) = row.split_at(WIDTH / 2);
        // SAFETY: each half is four floats; the loads need no more alignment than those.
        unsafe { [vld1q_f32(low.as_ptr()), vld1q_f32(high.as_ptr())] }
    }

    #[inline(always)]
    fn store(self, [low, high]: [float32x4_t; 2]) -> Row {
        let mut row = [0.0; WIDTH];
        let (first, second) = row.split_at_mut(WIDTH / 2);
        // SAFETY: each half is four floats; the stores need no more alignment than those.
        unsafe {
            vst1q_f32(first.as_mut_ptr(), low);
            vst1q_f32(second.as_mut_ptr(), high);
        }
        row
    }

    #[inline(always)]
    fn splat(self, a: f32) -> [float32x4_t; 2] {
        [unsafe { vdupq_n_f32(a) }; 2]
    }

    #[inline(always)]
    fn add(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        unsafe { [vaddq_f32(a[0], b[0]), vaddq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn sub(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        unsafe { [vsubq_f32(a[0], b[0]), vsubq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        unsafe { [vmulq_f32(a[0], b[0]), vmulq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn div(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        unsafe { [vdivq_f32(a[0], b[0]), vdivq_f32(a[1], b[1])] }
    }

    // NEON's own minimum and maximum return NaN where either is one.
    #[inline(always)]
    fn min(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        self.select(self.less(a, b), a, b)
    }

    #[inline(always)]
    fn max(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [float32x4_t; 2] {
        self.select(self.less(b, a), a, b)
    }

    #[inline(always)]
    fn less(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [uint32x4_t; 2] {
        unsafe { [vcltq_f32(a[0], b[0]), vcltq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn at_most(self, a: [float32x4_t; 2], b: [float32x4_t; 2]) -> [uint32x4_t; 2] {
        unsafe { [vcleq_f32(a[0], b[0]), vcleq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn and(self, a: [uint32x4_t; 2], b: [uint32x4_t; 2]) -> [uint32x4_t; 2] {
        unsafe { [vandq_u32(a[0], b[0]), vandq_u32(a[1], b[1])] }
    }

    #[inline(always)]
    fn or(self, a: [uint32x4_t; 2], b: [uint32x4_t; 2]) -> [uint32x4_t; 2] {
        unsafe { [vorrq_u32(a[0], b[0]), vorrq_u32(a[1], b[1])] }
    }

    #[inline(always)]
    fn select(
        self,
        mask: [uint32x4_t; 2],
        yes: [float32x4_t; 2],
        no: [float32x4_t; 2],
    ) -> [float32x4_t; 2] {
        unsafe {
            [
                vbslq_f32(mask[0], yes[0], no[0]),
                vbslq_f32(mask[1], yes[1], no[1]),
            ]
        }
    }

    #[inline(always)]
    fn bits(self, [low, high]: [uint32x4_t; 2]) -> u32 {
        // SAFETY: the load reads four numbers of 32 bits.
        unsafe {
            let first = vld1q_u32(FIRST.as_ptr());
            let second = vshlq_n_u32::<4>(first);
            vaddvq_u32(vorrq_u32(vandq_u32(low, first), vandq_u32(high, second)))
        }
    }

    #[inline(always)]
    fn pack(self, a: [float32x4_t; 2], tags: &[u32; WIDTH], bits: u32, out: &mut [u64; WIDTH]) {
        Portable.pack(self.store(a), tags, bits, out);
    }
}
