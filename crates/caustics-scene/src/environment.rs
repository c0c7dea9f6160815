use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use thiserror::Error;

/// Light from all around, infinitely far away: an equirectangular picture of radiance.
///
/// The upper row is the sky overhead (+Y), the middle of the picture is -Z and columns go on to +X,
/// so that a camera without rotation looks at the middle. Each texel has one radiance throughout.
/// Directions are sampled in proportion to the strongest channel, texel by texel, and evenly within
/// each.
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
    height: u32,
    pixels: Vec<Vec3>,
    /// The part of all weight up to and including each row; the last is 1.
    rows: Vec<f64>,
    /// For each row, the part of its weight up to and including each texel.
    columns: Vec<f64>,
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
    /// The light of a picture, row by row from the top, in W/(sr m^2).
    ///
    /// # Errors
    /// Its size is zero or not that of the pixels, a radiance is negative or not finite, or all is
    /// black.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, EnvironmentError> {
        if u64::from(width) * u64::from(height) != pixels.len() as u64 || pixels.is_empty() {
            return Err(EnvironmentError::Size {
                width,
                height,
                pixels: pixels.len(),
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
        let mut columns = Vec::with_capacity(pixels.len());
        let mut total = 0.0;
        for (row, texels) in pixels.chunks_exact(width as usize).enumerate() {
            let (top, bottom) = heights(row as u32, height);
            let area = f64::from(top - bottom);
            let mut sum = 0.0;
            let first = columns.len();
            for texel in texels {
                sum += f64::from(texel.max_element());
                columns.push(sum);
            }
            if sum > 0.0 {
                for value in &mut columns[first..] {
                    *value /= sum;
                }
            }
            total += sum * area;
            rows.push(total);
        }
        if !(total > 0.0 && total.is_finite()) {
            return Err(EnvironmentError::Black);
        }
        for value in &mut rows {
            *value /= total;
        }
        Ok(Self {
            width,
            height,
            pixels,
            rows,
            columns,
        })
    }

    /// Radiance of the light that comes from a unit direction, in W/(sr m^2).
    #[must_use]
    pub fn radiance(&self, towards: Vec3) -> Vec3 {
        // Casts saturate, and a NaN is 0.
        let row = (towards.y.clamp(-1.0, 1.0).acos() / PI * self.height as f32) as u32;
        let turn = towards.x.atan2(-towards.z) / TAU + 0.5;
        let column = (turn * self.width as f32) as u32;
        self.texel(column.min(self.width - 1), row.min(self.height - 1))
    }

    /// The radiance of all directions together, integrated over the sphere, in W/m^2: times the
    /// cross-section of a ball, the flux that falls on it.
    #[must_use]
    pub fn total(&self) -> Vec3 {
        let mut sum = glam::DVec3::ZERO;
        for (row, texels) in self.pixels.chunks_exact(self.width as usize).enumerate() {
            let all: glam::DVec3 = texels.iter().map(|it| it.as_dvec3()).sum();
            sum += f64::from(self.solid_angle(row as u32)) * all;
        }
        sum.as_vec3()
    }

    /// The direction at a point of the unit square, by importance; brighter texels get as much more
    /// of the square.
    #[must_use]
    pub fn sample(&self, sample: Vec2) -> EnvironmentSample {
        let (row, down, row_part) = chosen(&self.rows, sample.y);
        let first = row as usize * self.width as usize;
        let of_row = &self.columns[first..first + self.width as usize];
        let (column, along, column_part) = chosen(of_row, sample.x);
        let (top, bottom) = heights(row, self.height);
        let height = top + (bottom - top) * down;
        let ring = (1.0 - height * height).max(0.0).sqrt();
        let turn = TAU * ((column as f32 + along) / self.width as f32 - 0.5);
        EnvironmentSample {
            towards: Vec3::new(ring * turn.sin(), height, -ring * turn.cos()),
            radiance: self.texel(column, row),
            pdf: row_part * column_part / self.solid_angle(row),
        }
    }

    fn texel(&self, column: u32, row: u32) -> Vec3 {
        self.pixels[row as usize * self.width as usize + column as usize]
    }

    /// Of one texel of a row, in steradians.
    fn solid_angle(&self, row: u32) -> f32 {
        let (top, bottom) = heights(row, self.height);
        TAU / self.width as f32 * (top - bottom)
    }
}

/// The cosines of the angles from +Y at which a row begins and ends.
fn heights(row: u32, height: u32) -> (f32, f32) {
    let cosine = |row: u32| (PI * row as f32 / height as f32).cos();
    (cosine(row), cosine(row + 1))
}

/// The entry of a cumulative distribution at a number in [0, 1), how far along it, and its part.
fn chosen(cumulative: &[f64], number: f32) -> (u32, f32, f32) {
    let number = f64::from(number.max(0.0).min(1.0f32.next_down()));
    let index = cumulative
        .partition_point(|&end| end <= number)
        .min(cumulative.len() - 1);
    let start = index.checked_sub(1).map_or(0.0, |it| cumulative[it]);
    let part = cumulative[index] - start;
    let along = if part > 0.0 {
        ((number - start) / part) as f32
    } else {
        0.5
    };
    (
        index as u32,
        along.clamp(0.0, 1.0f32.next_down()),
        part as f32,
    )
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
    }
}
