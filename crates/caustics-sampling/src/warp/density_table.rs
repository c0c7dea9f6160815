use glam::Vec2;
use thiserror::Error;

use super::WarpSample;
use crate::unit_interval::nearest;

/// Why numbers make no [`DensityTable`].
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum DensityError {
    /// A table has cells.
    #[error("a table of densities needs at least one cell along each side")]
    NoCells,
    /// There are more or fewer densities than nodes.
    #[error("{found} densities for {expected} nodes")]
    NodeCount {
        /// Densities that were given.
        found: usize,
        /// Nodes of the table.
        expected: usize,
    },
    /// A density is zero, negative, infinite or not a number.
    #[error("density {index} is {density}, which is not a finite number above 0")]
    InvalidDensity {
        /// Which density.
        index: usize,
        /// Its value.
        density: f32,
    },
}

/// Lower densities, relative to the mean, count as this one: their reciprocals would overflow.
const LEAST_DENSITY: f32 = 1e-12;

/// A density over the unit square, and the warp that gives evenly spaced points that density.
///
/// Densities are given at the nodes of a square grid and bilinear between them. Rows stay rows: the
/// second coordinate is chosen by the marginal density `m(y)`, the integral of the density `p(x, y)` over
/// the row, and the first in its row by `p(x, y) / m(y)`, each by inverting a distribution that is
/// quadratic between nodes. With both distributions
///
/// `v = ∫₀ʸ m(t) dt` and `u = 1 / m(y) ∫₀ˣ p(s, y) ds`
///
/// the derivatives follow by implicit differentiation:
///
/// `dy/dv = 1 / m`, `dx/du = m / p` and `dx/dv = -(∂u/∂y) m / p dy/dv`.
///
/// As the density has no steps, the sizes of cells have none: a lattice's change little by little, so that
/// footprints made from them go on side by side. The shear `dx/dv` has one at each row of nodes, where the
/// density's slope has, which is a seam.
///
/// ```
/// use caustics_sampling::{glam::vec2, warp::DensityTable};
///
/// // Three times as dense on the right as on the left.
/// let table = DensityTable::new(1, &[1.0, 3.0, 1.0, 3.0])?;
/// let sample = table.sample(vec2(0.5, 0.25));
/// assert!((sample.value - vec2(0.618_034, 0.25)).length() < 1e-6);
/// assert!((sample.pdf - 1.118_034).abs() < 1e-6);
/// assert!((sample.d_du.x * sample.d_dv.y * sample.pdf - 1.0).abs() < 1e-6);
/// # Ok::<(), caustics_sampling::warp::DensityError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DensityTable {
    /// Cells along each side.
    resolution: u32,
    /// For each node, row by row.
    densities: Vec<f32>,
    /// For each node, the integral of its row's density up to it.
    integrals: Vec<f32>,
    /// For each row of nodes, the integral of the density below it.
    cumulative: Vec<f32>,
}

impl DensityTable {
    /// A table of `resolution` x `resolution` cells, from a density for each of its nodes, row by row; they
    /// need not integrate to one. One of less than 10⁻¹² of the mean counts as that.
    ///
    /// # Errors
    /// If there is no cell, or not one density for each node, or a density is not finite and above zero.
    pub fn new(resolution: u32, densities: &[f32]) -> Result<Self, DensityError> {
        if resolution == 0 {
            return Err(DensityError::NoCells);
        }
        let cells = resolution as usize;
        let expected = (cells + 1).saturating_mul(cells + 1);
        let found = densities.len();
        if found != expected {
            return Err(DensityError::NodeCount { found, expected });
        }
        let is_valid = |density: f32| density > 0.0 && density.is_finite();
        if let Some(index) = densities.iter().position(|&it| !is_valid(it)) {
            let density = densities[index];
            return Err(DensityError::InvalidDensity { index, density });
        }
        let half_step = 0.5 / f64::from(resolution);
        // The integral up to each of some values with even steps between them.
        let integrate = |values: &[f64]| {
            let mut integrals = vec![0.0];
            let mut sum = 0.0;
            for pair in values.windows(2) {
                sum += half_step * (pair[0] + pair[1]);
                integrals.push(sum);
            }
            (integrals, sum)
        };
        let densities: Vec<f64> = densities.iter().copied().map(f64::from).collect();
        let (integrals, marginals): (Vec<_>, Vec<_>) =
            densities.chunks(cells + 1).map(integrate).unzip();
        let (cumulative, total) = integrate(&marginals);
        let normalised =
            |values: Vec<f64>| values.into_iter().map(|it| (it / total) as f32).collect();
        let least = f64::from(LEAST_DENSITY) * total;
        Ok(Self {
            resolution,
            densities: normalised(densities.into_iter().map(|it| it.max(least)).collect()),
            integrals: normalised(integrals.concat()),
            cumulative: normalised(cumulative),
        })
    }

    /// Cells along each side.
    #[must_use]
    pub fn resolution(&self) -> u32 {
        self.resolution
    }

    /// The density at each node, row by row: what a shader needs to know, with the two that follow.
    #[must_use]
    pub fn densities(&self) -> &[f32] {
        &self.densities
    }

    /// For each node, row by row, the integral of its row's density up to it.
    #[must_use]
    pub fn row_integrals(&self) -> &[f32] {
        &self.integrals
    }

    /// For each row of nodes, the integral of the density over all below it.
    #[must_use]
    pub fn cumulative(&self) -> &[f32] {
        &self.cumulative
    }

    /// The density at a point of the square; it integrates to one.
    #[must_use]
    pub fn density(&self, point: Vec2) -> f32 {
        let scaled = point * self.resolution as f32;
        let last = (self.resolution - 1) as f32;
        let cell = scaled.floor().clamp(Vec2::ZERO, Vec2::splat(last));
        let along = (scaled - cell).clamp(Vec2::ZERO, Vec2::ONE);
        let row = self.row(cell.y as usize, along.y);
        let column = cell.x as usize;
        between(row.density(column), row.density(column + 1), along.x)
    }

    /// The image of a point of the square.
    #[must_use]
    pub fn sample(&self, point: Vec2) -> WarpSample<Vec2> {
        let cells = self.resolution as f32;
        let step = 1.0 / cells;
        let last = self.resolution as usize;
        let width = last + 1;

        let below = last_below(last, |row| self.cumulative[row] <= point.y);
        let marginals = [0, 1].map(|next| self.integrals[(below + next) * width + last]);
        let within = (point.y - self.cumulative[below]) * cells;
        let up = inverse(marginals[0], marginals[1], within);
        let row = self.row(below, up);
        let marginal = row.integral(last);
        let sought = point.x * marginal;

        let left = last_below(last, |column| row.integral(column) <= sought);
        let densities = [row.density(left), row.density(left + 1)];
        let along = inverse(
            densities[0],
            densities[1],
            (sought - row.integral(left)) * cells,
        );
        let density = between(densities[0], densities[1], along);

        // How the integral up to the image changes from row to row.
        let steepening = [row.density_change(left), row.density_change(left + 1)];
        let on_the_way = along * (steepening[0] + 0.5 * (along * (steepening[1] - steepening[0])));
        let change = row.integral_change(left) + on_the_way * step;
        let turning = (change - point.x * (marginals[1] - marginals[0])) * cells;

        let d_dv = 1.0 / marginal;
        let d_du = marginal * (1.0 / density);
        WarpSample {
            value: Vec2::new(
                nearest((left as f32 + along) * step),
                nearest((below as f32 + up) * step),
            ),
            pdf: density,
            d_du: Vec2::new(d_du, 0.0),
            d_dv: Vec2::new(-(turning * (1.0 / density) * d_dv), d_dv),
        }
    }

    fn row(&self, below: usize, up: f32) -> Row<'_> {
        let width = self.resolution as usize + 1;
        let first = below * width;
        Row {
            densities: &self.densities[first..first + 2 * width],
            integrals: &self.integrals[first..first + 2 * width],
            width,
            up,
        }
    }
}

/// What lies between two rows of nodes.
struct Row<'a> {
    /// Of both rows.
    densities: &'a [f32],
    /// Of both rows.
    integrals: &'a [f32],
    /// Nodes of one row.
    width: usize,
    /// How far up, of the way from one row to the other.
    up: f32,
}

impl Row<'_> {
    fn density(&self, column: usize) -> f32 {
        let above = self.densities[self.width + column];
        between(self.densities[column], above, self.up)
    }

    fn integral(&self, column: usize) -> f32 {
        let above = self.integrals[self.width + column];
        between(self.integrals[column], above, self.up)
    }

    /// By how much the density changes from one row to the other.
    fn density_change(&self, column: usize) -> f32 {
        self.densities[self.width + column] - self.densities[column]
    }

    fn integral_change(&self, column: usize) -> f32 {
        self.integrals[self.width + column] - self.integrals[column]
    }
}

fn between(first: f32, second: f32, along: f32) -> f32 {
    first + along * (second - first)
}

/// The last of `0..count` for which `is_below` holds, which holds up to some number; 0 if for none.
fn last_below(count: usize, is_below: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if is_below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Where in a cell of width 1 the integral of a density that runs from `first` to `second` is `area`.
fn inverse(first: f32, second: f32, area: f32) -> f32 {
    // The root that stays exact where both are equal.
    let squared = first * first + 2.0 * ((second - first) * area);
    let root = squared.max(0.0).sqrt();
    (2.0 * area * (1.0 / (first + root))).clamp(0.0, 1.0)
}
