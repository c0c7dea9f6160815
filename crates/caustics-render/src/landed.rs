//! A photon for this crate's tests.

use caustics_trace::{Coverage, FootprintSource, Photon};
use glam::Vec3;

/// One that fell from above, with a different flux in each channel.
pub(crate) fn landed(position: Vec3, axes: [Vec3; 2]) -> Photon {
    Photon {
        position,
        incoming: Vec3::NEG_Y,
        flux: Vec3::new(1.0, 2.0, 3.0),
        normal: Vec3::Y,
        axes,
        object: 0,
        events: 1,
        source: FootprintSource::Differential,
        coverage: Coverage::Cell,
    }
}
