// By how much irradiance is multiplied while it is blended, so that half floats neither overflow
// nor lose what is faint.

// Rust mirror: `SplatScale`.
struct SplatScale {
    scale: f32,
    // The sum of the peaks of all footprints: no pixel can be brighter.
    peak_sum: f32,
}

// The most footprints that the estimate of the sums is drawn from: if all are on one pixel, half
// floats still add up.
const SAMPLE: u32 = 2048u;

// One in so many footprints serves for the estimate.
fn sample_stride(count: u32) -> u32 {
    return max(16u, (count + SAMPLE - 1u) / SAMPLE);
}
