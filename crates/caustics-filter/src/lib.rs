//! Reconstruction kernels, linear images and error metrics for caustic rendering.
//!
//! What stands between photons and a picture: [`Kernel`] says how a photon's flux spreads over its
//! disc, [`Image`] holds linear radiance, and [`Comparison`] says how far that is from a reference.
//! Start with [`Image`]:
//!
//! ```
//! use caustics_filter::{Comparison, Image, Kernel};
//!
//! // One photon of 1 W on a receiver of 1 m^2, seen by 64 x 64 pixels: its disc has a radius
//! // of 20 pixels.
//! let (side, radius) = (64, 20.0_f32);
//! let mut image = Image::new(side, side)?;
//! let pixel_area = 1.0 / (side * side) as f32;
//! for (y, row) in image.rows_mut().enumerate() {
//!     for (x, pixel) in row.iter_mut().enumerate() {
//!         let (dx, dy) = (x as f32 - 31.5, y as f32 - 31.5);
//!         let density = Kernel::Epanechnikov.density((dx * dx + dy * dy) / (radius * radius));
//!         *pixel = [density / (radius * radius * pixel_area); 3];
//!     }
//! }
//! // The mean irradiance is 1 W/m^2: the kernel neither adds nor takes energy.
//! assert!((image.mean() - 1.0).abs() < 1e-3);
//!
//! // Against even light of the same flux:
//! let even = Image::from_pixels(side, side, vec![[1.0; 3]; 64 * 64])?;
//! let comparison = Comparison::new(&image, &even)?;
//! assert!((comparison.energy_ratio - 1.0).abs() < 1e-3);
//! assert!(comparison.relative_mse > 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | items | what they are for |
//! | --- | --- |
//! | [`Kernel`] | kernels of integral one on the unit disc, with their variances |
//! | [`Image`] | linear RGB in rows from the top left |
//! | `read_exr`, `write_exr`, `decode_exr`, `encode_exr` | `OpenEXR` files and bytes (feature `exr`) |
//! | `write_png`, `encode_png` | 8-bit sRGB files and bytes (feature `png`) |
//! | [`Display`], [`ToneCurve`] | exposure and tone, from radiance to 8 bits |
//! | [`Comparison`] | all error metrics at once; each is also a function of its own |
//!
//! # NaNs and infinities
//!
//! An image may hold them, and EXR files keep them. [`Comparison`] takes those of the image under
//! test as zero and counts them, and refuses a reference that has some; a [`Display`] shows a NaN
//! black and positive infinity white.
//!
//! # Features
//!
//! `exr` and `png`, both on by default, bring the file formats and nothing else.
//!
//! # References
//!
//! Kernels: Silverman 1986 and Jensen 2001. Tone: IEC 61966-2-1 and Reinhard et al. 2002. Relative
//! mean squared error, as in Rousselle, Knaus and Zwicker, *Adaptive Sampling and Reconstruction
//! using Greedy Error Minimization* (2011), with a floor that follows the reference's mean.

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
#[cfg(feature = "exr")]
pub use file_error::DecodeError;
#[cfg(any(feature = "exr", feature = "png"))]
pub use file_error::{EncodeError, FileError};
pub use image::{Image, ImageError};
pub use kernel::{Kernel, UnknownKernel};
pub use metrics::{
    Comparison, MetricError, absolute_errors, energy_ratio, percentile, relative_errors,
    relative_mse, rmse, trimmed_mean,
};
#[cfg(feature = "png")]
pub use png_io::{encode_png, write_png};
