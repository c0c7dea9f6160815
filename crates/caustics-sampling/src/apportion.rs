use thiserror::Error;

/// Why a total could not be shared.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ApportionError {
    /// A weight is negative, infinite or not a number.
    #[error("weight {index} is {weight}, which is not a finite number >= 0")]
    InvalidWeight {
        /// Which weight.
        index: usize,
        /// Its value.
        weight: f64,
    },
    /// There is something to share, but no weight is above zero.
    #[error("all weights are zero, so that the total of {total} cannot be shared")]
    NoWeight {
        /// What was to be shared.
        total: usize,
    },
    /// The floors alone are more than the total.
    #[error("a floor of {floor} for each of {entries} entries exceeds the total of {total}")]
    FloorExceedsTotal {
        /// The least that each entry should get.
        floor: usize,
        /// Number of entries with a weight above zero.
        entries: usize,
        /// What was to be shared.
        total: usize,
    },
}

/// Shares `total` among entries in proportion to their weights; the shares sum to it exactly.
///
/// By largest remainders (Hamilton's method): everyone gets the whole part of its exact share, and
/// what is left goes to the largest remainders, one each. A share thus differs from the exact one
/// by less than one; an entry never gets less than one of smaller weight; a weight of zero gets
/// nothing. As ever with this method, a larger total may take one away from some entry.
///
/// # Errors
///
/// A negative or non-finite weight, or no weight above zero while `total` is not zero.
///
/// ```
/// use caustics_sampling::apportion;
///
/// assert_eq!(apportion(&[1.0, 1.0, 1.0], 8)?, [3, 3, 2]);
/// assert_eq!(apportion(&[0.62, 0.0, 0.38], 10)?, [6, 0, 4]);
/// # Ok::<(), caustics_sampling::ApportionError>(())
/// ```
pub fn apportion(weights: &[f64], total: usize) -> Result<Vec<usize>, ApportionError> {
    apportion_with_floor(weights, total, 0)
}

/// As [`apportion`], but each entry of weight above zero gets at least `floor`.
///
/// Entries whose proportional share would be below the floor get the floor; the others share what
/// remains in proportion to their weights.
///
/// # Errors
///
/// As [`apportion`], and where the floors alone exceed the total.
///
/// ```
/// use caustics_sampling::apportion_with_floor;
///
/// // A strong light does not starve a weak one.
/// assert_eq!(apportion_with_floor(&[1000.0, 1.0], 1000, 50)?, [950, 50]);
/// # Ok::<(), caustics_sampling::ApportionError>(())
/// ```
pub fn apportion_with_floor(
    weights: &[f64],
    total: usize,
    floor: usize,
) -> Result<Vec<usize>, ApportionError> {
    for (index, &weight) in weights.iter().enumerate() {
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(ApportionError::InvalidWeight { index, weight });
        }
    }
    let mut shares = vec![0; weights.len()];
    let mut open: Vec<usize> = (0..weights.len()).filter(|&i| weights[i] > 0.0).collect();
    if open.is_empty() {
        return if total == 0 {
            Ok(shares)
        } else {
            Err(ApportionError::NoWeight { total })
        };
    }
    let exceeds = ApportionError::FloorExceedsTotal {
        floor,
        entries: open.len(),
        total,
    };
    if floor
        .checked_mul(open.len())
        .is_none_or(|floors| floors > total)
    {
        return Err(exceeds);
    }

    // Heaviest first: those below the floor are then a tail, and ties go to the heavier, then to
    // the earlier entry.
    open.sort_by(|&i, &j| weights[j].total_cmp(&weights[i]).then(i.cmp(&j)));
    let scaled: Vec<f64> = open
        .iter()
        .map(|&i| weights[i] / weights[open[0]])
        .collect();
    let sums: Vec<f64> = scaled
        .iter()
        .scan(0.0, |sum, weight| {
            *sum += weight;
            Some(*sum)
        })
        .collect();
    let (mut entries, mut remaining) = (open.len(), total);
    while entries > 1 && scaled[entries - 1] / sums[entries - 1] * (remaining as f64) < floor as f64
    {
        entries -= 1;
        shares[open[entries]] = floor;
        remaining -= floor;
    }
    let exact = scaled[..entries]
        .iter()
        .map(|w| w / sums[entries - 1] * remaining as f64);
    for (&entry, share) in open.iter().zip(round_to_sum(exact, remaining)) {
        shares[entry] = share;
    }
    Ok(shares)
}

/// Rounds shares, given in falling order, up or down so that they sum to `total`.
fn round_to_sum(exact: impl Iterator<Item = f64>, total: usize) -> Vec<usize> {
    let (mut shares, remainders): (Vec<usize>, Vec<f64>) =
        exact.map(|share| (share as usize, share.fract())).unzip();
    let mut order: Vec<usize> = (0..shares.len()).collect();
    order.sort_by(|&i, &j| remainders[j].total_cmp(&remainders[i]).then(i.cmp(&j)));

    // One round, as long as the numbers are small enough for an f64 to count them; beyond 2^53 the
    // whole parts are off by more than one, to either side.
    let total = total as u128;
    let mut assigned: u128 = shares.iter().map(|&share| share as u128).sum();
    while assigned < total {
        for &entry in order
            .iter()
            .take((total - assigned).min(order.len() as u128) as usize)
        {
            shares[entry] += 1;
            assigned += 1;
        }
    }
    for &entry in order.iter().rev().cycle() {
        if assigned == total {
            break;
        }
        if shares[entry] > 0 {
            shares[entry] -= 1;
            assigned -= 1;
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_the_earlier_of_equal_weights() {
        assert_eq!(apportion(&[1.0; 4], 6), Ok(vec![2, 2, 1, 1]));
    }

    #[test]
    fn extreme_weights_do_not_overflow() {
        assert_eq!(apportion(&[f64::MAX, f64::MAX, 0.0], 10), Ok(vec![5, 5, 0]));
        assert_eq!(
            apportion(&[f64::MIN_POSITIVE, f64::MAX], 10),
            Ok(vec![0, 10])
        );
        assert_eq!(
            apportion_with_floor(&[5e-324, f64::MAX], 10, 3),
            Ok(vec![3, 7])
        );
    }

    #[test]
    fn nothing_to_share_is_no_error() {
        assert_eq!(apportion(&[], 0), Ok(vec![]));
        assert_eq!(apportion(&[0.0, 0.0], 0), Ok(vec![0, 0]));
        assert_eq!(apportion(&[3.0, 1.0], 0), Ok(vec![0, 0]));
    }

    #[test]
    fn bad_input_is_named() {
        let error = apportion(&[1.0, -2.0], 3).unwrap_err();
        assert_eq!(
            error,
            ApportionError::InvalidWeight {
                index: 1,
                weight: -2.0
            }
        );
        assert!(apportion(&[f64::NAN], 3).is_err());
        assert!(apportion(&[f64::INFINITY], 3).is_err());
        assert_eq!(
            apportion(&[0.0], 3),
            Err(ApportionError::NoWeight { total: 3 })
        );
        let floors = ApportionError::FloorExceedsTotal {
            floor: 2,
            entries: 2,
            total: 3,
        };
        assert_eq!(apportion_with_floor(&[1.0, 0.0, 1.0], 3, 2), Err(floors));
        assert!(apportion_with_floor(&[1.0, 1.0], 3, usize::MAX).is_err());
    }

    #[test]
    fn totals_beyond_the_integers_of_f64_sum_exactly() {
        let total = usize::MAX / 2 - 12345;
        let shares = apportion(&[1.0, 2.0, 3.0, 0.7], total).unwrap();
        assert_eq!(shares.iter().sum::<usize>(), total);
    }
}
