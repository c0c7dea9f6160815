use thiserror::Error;

use crate::unit_interval;

/// Why weights make no distribution.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum DiscreteError {
    /// A weight is negative, infinite or not a number.
    #[error("weight {index} is {weight}, which is not a finite number >= 0")]
    InvalidWeight {
        /// Which weight.
        index: usize,
        /// Its value.
        weight: f32,
    },
    /// There are no weights, or none above zero.
    #[error("none of the {entries} weights is above zero")]
    NoWeight {
        /// Number of weights.
        entries: usize,
    },
}

/// Draws entries with a probability in proportion to their weights.
///
/// The cumulative distribution is kept in `f64`: an `f32` near one has steps of 2^-24, in which the
/// triangles of a large emitter would vanish.
///
/// ```
/// use caustics_sampling::DiscreteDistribution;
///
/// let areas = DiscreteDistribution::new(&[1.0, 0.0, 3.0])?;
/// let drawn = areas.sample(0.5);
/// assert_eq!((drawn.index, drawn.probability), (2, 0.75));
/// // The entry covers 0.25..1, of which 0.5 is a third: ready to be used again.
/// assert!((drawn.remapped - 1.0 / 3.0).abs() < 1e-6);
/// # Ok::<(), caustics_sampling::DiscreteError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteDistribution {
    /// Entry `i` covers `cumulative[i]..cumulative[i + 1]`; first 0, last 1.
    cumulative: Vec<f64>,
    total: f64,
}

/// What [`DiscreteDistribution::sample`] draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteSample {
    /// Which entry.
    pub index: usize,
    /// Probability of that entry, above zero.
    pub probability: f32,
    /// Where in its entry the number fell, in `[0, 1)`: uniform again, and independent of the
    /// entry, with as many bits fewer as the choice has used up.
    pub remapped: f32,
}

impl DiscreteDistribution {
    /// The distribution in proportion to the weights, which need not sum to one.
    ///
    /// # Errors
    ///
    /// A negative or non-finite weight, or none above zero.
    pub fn new(weights: &[f32]) -> Result<Self, DiscreteError> {
        let mut cumulative = Vec::with_capacity(weights.len() + 1);
        let mut total = 0.0;
        cumulative.push(0.0);
        for (index, &weight) in weights.iter().enumerate() {
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(DiscreteError::InvalidWeight { index, weight });
            }
            total += f64::from(weight);
            cumulative.push(total);
        }
        if total == 0.0 {
            return Err(DiscreteError::NoWeight {
                entries: weights.len(),
            });
        }
        for value in &mut cumulative {
            *value /= total;
        }
        Ok(Self { cumulative, total })
    }

    /// The entry at `u`, which lies in `[0, 1)`; values outside are taken to the nearest end, and
    /// a NaN to zero. Entries of weight zero are never drawn.
    #[must_use]
    pub fn sample(&self, u: f32) -> DiscreteSample {
        let u = f64::from(unit_interval::nearest(u));
        let index = self.cumulative.partition_point(|&below| below <= u) - 1;
        let (start, end) = (self.cumulative[index], self.cumulative[index + 1]);
        let remapped = ((u - start) / (end - start)) as f32;
        DiscreteSample {
            index,
            probability: (end - start) as f32,
            remapped: unit_interval::nearest(remapped),
        }
    }

    /// Probability of an entry, zero where there is none of this index.
    #[must_use]
    pub fn probability(&self, index: usize) -> f32 {
        match self.cumulative.get(index..index.saturating_add(2)) {
            Some(&[start, end]) => (end - start) as f32,
            _ => 0.0,
        }
    }

    /// Number of entries, at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "there is always an entry")]
    pub fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    /// The sum of the weights.
    #[must_use]
    pub fn total_weight(&self) -> f64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_fall_on_entries_of_weight() {
        let distribution = DiscreteDistribution::new(&[0.0, 2.0, 6.0, 0.0]).unwrap();
        assert_eq!(distribution.sample(0.0).index, 1);
        assert_eq!(distribution.sample(0.25).index, 2);
        assert_eq!(distribution.sample(1.0 - f32::EPSILON / 2.0).index, 2);
        for outside in [-1.0, 2.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let sample = distribution.sample(outside);
            assert!(
                (0.0..1.0).contains(&sample.remapped),
                "{outside}: {sample:?}"
            );
        }
        assert_eq!(distribution.probability(1), 0.25);
        assert_eq!(distribution.probability(3), 0.0);
        assert_eq!(distribution.probability(4), 0.0);
        assert_eq!(distribution.probability(usize::MAX), 0.0);
        assert_eq!((distribution.len(), distribution.total_weight()), (4, 8.0));
    }

    #[test]
    fn bad_weights_are_named() {
        let error = DiscreteDistribution::new(&[1.0, f32::NAN]).unwrap_err();
        assert!(matches!(
            error,
            DiscreteError::InvalidWeight { index: 1, .. }
        ));
        for none in [&[][..], &[0.0, 0.0]] {
            let error = DiscreteDistribution::new(none).unwrap_err();
            assert_eq!(
                error,
                DiscreteError::NoWeight {
                    entries: none.len()
                }
            );
        }
    }

    #[test]
    fn a_million_entries_all_have_their_share() {
        let distribution = DiscreteDistribution::new(&vec![0.3; 1 << 20]).unwrap();
        for index in [0, 12345, (1 << 20) - 1] {
            let u = (index as f32 + 0.5) / (1 << 20) as f32;
            assert_eq!(distribution.sample(u).index, index);
        }
    }
}
