/// A Gaussian's value in its middle if it ends at three standard deviations, as caustics-render has
/// it: `1 / (2 pi (1 - exp(-3² / 2)))`.
const PEAK_AT_THREE: f32 = 0.160_942_8;

/// The part of a normal distribution that lies within three standard deviations: `1 - exp(-3² / 2)`.
const WITHIN_THREE: f64 = 0.988_891_003_461_758;

/// The range of truncations, in standard deviations.
pub(crate) const RANGE: std::ops::RangeInclusive<f32> = 1.0..=4.0;

/// The `Truncations` of `shaders/density.wgsl`: for footprints that lie side by side, then for those
/// that overlap. CPU twin: `Kernels` of caustics-render.
pub(crate) fn uniform(truncation: f32, overlap_truncation: f32) -> [f32; 4] {
    let [end, peak] = gaussian(truncation);
    let [overlap_end, overlap_peak] = gaussian(overlap_truncation);
    [end, peak, overlap_end, overlap_peak]
}

/// Where a Gaussian ends, in standard deviations, and its value in its middle, by which it keeps its
/// flux. CPU twin: `TruncatedKernel` of caustics-render.
fn gaussian(truncation: f32) -> [f32; 2] {
    let within = 1.0 - (-0.5 * f64::from(truncation).powi(2)).exp();
    [truncation, PEAK_AT_THREE * (WITHIN_THREE / within) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_one_over_what_is_within() {
        assert_eq!(gaussian(3.0), [3.0, PEAK_AT_THREE]);
        for (truncation, peak) in [
            (1.0, 0.404_491_35),
            (2.65, 0.164_053_51),
            (4.0, 0.159_208_35),
        ] {
            let [_, found] = gaussian(truncation);
            assert!((found / peak - 1.0).abs() < 1e-6, "{truncation}: {found}");
        }
    }
}
