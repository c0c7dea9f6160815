use std::f32::consts::{PI, SQRT_2};

use crate::footprint::MAX_SLIDE;

/// Squared radius, in standard deviations, at which the Gaussian is cut off.
const GAUSSIAN_CUT: f32 = 9.0;

/// The shape in which a footprint spreads its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FootprintKernel {
    /// A Gaussian with the footprint's axes for its standard deviations, cut off at three of them.
    #[default]
    Gaussian,
    /// Epanechnikov's parabola over the footprint's ellipse, as in adaptive anisotropic photon
    /// scattering (Yang and Ouyang 2021).
    Ellipse,
    /// Constant over a disc of the footprint's area (Larsen 2006).
    Disc,
    /// The product of two tents along the footprint's axes: on a lattice they sum to one.
    Tent,
}

impl FootprintKernel {
    /// All kernels.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::Ellipse, Self::Disc, Self::Tent];

    /// The name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Ellipse => "ellipse",
            Self::Disc => "disc",
            Self::Tent => "tent",
        }
    }

    /// Squared radius, in standard deviations, beyond which the kernel is zero.
    pub(crate) fn cut(self) -> f32 {
        match self {
            Self::Gaussian => GAUSSIAN_CUT,
            Self::Ellipse => 6.0,
            Self::Disc => 4.0,
            Self::Tent => 12.0,
        }
    }

    /// The variance that a pixel adds along each of its edges, in squared pixels.
    ///
    /// For the Gaussian it is that of the box as wide as the pixel. The others end sooner, and need
    /// more to reach a pixel's middle from wherever they stand.
    pub(crate) fn pixel_variance(self) -> f32 {
        if self == Self::Gaussian {
            1.0 / 12.0
        } else {
            0.25
        }
    }

    /// The extent of the kernel along each of its axes, for axes of one standard deviation.
    pub(crate) fn reach(self) -> f32 {
        match self {
            Self::Gaussian => GAUSSIAN_CUT.sqrt(),
            // Radii at which each kernel has the variance 1 along each axis.
            Self::Ellipse | Self::Tent => 6.0f32.sqrt(),
            Self::Disc => 2.0,
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
        if self == Self::Tent {
            SQRT_2 * self.reach()
        } else {
            self.reach()
        }
    }

    /// The kernel at coordinates along its axes in standard deviations; its integral is 1.
    #[inline]
    pub(crate) fn density(self, u: f32, v: f32) -> f32 {
        let squared = u * u + v * v;
        match self {
            Self::Gaussian => gaussian(squared),
            Self::Ellipse => (1.0 - squared / 6.0).max(0.0) / (3.0 * PI),
            Self::Disc => {
                if squared < 4.0 {
                    0.25 / PI
                } else {
                    0.0
                }
            }
            Self::Tent => {
                let width = 6.0f32.sqrt();
                let tent = |x: f32| (1.0 - x.abs() / width).max(0.0);
                tent(u) * tent(v) / 6.0
            }
        }
    }
}

/// The normal density at a squared radius, cut off and divided by what is left of its integral.
///
/// The exponential is `exp(-squared / 32)` by its series, to the 16th power: right to 1e-5 of its
/// value up to the cut, without a branch or a call, so that loops over it use vector instructions.
#[inline]
fn gaussian(squared: f32) -> f32 {
    /// `1 / (2 pi (1 - exp(-GAUSSIAN_CUT / 2)))`
    const PEAK: f32 = 0.160_942_8;
    let y = squared * (1.0 / 32.0);
    let series =
        1.0 - y * (1.0 - y * (1.0 / 2.0 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
    let second = series * series;
    let fourth = second * second;
    let eighth = fourth * fourth;
    let value = PEAK * (eighth * eighth);
    if squared < GAUSSIAN_CUT { value } else { 0.0 }
}
