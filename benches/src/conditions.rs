//! When, where and from which sources something was measured.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::score::Conditions;

/// The conditions of now, on a machine of the given class.
#[must_use]
pub fn conditions(machine: &str) -> Conditions {
    let days = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |elapsed| elapsed.as_secs() / 86_400);
    Conditions {
        threads: rayon::current_num_threads(),
        // The rows' columns are parted by commas.
        machine: machine.replace(',', ";"),
        date: date(days),
        commit: commit().unwrap_or_else(|| "unknown".to_owned()),
    }
}

/// The version of the sources, with a mark where the libraries differ from it.
fn commit() -> Option<String> {
    let git = |words: &[&str]| {
        let output = Command::new("git")
            .args(["-C", concat!(env!("CARGO_MANIFEST_DIR"), "/..")])
            .args(words)
            .output()
            .ok()
            .filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let hash = git(&["rev-parse", "--short=10", "HEAD"])?;
    let changes = git(&["status", "--porcelain", "--", "crates", "benches/src"])?;
    Some(if changes.is_empty() {
        hash
    } else {
        format!("{hash}+")
    })
}

/// The Gregorian date, as year-month-day, so many days after 1970-01-01.
fn date(days: u64) -> String {
    // In years that begin in March the leap day comes last, and a month's first day is a linear
    // function of its number.
    let days = days + 719_468;
    let era = days / 146_097;
    let of_era = days % 146_097;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 {
        march_month + 3
    } else {
        march_month - 9
    };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::date;

    #[test]
    fn dates_around_leap_days() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(11_016), "2000-02-29");
        assert_eq!(date(11_017), "2000-03-01");
        assert_eq!(date(19_722), "2023-12-31");
        assert_eq!(date(47_541), "2100-03-01");
    }
}
