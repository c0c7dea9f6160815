/// The shape in which a footprint spreads its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FootprintKernel {
    /// A Gaussian with the footprint's axes for its standard deviations, cut off at
    /// [`FootprintOptions::truncation`](crate::FootprintOptions::truncation) of them.
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
}
