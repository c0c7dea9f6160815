use std::f32::consts::FRAC_1_PI;

use caustics_accel::BoxTree;
use caustics_geometry::Aabb;
use caustics_trace::Photon;
use glam::Vec3;

use crate::error::RenderError;
use crate::eye::Receiver;
use crate::footprint::{Density, ExtentBounds, FootprintOptions, Gate};

/// Footprints' spacings below this part of all are the close ones.
const CLOSE_QUANTILE: f32 = 0.1;

/// The least standard deviation of a footprint, relative to that of the close ones.
const LEAST_EXTENT: f32 = 0.125;

/// The least standard deviation of a footprint, relative to the diagonal of the box around all
/// photons: below it, the rounding of positions would show.
const LEAST_OF_SCENE: f32 = 1e-6;

/// The largest standard deviation of a footprint, relative to the same diagonal.
const MOST_OF_SCENE: f32 = 1e3;

/// The largest standard deviation, in metres, where one photon is all there is.
const MOST_METRES: f32 = 1e9;

/// What became of the photons that a [`FootprintGather`] was built from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatherStats {
    /// Photons that can be found.
    pub stored: u64,
    /// Of these, photons whose footprint was narrower than [`FootprintGather::least_extent`], and
    /// was widened to it: a point or a line has no area to divide the flux by.
    pub widened: u64,
    /// Of these, photons whose footprint was longer than a thousand times the box around all
    /// photons, and was shortened to that.
    pub shortened: u64,
    /// Photons left out because their flux over their area is more than a number holds.
    pub invalid: u64,
}

/// The caustics at any point of the scene, from the same footprints that
/// [`splat`](crate::splat()) draws: for what is seen in a mirror or through glass, for baking, and
/// for whatever asks.
///
/// A photon lights the points that the splat would: those close to its plane, turned its way, on
/// the lit side, each by the kernel around the point where its light passes the plane. A footprint
/// without area is widened, see [`least_extent`](Self::least_extent) and [`GatherStats`].
#[derive(Clone)]
pub struct FootprintGather {
    tree: BoxTree,
    /// In the order of the tree.
    footprints: Vec<Footprint>,
    /// The part of a pixel's extent by which a search is widened.
    kernel_reach: f32,
    pixel_deviation: f32,
    least_extent: f32,
    stats: GatherStats,
}

#[derive(Clone, Copy)]
struct Footprint {
    density: Density,
    gate: Gate,
}

impl Footprint {
    fn new(density: Density) -> Self {
        Self {
            gate: density.gate(),
            density,
        }
    }

    #[inline]
    fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let density = &self.density;
        if self.gate.admits(density, position, normal) {
            density.irradiance(position, normal)
        } else {
            Vec3::ZERO
        }
    }
}

impl FootprintGather {
    /// Prepares the photons' footprints and builds the tree over them.
    ///
    /// # Errors
    /// Options out of range, or a photon with a number that is not finite.
    pub fn new(photons: &[Photon], options: &FootprintOptions) -> Result<Self, RenderError> {
        options.validate()?;
        if let Some(photon) = photons.iter().position(|photon| !is_finite(photon)) {
            return Err(RenderError::NonFinitePhoton { photon });
        }
        let bounds = extent_bounds(photons, options);
        let mut stats = GatherStats::default();
        let mut footprints = Vec::with_capacity(photons.len());
        for photon in photons {
            let Some((density, adjustment)) = Density::within(photon, &bounds, options) else {
                stats.invalid += 1;
                continue;
            };
            stats.stored += 1;
            stats.widened += u64::from(adjustment.widened);
            stats.shortened += u64::from(adjustment.shortened);
            footprints.push(Footprint::new(density));
        }
        let boxes: Vec<Aabb> = footprints
            .iter()
            .map(|footprint| footprint.density.bounds())
            .collect();
        let tree = BoxTree::new(&boxes)?;
        let footprints = tree
            .order()
            .iter()
            .map(|&index| footprints[index as usize])
            .collect();
        Ok(Self {
            tree,
            footprints,
            kernel_reach: options.kernel.search_reach(),
            pixel_deviation: options.kernel.pixel_variance().sqrt(),
            least_extent: bounds.least,
            stats,
        })
    }

    /// Irradiance at a point of a surface with unit `normal`, in W/m² for each channel, by the
    /// light that falls on the side of the normal.
    #[must_use]
    pub fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        self.tree.visit_overlapping(
            &Aabb {
                min: position,
                max: position,
            },
            |range| {
                for footprint in &self.footprints[range] {
                    sum += footprint.irradiance(position, normal);
                }
            },
        );
        sum
    }

    /// Irradiance as in [`irradiance`](Self::irradiance), averaged over a pixel whose edges on the
    /// receiver are `pixel`, in metres.
    ///
    /// Each footprint is blurred by the pixel as in a splat, which moves its flux and keeps its
    /// sum.
    #[must_use]
    pub fn irradiance_over(&self, position: Vec3, normal: Vec3, pixel: [Vec3; 2]) -> Vec3 {
        let [a, b] = pixel;
        let blur = self.kernel_reach
            * self.pixel_deviation
            * (a.length_squared() + b.length_squared()).sqrt();
        let query = Aabb {
            min: position - blur,
            max: position + blur,
        };
        let mut sum = Vec3::ZERO;
        self.tree.visit_overlapping(&query, |range| {
            for footprint in &self.footprints[range] {
                if let Some(density) = footprint.density.blurred(&pixel) {
                    sum += Footprint::new(density).irradiance(position, normal);
                }
            }
        });
        sum
    }

    /// Radiance that a Lambertian receiver reflects towards the eye, in W/(sr m²).
    #[must_use]
    pub fn radiance(&self, receiver: &Receiver) -> Vec3 {
        let irradiance = self.irradiance(receiver.point.spawn.position, receiver.normal);
        receiver.albedo * FRAC_1_PI * irradiance
    }

    /// Radiance as in [`radiance`](Self::radiance), averaged over a pixel whose edges on the
    /// receiver are `pixel`, in metres.
    #[must_use]
    pub fn radiance_over(&self, receiver: &Receiver, pixel: [Vec3; 2]) -> Vec3 {
        let position = receiver.point.spawn.position;
        receiver.albedo * FRAC_1_PI * self.irradiance_over(position, receiver.normal, pixel)
    }

    /// What became of the photons.
    #[must_use]
    pub fn stats(&self) -> GatherStats {
        self.stats
    }

    /// The least standard deviation of a footprint in any direction, in metres: an eighth of what
    /// footprints in the closest tenth have, so that what is widened stays finer than its
    /// neighbours.
    #[must_use]
    pub fn least_extent(&self) -> f32 {
        self.least_extent
    }

    /// How many footprints there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.footprints.len()
    }

    /// Whether there is no footprint, and so no light.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.footprints.is_empty()
    }

    /// Memory that it occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.tree.memory_bytes()
            + self.footprints.capacity() * size_of::<Footprint>()
    }
}

fn is_finite(photon: &Photon) -> bool {
    let [a, b] = photon.axes;
    [
        photon.position,
        photon.incoming,
        photon.flux,
        photon.normal,
        a,
        b,
    ]
    .iter()
    .all(|vector| vector.is_finite())
}

fn extent_bounds(photons: &[Photon], options: &FootprintOptions) -> ExtentBounds {
    let around = photons
        .iter()
        .fold(Aabb::EMPTY, |bounds, photon| bounds.extend(photon.position));
    let diagonal = if photons.is_empty() {
        0.0
    } else {
        around.diagonal().length()
    };
    let mut spacings: Vec<f32> = photons
        .iter()
        .map(|photon| {
            let [a, b] = photon.axes;
            a.cross(b).length().sqrt()
        })
        .filter(|spacing| *spacing > 0.0 && spacing.is_finite())
        .collect();
    let rank = (CLOSE_QUANTILE * spacings.len() as f32) as usize;
    let close = if spacings.is_empty() {
        // No footprint has an area: as if the photons shared the box's face evenly.
        diagonal / (photons.len().max(1) as f32).sqrt()
    } else {
        *spacings.select_nth_unstable_by(rank, f32::total_cmp).1
    };
    let least = LEAST_EXTENT * options.scale * close;
    let least = least.max(LEAST_OF_SCENE * diagonal);
    let most = if diagonal > 0.0 {
        MOST_OF_SCENE * diagonal
    } else {
        MOST_METRES
    };
    ExtentBounds {
        least: if least > 0.0 { least } else { 1e-3 },
        most,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FootprintKernel;

    pub(super) fn photon(position: Vec3, axes: [Vec3; 2]) -> Photon {
        Photon {
            position,
            incoming: Vec3::NEG_Y,
            flux: Vec3::new(1.0, 2.0, 3.0),
            normal: Vec3::Y,
            axes,
            object: 0,
            events: 1,
        }
    }

    #[test]
    fn nothing_lights_nothing() {
        let gather = FootprintGather::new(&[], &FootprintOptions::default()).unwrap();
        assert!(gather.is_empty());
        assert_eq!(gather.irradiance(Vec3::ZERO, Vec3::Y), Vec3::ZERO);
        assert_eq!(
            gather.irradiance_over(Vec3::ZERO, Vec3::Y, [Vec3::X, Vec3::Z]),
            Vec3::ZERO
        );
    }

    #[test]
    fn the_middle_of_a_gaussian_has_its_flux_over_two_pi_times_its_variance() {
        let photons = [photon(Vec3::ONE, [0.2 * Vec3::X, 0.4 * Vec3::Z])];
        let options = FootprintOptions {
            scale: 0.5,
            ..FootprintOptions::default()
        };
        let gather = FootprintGather::new(&photons, &options).unwrap();
        let cut_off = 1.0 - (-4.5f32).exp();
        let peak = 1.0 / (2.0 * std::f32::consts::PI * 0.1 * 0.2 * cut_off);
        let measured = gather.irradiance(Vec3::ONE, Vec3::Y);
        assert!(
            measured.abs_diff_eq(peak * photons[0].flux, 1e-5 * peak),
            "{measured} {peak}"
        );
    }

    #[test]
    fn numbers_that_are_not_finite_are_named() {
        let good = photon(Vec3::ZERO, [Vec3::X, Vec3::Z]);
        let bad = Photon {
            flux: Vec3::new(0.0, f32::NAN, 0.0),
            ..good
        };
        let result = FootprintGather::new(&[good, bad], &FootprintOptions::default());
        assert_eq!(
            result.err(),
            Some(RenderError::NonFinitePhoton { photon: 1 })
        );
    }

    #[test]
    fn every_kernel_spreads_a_footprint_without_area() {
        for kernel in FootprintKernel::ALL {
            let options = FootprintOptions {
                kernel,
                ..FootprintOptions::default()
            };
            let photons = [photon(Vec3::ZERO, [Vec3::ZERO; 2])];
            let gather = FootprintGather::new(&photons, &options).unwrap();
            assert_eq!(gather.stats().widened, 1);
            assert!(gather.irradiance(Vec3::ZERO, Vec3::Y).min_element() > 0.0);
        }
    }
}
