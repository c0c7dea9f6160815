//! Halves of full buckets along the widest axis.

#[cfg(feature = "parallel")]
use super::PARALLEL_POINTS;
use super::point::{Point, bounds, widest_axis};
use super::{BUCKET, Bucket, Split};

/// Sorts points into buckets, all of which but the last are full.
pub(super) fn build(points: &mut [Point]) -> (Vec<Split>, Vec<Bucket>) {
    let count = points.len().div_ceil(BUCKET);
    let mut splits = vec![Split::EMPTY; count.saturating_sub(1)];
    let mut buckets = vec![Bucket::EMPTY; count];
    partition(points, &mut splits, &mut buckets);
    (splits, buckets)
}

/// Sorts points into buckets and notes the splits above them.
fn partition(points: &mut [Point], splits: &mut [Split], buckets: &mut [Bucket]) {
    if let [bucket] = buckets {
        bucket.fill(points);
        return;
    }
    let Some((split, splits)) = splits.split_first_mut() else {
        return;
    };
    let (low, high) = bounds(points);
    let axis = widest_axis(high - low);
    let left_count = buckets.len().div_ceil(2);
    let compare = |a: &Point, b: &Point| a.along(axis).total_cmp(&b.along(axis));
    let (left, first_right, _) = points.select_nth_unstable_by(left_count * BUCKET, compare);
    let mut largest = f32::NEG_INFINITY;
    for point in left {
        let x = point.along(axis);
        largest = if x > largest { x } else { largest };
    }
    *split = Split::new(axis, left_count, largest, first_right.along(axis));
    let (left, right) = points.split_at_mut(left_count * BUCKET);
    let (left_splits, right_splits) = splits.split_at_mut(left_count - 1);
    let (left_buckets, right_buckets) = buckets.split_at_mut(left_count);
    #[cfg(feature = "parallel")]
    if left.len() > PARALLEL_POINTS {
        rayon::join(
            || partition(left, left_splits, left_buckets),
            || partition(right, right_splits, right_buckets),
        );
        return;
    }
    partition(left, left_splits, left_buckets);
    partition(right, right_splits, right_buckets);
}
