use glam::Vec2;

/// A square grid over the unit square for any number of points, in cells of exactly equal area.
///
/// `N` cells stand in about `sqrt(N)` rows. Where `N` is not a product that suits, the first rows
/// have one cell more than the others and are as much higher, so that every cell still has the
/// area `1/N`; a square `N` gives the plain square grid.
///
/// ```
/// use caustics_sampling::{Grid, glam::vec2};
///
/// // Seven cells: a row of three, two rows of two.
/// let grid = Grid::new(7);
/// assert_eq!((grid.rows(), grid.columns(0), grid.columns(1)), (3, 3, 2));
/// let cell = grid.cell(6);
/// assert!((cell.size.x * cell.size.y - 1.0 / 7.0).abs() < 1e-7);
/// assert!((cell.center() - vec2(0.75, 6.0 / 7.0)).length() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    count: u32,
    rows: u32,
}

/// One cell of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCell {
    /// Least `u` and `v` of the cell.
    pub corner: Vec2,
    /// Its edges along `u` and `v`.
    pub size: Vec2,
    /// Row, counted along `v`.
    pub row: u32,
    /// Column in its row, counted along `u`.
    pub column: u32,
}

impl GridCell {
    /// The middle of the cell.
    #[must_use]
    pub fn center(&self) -> Vec2 {
        self.corner + 0.5 * self.size
    }
}

impl Grid {
    /// The grid of `count` cells that are as square as can be. Zero is taken as one.
    #[must_use]
    pub fn new(count: u32) -> Self {
        Self::with_aspect(count, 1.0)
    }

    /// A grid of `count` cells that are square in a domain `aspect` times as long along `u` as
    /// along `v`: there are about `aspect` times as many columns as rows.
    ///
    /// A `count` of zero is taken as one; an aspect that is not above zero leaves one row or one
    /// column.
    #[must_use]
    pub fn with_aspect(count: u32, aspect: f32) -> Self {
        let count = count.max(1);
        // In f64, which holds every u32; a NaN becomes zero and then one row.
        let rows = (f64::from(count) / f64::from(aspect)).sqrt().round();
        Self {
            count,
            rows: (rows as u32).clamp(1, count),
        }
    }

    /// Number of cells, at least one.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// Number of rows.
    #[must_use]
    pub const fn rows(&self) -> u32 {
        self.rows
    }

    /// Number of cells in a row.
    #[must_use]
    pub const fn columns(&self, row: u32) -> u32 {
        self.count / self.rows + (row < self.count % self.rows) as u32
    }

    /// Cell `index`, row by row; indices from [`count`](Self::count) on start anew.
    #[must_use]
    pub fn cell(&self, index: u32) -> GridCell {
        let index = index % self.count;
        let (columns, longer_rows) = (self.count / self.rows, self.count % self.rows);
        let in_longer_rows = longer_rows * (columns + 1);
        let (row, column, columns) = if index < in_longer_rows {
            (index / (columns + 1), index % (columns + 1), columns + 1)
        } else {
            let after = index - in_longer_rows;
            (longer_rows + after / columns, after % columns, columns)
        };
        let count = self.count as f32;
        GridCell {
            corner: Vec2::new(
                column as f32 / columns as f32,
                (index - column) as f32 / count,
            ),
            size: Vec2::new(1.0 / columns as f32, columns as f32 / count),
            row,
            column,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_counts_give_square_grids() {
        let grid = Grid::new(16);
        let cell = grid.cell(6);
        assert_eq!((cell.row, cell.column), (1, 2));
        assert_eq!(cell.corner, Vec2::new(0.5, 0.25));
        assert_eq!(cell.size, Vec2::splat(0.25));
        assert_eq!(cell.center(), Vec2::new(0.625, 0.375));
        assert_eq!(grid.cell(16 + 6), cell);
    }

    #[test]
    fn aspect_sets_the_shape() {
        let grid = Grid::with_aspect(64, 4.0);
        assert_eq!((grid.rows(), grid.columns(0)), (4, 16));
        for (aspect, rows) in [(f32::INFINITY, 1), (0.0, 64), (f32::NAN, 1), (-1.0, 1)] {
            assert_eq!(Grid::with_aspect(64, aspect).rows(), rows, "{aspect}");
        }
    }

    #[test]
    fn no_count_is_one() {
        assert_eq!(Grid::new(0), Grid::new(1));
        assert_eq!(Grid::new(0).cell(5).center(), Vec2::splat(0.5));
    }
}
