use crate::renderer_error::RendererError;
use crate::splat_options::SplatKernel;
use crate::truncation;

/// How a [`Gather`](crate::Gather) is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherOptions {
    /// The shape of a footprint.
    pub kernel: SplatKernel,
    /// Standard deviation of the kernel along a footprint's axis, in sample spacings; above 0.
    pub scale: f32,
    /// Where the Gaussian kernel ends, in standard deviations: 1 to 4. What would lie beyond is
    /// shared out over the rest, so that no flux is lost. Other kernels end where they must.
    pub truncation: f32,
    /// The same for photons that [overlap](caustics_trace::Coverage::Overlap), as those of lights with
    /// an area do by the dozen.
    pub overlap_truncation: f32,
    /// The longer axis may be at most this many times the shorter one, which is widened; at least
    /// 1, and infinite for no limit.
    pub max_anisotropy: f32,
    /// The least standard deviation of a footprint, in metres: a narrower one is widened to it and
    /// counted, because a point or a line has no area to divide the flux by. Above 0; a thousandth
    /// of what is to be seen sharp is enough.
    pub least_extent: f32,
    /// The largest extent of a footprint's axis times the scale, in metres: a longer one is
    /// shortened and counted. At least the least, and at most 2^27 times that.
    pub most_extent: f32,
    /// Footprints that there is room for, at most 2^27.
    pub capacity: u32,
    /// Room for pairs of a footprint and a cell that its box touches, for each footprint: 1 to 8.
    /// In 8 all fit.
    pub entries_per_footprint: u32,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self {
            kernel: SplatKernel::default(),
            scale: 0.55,
            truncation: 3.0,
            overlap_truncation: 2.0,
            max_anisotropy: f32::INFINITY,
            least_extent: 1e-5,
            most_extent: 1e3,
            capacity: 1 << 18,
            entries_per_footprint: 8,
        }
    }
}

impl GatherOptions {
    /// Checks every number.
    ///
    /// # Errors
    /// An option out of its range.
    pub fn validate(&self) -> Result<(), RendererError> {
        let is_positive = |it: f32| it > 0.0 && it.is_finite();
        let most = self.least_extent * (1u32 << 27) as f32;
        let checks = [
            (
                "scale",
                self.scale,
                is_positive(self.scale),
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
                "least_extent",
                self.least_extent,
                is_positive(self.least_extent),
                "above 0 and finite",
            ),
            (
                "most_extent",
                self.most_extent,
                self.most_extent >= self.least_extent && self.most_extent <= most,
                "1 to 2^27 times the least",
            ),
            (
                "capacity",
                self.capacity as f32,
                self.capacity <= 1 << 27,
                "at most 2^27",
            ),
            (
                "entries_per_footprint",
                self.entries_per_footprint as f32,
                (1..=8).contains(&self.entries_per_footprint),
                "1 to 8",
            ),
        ];
        match checks.into_iter().find(|&(_, _, is_valid, _)| !is_valid) {
            Some((name, value, _, range)) => {
                Err(RendererError::OptionOutOfRange { name, value, range })
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_named() {
        let default = GatherOptions::default();
        assert_eq!(default.validate(), Ok(()));
        let truncation = 4.5;
        let error = GatherOptions {
            truncation,
            ..default
        }
        .validate()
        .unwrap_err();
        let expected = RendererError::OptionOutOfRange {
            name: "truncation",
            value: 4.5,
            range: "1 to 4",
        };
        assert_eq!(error, expected);
        let most_extent = 1e9;
        let error = GatherOptions {
            most_extent,
            ..default
        }
        .validate()
        .unwrap_err();
        let expected = RendererError::OptionOutOfRange {
            name: "most_extent",
            value: 1e9,
            range: "1 to 2^27 times the least",
        };
        assert_eq!(error, expected);
    }
}
