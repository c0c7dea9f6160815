//! Tests of shapes, meshes and their intersection.
//!
//! One program, which takes less time to build than one for each file.

mod mesh;
mod normal_derivative;
mod oracle;
mod plane_and_box;
mod shapes;
mod spawn;
mod sphere;
mod triangle;
mod watertight;
