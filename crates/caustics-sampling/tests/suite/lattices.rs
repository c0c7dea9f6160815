//! Grid, Fibonacci lattice and Kronecker sequence: equal cells, and distances against brute force.

use caustics_sampling::{Grid, PointSet, Rank1Lattice, Rotation, Sequence, glam::Vec2};
use proptest::prelude::*;

/// The least distance on the torus between any two points, in `f64`, times `sqrt(count)`: 1 for
/// a square grid, 1.0746 for the hexagonal lattice, the best there is.
fn normalised_minimum_distance(points: &[Vec2]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let difference = (a.as_dvec2() - b.as_dvec2()).abs();
            let wrapped = difference.min(1.0 - difference);
            least = least.min(wrapped.length_squared());
        }
    }
    (least * points.len() as f64).sqrt()
}

fn all_points(sequence: Sequence, count: u32, seed: u64) -> Vec<Vec2> {
    let set = PointSet::new(sequence, count, seed);
    (0..count).map(|index| set.point(index)).collect()
}

#[test]
fn grids_tile_the_square_with_one_point_a_cell() {
    for count in 1..400_u32 {
        let grid = Grid::new(count);
        let rows: u32 = (0..grid.rows()).map(|row| grid.columns(row)).sum();
        assert_eq!(rows, count);
        let mut cells = Vec::new();
        for index in 0..count {
            let cell = grid.cell(index);
            let area = f64::from(cell.size.x) * f64::from(cell.size.y) * f64::from(count);
            assert!(
                (area - 1.0).abs() < 1e-6,
                "cell {index} of {count} has {area} of its area"
            );
            let aspect = cell.size.x / cell.size.y;
            assert!(
                count < 4 || (0.4..2.5).contains(&aspect),
                "{index} of {count}: {aspect}"
            );
            cells.push(cell);
        }
        // In row order each cell starts where the one before ends: equal areas that sum to one
        // and do not overlap leave no gap.
        for pair in cells.windows(2) {
            let [before, after] = pair else {
                unreachable!()
            };
            if before.row == after.row {
                assert!((before.corner.x + before.size.x - after.corner.x).abs() < 1e-6);
                assert_eq!(before.corner.y, after.corner.y);
            } else {
                assert!((before.corner.x + before.size.x - 1.0).abs() < 1e-6);
                assert!((before.corner.y + before.size.y - after.corner.y).abs() < 1e-6);
                assert_eq!(after.corner.x, 0.0);
            }
        }
        for seed in [0, 1, 2] {
            for (cell, point) in cells.iter().zip(all_points(Sequence::Grid, count, seed)) {
                let inside = (point - cell.corner) / cell.size;
                assert!(inside.cmpge(Vec2::splat(-1e-4)).all(), "{count}: {inside}");
                assert!(
                    inside.cmple(Vec2::splat(1.0 + 1e-4)).all(),
                    "{count}: {inside}"
                );
            }
        }
    }
}

#[test]
fn square_grid_has_unit_distance() {
    let distance = normalised_minimum_distance(&all_points(Sequence::Grid, 400, 0));
    assert!((distance - 1.0).abs() < 1e-5, "{distance}");
}

#[test]
fn fibonacci_counts_are_as_good_as_the_fibonacci_generator() {
    let (mut before, mut number) = (5_u32, 8_u32);
    while number < 1000 {
        let plain: Vec<_> = (0..number)
            .map(|i| Vec2::new(i as f32, (i * before % number) as f32) / number as f32)
            .collect();
        let found = normalised_minimum_distance(&all_points(Sequence::Fibonacci, number, 0));
        let plain = normalised_minimum_distance(&plain);
        assert!(found > plain - 1e-4, "{number}: {found} {plain}");
        (before, number) = (number, before + number);
    }
}

#[test]
fn fibonacci_lattices_keep_their_distance_at_every_count() {
    for count in 2..600 {
        let lattice = Rank1Lattice::fibonacci(count);
        let points: Vec<_> = (0..count).map(|index| lattice.point(index)).collect();
        let distance = normalised_minimum_distance(&points);
        let least = if count < 57 { 0.577 } else { 0.86 };
        assert!(distance > least, "{count}: {distance}");
        // The basis says the same as brute force.
        let shortest = f64::from(lattice.basis()[0].length()) * f64::from(count).sqrt();
        // With two points the wrapped difference may be half the basis vector.
        assert!(
            count < 4 || (shortest - distance).abs() < 1e-4,
            "{count}: {shortest} {distance}"
        );
    }
}

#[test]
fn fibonacci_bases_keep_their_length_at_every_count() {
    for count in 57..20_000 {
        let shortest = Rank1Lattice::fibonacci(count).basis()[0].length();
        let normalised = f64::from(shortest) * f64::from(count).sqrt();
        assert!(normalised > 0.86, "{count}: {normalised}");
    }
}

#[test]
fn kronecker_keeps_its_distance_at_every_count() {
    // Differences of points are points, so that the least distance among n is the least of n - 1
    // vectors. 0.54 is what an exact computation in f64 gives up to 4 million.
    let origin = caustics_sampling::kronecker(0).as_dvec2();
    let mut least = f64::INFINITY;
    for index in 1..1 << 20 {
        let vector = (caustics_sampling::kronecker(index).as_dvec2() - origin).abs();
        least = least.min(vector.min(1.0 - vector).length_squared());
        let distance = (least * f64::from(index + 1)).sqrt();
        assert!(distance > 0.54, "{} points: {distance}", index + 1);
    }
    // Which is indeed the distance between any two.
    let points = all_points(Sequence::Kronecker, 1000, 0);
    assert!(normalised_minimum_distance(&points) > 0.54);
    // Control: Halton's points come far nearer.
    assert!(normalised_minimum_distance(&all_points(Sequence::Halton, 1000, 0)) < 0.3);
}

/// How many of these numbers of the unit interval are in the emptiest and in the fullest of its eighths.
fn eighths(numbers: impl Iterator<Item = f32>) -> [u32; 2] {
    let mut counts = [0; 8];
    for number in numbers {
        counts[(number * 8.0) as usize] += 1;
    }
    [0, 7].map(|place| {
        counts.sort_unstable();
        counts[place]
    })
}

#[test]
fn rows_and_columns_of_the_grid_are_well_spread_in_all_four_dimensions() {
    const SIDE: u32 = 64;
    for seed in [0, 5] {
        let set = PointSet::new(Sequence::Grid, SIDE * SIDE, seed);
        for line in 0..SIDE {
            let row = (0..SIDE).map(|at| line * SIDE + at);
            let column = (0..SIDE).map(|at| at * SIDE + line);
            let inside =
                |index: u32, dimension: u32| (set.sample(index, dimension) * SIDE as f32).fract();
            let found = [
                eighths(row.clone().map(|it| set.sample(it, 2))),
                eighths(row.clone().map(|it| set.sample(it, 3))),
                eighths(column.clone().map(|it| set.sample(it, 2))),
                eighths(column.clone().map(|it| set.sample(it, 3))),
                // How far the points of a row or column are from an edge of the square.
                eighths(row.map(|it| inside(it, 1))),
                eighths(column.map(|it| inside(it, 0))),
            ];
            for [least, most] in found {
                assert!(least >= 5 && most <= 12, "{seed} {line}: {found:?}");
            }
        }
    }
}

#[test]
fn points_of_a_light_with_an_area_stay_in_their_cells() {
    for (count, seed) in [(1, 0), (7, 0), (1000, 9), (4096, 1 << 40)] {
        let (grid, set) = (Grid::new(count), PointSet::new(Sequence::Grid, count, seed));
        for index in 0..count {
            let cell = grid.cell(index);
            let point = Vec2::new(set.sample(index, 0), set.sample(index, 1));
            let inside = (point - cell.corner) / cell.size;
            assert!(
                inside.cmpge(Vec2::splat(-1e-3)).all() && inside.cmple(Vec2::splat(1.001)).all(),
                "{count} {seed} {index}: {inside}"
            );
        }
    }
}

proptest! {
    #[test]
    fn a_basis_is_reduced_and_spans_one_point(count in 1_u32..) {
        let lattice = Rank1Lattice::fibonacci(count);
        let [a, b] = lattice.basis().map(Vec2::as_dvec2);
        let area = a.perp_dot(b).abs() * f64::from(count);
        prop_assert!((area - 1.0).abs() < 1e-5, "{area}");
        prop_assert!(a.length_squared() <= b.length_squared() * (1.0 + 1e-6));
        prop_assert!(a.dot(b).abs() <= 0.5 * a.length_squared() * (1.0 + 1e-5));
        prop_assert!(count < 57 || a.length() * f64::from(count).sqrt() > 0.86);
    }

    #[test]
    fn spacing_spans_the_area_of_a_point(count in 1_u32.., index: u32) {
        for sequence in Sequence::ALL {
            let [a, b] = PointSet::new(sequence, count, 0).spacing(index).map(Vec2::as_dvec2);
            let area = a.perp_dot(b).abs() * f64::from(count);
            prop_assert!((area - 1.0).abs() < 1e-5, "{sequence}: {area}");
        }
    }

    #[test]
    fn rotation_keeps_distances_on_the_torus(
        seed: u64, ax in 0.0_f32..1.0, ay in 0.0_f32..1.0, bx in 0.0_f32..1.0, by in 0.0_f32..1.0,
    ) {
        let distance = |a: Vec2, b: Vec2| {
            let difference = (a.as_dvec2() - b.as_dvec2()).abs();
            difference.min(1.0 - difference).length()
        };
        let (a, b) = (Vec2::new(ax, ay), Vec2::new(bx, by));
        let rotation = Rotation::new(seed);
        let (ra, rb) = (rotation.apply(a), rotation.apply(b));
        for value in [ra.x, ra.y, rb.x, rb.y] {
            prop_assert!((0.0..1.0).contains(&value));
        }
        prop_assert!((distance(a, b) - distance(ra, rb)).abs() < 4e-7);
    }

    #[test]
    fn seeds_keep_the_fibonacci_distance(seed: u64) {
        let plain = normalised_minimum_distance(&all_points(Sequence::Fibonacci, 233, 0));
        let rotated = normalised_minimum_distance(&all_points(Sequence::Fibonacci, 233, seed));
        prop_assert!((plain - rotated).abs() < 1e-4);
    }
}
