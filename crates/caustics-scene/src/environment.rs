use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use caustics_sampling::warp::sine_cosine;
use glam::{DVec3, Vec2, Vec3};
use thiserror::Error;

use crate::environment_parts::{EnvironmentRow, EnvironmentTexel, PARTS, chosen, ends};

/// Light from all around, infinitely far away: an equirectangular picture of radiance.
///
/// The upper row is the sky overhead (+Y), the middle of the picture is -Z and columns go on to +X,
/// so that a camera without rotation looks at the middle. Each texel has one radiance throughout.
/// Directions are sampled in proportion to the strongest channel, texel by texel, and evenly within
/// each. Clones share the picture.
///
/// ```
/// use caustics_scene::Environment;
/// use glam::Vec3;
///
/// // A white upper half over a black lower one.
/// let pixels = [[1.0; 3], [1.0; 3], [0.0; 3], [0.0; 3]];
/// let sky = Environment::new(2, 2, pixels.to_vec())?;
/// assert_eq!(sky.radiance(Vec3::Y), Vec3::ONE);
/// assert_eq!(sky.radiance(Vec3::NEG_Y), Vec3::ZERO);
/// assert!((sky.total().x - 2.0 * std::f32::consts::PI).abs() < 1e-5);
/// # Ok::<(), caustics_scene::EnvironmentError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    width: u32,
    rows: Arc<[EnvironmentRow]>,
    texels: Arc<[EnvironmentTexel]>,
    strongest: f32,
}

/// A direction from which light comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit direction towards the light.
    pub towards: Vec3,
    /// Radiance from there, in W/(sr m^2).
    pub radiance: Vec3,
    /// Probability density, in 1/sr.
    pub pdf: f32,
}

impl Environment {
    /// The most texels along either side.
    pub const MAX_SIDE: u32 = 1 << 16;

    /// Of how many parts samples are shared among rows, and those of a row among its texels.
    pub const PARTS: u32 = PARTS;

    /// The light of a picture, row by row from the top, in W/(sr m^2).
    ///
    /// # Errors
    /// Its size is zero, not that of the pixels or beyond [`MAX_SIDE`](Self::MAX_SIDE), a radiance is negative or not finite, or all is
    /// black.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, EnvironmentError> {
        if u64::from(width) * u64::from(height) != pixels.len() as u64 || pixels.is_empty() {
            return Err(EnvironmentError::Size {
                width,
                height,
                pixels: pixels.len(),
            });
        }
        if width.max(height) > Self::MAX_SIDE {
            return Err(EnvironmentError::Side {
                width,
                height,
                limit: Self::MAX_SIDE,
            });
        }
        let bad = |value: &f32| !(value.is_finite() && *value >= 0.0);
        if let Some((pixel, value)) = pixels
            .iter()
            .enumerate()
            .find_map(|(index, it)| Some((index, *it.iter().find(|value| bad(value))?)))
        {
            return Err(EnvironmentError::Radiance { pixel, value });
        }
        let pixels: Vec<Vec3> = pixels.into_iter().map(Vec3::from).collect();
        let mut rows = Vec::with_capacity(height as usize);
        let mut texels = Vec::with_capacity(pixels.len());
        let mut row_weights = Vec::with_capacity(height as usize);
        let mut weights = Vec::with_capacity(width as usize);
        for (row, of_row) in (0..height).zip(pixels.chunks_exact(width as usize)) {
            weights.clear();
            weights.extend(of_row.iter().map(|it| f64::from(it.max_element())));
            let texel = |(&radiance, end)| EnvironmentTexel { radiance, end };
            texels.extend(of_row.iter().zip(ends(&weights)).map(texel));
            let (top, bottom) = (edge(row, height), edge(row + 1, height));
            rows.push(EnvironmentRow {
                top,
                bottom,
                solid_angle: TAU / width as f32 * (top - bottom),
                end: 0,
            });
            row_weights.push(weights.iter().sum::<f64>() * f64::from(top - bottom));
        }
        let total: f64 = row_weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(EnvironmentError::Black);
        }
        for (row, end) in rows.iter_mut().zip(ends(&row_weights)) {
            row.end = end;
        }
        let mut sky = Self {
            width,
            rows: rows.into(),
            texels: texels.into(),
            strongest: 0.0,
        };
        sky.strongest = sky.strongest();
        Ok(sky)
    }

    /// Its width and height in texels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.rows.len() as u32]
    }

    /// Its rows, from the top.
    #[must_use]
    pub fn rows(&self) -> &[EnvironmentRow] {
        &self.rows
    }

    /// Its texels, row by row from the top.
    #[must_use]
    pub fn texels(&self) -> &[EnvironmentTexel] {
        &self.texels
    }

    /// Whether both are clones of one: then they have the same picture, and none need be compared.
    #[must_use]
    pub fn shares_picture(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.texels, &other.texels)
    }

    /// What the radiance of no [`sample`](Self::sample), divided by its density, exceeds in any
    /// channel, in W/m^2. Importance makes it nearly the same for all.
    #[must_use]
    pub fn strongest_sample(&self) -> f32 {
        self.strongest
    }

    /// Radiance of the light that comes from a unit direction, in W/(sr m^2).
    #[must_use]
    pub fn radiance(&self, towards: Vec3) -> Vec3 {
        let [width, height] = self.size();
        // Casts saturate, and a NaN is 0.
        let row = (towards.y.clamp(-1.0, 1.0).acos() / PI * height as f32) as u32;
        let turn = towards.x.atan2(-towards.z) / TAU + 0.5;
        let column = (turn * width as f32) as u32;
        let of_row = self.texels_of(row.min(height - 1) as usize);
        of_row[column.min(width - 1) as usize].radiance
    }

    /// The radiance of all directions together, integrated over the sphere, in W/m^2: times the
    /// cross-section of a ball, the flux that falls on it.
    #[must_use]
    pub fn total(&self) -> Vec3 {
        let of_row = |(index, row): (usize, &EnvironmentRow)| {
            let texels = self.texels_of(index).iter();
            let all: DVec3 = texels.map(|it| it.radiance.as_dvec3()).sum();
            f64::from(row.solid_angle) * all
        };
        let sum: DVec3 = self.rows.iter().enumerate().map(of_row).sum();
        sum.as_vec3()
    }

    /// The direction at a point of the unit square, by importance; brighter texels get as much more
    /// of the square.
    #[must_use]
    pub fn sample(&self, sample: Vec2) -> EnvironmentSample {
        let row = chosen(&self.rows, sample.y);
        let EnvironmentRow {
            top,
            bottom,
            solid_angle,
            ..
        } = self.rows[row.index];
        let of_row = self.texels_of(row.index);
        let column = chosen(of_row, sample.x);
        let height = top + (bottom - top) * row.along;
        let ring = (1.0 - height * height).max(0.0).sqrt();
        let turn = (column.index as f32 + column.along) / self.width as f32 - 0.5;
        let (sine, cosine) = sine_cosine(TAU * turn);
        EnvironmentSample {
            towards: Vec3::new(ring * sine, height, -ring * cosine),
            radiance: of_row[column.index].radiance,
            pdf: row.part * column.part / solid_angle,
        }
    }

    fn texels_of(&self, row: usize) -> &[EnvironmentTexel] {
        let width = self.width as usize;
        &self.texels[row * width..(row + 1) * width]
    }

    fn strongest(&self) -> f32 {
        let mut strongest = 0.0f32;
        let mut row_start = 0;
        for (index, row) in self.rows.iter().enumerate() {
            let row_part = (row.end - row_start) as f32 / PARTS as f32;
            row_start = row.end;
            let mut start = 0;
            for texel in self.texels_of(index) {
                let part = (texel.end - start) as f32 / PARTS as f32;
                start = texel.end;
                let pdf = row_part * part / row.solid_angle;
                if pdf > 0.0 {
                    strongest = strongest.max(texel.radiance.max_element() / pdf);
                }
            }
        }
        strongest
    }
}

/// The cosine of the angle from +Y at which a row begins.
fn edge(row: u32, height: u32) -> f32 {
    (PI * row as f32 / height as f32).cos()
}

/// A picture that gives no light.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// A size that is zero, or not that of the pixels.
    #[error("an environment of {width} by {height} pixels cannot be made of {pixels}")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
    /// More texels along a side than can be told apart.
    #[error("an environment of {width} by {height} pixels has more than {limit} along a side")]
    Side {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// The most along either.
        limit: u32,
    },
    /// A radiance that is negative or not finite.
    #[error("radiance {value} of pixel {pixel} is not a finite number of at least 0")]
    Radiance {
        /// Number of the pixel, row by row.
        pixel: usize,
        /// The offending channel.
        value: f32,
    },
    /// No light at all, or more than can be summed.
    #[error("the environment is black, or its light is not finite")]
    Black,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky() -> Environment {
        let (width, height) = (16, 8);
        let pixels = (0..width * height).map(|index| {
            let bright = if index == 37 { 500.0 } else { 0.0 };
            [
                bright + (index % 7) as f32,
                0.5 * (index % 3) as f32,
                bright,
            ]
        });
        Environment::new(width, height, pixels.collect()).unwrap()
    }

    /// Of a lattice over the square, each sample stands for `1 / pdf` steradians.
    #[test]
    fn samples_integrate_to_the_total() {
        let sky = sky();
        const SIDE: u16 = 1000;
        let mut sum = glam::DVec3::ZERO;
        for y in 0..SIDE {
            for x in 0..SIDE {
                let at = (Vec2::new(f32::from(x), f32::from(y)) + 0.5) / f32::from(SIDE);
                let sample = sky.sample(at);
                assert!((sample.towards.length() - 1.0).abs() < 1e-5);
                sum += (sample.radiance / sample.pdf).as_dvec3();
                if x % 10 == 3 && y % 10 == 3 {
                    // Not within rounding of a texel's border.
                    let near = sky.radiance(sample.towards);
                    assert!(near == sample.radiance || near.max_element() > 0.0);
                }
            }
        }
        let mean = sum.as_vec3() / f32::from(SIDE).powi(2);
        assert!(
            (mean - sky.total()).abs().max_element() < 2e-3 * sky.total().x,
            "{mean}"
        );
    }

    /// Nearly all samples carry the mean; the bound holds for the last bit of each.
    #[test]
    fn no_sample_is_stronger_than_the_strongest() {
        let sky = sky();
        let mut strongest = 0.0f32;
        for index in 0u16..50_000 {
            let at = Vec2::new(f32::from(index % 250), f32::from(index / 250));
            let sample = sky.sample((at + 0.5) / Vec2::new(250.0, 200.0));
            strongest = strongest.max(sample.radiance.max_element() / sample.pdf);
        }
        assert!(strongest <= sky.strongest_sample());
        assert!(strongest > 0.999 * sky.strongest_sample());
    }

    #[test]
    fn clones_share_their_picture() {
        let (one, other) = (sky(), sky());
        assert!(one == other && !one.shares_picture(&other));
        assert!(one.shares_picture(&one.clone()));
        assert_eq!(one.size(), [16, 8]);
    }

    /// Beside a sun of 10^30 times their radiance.
    #[test]
    fn the_dimmest_texels_are_sampled_too() {
        let (width, height) = (64, 32);
        let mut pixels = vec![[1.0; 3]; 64 * 32];
        pixels[700] = [1e30; 3];
        pixels[701] = [0.0; 3];
        let sky = Environment::new(width, height, pixels).unwrap();
        assert_eq!(sky.rows()[31].end, PARTS);
        for row in 0..32 {
            let start = if row == 0 { 0 } else { sky.rows()[row - 1].end };
            assert!(sky.rows()[row].end > start, "{row}");
            let of_row = sky.texels_of(row);
            assert_eq!(of_row[63].end, PARTS);
            let starts = std::iter::once(0).chain(of_row.iter().map(|it| it.end));
            for (texel, start) in of_row.iter().zip(starts) {
                assert_eq!(texel.end > start, texel.radiance != Vec3::ZERO, "{row}");
            }
        }
    }

    #[test]
    fn the_middle_is_ahead_and_columns_go_to_the_right() {
        let pixels = (0u8..8).map(|index| [f32::from(index) + 1.0; 3]).collect();
        let sky = Environment::new(4, 2, pixels).unwrap();
        let at = |x: f32, y: f32, z: f32| sky.radiance(Vec3::new(x, y, z).normalize()).x;
        assert_eq!(at(0.1, 0.1, -1.0), 3.0);
        assert_eq!(at(-0.1, 0.1, -1.0), 2.0);
        assert_eq!(at(0.1, 0.1, 1.0), 4.0);
        assert_eq!(at(0.1, -0.1, -1.0), 7.0);
    }

    #[test]
    fn nonsense_is_refused() {
        let refused = |width, height, pixels: &[[f32; 3]]| {
            Environment::new(width, height, pixels.to_vec()).unwrap_err()
        };
        assert!(matches!(
            refused(2, 2, &[[1.0; 3]]),
            EnvironmentError::Size { .. }
        ));
        assert!(matches!(refused(0, 0, &[]), EnvironmentError::Size { .. }));
        assert_eq!(refused(1, 1, &[[0.0; 3]]), EnvironmentError::Black);
        let error = refused(2, 1, &[[1.0; 3], [1.0, -2.0, 1.0]]);
        assert_eq!(
            error,
            EnvironmentError::Radiance {
                pixel: 1,
                value: -2.0
            }
        );
        assert!(Environment::new(1, 1, vec![[f32::NAN; 3]]).is_err());
        let long = vec![[1.0; 3]; 65_537];
        assert_eq!(
            refused(65_537, 1, &long),
            EnvironmentError::Side {
                width: 65_537,
                height: 1,
                limit: 65_536
            }
        );
        assert!(Environment::new(65_536, 1, long[1..].to_vec()).is_ok());
    }
}
