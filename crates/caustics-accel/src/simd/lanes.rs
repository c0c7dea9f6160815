//! Arithmetic on eight lanes at once, so that the traversal is written only once.

/// How many lanes there are.
pub(crate) const WIDTH: usize = 8;

/// One number for each lane.
pub(crate) type Row = [f32; WIDTH];

/// A set of eight-lane instructions.
///
/// Every implementation rounds each operation as IEEE 754 demands and none contracts a product and
/// a sum, so that all of them return the same bits.
pub(crate) trait Lanes: Copy {
    /// One float for each lane.
    type Floats: Copy;
    /// One yes or no for each lane.
    type Mask: Copy;

    fn load(self, row: &Row) -> Self::Floats;
    fn store(self, a: Self::Floats) -> Row;
    fn splat(self, a: f32) -> Self::Floats;
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The lesser one; `b` where either is NaN.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The greater one; `b` where either is NaN.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Where `a` is less than `b`; no where either is NaN.
    fn less(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    /// Where `a` is at most `b`; no where either is NaN.
    fn at_most(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `yes` where the mask is set, else `no`.
    fn select(self, mask: Self::Mask, yes: Self::Floats, no: Self::Floats) -> Self::Floats;
    /// Lane 0 in the lowest bit.
    fn bits(self, mask: Self::Mask) -> u32;
    /// For each lane whose bit is set, in order and without gaps: the bits of its float in the high
    /// half and its tag in the low one. What is in `out` after them does not matter.
    fn pack(self, a: Self::Floats, tags: &[u32; WIDTH], bits: u32, out: &mut [u64; WIDTH]);
}

/// Removes and returns the lowest set bit's index.
#[inline(always)]
pub(crate) fn next_lane(bits: &mut u32) -> usize {
    // The mask tells the compiler that the lane is in range.
    let lane = bits.trailing_zeros() as usize & 7;
    *bits &= *bits - 1;
    lane
}

/// Plain arrays, which the compiler turns into whatever the target has (SSE2, NEON).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

/// A value for each lane. Not by a loop: kernels are hundreds of these operations in one function, and to
/// rotate, number and unroll so many loops took the compiler three fifths of its time for this crate.
#[inline(always)]
fn each<T>(of: impl Fn(usize) -> T) -> [T; WIDTH] {
    [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
}

#[inline(always)]
fn mask(of: impl Fn(usize) -> bool) -> [u32; WIDTH] {
    each(|lane| if of(lane) { u32::MAX } else { 0 })
}

impl Lanes for Portable {
    type Floats = Row;
    type Mask = [u32; WIDTH];

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn store(self, a: Row) -> Row {
        a
    }

    #[inline(always)]
    fn splat(self, a: f32) -> Row {
        [a; WIDTH]
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        each(|lane| a[lane] + b[lane])
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        each(|lane| a[lane] - b[lane])
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        each(|lane| a[lane] * b[lane])
    }

    #[inline(always)]
    fn div(self, a: Row, b: Row) -> Row {
        each(|lane| a[lane] / b[lane])
    }

    #[inline(always)]
    fn min(self, a: Row, b: Row) -> Row {
        each(|lane| if a[lane] < b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn max(self, a: Row, b: Row) -> Row {
        each(|lane| if a[lane] > b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn less(self, a: Row, b: Row) -> [u32; WIDTH] {
        mask(|lane| a[lane] < b[lane])
    }

    #[inline(always)]
    fn at_most(self, a: Row, b: Row) -> [u32; WIDTH] {
        mask(|lane| a[lane] <= b[lane])
    }

    #[inline(always)]
    fn and(self, a: [u32; WIDTH], b: [u32; WIDTH]) -> [u32; WIDTH] {
        each(|lane| a[lane] & b[lane])
    }

    #[inline(always)]
    fn or(self, a: [u32; WIDTH], b: [u32; WIDTH]) -> [u32; WIDTH] {
        each(|lane| a[lane] | b[lane])
    }

    #[inline(always)]
    fn select(self, mask: [u32; WIDTH], yes: Row, no: Row) -> Row {
        each(|lane| if mask[lane] != 0 { yes[lane] } else { no[lane] })
    }

    #[inline(always)]
    fn bits(self, mask: [u32; WIDTH]) -> u32 {
        let bits = each(|lane| mask[lane] & (1 << lane));
        (bits[0] | bits[1]) | (bits[2] | bits[3]) | ((bits[4] | bits[5]) | (bits[6] | bits[7]))
    }

    #[inline(always)]
    fn pack(self, a: Row, tags: &[u32; WIDTH], mut bits: u32, out: &mut [u64; WIDTH]) {
        for out in out {
            if bits == 0 {
                break;
            }
            let lane = next_lane(&mut bits);
            *out = u64::from(a[lane].to_bits()) << 32 | u64::from(tags[lane]);
        }
    }
}
