mod build;

use caustics_accel::BoxTree;
use caustics_geometry::Aabb;
use glam::Vec3;

pub use self::build::GatherStats;
use crate::density::Density;
use crate::eye::Receiver;
use crate::footprint_piece::{Footprint, Piece, Target};
use crate::truncated_kernel::Kernels;

/// The caustics at any point of the scene, from the same footprints that
/// [`splat`](crate::splat()) draws: for what is seen in a mirror or through glass, for baking, and
/// for whatever asks.
///
/// A photon lights the points that the splat would: those close to its plane, turned its way, on
/// the lit side, each by the kernel around the point where its light meets the plane. So screen,
/// mirror and bake agree.
///
/// ```
/// use caustics_render::{FootprintGather, FootprintOptions};
/// use caustics_trace::{Coverage, FootprintSource, Photon};
/// use glam::Vec3;
///
/// // One watt, straight down, over about a square decimetre of the floor.
/// let photon = Photon {
///     position: Vec3::ZERO,
///     incoming: Vec3::NEG_Y,
///     flux: Vec3::ONE,
///     normal: Vec3::Y,
///     axes: [0.1 * Vec3::X, 0.1 * Vec3::Z],
///     object: 0,
///     events: 1,
///     source: FootprintSource::Checked,
///     coverage: Coverage::Cell,
/// };
/// let gather = FootprintGather::new(&[photon], &FootprintOptions::default())?;
/// assert!(gather.irradiance(Vec3::ZERO, Vec3::Y).x > 50.0);
/// // Not the floor's underside, nor a metre away.
/// assert_eq!(gather.irradiance(Vec3::ZERO, Vec3::NEG_Y), Vec3::ZERO);
/// assert_eq!(gather.irradiance(Vec3::X, Vec3::Y), Vec3::ZERO);
/// # Ok::<(), caustics_render::RenderError>(())
/// ```
///
/// # Footprints without area
/// A splat blurs every footprint by a pixel. Here there may be none, so a footprint narrower than
/// [`least_extent`](Self::least_extent) is widened to it and counted; none is dropped for that.
/// [`irradiance_over`](Self::irradiance_over) adds the blur of a pixel.
///
/// # Cost
/// A search costs about as much as there are footprints on its point, which
/// [`FootprintOptions::max_overlaps`](crate::FootprintOptions::max_overlaps) limits. Long ones that
/// lie askew would cost more, since the boxes around them are mostly empty: they are cut into up to
/// 256 pieces, lengthwise and by their height above the receiver, as long as that saves enough. Of
/// footprints far larger than the scene only the part in it is cut.
#[derive(Clone, Debug)]
pub struct FootprintGather {
    tree: BoxTree,
    /// In the order of the tree.
    pieces: Vec<Piece>,
    footprints: Vec<Footprint>,
    /// One for each footprint.
    densities: Vec<Density>,
    kernels: Kernels,
    /// By how much a search is widened, relative to a pixel's edges.
    blur_reach: f32,
    least_extent: f32,
    stats: GatherStats,
}

impl FootprintGather {
    /// Irradiance at a point of a surface with unit `normal`, in W/m² for each channel, by the
    /// light that falls on the side of the normal.
    ///
    /// Whatever object the point belongs to: it may share light with a parallel surface that is
    /// closer to it than a part of a footprint's width. [`irradiance_on`](Self::irradiance_on) knows
    /// better.
    #[must_use]
    pub fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.irradiance_at(&Target {
            position,
            normal,
            object: None,
        })
    }

    /// Irradiance as in [`irradiance`](Self::irradiance), at a point of the object with this index
    /// among the world's.
    #[must_use]
    pub fn irradiance_on(&self, object: u32, position: Vec3, normal: Vec3) -> Vec3 {
        self.irradiance_at(&Target {
            position,
            normal,
            object: Some(object),
        })
    }

    fn irradiance_at(&self, target: &Target) -> Vec3 {
        let mut sum = Vec3::ZERO;
        self.for_each_lighting(target, |density, kernel| {
            sum += density.irradiance_at(kernel, target.normal);
        });
        sum
    }

    /// Calls `visit` with each footprint that lights a point, and its kernel there.
    #[inline]
    fn for_each_lighting(&self, target: &Target, mut visit: impl FnMut(&Density, f32)) {
        self.tree.for_each_around(target.position, |place| {
            let piece = &self.pieces[place];
            let index = piece.footprint as usize;
            let kernel = self.kernels.get(piece.coverage);
            let kernel = self.footprints[index].kernel_at(piece, target, kernel);
            if kernel > 0.0 {
                visit(&self.densities[index], kernel);
            }
        });
    }

    /// Irradiance as in [`irradiance`](Self::irradiance), averaged over a pixel whose edges on the
    /// receiver are `pixel`, in metres.
    ///
    /// Each footprint is blurred as in a splat, which spreads its flux and keeps its sum. A pixel
    /// that is not finite, or larger than numbers hold when squared, is as dark as one at which
    /// no photon landed.
    #[must_use]
    pub fn irradiance_over(&self, position: Vec3, normal: Vec3, pixel: [Vec3; 2]) -> Vec3 {
        let target = Target {
            position,
            normal,
            object: None,
        };
        let mut sum = Vec3::ZERO;
        self.for_each_over(&target, pixel, |blurred| {
            sum += blurred.irradiance(position, normal);
        });
        sum
    }

    /// Calls `visit` with each footprint, blurred by a pixel, that lights a point.
    fn for_each_over(&self, target: &Target, pixel: [Vec3; 2], mut visit: impl FnMut(&Density)) {
        let Target {
            position,
            normal,
            object,
        } = *target;
        let [a, b] = pixel;
        let reach = self.blur_reach * (a.length_squared() + b.length_squared()).sqrt();
        let query = Aabb {
            min: position - reach,
            max: position + reach,
        };
        self.tree.for_each_overlapping(&query, |place| {
            let piece = &self.pieces[place];
            let index = piece.footprint as usize;
            if self.footprints[index].is_in(piece, position)
                && let Some(blurred) = self.densities[index].blurred(&pixel)
                && blurred.gate().admits(&blurred, position, normal, object)
            {
                visit(&blurred);
            }
        });
    }

    /// Radiance that a receiver reflects towards the eye, in W/(sr m²): each photon's part by its own
    /// direction.
    #[must_use]
    pub fn radiance(&self, receiver: &Receiver) -> Vec3 {
        let target = Target::of(receiver);
        if receiver.brdf.is_lambertian() {
            return receiver.reflectance(target.normal) * self.irradiance_at(&target);
        }
        let mut sum = Vec3::ZERO;
        self.for_each_lighting(&target, |density, kernel| {
            let reflectance = receiver.reflectance(-density.incoming);
            sum += reflectance * density.irradiance_at(kernel, target.normal);
        });
        sum
    }

    /// Radiance as in [`radiance`](Self::radiance), averaged over a pixel whose edges on the
    /// receiver are `pixel`, in metres.
    #[must_use]
    pub fn radiance_over(&self, receiver: &Receiver, pixel: [Vec3; 2]) -> Vec3 {
        let target = Target::of(receiver);
        let mut sum = Vec3::ZERO;
        self.for_each_over(&target, pixel, |blurred| {
            let reflectance = receiver.reflectance(-blurred.incoming);
            sum += reflectance * blurred.irradiance(target.position, target.normal);
        });
        sum
    }

    /// What became of the photons.
    #[must_use]
    pub fn stats(&self) -> GatherStats {
        self.stats
    }

    /// The least standard deviation of a footprint in any direction, in metres: an eighth of what
    /// footprints in the closest tenth have, so that what is widened stays finer than its
    /// neighbours, and at least a millionth of the box around all photons.
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

    /// How many pieces the footprints are cut into.
    #[must_use]
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Memory that it occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.tree.memory_bytes()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.footprints.capacity() * size_of::<Footprint>()
            + self.densities.capacity() * size_of::<Density>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::footprint::FootprintOptions;
    use crate::footprint_kernel::FootprintKernel;
    use crate::landed::landed;
    use approx::assert_relative_eq;
    use caustics_trace::Photon;
    use proptest::prelude::*;

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
        let photons = [landed(Vec3::ONE, [0.2 * Vec3::X, 0.4 * Vec3::Z])];
        for truncation in [1.0f32, 2.5, 3.0, 4.0] {
            let options = FootprintOptions {
                scale: 0.5,
                truncation,
                ..FootprintOptions::default()
            };
            let gather = FootprintGather::new(&photons, &options).unwrap();
            // What is cut off is shared out over the rest.
            let kept = 1.0 - (-0.5 * truncation * truncation).exp();
            let peak = 1.0 / (2.0 * std::f32::consts::PI * 0.1 * 0.2 * kept);
            let measured = gather.irradiance(Vec3::ONE, Vec3::Y);
            for channel in 0..3 {
                let expected = peak * photons[0].flux[channel];
                assert_relative_eq!(measured[channel], expected, max_relative = 1e-5);
            }
        }
    }

    #[test]
    fn a_point_that_is_no_number_is_dark() {
        let photons = [landed(Vec3::ZERO, [Vec3::X, Vec3::Z])];
        let gather = FootprintGather::new(&photons, &FootprintOptions::default()).unwrap();
        let nowhere = Vec3::splat(f32::NAN);
        assert_eq!(gather.irradiance(nowhere, Vec3::Y), Vec3::ZERO);
        assert_eq!(
            gather.irradiance_over(Vec3::ZERO, Vec3::Y, [nowhere; 2]),
            Vec3::ZERO
        );
        assert_eq!(
            gather.irradiance_over(Vec3::ZERO, Vec3::Y, [Vec3::MAX; 2]),
            Vec3::ZERO
        );
    }

    /// Footprints from a millimetre to ten metres, at any angle to each other and to the light.
    fn any_photon() -> impl Strategy<Value = Photon> {
        let unit = || {
            prop::array::uniform3(-1.0f32..1.0)
                .prop_map(Vec3::from)
                .prop_filter("too short", |v| v.length_squared() > 0.01)
                .prop_map(Vec3::normalize)
        };
        let exponent = || -3.0f32..1.0;
        (
            prop::array::uniform3(-1.0f32..1.0),
            unit(),
            unit(),
            (0.0f32..3.2, 0.0f32..3.2),
            (exponent(), exponent()),
        )
            .prop_map(|(position, normal, incoming, (one, other), (a, b))| {
                let (tangent, bitangent) = normal.any_orthonormal_pair();
                let axis = |angle: f32, exponent: f32| {
                    10.0f32.powf(exponent) * (angle.cos() * tangent + angle.sin() * bitangent)
                };
                Photon {
                    position: position.into(),
                    incoming: if incoming.dot(normal) < 0.0 {
                        incoming
                    } else {
                        -incoming
                    },
                    flux: Vec3::new(3.0, 2.0, 1.0),
                    normal,
                    axes: [axis(one, a), axis(other, b)],
                    object: 0,
                    events: 1,
                    source: caustics_trace::FootprintSource::Differential,
                    coverage: caustics_trace::Coverage::Cell,
                }
            })
    }

    proptest! {
        /// The tree and the pieces find each footprint that lights a point, once.
        #[test]
        fn every_point_is_lit_by_the_sum_of_all_footprints(
            photons in prop::collection::vec(any_photon(), 1..60),
            kernel in prop::sample::select(&FootprintKernel::ALL[..]),
            truncation in 1.0f32..=4.0,
        ) {
            let options = FootprintOptions { kernel, truncation, ..FootprintOptions::default() };
            let gather = FootprintGather::new(&photons, &options).unwrap();
            prop_assert_eq!(gather.len(), photons.len());
            let pixel = [0.05 * Vec3::X, Vec3::new(0.0, 0.02, 0.05)];
            for photon in &photons {
                let [a, b] = photon.axes;
                for aside in [Vec3::ZERO, a, b - 0.3 * a, 0.7 * b + 0.01 * photon.normal] {
                    let (position, normal) = (photon.position + aside, photon.normal);
                    let (mut alone, mut blurred) = (Vec3::ZERO, Vec3::ZERO);
                    for density in &gather.densities {
                        if density.gate().admits(density, position, normal, None) {
                            alone += density.irradiance(position, normal);
                        }
                        let density = density.blurred(&pixel).unwrap();
                        if density.gate().admits(&density, position, normal, None) {
                            blurred += density.irradiance(position, normal);
                        }
                    }
                    let found = gather.irradiance(position, normal);
                    prop_assert!(found.abs_diff_eq(alone, 1e-5 * alone.x), "{found} {alone}");
                    let found = gather.irradiance_over(position, normal, pixel);
                    prop_assert!(found.abs_diff_eq(blurred, 1e-5 * blurred.x), "{found} {blurred}");
                }
            }
        }
    }
}
