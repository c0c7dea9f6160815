use std::f32::consts::{PI, SQRT_2};

use caustics_trace::Coverage;

use crate::density::MAX_SLIDE;
use crate::footprint::FootprintOptions;
use crate::footprint_kernel::FootprintKernel;

/// The Gaussian's value in its middle if it ends at three standard deviations:
/// `1 / (2 pi (1 - exp(-3² / 2)))`.
const PEAK_AT_THREE: f32 = 0.160_942_8;

/// The part of a normal distribution that lies within three standard deviations: `1 - exp(-3² / 2)`.
const WITHIN_THREE: f64 = 0.988_891_003_461_758;

/// The kernels of all photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kernels {
    cell: TruncatedKernel,
    overlap: TruncatedKernel,
}

impl Kernels {
    /// The kernels that the options ask for.
    pub(crate) fn of(options: &FootprintOptions) -> Self {
        let ending = |truncation| TruncatedKernel::new(options.kernel, truncation);
        Self {
            cell: ending(options.truncation),
            overlap: ending(options.overlap_truncation),
        }
    }

    /// The kernel of photons whose footprints lie so among others.
    #[inline]
    pub(crate) fn get(self, coverage: Coverage) -> TruncatedKernel {
        if coverage.overlaps() {
            self.overlap
        } else {
            self.cell
        }
    }

    /// How far the blur of a pixel may carry light, relative to the pixel's edges.
    pub(crate) fn blur_reach(self) -> f32 {
        let farthest = self.cell.search_reach().max(self.overlap.search_reach());
        farthest * self.cell.shape.pixel_variance().sqrt()
    }
}

/// A kernel and where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TruncatedKernel {
    pub(crate) shape: FootprintKernel,
    /// Where a Gaussian ends, in standard deviations.
    truncation: f32,
    /// A Gaussian's value in its middle.
    peak: f32,
}

impl TruncatedKernel {
    /// A kernel that ends, if it is a Gaussian, at so many standard deviations.
    fn new(shape: FootprintKernel, truncation: f32) -> Self {
        // In f64, so that the quotient is one for three standard deviations on any machine.
        let within = 1.0 - (-0.5 * f64::from(truncation).powi(2)).exp();
        Self {
            shape,
            truncation,
            peak: PEAK_AT_THREE * (WITHIN_THREE / within) as f32,
        }
    }

    /// Squared radius, in standard deviations, beyond which the kernel is zero.
    #[inline]
    pub(crate) fn cut(self) -> f32 {
        match self.shape {
            FootprintKernel::Gaussian => self.truncation * self.truncation,
            FootprintKernel::Ellipse => 6.0,
            FootprintKernel::Disc => 4.0,
            FootprintKernel::Tent => 12.0,
        }
    }

    /// The extent of the kernel along each of its axes, for axes of one standard deviation.
    pub(crate) fn reach(self) -> f32 {
        match self.shape {
            FootprintKernel::Gaussian => self.truncation,
            // Radii at which each kernel has the variance 1 along each axis.
            FootprintKernel::Ellipse | FootprintKernel::Tent => 6.0f32.sqrt(),
            FootprintKernel::Disc => 2.0,
        }
    }

    /// How far a blur of one standard deviation carries light from where it would be, in any
    /// direction, along the receiver or off its plane.
    pub(crate) fn search_reach(self) -> f32 {
        self.outer_reach() + self.reach() * MAX_SLIDE
    }

    /// The farthest that light gets along any direction, in standard deviations along that
    /// direction.
    pub(crate) fn outer_reach(self) -> f32 {
        // The tent's corners lie beyond the ellipse.
        if self.shape == FootprintKernel::Tent {
            SQRT_2 * self.reach()
        } else {
            self.reach()
        }
    }

    /// The kernel at coordinates along its axes in standard deviations; its integral is 1.
    #[inline]
    pub(crate) fn density(self, u: f32, v: f32) -> f32 {
        let squared = u * u + v * v;
        match self.shape {
            FootprintKernel::Gaussian => {
                let value = self.peak * exponential(squared);
                if squared < self.cut() { value } else { 0.0 }
            }
            FootprintKernel::Ellipse => (1.0 - squared / 6.0).max(0.0) / (3.0 * PI),
            FootprintKernel::Disc => {
                if squared < 4.0 {
                    0.25 / PI
                } else {
                    0.0
                }
            }
            FootprintKernel::Tent => {
                let width = 6.0f32.sqrt();
                let tent = |x: f32| (1.0 - x.abs() / width).max(0.0);
                tent(u) * tent(v) / 6.0
            }
        }
    }
}

/// `exp(-squared / 2)`: the series of `exp(-squared / 32)`, to the 16th power. It is off by less than
/// 1e-6 up to four standard deviations, and by 2e-5 of its value up to three, without a branch or a
/// call, so that loops over it use vector instructions.
#[inline]
fn exponential(squared: f32) -> f32 {
    let y = squared * (1.0 / 32.0);
    let series =
        1.0 - y * (1.0 - y * (1.0 / 2.0 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
    let second = series * series;
    let fourth = second * second;
    let eighth = fourth * fourth;
    eighth * eighth
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn gaussian(truncation: f32) -> TruncatedKernel {
        TruncatedKernel::new(FootprintKernel::Gaussian, truncation)
    }

    /// The kernel's integral over rings of equal width, by the midpoint rule in f64.
    fn integral(kernel: TruncatedKernel, rings: u32) -> f64 {
        let width = f64::from(kernel.reach()) / f64::from(rings);
        let ring = |ring: u32| {
            let radius = (f64::from(ring) + 0.5) * width;
            f64::from(kernel.density(radius as f32, 0.0)) * radius
        };
        std::f64::consts::TAU * width * (0..rings).map(ring).sum::<f64>()
    }

    #[test]
    fn the_series_is_the_exponential_up_to_four_standard_deviations() {
        let mut most = [0.0f64; 2];
        for step in 0..=16_000 {
            let squared = step as f32 / 1000.0;
            let expected = (-0.5 * f64::from(squared)).exp();
            let off = (f64::from(exponential(squared)) - expected).abs();
            most[0] = most[0].max(off);
            if squared <= 9.0 {
                most[1] = most[1].max(off / expected);
            }
        }
        // Of the largest value, and of each value up to three standard deviations.
        assert!(most[0] < 1e-6, "{most:?}");
        assert!(most[1] < 2e-5, "{most:?}");
    }

    #[test]
    fn the_peak_is_one_over_what_is_within() {
        assert_eq!(gaussian(3.0).peak, PEAK_AT_THREE);
        for (truncation, peak) in [
            (1.0, 0.404_491_35),
            (2.0, 0.184_065_5),
            (2.65, 0.164_053_51),
            (4.0, 0.159_208_35),
        ] {
            let found = gaussian(truncation).peak;
            assert!((found / peak - 1.0).abs() < 1e-6, "{truncation}: {found}");
        }
    }

    proptest! {
        #[test]
        fn the_integral_is_one_for_any_truncation(truncation in 1.0f32..=4.0) {
            let found = integral(gaussian(truncation), 20_000);
            prop_assert!((found - 1.0).abs() < 2e-6, "{found}");
        }

        #[test]
        fn there_is_no_light_beyond_the_reach(
            truncation in 1.0f32..=4.0,
            radius in 0.0f32..6.0,
            angle in 0.0f32..6.3,
        ) {
            let kernel = gaussian(truncation);
            let (v, u) = angle.sin_cos();
            let found = kernel.density(radius * u, radius * v);
            prop_assume!((radius - truncation).abs() > 1e-5);
            prop_assert_eq!(found > 0.0, radius < truncation);
            prop_assert_eq!(kernel.outer_reach(), truncation);
        }
    }
}
