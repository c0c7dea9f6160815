/// The ways to turn photons into radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Estimate {
    /// The nearest photons over the area of their disc.
    #[default]
    Nearest,
}

impl Estimate {
    /// All estimates.
    pub const ALL: [Self; 1] = [Self::Nearest];

    /// The name by which a user asks for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
        }
    }

    /// What it does, in one line.
    #[must_use]
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Nearest => "the nearest photons, over the area of the disc that holds them",
        }
    }

    /// The estimate with a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|it| it.name() == name)
    }
}
