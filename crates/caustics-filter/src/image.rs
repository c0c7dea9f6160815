use thiserror::Error;

/// Why an [`Image`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ImageError {
    /// No pixels, or more than [`Image::MAX_PIXELS`].
    #[error("an image of {width} x {height} pixels is empty or has more than 134217728 pixels")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Number of rows.
        height: u32,
    },
    /// The pixels given are not as many as the size says.
    #[error("{found} pixels given for an image of {width} x {height}")]
    PixelCount {
        /// Pixels in a row.
        width: u32,
        /// Number of rows.
        height: u32,
        /// Pixels given.
        found: usize,
    },
}

/// A picture in linear RGB, usually radiance in W/(sr m^2), row by row from the top left.
///
/// Any `f32` is allowed in it: what happens to NaNs and infinities is up to each user of the
/// pixels ([`Image::non_finite`] counts them).
///
/// ```
/// use caustics_filter::Image;
///
/// let mut image = Image::new(640, 480)?;
/// *image.pixel_mut(639, 0).unwrap() = [1.0, 0.5, 0.0];
/// assert_eq!(image.pixels()[639], [1.0, 0.5, 0.0]);
/// assert_eq!(image.pixel(640, 0), None);
/// # Ok::<(), caustics_filter::ImageError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// The most pixels of an image: 2^27, or 1.5 GiB. A corrupt file must not ask for more.
    pub const MAX_PIXELS: usize = 1 << 27;

    /// A black image.
    ///
    /// # Errors
    ///
    /// A width or height of zero, or too many pixels.
    pub fn new(width: u32, height: u32) -> Result<Self, ImageError> {
        let count = Self::check_size(width, height)?;
        Ok(Self {
            width,
            height,
            pixels: vec![[0.0; 3]; count],
        })
    }

    /// An image of these pixels, row by row from the top left.
    ///
    /// # Errors
    ///
    /// A width or height of zero, too many pixels, or a wrong number of them.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        if pixels.len() != Self::check_size(width, height)? {
            return Err(ImageError::PixelCount {
                width,
                height,
                found: pixels.len(),
            });
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Pixels in a row.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top left.
    #[must_use]
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All pixels, to be changed.
    #[must_use]
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixels, row by row from the top left.
    #[must_use]
    pub fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels
    }

    /// The pixel in column `x` from the left and row `y` from the top.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        self.pixels.get(self.index(x, y)?).copied()
    }

    /// The pixel in column `x` from the left and row `y` from the top, to be changed.
    #[must_use]
    pub fn pixel_mut(&mut self, x: u32, y: u32) -> Option<&mut [f32; 3]> {
        let index = self.index(x, y)?;
        self.pixels.get_mut(index)
    }

    /// The rows from the top.
    #[must_use]
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[[f32; 3]]> {
        self.pixels.chunks_exact(self.width as usize)
    }

    /// The rows from the top, to be changed: one for each worker that fills the image.
    pub fn rows_mut(&mut self) -> impl ExactSizeIterator<Item = &mut [[f32; 3]]> {
        self.pixels.chunks_exact_mut(self.width as usize)
    }

    /// Number of channel values that are NaN or infinite.
    #[must_use]
    pub fn non_finite(&self) -> usize {
        self.pixels
            .as_flattened()
            .iter()
            .filter(|value| !value.is_finite())
            .count()
    }

    /// Mean over pixels and channels, summed in `f64`: an `f32` sum loses digits by the million.
    #[must_use]
    pub fn mean(&self) -> f64 {
        let values = self.pixels.as_flattened();
        values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64
    }

    /// The number of pixels of an image of this size, if there can be one.
    pub(crate) fn check_size(width: u32, height: u32) -> Result<usize, ImageError> {
        let count = u64::from(width) * u64::from(height);
        match usize::try_from(count) {
            Ok(count) if (1..=Self::MAX_PIXELS).contains(&count) => Ok(count),
            _ => Err(ImageError::Size { width, height }),
        }
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        (x < self.width && y < self.height).then_some(y as usize * self.width as usize + x as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        for (width, height) in [(0, 0), (0, 5), (5, 0), (u32::MAX, u32::MAX), (1 << 27, 2)] {
            let error = ImageError::Size { width, height };
            assert_eq!(Image::new(width, height), Err(error));
            assert_eq!(Image::from_pixels(width, height, vec![]), Err(error));
        }
        let error = ImageError::PixelCount {
            width: 2,
            height: 2,
            found: 3,
        };
        assert_eq!(Image::from_pixels(2, 2, vec![[0.0; 3]; 3]), Err(error));
        assert!(
            error
                .to_string()
                .contains("3 pixels given for an image of 2 x 2")
        );
        let limit = ImageError::Size {
            width: 0,
            height: 1,
        }
        .to_string();
        assert!(limit.contains(&Image::MAX_PIXELS.to_string()));
    }

    #[test]
    fn rows_run_from_the_top() {
        let pixels = (0..6).map(|i| [i as f32; 3]).collect();
        let mut image = Image::from_pixels(3, 2, pixels).unwrap();
        assert_eq!(image.pixel(2, 0), Some([2.0; 3]));
        assert_eq!(image.pixel(0, 1), Some([3.0; 3]));
        for outside in [(3, 0), (0, 2), (u32::MAX, u32::MAX)] {
            assert_eq!(image.pixel(outside.0, outside.1), None);
            assert_eq!(image.pixel_mut(outside.0, outside.1), None);
        }
        assert_eq!(image.rows().len(), 2);
        assert_eq!(image.mean(), 2.5);
        for (y, row) in image.rows_mut().enumerate() {
            row.fill([y as f32; 3]);
        }
        assert_eq!(image.rows().nth(1), Some(&[[1.0; 3]; 3][..]));
        image.pixels_mut()[4] = [f32::NAN, f32::INFINITY, 1.0];
        assert_eq!(image.non_finite(), 2);
    }
}
