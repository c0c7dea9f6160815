use caustics_sampling::Sequence;

use crate::footprint_kernel::FootprintKernel;

/// The ways to turn photons into radiance.
///
/// Each is a choice of the points that photons are emitted from and of what is done with them where
/// they land. [`Estimate::GridGaussian`] is the best measured and the default; the others are
/// there to be compared with, and for hosts that cannot keep a lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Estimate {
    /// The nearest photons over the area of their disc.
    Nearest,
    /// Halton's points, each photon a disc of its footprint's area.
    HaltonDisc,
    /// Halton's points, each photon an ellipse.
    HaltonEllipse,
    /// A lattice of cells, each photon an ellipse.
    GridEllipse,
    /// A lattice of cells, each photon a Gaussian.
    #[default]
    GridGaussian,
}

impl Estimate {
    /// All estimates.
    pub const ALL: [Self; 5] = [
        Self::Nearest,
        Self::HaltonDisc,
        Self::HaltonEllipse,
        Self::GridEllipse,
        Self::GridGaussian,
    ];

    /// The name by which a user asks for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::HaltonDisc => "halton-disc",
            Self::HaltonEllipse => "halton-ellipse",
            Self::GridEllipse => "grid-ellipse",
            Self::GridGaussian => "grid-gaussian",
        }
    }

    /// What it does, in one line.
    #[must_use]
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Nearest => "the nearest photons, over the area of the disc that holds them",
            Self::HaltonDisc => "Halton's points, each photon a disc of its footprint's area",
            Self::HaltonEllipse => "Halton's points, each photon an ellipse over its footprint",
            Self::GridEllipse => "a lattice, each photon an ellipse over its footprint",
            Self::GridGaussian => "a lattice, each photon a Gaussian over its footprint",
        }
    }

    /// The estimate with a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|it| it.name() == name)
    }

    /// The points that its photons are emitted from.
    #[must_use]
    pub const fn sequence(self) -> Sequence {
        match self {
            Self::Nearest | Self::HaltonDisc | Self::HaltonEllipse => Sequence::Halton,
            Self::GridEllipse | Self::GridGaussian => Sequence::Grid,
        }
    }

    /// The shape of its footprints; `None` where photons are points.
    #[must_use]
    pub const fn kernel(self) -> Option<FootprintKernel> {
        match self {
            Self::Nearest => None,
            Self::HaltonDisc => Some(FootprintKernel::Disc),
            Self::HaltonEllipse | Self::GridEllipse => Some(FootprintKernel::Ellipse),
            Self::GridGaussian => Some(FootprintKernel::Gaussian),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_their_estimates() {
        for estimate in Estimate::ALL {
            assert_eq!(Estimate::from_name(estimate.name()), Some(estimate));
        }
        assert_eq!(Estimate::from_name("best"), None);
    }
}
