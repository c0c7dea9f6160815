//! What of a picture's relative error is noise of the reference, and what is its own.
//!
//! A reference R = S + n is the truth S and noise n. A counted picture has noise m that does not
//! depend on n, or on the picture T under test. So the mean of (T - R)(T - (S + m)) is that of
//! (T - S)², while the mean of (T - R)² has the mean of n² on top. The weight 1 / (R² + ε) knows n,
//! which matters to second order alone.

use caustics::filter::{Image, relative_mse};

use crate::counted::{Counted, PARTS};
use crate::stage::Failure;

/// The part of the reference's mean that steadies relMSE where the reference is dark.
pub const FLOOR: f64 = 0.1;

/// Ways to halve the four parts of a counted picture: signs of the parts.
const HALVES: [[f64; PARTS]; 3] = [
    [1.0, 1.0, -1.0, -1.0],
    [1.0, -1.0, 1.0, -1.0],
    [1.0, -1.0, -1.0, 1.0],
];

/// Ways to part them into two pairs.
const PAIRS: [[usize; PARTS]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// A number and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// The number, without bias.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// A channel of a pixel.
struct Value {
    /// 1 / (r² + (floor mean r)²).
    weight: f64,
    test: f64,
    reference: f64,
    parts: [f64; PARTS],
}

impl Value {
    fn counted(&self) -> f64 {
        self.parts.iter().sum::<f64>() / PARTS as f64
    }

    /// As far from zero as the counted value is from the truth: half of what two of its halves
    /// differ by.
    fn contrast(&self, signs: &[f64; PARTS]) -> f64 {
        let difference: f64 = self
            .parts
            .iter()
            .zip(signs)
            .map(|(part, sign)| part * sign)
            .sum();
        difference / PARTS as f64
    }
}

/// The relMSE of `test` to what `reference` would be without its noise, with the sign that chance
/// gives it.
///
/// The standard error is that of the noises, from pixel to pixel. With b = T - S, the mean of
/// (b - n)(b - m) is off by that of -bm + nm - bn. The variance of the first two is that of
/// (T - R) m, which parts of the counted picture tell by how they differ; that of the last is the
/// product of two independent factors bn, of one pair of parts each.
///
/// # Errors
/// If the pictures differ in size, or the reference is black or not finite.
pub fn error_without_noise(
    test: &Image,
    reference: &Image,
    counted: &Counted,
    floor: f64,
) -> Result<Estimated, Failure> {
    let (mut sum, mut by_counted, mut by_reference) = (0.0, 0.0, 0.0);
    for_each_pixel(test, reference, counted, floor, |values| {
        let mean = |of: &dyn Fn(&Value) -> f64| values.iter().map(of).sum::<f64>() / 3.0;
        sum += mean(&|v| v.weight * (v.test - v.reference) * (v.test - v.counted()));
        for signs in &HALVES {
            let off = mean(&|v| v.weight * (v.test - v.reference) * v.contrast(signs));
            by_counted += off * off / HALVES.len() as f64;
        }
        let products = [0, 1, 2, 3].map(|test| {
            [0, 1, 2, 3].map(|reference| {
                mean(&|v| v.weight * (v.test - v.parts[test]) * (v.reference - v.parts[reference]))
            })
        });
        for [i, j, k, l] in PAIRS {
            let straight = products[i][k] * products[j][l] + products[k][i] * products[l][j];
            let crossed = products[i][l] * products[j][k] + products[l][i] * products[k][j];
            by_reference += (straight + crossed) / (4 * PAIRS.len()) as f64;
        }
    })?;
    // That is no square, and what is less than none of a variance is noise.
    Ok(estimated(
        sum,
        by_counted + by_reference.max(0.0),
        reference,
    ))
}

/// The relMSE of the truth to `reference`: the reference's own noise.
///
/// It is the mean of (R - C)(R - D) over the pairs C, D of the counted picture's parts. The standard
/// error is a little too large: it takes the square of the counted noise for products of its parts.
///
/// # Errors
/// As [`error_without_noise`].
pub fn reference_noise(
    reference: &Image,
    counted: &Counted,
    floor: f64,
) -> Result<Estimated, Failure> {
    let pairs = (PARTS * (PARTS - 1)) as f64;
    let (mut sum, mut variance) = (0.0, 0.0);
    for_each_pixel(reference, reference, counted, floor, |values| {
        let mean = |of: &dyn Fn(&Value) -> f64| values.iter().map(of).sum::<f64>() / 3.0;
        sum += mean(&|v| {
            let off = v.parts.map(|part| v.reference - part);
            let of_all = off.iter().sum::<f64>().powi(2);
            let of_same: f64 = off.iter().map(|off| off * off).sum();
            v.weight * (of_all - of_same) / pairs
        });
        for signs in &HALVES {
            let off = mean(&|v| v.weight * (v.reference - v.counted()) * v.contrast(signs)).powi(2);
            variance += 4.0 * off / HALVES.len() as f64;
        }
    })?;
    Ok(estimated(sum, variance, reference))
}

fn estimated(sum: f64, variance: f64, reference: &Image) -> Estimated {
    let pixels = reference.pixels().len() as f64;
    Estimated {
        value: sum / pixels,
        standard_error: variance.sqrt() / pixels,
    }
}

fn for_each_pixel(
    test: &Image,
    reference: &Image,
    counted: &Counted,
    floor: f64,
    mut visit: impl FnMut(&[Value; 3]),
) -> Result<(), Failure> {
    // All that may be wrong with the sizes and the reference is found there.
    relative_mse(test, reference)?;
    for part in &counted.parts {
        relative_mse(part, reference)?;
    }
    let steady = (floor * reference.mean()).powi(2);
    let finite_or_zero = |value: f32| {
        if value.is_finite() {
            f64::from(value)
        } else {
            0.0
        }
    };
    let pairs = test.pixels().iter().zip(reference.pixels());
    for (index, (test, reference)) in pairs.enumerate() {
        let value = |channel: usize| {
            let r = f64::from(reference[channel]);
            Value {
                weight: 1.0 / (r * r + steady),
                test: finite_or_zero(test[channel]),
                reference: r,
                parts: [0, 1, 2, 3]
                    .map(|part| finite_or_zero(counted.parts[part].pixels()[index][channel])),
            }
        };
        visit(&[value(0), value(1), value(2)]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const SIZE: u32 = 64;

    /// A truth, pictures of it with independent noises, and one that is off by a known amount.
    struct Case {
        truth: Image,
        test: Image,
        reference: Image,
        counted: Counted,
    }

    /// Uniform noise of standard deviation `deviation` times the truth, alike in all channels, as
    /// that of white light is.
    fn noisy(truth: &Image, deviation: f32, random: &mut Random) -> Image {
        let mut image = truth.clone();
        for pixel in image.pixels_mut() {
            let noise = deviation * 12.0_f32.sqrt() * (random.uniform() - 0.5);
            *pixel = pixel.map(|value| value * (1.0 + noise));
        }
        image
    }

    fn case(seed: u64) -> Case {
        let mut random = Random::new(seed);
        let mut truth = Image::new(SIZE, SIZE).unwrap();
        for pixel in truth.pixels_mut() {
            *pixel = [1.0, 0.8, 0.5].map(|tint| tint * (0.2 + 2.0 * random.uniform()));
        }
        Case {
            test: noisy(&truth, 0.02, &mut random),
            reference: noisy(&truth, 0.03, &mut random),
            counted: Counted {
                parts: [(); PARTS].map(|()| noisy(&truth, 0.05, &mut random)),
                photons: 0,
                seconds: 0.0,
            },
            truth,
        }
    }

    /// The relMSE of one image to another, with a third's weights.
    fn weighted(test: &Image, other: &Image, weight: &Image) -> f64 {
        let steady = (FLOOR * weight.mean()).powi(2);
        let values = |image: &Image| -> Vec<f64> {
            let flat = image.pixels().as_flattened();
            flat.iter().map(|&value| f64::from(value)).collect()
        };
        let (test, other, weight) = (values(test), values(other), values(weight));
        let sum: f64 = (0..test.len())
            .map(|i| (test[i] - other[i]).powi(2) / (weight[i] * weight[i] + steady))
            .sum();
        sum / test.len() as f64
    }

    /// Mean and mean square of how many standard errors off an estimate is.
    fn scores(of: impl Fn(&Case) -> (Estimated, f64)) -> [f64; 2] {
        const CASES: u64 = 200;
        let mut sums = [0.0; 2];
        for seed in 0..CASES {
            let (estimated, truth) = of(&case(seed));
            let score = (estimated.value - truth) / estimated.standard_error;
            sums[0] += score / CASES as f64;
            sums[1] += score * score / CASES as f64;
        }
        sums
    }

    #[test]
    fn an_error_is_told_from_the_references_noise() {
        let [mean, square] = scores(|it| {
            let estimated =
                error_without_noise(&it.test, &it.reference, &it.counted, FLOOR).unwrap();
            (estimated, weighted(&it.test, &it.truth, &it.reference))
        });
        // Of 200 scores the mean is off by 0.07, the mean square by 0.1.
        assert!(mean.abs() < 0.25, "{mean}");
        assert!((square - 1.0).abs() < 0.35, "{square}");
        // The noise is no small part of the error as it is without this.
        let it = case(0);
        let with = relative_mse(&it.test, &it.reference).unwrap();
        let without = weighted(&it.test, &it.truth, &it.reference);
        assert!(with > 3.0 * without, "{with} {without}");
    }

    #[test]
    fn a_references_noise_is_told_by_the_truth() {
        let [mean, square] = scores(|it| {
            let estimated = reference_noise(&it.reference, &it.counted, FLOOR).unwrap();
            (estimated, weighted(&it.truth, &it.reference, &it.reference))
        });
        assert!(mean.abs() < 0.25, "{mean}");
        // Not above 1, as the standard error is a little too large.
        assert!((0.55..1.3).contains(&square), "{square}");
    }

    #[test]
    fn without_noise_the_error_is_the_usual() {
        let Case { truth, test, .. } = case(1);
        let counted = Counted {
            parts: [(); PARTS].map(|()| truth.clone()),
            photons: 0,
            seconds: 0.0,
        };
        let estimated = error_without_noise(&test, &truth, &counted, FLOOR).unwrap();
        let expected = relative_mse(&test, &truth).unwrap();
        assert!((estimated.value / expected - 1.0).abs() < 1e-12);
        assert_eq!(estimated.standard_error, 0.0);
        assert_eq!(reference_noise(&truth, &counted, FLOOR).unwrap().value, 0.0);
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        let Case {
            test,
            reference,
            counted,
            ..
        } = case(2);
        let other = Image::new(3, 3).unwrap();
        assert!(error_without_noise(&other, &reference, &counted, FLOOR).is_err());
        assert!(error_without_noise(&test, &other, &counted, FLOOR).is_err());
        assert!(reference_noise(&other, &counted, FLOOR).is_err());
    }
}
