//! Markdown tables.

use caustics_benches::score::Conditions;

/// A table of rows of cells under a header.
pub(crate) struct Table {
    text: String,
}

impl Table {
    /// The first column is to the left, the others to the right.
    pub(crate) fn new(header: &[String]) -> Self {
        let rule = vec!["---:"; header.len() - 1].join(" | ");
        let mut table = Self {
            text: String::new(),
        };
        table.row(header);
        table.text.push_str(&format!("| --- | {rule} |\n"));
        table
    }

    pub(crate) fn row(&mut self, cells: &[String]) {
        self.text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }

    pub(crate) fn finish(self) -> String {
        self.text
    }
}

/// Three significant figures.
pub(crate) fn figures(x: f64) -> String {
    let digits = if x >= 100.0 {
        0
    } else if x >= 10.0 {
        1
    } else {
        2
    };
    format!("{x:.digits$}")
}

pub(crate) fn geometric_mean(values: &[f64]) -> f64 {
    (values.iter().map(|x| x.ln()).sum::<f64>() / values.len() as f64).exp()
}

/// When, where and from what everything was measured.
pub(crate) fn conditions(of: &Conditions, is_quick: bool) -> String {
    let mut table = Table::new(&["date", "sources", "machine", "cores", "run"].map(str::to_owned));
    table.row(&[
        of.date.clone(),
        format!("`{}`", of.commit),
        of.machine.clone(),
        of.threads.to_string(),
        (if is_quick { "quick" } else { "full" }).to_owned(),
    ]);
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_rows() {
        assert_eq!(
            [0.123_4, 12.34, 1234.4].map(figures),
            ["0.12", "12.3", "1234"]
        );
        assert!((geometric_mean(&[1.0, 4.0]) - 2.0).abs() < 1e-12);
        let mut table = Table::new(&["a".to_owned(), "b".to_owned()]);
        table.row(&["x".to_owned(), "1".to_owned()]);
        assert_eq!(table.finish(), "| a | b |\n| --- | ---: |\n| x | 1 |\n");
    }
}
