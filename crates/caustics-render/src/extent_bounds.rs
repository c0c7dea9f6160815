use caustics_trace::Photon;

use crate::footprint::FootprintOptions;

/// Footprints' spacings below this part of all are the close ones.
const CLOSE_QUANTILE: f32 = 0.1;

/// The least standard deviation of a footprint, relative to that of the close ones.
const LEAST_EXTENT: f32 = 0.125;

/// The least standard deviation of a footprint, relative to the diagonal of the box around all
/// photons: below it, the rounding of positions would show.
const LEAST_OF_SCENE: f32 = 1e-6;

/// The least standard deviation of a footprint where nothing else tells, in metres.
const LEAST_METRES: f32 = 1e-9;

/// The largest extent of a footprint, relative to the same diagonal.
const MOST_OF_SCENE: f32 = 1e3;

/// The largest extent of a footprint where one photon is all there is, in metres.
const MOST_METRES: f32 = 1e9;

/// The standard deviations that a footprint without a pixel may have, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExtentBounds {
    pub(crate) least: f32,
    pub(crate) most: f32,
}

impl ExtentBounds {
    /// Of the footprints of some photons, which `diagonal` metres hold from corner to corner.
    pub(crate) fn of(photons: &[Photon], options: &FootprintOptions, diagonal: f32) -> Self {
        let spacing = |photon: &Photon| {
            let [a, b] = photon.axes;
            a.cross(b).length().sqrt()
        };
        let mut spacings: Vec<f32> = photons
            .iter()
            .map(spacing)
            .filter(|spacing| *spacing > 0.0 && spacing.is_finite())
            .collect();
        let close = if spacings.is_empty() {
            // No footprint has an area: as if the photons shared a square of the scene's size.
            diagonal / (photons.len().max(1) as f32).sqrt()
        } else {
            let rank = (CLOSE_QUANTILE * spacings.len() as f32) as usize;
            *spacings.select_nth_unstable_by(rank, f32::total_cmp).1
        };
        let least = LEAST_EXTENT * options.scale * close;
        Self {
            least: least.max(LEAST_OF_SCENE * diagonal).max(LEAST_METRES),
            most: if diagonal > 0.0 {
                MOST_OF_SCENE * diagonal
            } else {
                MOST_METRES
            },
        }
    }
}
