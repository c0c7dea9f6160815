//! Halton, Sobol' and the generator of random numbers, against the properties that define them.

use caustics_sampling::{
    CounterRng, HALTON_DIMENSIONS, PointSet, Sequence, halton, halton_scrambled, radical_inverse,
    sobol,
};
use proptest::prelude::*;

/// Asserts that each of `columns` by `rows` equal boxes holds one of as many points.
///
/// The coordinates are `f32`, and a product of such with a number up to 2^24 is exact in `f64`: so
/// is the box.
fn assert_one_point_a_box(
    points: impl ExactSizeIterator<Item = [f32; 2]>,
    columns: u32,
    rows: u32,
    case: &str,
) {
    let mut seen = vec![false; (columns * rows) as usize];
    assert_eq!(points.len(), seen.len());
    for [x, y] in points {
        assert!(
            (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y),
            "{case}: ({x}, {y})"
        );
        let column = (f64::from(x) * f64::from(columns)) as usize;
        let row = (f64::from(y) * f64::from(rows)) as usize;
        let slot = &mut seen[row * columns as usize + column];
        assert!(!*slot, "{case}: two points in box ({column}, {row})");
        *slot = true;
    }
}

#[test]
fn halton_has_one_point_in_each_elementary_interval_of_each_block() {
    for (i, j) in [
        (0, 0),
        (1, 0),
        (0, 1),
        (1, 1),
        (3, 2),
        (2, 4),
        (7, 1),
        (0, 9),
        (12, 0),
        (6, 6),
    ] {
        let (columns, rows) = (1 << i, 3_u32.pow(j));
        let block = columns * rows;
        for number in [0, 1, 2, 3, 17, 1000, (u32::MAX - block) / block] {
            let start = number * block;
            let case = format!("2^{i} 3^{j}, block {number}");
            let points = (start..start + block).map(|n| [halton(n, 0), halton(n, 1)]);
            assert_one_point_a_box(points.collect::<Vec<_>>().into_iter(), columns, rows, &case);
            let points = (start..start + block)
                .map(|n| [halton_scrambled(n, 0, 5), halton_scrambled(n, 1, 5)]);
            assert_one_point_a_box(points.collect::<Vec<_>>().into_iter(), columns, rows, &case);
        }
    }
}

#[test]
fn halton_is_stratified_in_every_dimension() {
    let mut base = 2_u32;
    for dimension in 0..HALTON_DIMENSIONS {
        for seed in [None, Some(1), Some(u64::MAX)] {
            let points = (base * base * 7..base * base * 8).map(|index| {
                [
                    seed.map_or(halton(index, dimension), |s| {
                        halton_scrambled(index, dimension, s)
                    }),
                    0.0,
                ]
            });
            let case = format!("dimension {dimension}, seed {seed:?}");
            let points: Vec<_> = points.collect();
            assert_one_point_a_box(points.into_iter(), base * base, 1, &case);
        }
        base = (base + 1..)
            .find(|&n| (2..n).all(|d| !n.is_multiple_of(d)))
            .unwrap();
    }
}

#[test]
fn sobol_has_one_point_in_each_elementary_interval_of_each_block() {
    for seed in [0, 1, u64::MAX] {
        for (i, j) in (0..=11).flat_map(|sum| (0..=sum).map(move |i| (i, sum - i))) {
            let block = 1 << (i + j);
            for number in [0, 1, 2, 999, (1 << 16) + 5] {
                let points = (number * block..(number + 1) * block)
                    .map(|n| [sobol(n, 0, seed), sobol(n, 1, seed)]);
                let case = format!("seed {seed}, 2^{i} 2^{j}, block {number}");
                let points: Vec<_> = points.collect();
                assert_one_point_a_box(points.into_iter(), 1 << i, 1 << j, &case);
            }
        }
    }
}

#[test]
fn sobol_is_stratified_in_every_dimension_and_padded_pairs_are_independent() {
    for dimension in 0..24 {
        let points: Vec<_> = (256..512).map(|n| [sobol(n, dimension, 3), 0.0]).collect();
        assert_one_point_a_box(
            points.into_iter(),
            256,
            1,
            &format!("dimension {dimension}"),
        );
    }
    // Dimensions 0 and 4 are the same before shuffle and scramble. Occupancy of 8 x 8 boxes by
    // 4096 points, 64 expected in each: 63 degrees of freedom, of which 103.4 is the 99.9th
    // percentile. Without the shuffle all would lie in 8 boxes and the statistic be 28672.
    let mut boxes = [0_u32; 64];
    for n in 0..4096 {
        let place = |dimension| (sobol(n, dimension, 3) * 8.0) as usize;
        boxes[place(0) * 8 + place(4)] += 1;
    }
    let statistic: f64 = boxes
        .iter()
        .map(|&n| (f64::from(n) - 64.0).powi(2) / 64.0)
        .sum();
    assert!(statistic < 103.4, "{statistic}");
}

#[test]
fn generator_is_uniform_and_its_neighbours_independent() {
    // Pairs of successive numbers, of the same number in successive streams, and in successive
    // seeds: 256 boxes, 255 degrees of freedom, 99.9th percentile 330.5. A million pairs each.
    let pairs: [fn(u32) -> [u32; 2]; 3] = [
        |n| [0, 1].map(|next| CounterRng::new(1, 2).at(2 * n + next)),
        |n| [0, 1].map(|next| CounterRng::new(3, u64::from(2 * n + next)).next_u32()),
        |n| [0, 1].map(|next| CounterRng::new(u64::from(2 * n + next), 4).next_u32()),
    ];
    for (number, pair) in pairs.into_iter().enumerate() {
        let mut boxes = [0_u32; 256];
        let count = 1 << 20;
        for n in 0..count {
            let [a, b] = pair(n);
            boxes[(a >> 28 << 4 | b >> 28) as usize] += 1;
        }
        let expected = f64::from(count) / 256.0;
        let statistic: f64 = boxes
            .iter()
            .map(|&n| (f64::from(n) - expected).powi(2) / expected)
            .sum();
        assert!(statistic < 330.5, "pairing {number}: {statistic}");
    }
}

proptest! {
    #[test]
    fn radical_inverse_is_the_exact_one_rounded_up(index: u32, base in 2_u32..1000) {
        // Oracle: the digits in integers, as many as make a denominator of at most 2^24.
        let (mut numerator, mut denominator, mut rest) = (0_u64, 1_u64, u64::from(index));
        while denominator * u64::from(base) <= 1 << 24 {
            numerator = numerator * u64::from(base) + rest % u64::from(base);
            denominator *= u64::from(base);
            rest /= u64::from(base);
        }
        let value = radical_inverse(index, base);
        let exact = |x: f32| f64::from(x) * denominator as f64;
        prop_assert!(exact(value) >= numerator as f64);
        prop_assert!(value == 0.0 || exact(value.next_down()) < numerator as f64);
        prop_assert!(exact(value) < (numerator + 1) as f64);
    }

    #[test]
    fn all_samples_are_below_one(index: u32, count in 1_u32.., seed: u64, dimension: u32) {
        for sequence in Sequence::ALL {
            let points = PointSet::new(sequence, count, seed);
            for value in [
                points.point(index).x,
                points.point(index).y,
                points.sample(index, dimension),
                points.sample(index, dimension % 40),
            ] {
                prop_assert!((0.0..1.0).contains(&value), "{sequence}: {value}");
            }
        }
    }
}
