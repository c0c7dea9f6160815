//! Contestants that take turns, so that whatever else the machine does slows all of them alike.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// Rounds at most.
const ROUNDS: usize = 9;
/// Rounds that even the slowest takes part in.
const LEAST: usize = 2;

/// What is timed: its name, and what it does, which returns something that depends on the result.
pub(crate) struct Contestant<'a> {
    pub(crate) name: &'static str,
    pub(crate) run: Box<dyn FnMut() -> u64 + 'a>,
}

impl<'a> Contestant<'a> {
    pub(crate) fn new(name: &'static str, run: impl FnMut() -> u64 + 'a) -> Self {
        Self {
            name,
            run: Box::new(run),
        }
    }
}

/// A contestant's name and the median of its times, in seconds.
pub(crate) type Time = (&'static str, f64);

/// Lets all run in turns, each until it has used up its time.
pub(crate) fn medians(contestants: Vec<Contestant<'_>>, patience: Duration) -> Vec<Time> {
    let mut contestants: Vec<_> = contestants
        .into_iter()
        .map(|contestant| (contestant, Vec::new()))
        .collect();
    for round in 0..ROUNDS {
        for (contestant, times) in &mut contestants {
            let spent: f64 = times.iter().sum();
            if round < LEAST || spent < patience.as_secs_f64() {
                let start = Instant::now();
                black_box((contestant.run)());
                times.push(start.elapsed().as_secs_f64());
            }
        }
    }
    contestants
        .into_iter()
        .map(|(contestant, mut times)| {
            times.sort_by(f64::total_cmp);
            // The lower one of two middles: what interrupts only ever adds.
            (contestant.name, times[(times.len() - 1) / 2])
        })
        .collect()
}

/// A pool of so many threads.
///
/// # Errors
/// If the system grants none.
pub(crate) fn pool(threads: usize) -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build()
}
