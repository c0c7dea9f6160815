use caustics_benches::score::{PeerRow, Row};

/// The measures that charts and races go by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    RelativeMse,
    Trimmed,
}

impl Metric {
    pub(crate) const ALL: [Self; 2] = [Self::RelativeMse, Self::Trimmed];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::RelativeMse => "relMSE",
            Self::Trimmed => "trimmed relMSE",
        }
    }

    pub(crate) fn file(self) -> &'static str {
        match self {
            Self::RelativeMse => "accuracy-relmse.svg",
            Self::Trimmed => "accuracy-trimmed.svg",
        }
    }

    pub(crate) fn of(self, row: &Row) -> f64 {
        match self {
            Self::RelativeMse => row.relative_mse,
            Self::Trimmed => row.relative_mse_trimmed,
        }
    }

    pub(crate) fn of_peer(self, row: &PeerRow) -> f64 {
        match self {
            Self::RelativeMse => row.relative_mse,
            Self::Trimmed => row.relative_mse_trimmed,
        }
    }
}
