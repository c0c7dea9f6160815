//! Arrangements of a light, a specular body and a receiver whose caustic is known exactly.

mod curved_receiver;
mod flat_water;
mod glass_slab;
mod mirror_cylinder;
mod parabolic_mirror;
mod plano_convex_lens;
mod radial_lens;
mod sphere_lens;
mod wavy_water;

pub use curved_receiver::{CapLanding, LensOverCap, SunOverRipples};
pub use flat_water::FlatWater;
pub use glass_slab::GlassSlab;
pub use mirror_cylinder::MirrorCylinder;
pub use parabolic_mirror::ParabolicMirror;
pub use plano_convex_lens::PlanoConvexLens;
pub use radial_lens::{Landing, RadialLens};
pub use sphere_lens::SphereLens;
pub use wavy_water::{Wave, WavyWater};
