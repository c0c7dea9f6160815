use thiserror::Error;

/// Where points of the unit square can come from; [`PointSet`](crate::PointSet) makes them.
///
/// ```
/// use caustics_sampling::Sequence;
///
/// assert_eq!("grid".parse(), Ok(Sequence::Grid));
/// assert!("dice".parse::<Sequence>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Sequence {
    /// [Halton's sequence](crate::halton): can be extended, in any number of dimensions; no
    /// lattice, so that neighbours stand at uneven distances.
    Halton,
    /// [Sobol's sequence](crate::sobol), Owen-scrambled: can be extended, best at powers of two;
    /// no lattice.
    Sobol,
    /// A [square grid](crate::Grid) of cells of equal area.
    Grid,
    /// The [Fibonacci lattice](crate::Rank1Lattice): as regular as the grid, and without its rows
    /// along the axes.
    Fibonacci,
    /// The [Kronecker sequence](crate::kronecker) of the plastic number: can be extended, nearly
    /// a lattice at every count.
    Kronecker,
}

impl Sequence {
    /// All sequences.
    pub const ALL: [Self; 5] = [
        Self::Halton,
        Self::Sobol,
        Self::Grid,
        Self::Fibonacci,
        Self::Kronecker,
    ];

    /// The name in lower case, as [`FromStr`](std::str::FromStr) reads it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Halton => "halton",
            Self::Sobol => "sobol",
            Self::Grid => "grid",
            Self::Fibonacci => "fibonacci",
            Self::Kronecker => "kronecker",
        }
    }

    /// Whether points after the last extend the set; a grid and a Fibonacci lattice begin anew.
    #[must_use]
    pub const fn is_extensible(self) -> bool {
        matches!(self, Self::Halton | Self::Sobol | Self::Kronecker)
    }
}

impl std::fmt::Display for Sequence {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.name())
    }
}

/// A name that no sequence has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("unknown sequence `{name}`, not one of halton, sobol, grid, fibonacci, kronecker")]
pub struct UnknownSequence {
    /// The name given.
    pub name: String,
}

impl std::str::FromStr for Sequence {
    type Err = UnknownSequence;

    fn from_str(name: &str) -> Result<Self, UnknownSequence> {
        let found = Self::ALL
            .into_iter()
            .find(|sequence| sequence.name() == name);
        found.ok_or_else(|| UnknownSequence {
            name: name.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_the_error_lists_them() {
        let error = "dice".parse::<Sequence>().unwrap_err().to_string();
        for sequence in Sequence::ALL {
            assert_eq!(sequence.to_string().parse(), Ok(sequence));
            assert!(error.contains(sequence.name()));
        }
    }
}
