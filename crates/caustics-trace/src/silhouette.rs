/// By what a footprint is shortened that has been fitted to the end of the light already.
const EXTENT: f32 = 0.78;

/// The least ratio of a differential to the distance of the one neighbour that tells a silhouette
/// from an edge of even light.
const LEAST_RATIO: f32 = 1.02;

/// By how much of a cell the two ways to tell the distance of a silhouette may differ.
const AGREEMENT: f32 = 0.1;

/// A silhouette beside a photon of a lattice.
///
/// A ray that meets a smooth surface a small distance x inside its silhouette turns, and lands away
/// from the ray that just misses it, as c sqrt(x). With the cells' width as the unit, x is found
/// from the ratio r of the photon's differential, c / (2 sqrt(x)), to the distance of its neighbour,
/// c (sqrt(x + 1) - sqrt(x)): it is 1 / (4 r (r - 1)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Silhouette {
    ratio: f32,
    /// How far inside the silhouette the photon is, in cells of the lattice.
    pub(crate) inside: f32,
    /// Whether the neighbour's differential says the same, with which this one's has the ratio
    /// sqrt(1 + 1/x). Where cells are so wide that light turns otherwise than by the square root, they
    /// differ.
    pub(crate) is_sure: bool,
}

/// Where the light of a cell at a silhouette lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    /// How far from the photon towards its neighbour its middle is, in their distance.
    pub(crate) inwards: f32,
    /// How wide it is, in that distance.
    pub(crate) extent: f32,
}

impl Silhouette {
    /// Of a photon whose differential is `ratio` times as long as its one neighbour is far away, and
    /// `slope` times as long as that neighbour's; `None` where that tells no silhouette.
    pub(crate) fn of(ratio: f32, slope: f32) -> Option<Self> {
        (ratio > LEAST_RATIO).then(|| {
            let inside = 1.0 / (4.0 * ratio * (ratio - 1.0));
            let by_slope = 1.0 / (slope * slope - 1.0);
            Self {
                ratio,
                inside,
                is_sure: slope > 1.0 && (inside - by_slope).abs() < AGREEMENT,
            }
        })
    }

    /// How many cells' light is between the silhouette and the far side of the photon's cell, if the
    /// photon is the last of its row: it stands for all of that.
    pub(crate) fn cells(&self) -> Option<f32> {
        (self.is_sure && self.inside < 1.0).then_some(self.inside + 0.5)
    }

    /// The light between x - 1/2, or the silhouette where that is nearer, and x + 1/2.
    ///
    /// With s and d for the sum and the difference of the roots of its ends, the mean of where it
    /// lands is s / 2 + d² / (6 s) and the variance d² / 12 (1 - d² / (3 s²)), in which nothing
    /// cancels.
    pub(crate) fn fit(&self) -> Fit {
        let x = self.inside;
        let (low, high) = ((x - 0.5).max(0.0), x + 0.5);
        // In c.
        let sum = low.sqrt() + high.sqrt();
        let difference = (high - low) / sum;
        let mean = 0.5 * sum + difference * difference / (6.0 * sum);
        let skew = difference / sum;
        // As wide as the even light that has this variance.
        let width = difference * (1.0 - skew * skew / 3.0).sqrt();
        // c in the distance to the neighbour.
        let scale = 2.0 * self.ratio * x.sqrt();
        Fit {
            inwards: scale * (mean - x.sqrt()),
            extent: EXTENT * scale * width,
        }
    }
}
