//! Reconstruction kernels, linear images and error metrics for caustic rendering.

mod display;
#[cfg(feature = "exr")]
mod exr_io;
#[cfg(any(feature = "exr", feature = "png"))]
mod file_error;
mod image;
mod kernel;
mod metrics;
#[cfg(feature = "png")]
mod png_io;

pub use display::{Display, ToneCurve};
#[cfg(feature = "exr")]
pub use exr_io::{decode_exr, encode_exr, read_exr, write_exr};
#[cfg(any(feature = "exr", feature = "png"))]
pub use file_error::{DecodeError, EncodeError, FileError};
pub use image::{Image, ImageError};
pub use kernel::{Kernel, UnknownKernel};
pub use metrics::{
    Comparison, MetricError, absolute_errors, energy_ratio, percentile, relative_errors,
    relative_mse, rmse, trimmed_mean,
};
#[cfg(feature = "png")]
pub use png_io::{encode_png, write_png};
