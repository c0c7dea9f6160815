// By how much irradiance is multiplied while it is blended, so that half floats neither overflow
// nor lose what is faint.

// Rust mirror: `SplatScale`.
struct SplatScale {
    scale: f32,
    // The sum of the peaks of all footprints: no pixel can be brighter.
    peak_sum: f32,
}
