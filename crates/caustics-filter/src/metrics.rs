use thiserror::Error;

use crate::Image;

/// The part of the reference's mean that steadies the relative error where the reference is dark.
const RELATIVE_FLOOR: f64 = 0.1;

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MetricError {
    /// The images are of different sizes.
    #[error(
        "a test image of {test_width} x {test_height} against a reference of {reference_width} x {reference_height}"
    )]
    Size {
        /// Width of the image under test.
        test_width: u32,
        /// Height of the image under test.
        test_height: u32,
        /// Width of the reference.
        reference_width: u32,
        /// Height of the reference.
        reference_height: u32,
    },
    /// The reference holds NaNs or infinities.
    #[error("{count} values of the reference are not finite")]
    NonFiniteReference {
        /// How many channel values.
        count: usize,
    },
    /// The reference's mean is not above zero, so that nothing is relative to it.
    #[error("the reference is black")]
    BlackReference,
}

/// How far an image is from a reference; all sums are over pixels and channels, in `f64`.
///
/// Values of the test image that are not finite count as zero, and are counted. A reference that
/// holds such values, is black or of another size is an error. The measures are in `f64` since
/// they sum squares of numbers that range over many orders of magnitude.
///
/// ```
/// use caustics_filter::{Comparison, Image};
///
/// let reference = Image::from_pixels(2, 1, vec![[1.0; 3], [3.0; 3]])?;
/// let test = Image::from_pixels(2, 1, vec![[1.0; 3], [2.0; 3]])?;
/// let comparison = Comparison::new(&test, &reference)?;
/// assert_eq!(comparison.energy_ratio, 0.75);
/// assert_eq!(comparison.rmse, 0.5_f64.sqrt());
/// // One pixel of two is off, by 1: (1 / (3^2 + (0.1 * 2)^2)) / 2.
/// assert!((comparison.relative_mse - 0.5 / 9.04).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Sum of the test image over that of the reference.
    pub energy_ratio: f64,
    /// Root of the mean squared difference, in the images' unit.
    pub rmse: f64,
    /// The same over the reference's mean.
    pub rmse_relative: f64,
    /// Mean of `(t - r)^2 / (r^2 + (0.1 mean r)^2)`.
    pub relative_mse: f64,
    /// The same without the 1 % of pixels where it is largest.
    pub relative_mse_trimmed: f64,
    /// 99.9th percentile of a pixel's mean absolute difference, in the images' unit.
    pub p999: f64,
    /// The same over the reference's mean.
    pub p999_relative: f64,
    /// Channel values of the test image that are not finite, taken as zero.
    pub non_finite: usize,
}

impl Comparison {
    /// Compares an image with a reference by all measures.
    ///
    /// # Errors
    ///
    /// Different sizes; a reference that is black or not finite.
    pub fn new(test: &Image, reference: &Image) -> Result<Self, MetricError> {
        let mean = reference_mean(test, reference)?;
        let rmse = rmse(test, reference)?;
        let p999 = percentile(&absolute_errors(test, reference)?, 99.9);
        let relative = relative_errors(test, reference)?;
        Ok(Self {
            energy_ratio: energy_ratio(test, reference)?,
            rmse,
            rmse_relative: rmse / mean,
            relative_mse: average(&relative),
            relative_mse_trimmed: trimmed_mean(&relative, 0.01),
            p999,
            p999_relative: p999 / mean,
            non_finite: test.non_finite(),
        })
    }
}

/// Sum of the test image over that of the reference.
///
/// # Errors
///
/// As [`Comparison::new`].
pub fn energy_ratio(test: &Image, reference: &Image) -> Result<f64, MetricError> {
    reference_mean(test, reference)?;
    let total = |image| values(image).map(finite_or_zero).sum::<f64>();
    Ok(total(test) / total(reference))
}

/// Root of the mean squared difference, in the images' unit. The reference may be black.
///
/// # Errors
///
/// Different sizes, or a reference that is not finite.
pub fn rmse(test: &Image, reference: &Image) -> Result<f64, MetricError> {
    comparable(test, reference)?;
    let squares = values(test)
        .zip(values(reference))
        .map(|(t, r)| (finite_or_zero(t) - f64::from(r)).powi(2));
    Ok((squares.sum::<f64>() / values(reference).len() as f64).sqrt())
}

/// Mean of `(t - r)^2 / (r^2 + (0.1 mean r)^2)`.
///
/// # Errors
///
/// As [`Comparison::new`].
pub fn relative_mse(test: &Image, reference: &Image) -> Result<f64, MetricError> {
    Ok(average(&relative_errors(test, reference)?))
}

/// For every pixel the mean over channels of `(t - r)^2 / (r^2 + (0.1 mean r)^2)`.
///
/// # Errors
///
/// As [`Comparison::new`].
pub fn relative_errors(test: &Image, reference: &Image) -> Result<Vec<f64>, MetricError> {
    let floor = (RELATIVE_FLOOR * reference_mean(test, reference)?).powi(2);
    Ok(per_pixel(test, reference, |t, r| {
        (t - r).powi(2) / (r * r + floor)
    }))
}

/// For every pixel the mean over channels of `|t - r|`, in the images' unit. The reference may be
/// black.
///
/// # Errors
///
/// Different sizes, or a reference that is not finite.
pub fn absolute_errors(test: &Image, reference: &Image) -> Result<Vec<f64>, MetricError> {
    comparable(test, reference)?;
    Ok(per_pixel(test, reference, |t, r| (t - r).abs()))
}

/// Mean of the values without the largest ones, a part `trim` in `[0, 1)` of them; at least one
/// value stays. NaN where there are no values.
#[must_use]
pub fn trimmed_mean(values: &[f64], trim: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let kept = (values.len() as f64 * (1.0 - trim)) as usize;
    average(&sorted[..kept.clamp(1.min(values.len()), values.len())])
}

/// The value below which `percent` of the values lie, with linear interpolation between
/// neighbours (`percent` 0 is the least, 100 the largest). NaN where there are no values.
#[must_use]
pub fn percentile(values: &[f64], percent: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else {
        return f64::NAN;
    };
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let position = (percent / 100.0).clamp(0.0, 1.0) * last as f64;
    let below = sorted[position as usize];
    let above = sorted[(position as usize + 1).min(last)];
    below + (above - below) * position.fract()
}

fn per_pixel(test: &Image, reference: &Image, error: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let pixels = test.pixels().iter().zip(reference.pixels());
    pixels
        .map(|(test, reference)| {
            let channels = test.iter().zip(reference);
            channels
                .map(|(&t, &r)| error(finite_or_zero(t), f64::from(r)))
                .sum::<f64>()
                / 3.0
        })
        .collect()
}

fn comparable(test: &Image, reference: &Image) -> Result<(), MetricError> {
    if (test.width(), test.height()) != (reference.width(), reference.height()) {
        return Err(MetricError::Size {
            test_width: test.width(),
            test_height: test.height(),
            reference_width: reference.width(),
            reference_height: reference.height(),
        });
    }
    match reference.non_finite() {
        0 => Ok(()),
        count => Err(MetricError::NonFiniteReference { count }),
    }
}

/// The reference's mean, above zero.
fn reference_mean(test: &Image, reference: &Image) -> Result<f64, MetricError> {
    comparable(test, reference)?;
    let mean = reference.mean();
    if mean > 0.0 {
        Ok(mean)
    } else {
        Err(MetricError::BlackReference)
    }
}

fn values(image: &Image) -> impl ExactSizeIterator<Item = f32> {
    image.pixels().as_flattened().iter().copied()
}

fn finite_or_zero(value: f32) -> f64 {
    if value.is_finite() {
        f64::from(value)
    } else {
        0.0
    }
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
