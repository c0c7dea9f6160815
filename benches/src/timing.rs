//! Wall-clock times.

use std::time::Instant;

/// How often something is repeated to be timed.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// At most this many runs, at least one.
    pub runs: u32,
    /// No further run after this many seconds.
    pub seconds: f64,
}

/// A result and how long it took.
#[derive(Clone, Copy, Debug)]
pub struct Timed<T> {
    /// The last run's result.
    pub value: T,
    /// The median of all runs, in seconds.
    pub seconds: f64,
    /// How many runs there were.
    pub runs: u32,
}

/// Runs something until patience ends.
///
/// # Errors
/// The first error that a run returns.
pub fn median_of<T, E>(
    patience: Patience,
    mut run: impl FnMut() -> Result<T, E>,
) -> Result<Timed<T>, E> {
    median_after(patience, || Ok(()), |_| run())
}

/// Runs something until patience ends, each time with something made for it that is not timed.
///
/// # Errors
/// The first error that either returns.
pub fn median_after<P, T, E>(
    patience: Patience,
    mut prepare: impl FnMut() -> Result<P, E>,
    mut run: impl FnMut(&P) -> Result<T, E>,
) -> Result<Timed<T>, E> {
    let begin = Instant::now();
    let mut seconds = Vec::new();
    loop {
        let prepared = prepare()?;
        let start = Instant::now();
        let value = run(&prepared)?;
        seconds.push(start.elapsed().as_secs_f64());
        let runs = seconds.len() as u32;
        if runs >= patience.runs || begin.elapsed().as_secs_f64() >= patience.seconds {
            return Ok(Timed {
                value,
                seconds: median(&mut seconds),
                runs,
            });
        }
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 {
        values[middle]
    } else {
        0.5 * (values[middle - 1] + values[middle])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_the_two_middles() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 100.0]), 3.0);
    }

    #[test]
    fn runs_end_by_number_or_by_time() {
        let mut count = 0;
        let mut run = || {
            count += 1;
            Ok::<_, ()>(count)
        };
        let timed = median_of(
            Patience {
                runs: 3,
                seconds: 1e9,
            },
            &mut run,
        )
        .unwrap();
        assert_eq!((timed.value, timed.runs), (3, 3));
        let timed = median_of(
            Patience {
                runs: 3,
                seconds: 0.0,
            },
            &mut run,
        )
        .unwrap();
        assert_eq!((timed.value, timed.runs), (4, 1));
    }

    #[test]
    fn each_run_has_something_made_for_it_alone() {
        let patience = Patience {
            runs: 3,
            seconds: 1e9,
        };
        let mut made = 0;
        let mut used = Vec::new();
        let prepare = || {
            made += 1;
            Ok::<_, ()>(made)
        };
        let timed = median_after(patience, prepare, |&it| {
            used.push(it);
            Ok(10 * it)
        });
        assert_eq!(timed.unwrap().value, 30);
        assert_eq!(used, [1, 2, 3]);
    }
}
