use crate::renderer_error::RendererError;
use crate::truncation;

/// How footprints become pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SplatMethod {
    /// Footprints are sorted into tiles of 16 by 16 pixels and summed there, in fixed point: the
    /// same bits in every run, and no blending.
    #[default]
    Tiles,
    /// Each footprint is a quad, and the blending unit adds them, in `Rgba32Float` where the device
    /// has `FLOAT32_BLENDABLE` and in layers of `Rgba16Float` else.
    Quads,
}

/// The shape in which a footprint spreads its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SplatKernel {
    /// A Gaussian with the footprint's axes for its standard deviations, cut off at
    /// [`SplatOptions::truncation`] of them.
    #[default]
    Gaussian,
    /// Epanechnikov's parabola over the footprint's ellipse.
    Ellipse,
    /// Constant over a disc of the footprint's area.
    Disc,
    /// The product of two tents along the footprint's axes.
    Tent,
}

impl SplatKernel {
    /// All kernels.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::Ellipse, Self::Disc, Self::Tent];

    /// The value of the constant of the shaders.
    pub(crate) fn constant(self) -> (&'static str, f64) {
        ("FOOTPRINT_KERNEL", f64::from(self as u8))
    }
}

/// How footprints are splatted; fixed when a renderer is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatOptions {
    /// Tiles or quads.
    pub method: SplatMethod,
    /// The shape of a footprint.
    pub kernel: SplatKernel,
    /// Standard deviation of the kernel along a footprint's axis, in sample spacings; above 0.
    pub scale: f32,
    /// Where the Gaussian kernel ends, in standard deviations: 1 to 4. What would lie beyond is
    /// shared out over the rest, so that no flux is lost. Other kernels end where they must, and
    /// footprints that are [integrated over pixels](Self::integrate_pixels) always at 3.
    pub truncation: f32,
    /// The same for photons that [overlap](caustics_trace::Coverage::Overlap), as those of lights with
    /// an area do by the dozen.
    pub overlap_truncation: f32,
    /// The longer axis may be at most this many times the shorter one, which is widened; at least
    /// 1, and infinite for no limit.
    pub max_anisotropy: f32,
    /// Whether Gaussian footprints as small as pixels are integrated over each pixel; if not, they
    /// are blurred by the pixel and read at its middle, which lets a bright line leak some percent
    /// into the pixels beside it.
    pub integrate_pixels: bool,
    /// Room for pairs of a footprint and a tile that it touches, for each footprint that a batch
    /// has room for: 2 to 64. Tiles whose pairs do not fit together are summed in up to four rounds;
    /// pairs without room even then are counted in
    /// [`SplatStats::dropped_pairs`](crate::SplatStats::dropped_pairs).
    pub pairs_per_footprint: u32,
    /// Layers among which quads are shared where they are blended in half floats, 1 to 16, each of
    /// two textures: what the first rounds off is in the second. The layers are summed in 32 bits.
    /// Errors are in inverse proportion to their number, or to its root where many hundreds of
    /// footprints are on a pixel.
    pub half_float_layers: u32,
    /// Blends quads in half floats even where 32 bits could be blended.
    pub prefer_half_floats: bool,
}

impl Default for SplatOptions {
    fn default() -> Self {
        Self {
            method: SplatMethod::default(),
            kernel: SplatKernel::default(),
            scale: 0.55,
            truncation: 3.0,
            overlap_truncation: 2.0,
            max_anisotropy: f32::INFINITY,
            integrate_pixels: true,
            pairs_per_footprint: 8,
            half_float_layers: 4,
            prefer_half_floats: false,
        }
    }
}

impl SplatOptions {
    /// Checks every number.
    ///
    /// # Errors
    /// An option out of its range.
    pub fn validate(&self) -> Result<(), RendererError> {
        let checks = [
            (
                "scale",
                self.scale,
                self.scale > 0.0 && self.scale.is_finite(),
                "above 0 and finite",
            ),
            (
                "truncation",
                self.truncation,
                truncation::RANGE.contains(&self.truncation),
                "1 to 4",
            ),
            (
                "overlap_truncation",
                self.overlap_truncation,
                truncation::RANGE.contains(&self.overlap_truncation),
                "1 to 4",
            ),
            (
                "max_anisotropy",
                self.max_anisotropy,
                self.max_anisotropy >= 1.0,
                "at least 1",
            ),
            (
                "pairs_per_footprint",
                self.pairs_per_footprint as f32,
                (2..=64).contains(&self.pairs_per_footprint),
                "2 to 64",
            ),
            (
                "half_float_layers",
                self.half_float_layers as f32,
                (1..=16).contains(&self.half_float_layers),
                "1 to 16",
            ),
        ];
        match checks.into_iter().find(|&(_, _, is_valid, _)| !is_valid) {
            Some((name, value, _, range)) => {
                Err(RendererError::OptionOutOfRange { name, value, range })
            }
            None => Ok(()),
        }
    }

    /// Whether any footprints are integrated.
    pub(crate) fn integrates_pixels(&self) -> bool {
        self.integrate_pixels && self.kernel == SplatKernel::Gaussian
    }

    /// The limit as shaders know it, which need not know infinity.
    pub(crate) fn anisotropy_or_zero(&self) -> f32 {
        if self.max_anisotropy.is_finite() {
            self.max_anisotropy
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_named() {
        assert_eq!(SplatOptions::default().validate(), Ok(()));
        let refused = |options: SplatOptions| match options.validate() {
            Err(RendererError::OptionOutOfRange { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        let default = SplatOptions::default();
        assert_eq!(
            refused(SplatOptions {
                scale: 0.0,
                ..default
            }),
            "scale"
        );
        for truncation in [0.99, 4.01, f32::NAN, f32::INFINITY] {
            assert_eq!(
                refused(SplatOptions {
                    truncation,
                    ..default
                }),
                "truncation"
            );
        }
        let max_anisotropy = f32::NAN;
        assert_eq!(
            refused(SplatOptions {
                max_anisotropy,
                ..default
            }),
            "max_anisotropy"
        );
        let pairs_per_footprint = 0;
        assert_eq!(
            refused(SplatOptions {
                pairs_per_footprint,
                ..default
            }),
            "pairs_per_footprint"
        );
        let half_float_layers = 17;
        assert_eq!(
            refused(SplatOptions {
                half_float_layers,
                ..default
            }),
            "half_float_layers"
        );
    }
}
