//! Apportionment and discrete distributions against their definitions.

use caustics_sampling::{DiscreteDistribution, apportion, apportion_with_floor};
use proptest::prelude::*;

fn weights() -> impl Strategy<Value = Vec<f64>> {
    // Log-uniform over 24 orders of magnitude, with zeros and equal weights among them.
    let weight = prop_oneof![
        4 => (-12.0..12.0_f64).prop_map(|exponent| 10.0_f64.powf(exponent)),
        1 => Just(0.0),
        2 => Just(1.0),
    ];
    prop::collection::vec(weight, 1..40).prop_filter("something to share by", |weights| {
        weights.iter().any(|&w| w > 0.0)
    })
}

proptest! {
    #[test]
    fn shares_sum_exactly_and_differ_by_less_than_one(
        weights in weights(), total in 0_usize..10_000_000,
    ) {
        let shares = apportion(&weights, total).unwrap();
        prop_assert_eq!(shares.iter().sum::<usize>(), total);
        let sum: f64 = weights.iter().sum();
        for (&weight, &share) in weights.iter().zip(&shares) {
            let exact = weight / sum * total as f64;
            prop_assert!((share as f64 - exact).abs() < 1.0 + 1e-6, "{share} for {exact}");
            prop_assert!(weight > 0.0 || share == 0);
        }
    }

    #[test]
    fn heavier_entries_never_get_less(
        weights in weights(), total in 0_usize..10_000, floor in 0_usize..20,
    ) {
        let entries = weights.iter().filter(|&&w| w > 0.0).count();
        let total = total + floor * entries;
        let shares = apportion_with_floor(&weights, total, floor).unwrap();
        prop_assert_eq!(shares.iter().sum::<usize>(), total);
        for (i, &share) in shares.iter().enumerate() {
            prop_assert!(weights[i] == 0.0 || share >= floor);
            for (j, &other) in shares.iter().enumerate() {
                prop_assert!(weights[i] <= weights[j] || share >= other);
            }
        }
    }

    #[test]
    fn shares_with_a_floor_differ_from_the_exact_ones_by_less_than_one(
        weights in weights(), total in 1000_usize..10_000, floor in 0_usize..20,
    ) {
        // Oracle: the rate at which max(floor, rate weight) sums to the total, by bisection.
        let entries = weights.iter().filter(|&&w| w > 0.0).count();
        let total = total + floor * entries;
        let shares = apportion_with_floor(&weights, total, floor).unwrap();
        let exact = |rate: f64, weight: f64| {
            if weight > 0.0 { (rate * weight).max(floor as f64) } else { 0.0 }
        };
        let (mut low, mut high) = (0.0_f64, 1e30_f64);
        for _ in 0..300 {
            let middle = 0.5 * (low + high);
            let sum: f64 = weights.iter().map(|&w| exact(middle, w)).sum();
            if sum < total as f64 { low = middle } else { high = middle }
        }
        for (&weight, &share) in weights.iter().zip(&shares) {
            let exact = exact(low, weight);
            prop_assert!((share as f64 - exact).abs() < 1.0 + 1e-6, "{share} for {exact}");
        }
    }

    #[test]
    fn a_draw_falls_on_the_entry_that_covers_it(
        weights in weights(), u in 0.0_f32..1.0,
    ) {
        let weights: Vec<f32> = weights.iter().map(|&w| w as f32).collect();
        let distribution = DiscreteDistribution::new(&weights).unwrap();
        let sample = distribution.sample(u);
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let before: f64 = weights[..sample.index].iter().map(|&w| f64::from(w)).sum();
        let here = f64::from(weights[sample.index]);
        prop_assert!(here > 0.0);
        // Back from the remapped number, as far as its digits and those of the sum go.
        let back = (before + f64::from(sample.remapped) * here) / sum;
        prop_assert!((back - f64::from(u)).abs() < 1.2e-7, "{back} for {u}");
        prop_assert!((f64::from(sample.probability) - here / sum).abs() < 1e-7);
        prop_assert_eq!(sample.probability, distribution.probability(sample.index));
        prop_assert!((0.0..1.0).contains(&sample.remapped));
    }

    #[test]
    fn probabilities_sum_to_one(weights in weights()) {
        let weights: Vec<f32> = weights.iter().map(|&w| w as f32).collect();
        let distribution = DiscreteDistribution::new(&weights).unwrap();
        let sum: f64 =
            (0..distribution.len()).map(|i| f64::from(distribution.probability(i))).sum();
        prop_assert!((sum - 1.0).abs() < 1e-5);
    }
}

#[test]
fn remapped_numbers_are_uniform_again() {
    // 2^16 evenly spaced numbers; the entry of 3/8 gets 24576 of them, whose remapped values stand
    // evenly in its 16 boxes: equal counts but for the ends.
    let distribution = DiscreteDistribution::new(&[1.0, 3.0, 4.0]).unwrap();
    let mut boxes = [0_u32; 16];
    for n in 0..1 << 16 {
        let sample = distribution.sample((n as f32 + 0.5) / 65536.0);
        if sample.index == 1 {
            boxes[(sample.remapped * 16.0) as usize] += 1;
        }
    }
    assert!(boxes.iter().all(|&n| n.abs_diff(1536) <= 1), "{boxes:?}");
}
