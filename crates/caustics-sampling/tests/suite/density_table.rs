//! The warp of a density table against its definition in f64.

use caustics_sampling::glam::{DVec2, Vec2, vec2};
use caustics_sampling::warp::{DensityError, DensityTable};
use proptest::prelude::*;

/// The bilinear density of some nodes, which need not integrate to one, and its integrals.
struct Exact {
    cells: usize,
    nodes: Vec<f64>,
}

impl Exact {
    fn of(cells: u32, nodes: &[f32]) -> Self {
        let mut exact = Self {
            cells: cells as usize,
            nodes: nodes.iter().copied().map(f64::from).collect(),
        };
        let total = exact.below(1.0);
        exact.nodes.iter_mut().for_each(|it| *it /= total);
        exact
    }

    /// In which cell a coordinate lies, and where in it.
    fn cell(&self, x: f64) -> (usize, f64) {
        let scaled = x * self.cells as f64;
        let cell = (scaled as usize).min(self.cells - 1);
        (cell, scaled - cell as f64)
    }

    /// The density at a node's column between rows.
    fn column(&self, column: usize, y: f64) -> f64 {
        let (row, up) = self.cell(y);
        let node = |row: usize| self.nodes[row * (self.cells + 1) + column];
        node(row) * (1.0 - up) + node(row + 1) * up
    }

    fn density(&self, at: DVec2) -> f64 {
        let (column, along) = self.cell(at.x);
        self.column(column, at.y) * (1.0 - along) + self.column(column + 1, at.y) * along
    }

    /// The integral of a row from 0 to x, by the trapezoid and its part.
    fn along(&self, at: DVec2) -> f64 {
        let (cell, part) = self.cell(at.x);
        let step = 1.0 / self.cells as f64;
        let before: f64 = (0..cell)
            .map(|it| 0.5 * step * (self.column(it, at.y) + self.column(it + 1, at.y)))
            .sum();
        let (first, second) = (self.column(cell, at.y), self.column(cell + 1, at.y));
        before + step * part * (first + 0.5 * part * (second - first))
    }

    /// The integral over all below y: a row's integral is linear between rows of nodes.
    fn below(&self, y: f64) -> f64 {
        let marginal = |row: usize| self.along(DVec2::new(1.0, row as f64 / self.cells as f64));
        let (cell, part) = self.cell(y);
        let step = 1.0 / self.cells as f64;
        let before: f64 = (0..cell)
            .map(|it| 0.5 * step * (marginal(it) + marginal(it + 1)))
            .sum();
        before + step * part * (marginal(cell) + 0.5 * part * (marginal(cell + 1) - marginal(cell)))
    }

    /// The point of the square whose image is `at`.
    fn inverse(&self, at: DVec2) -> DVec2 {
        let row = self.along(DVec2::new(1.0, at.y));
        DVec2::new(self.along(at) / row, self.below(at.y))
    }
}

fn tables() -> impl Strategy<Value = (u32, Vec<f32>)> {
    (1u32..12).prop_flat_map(|cells| {
        let nodes = ((cells + 1) * (cells + 1)) as usize;
        // Over two orders of magnitude, evenly in the logarithm.
        let density = (-2.3f32..2.3).prop_map(f32::exp);
        (Just(cells), proptest::collection::vec(density, nodes))
    })
}

fn points() -> impl Strategy<Value = Vec2> {
    (0.0f32..1.0, 0.0f32..1.0).prop_map(|(u, v)| vec2(u, v))
}

proptest! {
    #[test]
    fn the_image_is_where_the_integrals_say((cells, nodes) in tables(), point in points()) {
        let table = DensityTable::new(cells, &nodes).unwrap();
        let exact = Exact::of(cells, &nodes);
        let sample = table.sample(point);
        let at = sample.value.as_dvec2();
        prop_assert!(at.cmpge(DVec2::ZERO).all() && at.cmplt(DVec2::ONE).all());
        let back = exact.inverse(at);
        prop_assert!((back - point.as_dvec2()).length() < 1e-5, "{back} for {point}");
        let density = exact.density(at);
        prop_assert!((f64::from(sample.pdf) / density - 1.0).abs() < 1e-4);
        prop_assert!((f64::from(table.density(sample.value)) / density - 1.0).abs() < 1e-4);
    }

    #[test]
    fn derivatives_are_those_of_the_inverse((cells, nodes) in tables(), point in points()) {
        let table = DensityTable::new(cells, &nodes).unwrap();
        let exact = Exact::of(cells, &nodes);
        let sample = table.sample(point);
        let at = sample.value.as_dvec2();
        // On the border of a cell there are two second derivatives, and the difference below is
        // between them.
        let scaled = at * f64::from(cells);
        prop_assume!((scaled - scaled.round()).abs().min_element() > 1e-3);
        let step = 1e-5 / f64::from(cells);
        let change = |axis: DVec2| {
            (exact.inverse(at + step * axis) - exact.inverse(at - step * axis)) / (2.0 * step)
        };
        let (d_dx, d_dy) = (change(DVec2::X), change(DVec2::Y));
        let (d_du, d_dv) = (sample.d_du.as_dvec2(), sample.d_dv.as_dvec2());
        // The product of both is one.
        for (column, expected) in [(d_du, DVec2::X), (d_dv, DVec2::Y)] {
            let found = column.x * d_dx + column.y * d_dy;
            let scale = column.x.abs() * d_dx.length() + column.y.abs() * d_dy.length();
            prop_assert!((found - expected).length() < 1e-3 * scale, "{found} for {expected}");
        }
        let area = f64::from(sample.d_du.perp_dot(sample.d_dv) * sample.pdf);
        prop_assert!((area - 1.0).abs() < 1e-5, "{area}");
    }

    #[test]
    fn equal_densities_move_nothing(cells in 1u32..50, density in 1e-3f32..1e3, point in points()) {
        let nodes = vec![density; ((cells + 1) * (cells + 1)) as usize];
        let sample = DensityTable::new(cells, &nodes).unwrap().sample(point);
        prop_assert!((sample.value - point).length() < 1e-5);
        prop_assert!((sample.pdf - 1.0).abs() < 1e-5);
        prop_assert!((sample.d_du - Vec2::X).length() < 1e-4);
        prop_assert!((sample.d_dv - Vec2::Y).length() < 1e-4);
    }
}

#[test]
fn the_ends_of_the_square_stay_in_it() {
    let last = 1.0 - f32::EPSILON / 2.0;
    for nodes in [
        [1e-6f32, 1.0, 1.0, 1e6],
        [1e6, 1.0, 1e-6, 1.0],
        [1e-30, 1e30, 1e-30, 1e30],
        [1.0; 4],
    ] {
        let table = DensityTable::new(1, &nodes).unwrap();
        for point in [
            vec2(0.0, 0.0),
            vec2(last, 0.0),
            vec2(0.0, last),
            vec2(last, last),
        ] {
            let sample = table.sample(point);
            assert!(sample.value.cmpge(Vec2::ZERO).all() && sample.value.cmplt(Vec2::ONE).all());
            assert!(sample.pdf > 0.0 && sample.pdf.is_finite());
            assert!(
                sample.d_du.is_finite() && sample.d_dv.is_finite(),
                "{sample:?}"
            );
        }
    }
}

#[test]
fn what_is_no_density_is_refused() {
    assert_eq!(DensityTable::new(0, &[1.0]), Err(DensityError::NoCells));
    let count = DensityError::NodeCount {
        found: 3,
        expected: 4,
    };
    assert_eq!(DensityTable::new(1, &[1.0; 3]), Err(count));
    assert!(DensityTable::new(u32::MAX, &[1.0; 4]).is_err());
    for density in [0.0, -1.0, f32::INFINITY] {
        let invalid = DensityError::InvalidDensity { index: 2, density };
        assert_eq!(
            DensityTable::new(1, &[1.0, 1.0, density, 1.0]),
            Err(invalid)
        );
    }
    let error = DensityTable::new(1, &[1.0, f32::NAN, 1.0, 1.0]).unwrap_err();
    assert!(matches!(
        error,
        DensityError::InvalidDensity { index: 1, .. }
    ));
}
