// By how much irradiance is multiplied while it is blended, so that half floats neither overflow
// nor lose what is faint.

// Rust mirror: `SplatScale`.
struct SplatScale {
    scale: f32,
    // The sum of the peaks of all footprints: no pixel can be brighter.
    peak_sum: f32,
}

// Numbers that a sum is kept in, each in a layer of its own: one, or two half floats, of which the
// second has what the first cannot hold.
override SUM_LIMBS: u32 = 1u;

// By how much the second is multiplied, since it is far less: a half float's last bit is no finer than
// 2^-24. With half floats' greatest sum in the first it reaches 32 units of that, and does not overflow.
const LOW_SCALE: f32 = 32.0;

// What a code of a pixel's unit is above the exponent that it stands for. A code of 0 is none.
const UNIT_OFFSET: i32 = 128;
