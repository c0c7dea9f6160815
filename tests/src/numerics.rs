//! Quadrature and roots in one dimension.

use std::f64::consts::PI;

/// Nodes of the Gauss-Legendre rule that all integrals here are made of.
const NODES: usize = 8;

/// The nodes and weights of the Gauss-Legendre rule on -1..1.
///
/// Roots of the Legendre polynomial by Newton's method from the usual cosine guess.
fn gauss_legendre() -> [(f64, f64); NODES] {
    std::array::from_fn(|index| {
        let mut x = (PI * (index as f64 + 0.75) / (NODES as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut previous, mut current) = (1.0, x);
            for degree in 2..=NODES {
                let n = degree as f64;
                (previous, current) = (
                    current,
                    ((2.0 * n - 1.0) * x * current - (n - 1.0) * previous) / n,
                );
            }
            slope = NODES as f64 * (x * current - previous) / (x * x - 1.0);
            x -= current / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// The integral of `f` from `start` to `end`, by `panels` pieces of eight nodes each.
pub fn integrate(f: impl Fn(f64) -> f64, start: f64, end: f64, panels: usize) -> f64 {
    let rule = gauss_legendre();
    let half = 0.5 * (end - start) / panels as f64;
    (0..panels)
        .map(|panel| {
            let middle = start + (2 * panel + 1) as f64 * half;
            rule.iter()
                .map(|&(x, weight)| weight * f(middle + half * x))
                .sum::<f64>()
                * half
        })
        .sum()
}

/// The integral of `f(x, y)` over a rectangle, by `panels` pieces of eight nodes along each side.
pub fn integrate_rectangle(
    f: impl Fn(f64, f64) -> f64,
    x: (f64, f64),
    y: (f64, f64),
    panels: usize,
) -> f64 {
    integrate(
        |x| integrate(|y| f(x, y), y.0, y.1, panels),
        x.0,
        x.1,
        panels,
    )
}

/// Where `f` changes its sign between `start` and `end`, in order, each to the last bit.
///
/// Two roots closer than the interval over `samples` may go unseen.
pub fn sign_changes(f: impl Fn(f64) -> f64, start: f64, end: f64, samples: usize) -> Vec<f64> {
    let at = |index: usize| start + (end - start) * index as f64 / samples as f64;
    let mut roots = Vec::new();
    let mut before = f(start) > 0.0;
    for index in 1..=samples {
        let after = f(at(index)) > 0.0;
        if after != before {
            let (mut low, mut high) = (at(index - 1), at(index));
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (f(middle) > 0.0) == before {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            roots.push(0.5 * (low + high));
        }
        before = after;
    }
    roots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_nodes_are_exact_up_to_degree_fifteen() {
        assert!((integrate(|x| x.powi(15), 0.0, 1.0, 1) - 1.0 / 16.0).abs() < 1e-15);
        // Degree 16 is not: the rule has eight nodes, and no more.
        assert!((integrate(|x| x.powi(16), 0.0, 1.0, 1) - 1.0 / 17.0).abs() > 1e-13);
    }

    #[test]
    fn integrates_over_a_rectangle() {
        let volume = integrate_rectangle(|x, y| x * x * y, (0.0, 3.0), (1.0, 2.0), 2);
        assert!((volume - 13.5).abs() < 1e-13);
    }

    #[test]
    fn finds_all_roots_in_order() {
        let roots = sign_changes(f64::sin, 1.0, 10.0, 100);
        let expected = [PI, 2.0 * PI, 3.0 * PI];
        assert_eq!(roots.len(), 3);
        assert!(
            roots
                .iter()
                .zip(expected)
                .all(|(root, exact)| (root - exact).abs() < 1e-14)
        );
    }
}
