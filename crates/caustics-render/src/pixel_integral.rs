use std::ops::Range;
use std::sync::LazyLock;

use glam::Vec2;

use crate::covariance::Covariance;
use crate::pixel_samples::PixelSamples;

/// Where the normal distribution ends, in standard deviations.
const CUT: f32 = 3.0;

/// Strips that a pixel is cut into across the footprint's longer extent, at most.
const MOST_STRIPS: f32 = 32.0;

/// The widest strip, in standard deviations along the longer extent, where it matters at what place in
/// the strip its flux has its mean.
const WIDEST_STRIP: f32 = 0.75;

/// By how much, in pixels, the middle of a footprint may slant along the shorter extent from one end of
/// a strip to the other; or by one standard deviation, which is blurred by so little.
const MOST_SLANT: f32 = 0.25;

/// By how much it may be off, in standard deviations.
const MOST_SHIFT: f32 = 0.05;

/// The least standard deviation, in pixels: a point for all that a picture can tell.
const LEAST_SIGMA: f32 = 1e-3;

/// Intervals of the table of the cumulative distribution.
const TABLE: usize = 512;

/// A footprint much like a pixel in size, as the part of its flux that each pixel gets: a normal
/// distribution integrated over the pixels' squares.
///
/// Read at the pixels' middles, blurred by a pixel, a bright line of light leaks some percent of
/// itself into the pixels beside it, which past a fold of the caustic or at its edge ought to be
/// black. The integral leaks nothing. Along the shorter extent it is taken between the cumulative
/// distribution's values, along the longer one by strips of a part of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelGaussian {
    /// Whether strips are cut across x, where the footprint is wider than high.
    is_wide: bool,
    /// Middle: along the longer extent, along the shorter one.
    center: Vec2,
    /// Standard deviation along the longer extent.
    long: f32,
    /// How the middle of a strip moves along the shorter extent with its place along the longer.
    slope: f32,
    /// Standard deviation along the shorter extent, in one place of the longer.
    short: f32,
    /// Strips in a pixel, a power of two.
    strips: f32,
}

impl PixelGaussian {
    /// A footprint around `center`, both in pixels.
    pub(crate) fn new(center: Vec2, covariance: &Covariance) -> Self {
        let is_wide = covariance.xx > covariance.yy;
        let (center, long, short) = if is_wide {
            (center, covariance.xx, covariance.yy)
        } else {
            (Vec2::new(center.y, center.x), covariance.yy, covariance.xx)
        };
        let slope = if long > 0.0 {
            covariance.xy / long
        } else {
            0.0
        };
        // What is left of the shorter variance in one place, and what the strip's own extent adds.
        let within = (short - slope * covariance.xy).max(0.0);
        let long = long.sqrt().max(LEAST_SIGMA);
        let [deviation, lean] = [within.sqrt(), slope.abs()];
        let most_slant = MOST_SLANT.max(deviation);
        let is_level = lean * long <= MOST_SHIFT * deviation;
        let mut strips = 1.0;
        while strips < MOST_STRIPS
            && (lean > most_slant * strips || !is_level && strips * long * WIDEST_STRIP < 1.0)
        {
            strips *= 2.0;
        }
        let strip = strips.recip().min(2.0 * CUT * long);
        let within = within + (slope * strip).powi(2) / 12.0;
        Self {
            is_wide,
            center,
            long,
            slope,
            short: within.sqrt().max(LEAST_SIGMA),
            strips,
        }
    }

    /// Its middle, in pixels.
    pub(crate) fn middle(&self) -> Vec2 {
        if self.is_wide {
            self.center
        } else {
            Vec2::new(self.center.y, self.center.x)
        }
    }

    /// The same, moved by so many pixels.
    pub(crate) fn moved(&self, shift: Vec2) -> Self {
        let shift = if self.is_wide {
            shift
        } else {
            Vec2::new(shift.y, shift.x)
        };
        Self {
            center: self.center + shift,
            ..*self
        }
    }

    /// Half the sides of the rectangle that holds it, in pixels.
    pub(crate) fn extent(&self) -> Vec2 {
        let along = CUT * self.long;
        let across = CUT * self.short + self.slope.abs() * along;
        if self.is_wide {
            Vec2::new(along, across)
        } else {
            Vec2::new(across, along)
        }
    }

    /// Calls `light` with the column, the row and the part of the flux of each pixel of `columns` and
    /// `rows` that gets any, and once for each. All pixels together get 1. `weights` is memory to work
    /// in, of zeros or empty, and left so.
    pub(crate) fn light_pixels(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
        weights: &mut Vec<f32>,
        mut light: impl FnMut(usize, usize, f32),
    ) {
        let (along, across) = if self.is_wide {
            (columns, rows)
        } else {
            (rows, columns)
        };
        if weights.len() < across.len() {
            weights.resize(across.len(), 0.0);
        }
        let cumulative = Cumulative::table();
        let [per_long, per_short] = [self.long, self.short].map(f32::recip);
        let per_strip = self.strips.recip();
        let reach = CUT * self.short;
        // No place is negative, so that conversion to whole numbers rounds down.
        let first = (self.center.x - CUT * self.long).max(along.start as f32);
        let last = (self.center.x + CUT * self.long).min(along.end as f32);
        let mut low = first;
        let mut below = cumulative.at((low - self.center.x) * per_long);
        while low < last {
            let pixel = low as i32;
            let pixel_end = ((pixel + 1) as f32).min(last);
            // From and to where the pixel's strips have light across.
            let mut lit = across.len()..0;
            while low < pixel_end {
                // The next multiple of a strip's width, exact in binary.
                let strip = (low * self.strips) as i32;
                let high = ((strip + 1) as f32 * per_strip).min(last);
                let above = cumulative.at((high - self.center.x) * per_long);
                let mass = above - below;
                // Where the strip's flux has its mean, to first order: the density slopes down
                // outwards.
                let strip = (high - low) * per_long;
                let middle = 0.5 * (low + high) - self.center.x;
                let mean = middle * (1.0 - (strip * strip * (1.0 / 12.0)).min(1.0));
                let middle = self.center.y + self.slope * mean;
                let begin = (middle - reach).max(across.start as f32) as i32;
                let end = (middle + reach + 1.0).min(across.end as f32) as i32;
                let cells = begin as usize - across.start
                    ..(end.max(begin) as usize).min(across.end) - across.start;
                let place = |cell: i32| (cell as f32 - middle) * per_short;
                let mut left = cumulative.at(place(begin));
                let mut cell = begin;
                for weight in weights.get_mut(cells.clone()).unwrap_or_default() {
                    cell += 1;
                    let right = cumulative.at(place(cell));
                    *weight += mass * (right - left);
                    left = right;
                }
                lit = lit.start.min(cells.start)..lit.end.max(cells.end);
                low = high;
                below = above;
            }
            let pixel = pixel as usize;
            for (cell, weight) in
                (across.start + lit.start..).zip(weights.get_mut(lit).unwrap_or_default())
            {
                if *weight > 0.0 {
                    let (column, row) = if self.is_wide {
                        (pixel, cell)
                    } else {
                        (cell, pixel)
                    };
                    light(column, row, *weight);
                    *weight = 0.0;
                }
            }
        }
    }

    /// The part of the flux that one pixel gets where these of its samples are.
    pub(crate) fn part(
        &self,
        column: usize,
        row: usize,
        samples: PixelSamples,
        weights: &mut Vec<f32>,
    ) -> f32 {
        let mut found = 0.0;
        if samples == PixelSamples::ALL {
            let (columns, rows) = (column..column + 1, row..row + 1);
            self.light_pixels(&columns, &rows, weights, |_, _, weight| found = weight);
            return found;
        }
        let [first_column, first_row] = [column, row].map(|it| it * PixelSamples::SIDE);
        let columns = first_column..first_column + PixelSamples::SIDE;
        let rows = first_row..first_row + PixelSamples::SIDE;
        let finer = self.enlarged(PixelSamples::SIDE as f32);
        finer.light_pixels(&columns, &rows, weights, |column, row, weight| {
            if samples.has(column - first_column, row - first_row) {
                found += weight;
            }
        });
        found
    }

    /// In smaller pixels, so many along the side of each.
    fn enlarged(&self, times: f32) -> Self {
        Self {
            center: times * self.center,
            long: times * self.long,
            short: times * self.short,
            strips: (self.strips / times).max(1.0),
            ..*self
        }
    }
}

/// The cumulative distribution of the normal distribution cut off at [`CUT`], by linear
/// interpolation in a table: right to 2e-5.
struct Cumulative([f32; TABLE + 2]);

impl Cumulative {
    fn table() -> &'static Self {
        static VALUES: LazyLock<Cumulative> = LazyLock::new(|| {
            // Simpson's rule between the table's places.
            let step = 2.0 * f64::from(CUT) / TABLE as f64;
            let density = |x: f64| (-0.5 * x * x).exp();
            let mut sums = [0.0f64; TABLE + 2];
            for index in 0..TABLE {
                let low = -f64::from(CUT) + index as f64 * step;
                let part = density(low) + 4.0 * density(low + 0.5 * step) + density(low + step);
                sums[index + 1] = sums[index] + part;
            }
            sums[TABLE + 1] = sums[TABLE];
            Cumulative(sums.map(|sum| (sum / sums[TABLE]) as f32))
        });
        &VALUES
    }

    #[inline]
    fn at(&self, deviations: f32) -> f32 {
        let place = (deviations + CUT) * (TABLE as f32 / (2.0 * CUT));
        let place = place.clamp(0.0, TABLE as f32);
        let index = place as usize;
        self.0[index] + (place - index as f32) * (self.0[index + 1] - self.0[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    /// The integral over each pixel by a sum over a fine grid, in f64.
    fn by_sum(center: Vec2, covariance: &Covariance, size: usize) -> Vec<f64> {
        const FINE: usize = 64;
        let determinant = f64::from(covariance.xx) * f64::from(covariance.yy)
            - f64::from(covariance.xy) * f64::from(covariance.xy);
        let mut weights = vec![0.0; size * size];
        for row in 0..size * FINE {
            for column in 0..size * FINE {
                let x = (column as f64 + 0.5) / FINE as f64 - f64::from(center.x);
                let y = (row as f64 + 0.5) / FINE as f64 - f64::from(center.y);
                let squared = (f64::from(covariance.yy) * x * x
                    - 2.0 * f64::from(covariance.xy) * x * y
                    + f64::from(covariance.xx) * y * y)
                    / determinant;
                weights[row / FINE * size + column / FINE] += (-0.5 * squared).exp();
            }
        }
        let norm = 1.0 / (std::f64::consts::TAU * determinant.sqrt() * (FINE * FINE) as f64);
        weights.iter().map(|it| it * norm).collect()
    }

    fn weights(center: Vec2, covariance: &Covariance, size: usize) -> Vec<f32> {
        let mut weights = vec![0.0; size * size];
        add_weights(
            &PixelGaussian::new(center, covariance),
            size,
            0..size,
            &mut weights,
        );
        weights
    }

    fn add_weights(gaussian: &PixelGaussian, size: usize, rows: Range<usize>, weights: &mut [f32]) {
        let first = rows.start;
        let mut scratch = Vec::new();
        gaussian.light_pixels(&(0..size), &rows, &mut scratch, |column, row, weight| {
            weights[(row - first) * size + column] += weight;
        });
        assert!(scratch.iter().all(|&it| it == 0.0));
    }

    fn turned(long: f32, short: f32, angle: f32) -> Covariance {
        let along = long * Vec2::from_angle(angle);
        let across = short * Vec2::from_angle(angle).perp();
        let mut covariance = Covariance::default();
        covariance.add(1.0, along.x, along.y);
        covariance.add(1.0, across.x, across.y);
        covariance
    }

    #[test]
    fn a_point_is_in_one_pixel() {
        let found = weights(Vec2::new(2.3, 1.9), &Covariance::default(), 4);
        for (index, weight) in found.into_iter().enumerate() {
            assert_abs_diff_eq!(weight, if index == 6 { 1.0 } else { 0.0 }, epsilon = 1e-6);
        }
    }

    #[test]
    fn a_line_beside_a_pixels_edge_leaks_nothing() {
        // Upright, 0.05 from the edge, 0.01 wide.
        let found = weights(
            Vec2::new(4.05, 4.0),
            &turned(0.7, 0.01, std::f32::consts::FRAC_PI_2),
            8,
        );
        for row in 0..8 {
            assert_abs_diff_eq!(found[row * 8 + 3], 0.0, epsilon = 1e-6);
        }
        assert_abs_diff_eq!(found.iter().sum::<f32>(), 1.0, epsilon = 1e-5);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn pixels_get_the_integral(
            x in 5.0f32..7.0,
            y in 5.0f32..7.0,
            long in 0.1f32..1.3,
            ratio in 0.05f32..1.0,
            angle in 0.0f32..3.2,
        ) {
            let covariance = turned(long, ratio.max(0.06 / long).min(1.0) * long, angle);
            let center = Vec2::new(x, y);
            let expected = by_sum(center, &covariance, 12);
            for (found, expected) in weights(center, &covariance, 12).into_iter().zip(expected) {
                // The tails that are cut off, spread over the rest, and the strips.
                prop_assert!(
                    (f64::from(found) - expected).abs() < 0.008,
                    "{found} for {expected}"
                );
            }
        }

        #[test]
        fn parts_of_a_pixel_are_as_the_whole(
            x in 4.5f32..7.5,
            y in 4.5f32..7.5,
            long in 0.02f32..1.5,
            ratio in 0.05f32..1.0,
            angle in 0.0f32..3.2,
            cut in 0usize..65,
        ) {
            // A pixel whose first samples are one surface's and whose others are another's.
            let covariance = turned(long, ratio * long, angle);
            let gaussian = PixelGaussian::new(Vec2::new(x, y), &covariance);
            let mut sides = [PixelSamples::default(); 2];
            for sample in 0..PixelSamples::COUNT {
                sides[usize::from(sample >= cut)].insert(sample);
            }
            prop_assume!(sides.iter().all(|it| *it != PixelSamples::ALL));
            let mut weights = Vec::new();
            let [one, other] = sides.map(|it| gaussian.part(6, 6, it, &mut weights));
            let whole = gaussian.part(6, 6, PixelSamples::ALL, &mut weights);
            prop_assert!((one + other - whole).abs() < 0.02, "{one} + {other} for {whole}");
            // By the integral over the rows of samples that are whole.
            let rows = cut / PixelSamples::SIDE;
            let mut above = PixelSamples::default();
            for sample in 0..rows * PixelSamples::SIDE {
                above.insert(sample);
            }
            let scale = PixelSamples::SIDE as f32;
            let finer = by_sum(
                scale * (Vec2::new(x, y) - 6.0),
                &Covariance {
                    xx: scale * scale * covariance.xx,
                    xy: scale * scale * covariance.xy,
                    yy: scale * scale * covariance.yy,
                },
                PixelSamples::SIDE,
            );
            let expected: f64 = finer[..rows * PixelSamples::SIDE].iter().sum();
            let found = gaussian.part(6, 6, above, &mut weights);
            prop_assert!((f64::from(found) - expected).abs() < 0.02, "{found} for {expected}");
        }

        #[test]
        fn pieces_are_as_the_whole(
            x in 3.0f32..7.0,
            y in 3.0f32..7.0,
            long in 0.001f32..2.0,
            short in 0.001f32..1.0,
            angle in 0.0f32..3.2,
            cut in 1usize..9,
        ) {
            let gaussian = PixelGaussian::new(Vec2::new(x, y), &turned(long, short, angle));
            let whole = weights(Vec2::new(x, y), &turned(long, short, angle), 10);
            let mut pieces = vec![0.0; 100];
            let (above, below) = pieces.split_at_mut(cut * 10);
            add_weights(&gaussian, 10, 0..cut, above);
            add_weights(&gaussian, 10, cut..10, below);
            for (piece, whole) in pieces.iter().zip(&whole) {
                prop_assert!((piece - whole).abs() < 1e-6);
            }
            for (pixel, whole) in whole.iter().enumerate() {
                let one = gaussian.part(pixel % 10, pixel / 10, PixelSamples::ALL, &mut Vec::new());
                prop_assert!((one - whole).abs() < 1e-6);
            }
        }
    }
}
