//! Work on all threads where the feature allows, whose results do not depend on how many there are.

/// What is made of each of so many numbers, in their order.
pub(crate) fn made<T: Send>(count: u32, make: impl Fn(u32) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(make).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(make).collect()
}
