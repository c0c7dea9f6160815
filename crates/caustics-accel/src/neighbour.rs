/// A point that a search has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index of the point in the list that the structure was built from.
    pub index: u32,
    /// Squared distance from the query point, in square metres.
    pub distance_squared: f32,
}

/// Memory that nearest-neighbour searches work in and return their result in.
///
/// Keep one for each thread and reuse it: after the first few queries nothing is allocated any
/// more.
#[derive(Clone, Debug, Default)]
pub struct NearestScratch {
    /// Candidates as sortable keys, see [`key`]; those that the last search did not write are left
    /// over from others.
    pub(crate) keys: Vec<u64>,
    /// The result of the last search.
    pub(crate) neighbours: Vec<Neighbour>,
}

impl NearestScratch {
    /// Empty scratch memory.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Turns the first `count` keys into the result, whose last element is the farthest.
    pub(crate) fn finish(&mut self, count: usize) -> &[Neighbour] {
        self.neighbours.clear();
        self.neighbours
            .extend(self.keys[..count].iter().map(|&key| Neighbour {
                index: index_of(key),
                distance_squared: distance_squared_of(key),
            }));
        &self.neighbours
    }
}

/// One integer that orders candidates by distance, and by index where the distances are equal.
///
/// Squared distances are never negative nor NaN, and the bit patterns of such floats are ordered
/// as the floats are. Breaking ties by the index makes the set of the k nearest unique, so that
/// every structure returns the same one.
pub(crate) fn key(distance_squared: f32, index: u32) -> u64 {
    (u64::from(distance_squared.to_bits()) << 32) | u64::from(index)
}

pub(crate) fn distance_squared_of(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

pub(crate) fn index_of(key: u64) -> u32 {
    key as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_by_distance_then_index() {
        assert!(key(0.0, 9) < key(f32::MIN_POSITIVE, 0));
        assert!(key(1.0, 9) < key(1.5, 0));
        assert!(key(1.0, 3) < key(1.0, 4));
        assert!(key(1.0e38, 3) < key(f32::INFINITY, 0));
        assert_eq!(index_of(key(2.5, 77)), 77);
        assert_eq!(distance_squared_of(key(2.5, 77)), 2.5);
    }
}
