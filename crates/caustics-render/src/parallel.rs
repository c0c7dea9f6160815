//! Work on all threads where the feature allows, whose results do not depend on how many there are.

/// What is made of each of so many numbers, in their order, by tasks of no fewer than `least`.
pub(crate) fn made<T: Send>(
    count: u32,
    least: usize,
    make: impl Fn(u32) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        let numbers = (0..count).into_par_iter().with_min_len(least);
        numbers.map(make).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        let _ = least;
        (0..count).map(make).collect()
    }
}

/// What is made of each of some items, in their order, by tasks of no fewer than `least`.
pub(crate) fn of_all<T: Sync, R: Send>(
    items: &[T],
    least: usize,
    make: impl Fn(&T) -> R + Sync + Send,
) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter().with_min_len(least).map(make).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        let _ = least;
        items.iter().map(make).collect()
    }
}

/// Does each of some tasks, which are large.
pub(crate) fn each<T: Send>(tasks: Vec<T>, run: impl Fn(T) + Sync + Send) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        tasks.into_par_iter().with_max_len(1).for_each(run);
    }
    #[cfg(not(feature = "parallel"))]
    tasks.into_iter().for_each(run);
}

/// What two tasks make.
pub(crate) fn both<A: Send, B: Send>(
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(feature = "parallel")]
    {
        rayon::join(one, other)
    }
    #[cfg(not(feature = "parallel"))]
    (one(), other())
}
