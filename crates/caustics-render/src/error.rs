use caustics_accel::AccelError;
use caustics_filter::ImageError;
use thiserror::Error;

/// What can be wrong with a picture's or an estimate's input.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RenderError {
    /// A picture without pixels, or with more than fit in memory.
    #[error("the picture's size {width} x {height} is not between 1 x 1 and {limit} x {limit}")]
    InvalidSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// The largest width and height.
        limit: u32,
    },
    /// No samples a pixel.
    #[error("the number of samples a pixel must be at least 1")]
    NoSamples,
    /// An estimate from no photons.
    #[error("the number of nearest photons must be at least 1")]
    NoNeighbours,
    /// A search radius that is not a positive number.
    #[error("the search radius {radius} is not a positive, finite number of metres")]
    InvalidRadius {
        /// The radius, in metres.
        radius: f32,
    },
    /// A footprint scale that is not a positive number.
    #[error("the footprint scale {scale} is not a positive, finite number of sample spacings")]
    InvalidScale {
        /// The scale, in sample spacings.
        scale: f32,
    },
    /// A Gaussian that ends too early, too late or nowhere.
    #[error("the truncation {truncation} is not between 1 and 4 standard deviations")]
    InvalidTruncation {
        /// Where it ends, in standard deviations.
        truncation: f32,
    },
    /// A limit on anisotropy below that of a disc.
    #[error("the anisotropy limit {max_anisotropy} is not at least 1")]
    InvalidAnisotropy {
        /// The limit.
        max_anisotropy: f32,
    },
    /// A number of overlaps that no photon could keep to.
    #[error("the number of overlaps {max_overlaps} is not above 0")]
    InvalidOverlaps {
        /// The number.
        max_overlaps: f32,
    },
    /// A photon with a NaN or infinite number in it.
    #[error("photon {photon} is not finite")]
    NonFinitePhoton {
        /// Index of the first such photon.
        photon: usize,
    },
    /// A structure that photons are found with could not be built.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// The picture's memory could not be had.
    #[error(transparent)]
    Image(#[from] ImageError),
}
