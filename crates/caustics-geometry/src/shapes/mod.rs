//! Generators of common meshes, centred on the origin unless they say otherwise, with +Y up.
//!
//! Closed solids wind outwards: seen from outside, their triangles run counterclockwise.
//! All sizes are in metres.

mod error;
mod heightfield;
mod icosphere;
mod polyhedra;
mod revolution;
mod round_solids;

pub use error::ShapeError;
pub use heightfield::{heightfield, heightfield_with_slope};
pub use icosphere::icosphere;
pub use polyhedra::{cuboid, quad};
pub use revolution::{ProfilePoint, RevolutionOptions, revolution, revolution_with_normals};
pub use round_solids::{cylinder, disc, torus, tube, uv_sphere};
