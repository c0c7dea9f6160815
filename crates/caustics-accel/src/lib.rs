//! Triangle and photon acceleration structures.

mod intersect;

pub use intersect::Intersect;
