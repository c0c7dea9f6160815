use caustics_accel::BoxTree;
use caustics_geometry::Aabb;
use caustics_trace::Photon;
use glam::Vec3;

use crate::density::{Adjustment, Density};
use crate::error::RenderError;
use crate::extent_bounds::ExtentBounds;
use crate::eye::Receiver;
use crate::footprint::FootprintOptions;
use crate::footprint_piece::{Cutting, Footprint, Piece, Target};
use crate::parallel;
use crate::thinning::thin_wide;
use crate::truncated_kernel::Kernels;

/// The area of boxes that one more piece must save, relative to a photon's share of the surface of
/// the box around all photons.
///
/// Of a quarter of it, the single sphere and the cognac glass got half as many pieces again, and
/// searches tried 4 to 20 % fewer footprints; of infinity, three to four times as many.
const PIECE_WORTH: f32 = 16.0;

/// Footprints that one task prepares.
const CHUNK: usize = 4096;

/// What became of the photons that a [`FootprintGather`] was built from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatherStats {
    /// Photons that can be found.
    pub stored: u64,
    /// Of these, photons whose footprint was narrower than [`FootprintGather::least_extent`] and
    /// was widened to it: a point or a line has no area to divide the flux by.
    pub widened: u64,
    /// Of these, photons whose footprint was longer than a thousand times the box around all
    /// photons and was shortened to that.
    pub shortened: u64,
    /// Photons left out of the many that wide footprints come from, their flux given to others: see
    /// [`FootprintOptions::max_overlaps`].
    pub merged: u64,
    /// Photons left out because their flux over their area is more than a number holds.
    pub invalid: u64,
}

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
/// [`FootprintOptions::max_overlaps`] limits. Long ones that lie askew
/// would cost more, since the boxes around them are mostly empty: they are cut into up to 256
/// pieces, lengthwise and by their height above the receiver, as long as that saves enough. Of
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
    /// Prepares the photons' footprints and builds a tree over them, in parallel with the feature
    /// `parallel`; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// Options out of range, a photon with a number that is not finite, or more pieces of
    /// footprints than [`BoxTree::MAX_BOXES`].
    pub fn new(photons: &[Photon], options: &FootprintOptions) -> Result<Self, RenderError> {
        options.validate()?;
        if let Some(photon) = photons.iter().position(|photon| !is_finite(photon)) {
            return Err(RenderError::NonFinitePhoton { photon });
        }
        let given = photons.len() as u64;
        let photons = thin_wide(photons, options);
        let around = Aabb::from_points(photons.iter().map(|photon| photon.position));
        let diagonal = if around.is_empty() {
            0.0
        } else {
            around.diagonal().length()
        };
        let surface = if around.is_empty() {
            0.0
        } else {
            around.surface_area()
        };
        let extents = ExtentBounds::of(&photons, options, diagonal);
        let kernels = Kernels::of(options);

        let mut stats = GatherStats {
            merged: given - photons.len() as u64,
            ..GatherStats::default()
        };
        let mut densities = Vec::with_capacity(photons.len());
        let prepared = parallel::of_all(&photons, CHUNK, |photon| {
            Density::within(photon, &extents, options, kernels.get(photon.coverage))
        });
        for one in prepared {
            let Some((density, Adjustment { widened, shortened })) = one else {
                stats.invalid += 1;
                continue;
            };
            stats.stored += 1;
            stats.widened += u64::from(widened);
            stats.shortened += u64::from(shortened);
            densities.push(density);
        }

        let cutting = Cutting {
            scene: diagonal,
            worth: PIECE_WORTH * surface / photons.len().max(1) as f32,
        };
        let (pieces, boxes) = cut(&densities, &cutting);
        let (tree, order) = BoxTree::new(&boxes)?;
        let (pieces, densities) = in_order(&order, &pieces, &densities);
        Ok(Self {
            tree,
            pieces,
            footprints: densities.iter().map(Footprint::new).collect(),
            densities,
            kernels,
            blur_reach: kernels.blur_reach(),
            least_extent: extents.least,
            stats,
        })
    }

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

/// All footprints' pieces, in their order, and the boxes around them.
fn cut(densities: &[Density], cutting: &Cutting) -> (Vec<Piece>, Vec<Aabb>) {
    let chunks: Vec<&[Density]> = densities.chunks(CHUNK).collect();
    let parts = parallel::made(chunks.len() as u32, 1, |number| {
        let (chunk, first) = (chunks[number as usize], number * CHUNK as u32);
        let mut part = Vec::with_capacity(2 * chunk.len());
        for (density, index) in chunk.iter().zip(first..) {
            cutting.cut(index, density, |piece, bounds| part.push((piece, bounds)));
        }
        part
    });
    parts.into_iter().flatten().unzip()
}

/// Puts the pieces into an order, and the densities into the order in which the pieces need them.
fn in_order(order: &[u32], pieces: &[Piece], densities: &[Density]) -> (Vec<Piece>, Vec<Density>) {
    let mut place_of = vec![u32::MAX; densities.len()];
    let mut in_order = Vec::with_capacity(densities.len());
    let pieces = order
        .iter()
        .map(|&index| {
            let piece = pieces[index as usize];
            let place = &mut place_of[piece.footprint as usize];
            if *place == u32::MAX {
                *place = in_order.len() as u32;
                in_order.push(densities[piece.footprint as usize]);
            }
            Piece {
                footprint: *place,
                ..piece
            }
        })
        .collect();
    (pieces, in_order)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::footprint_kernel::FootprintKernel;
    use crate::landed::landed;
    use approx::assert_relative_eq;
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
    fn numbers_that_are_not_finite_are_named() {
        let good = landed(Vec3::ZERO, [Vec3::X, Vec3::Z]);
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
    fn what_cannot_be_spread_is_counted() {
        let point = landed(Vec3::ZERO, [Vec3::ZERO; 2]);
        let line = landed(Vec3::X, [Vec3::X, Vec3::ZERO]);
        let endless = landed(Vec3::Z, [1e30 * Vec3::X, 1e30 * Vec3::Z]);
        let blinding = Photon {
            flux: Vec3::MAX,
            ..point
        };
        let photons = [point, line, endless, blinding];
        for kernel in FootprintKernel::ALL {
            let options = FootprintOptions {
                kernel,
                ..FootprintOptions::default()
            };
            let gather = FootprintGather::new(&photons, &options).unwrap();
            let expected = GatherStats {
                merged: 0,
                stored: 3,
                widened: 2,
                shortened: 1,
                invalid: 1,
            };
            assert_eq!(gather.stats(), expected, "{kernel:?}");
            let lit = gather.irradiance(Vec3::ZERO, Vec3::Y);
            assert!(
                lit.min_element() > 0.0 && lit.is_finite(),
                "{kernel:?}: {lit}"
            );
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

    #[cfg(feature = "parallel")]
    #[test]
    fn the_number_of_threads_does_not_matter() {
        let photons: Vec<Photon> = (0..3 * CHUNK)
            .map(|index| {
                let (sine, cosine) = (index as f32).sin_cos();
                let place = Vec3::new(cosine, 0.0, sine) * (index as f32 * 1e-4);
                let long = (1 + index % 50) as f32 * Vec3::new(sine, 0.0, cosine);
                landed(place, [0.01 * long, 0.01 * Vec3::new(-cosine, 0.0, sine)])
            })
            .collect();
        let lit_with = |threads: usize| -> Vec<Vec3> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let gather = pool
                .unwrap()
                .install(|| FootprintGather::new(&photons, &FootprintOptions::default()))
                .unwrap();
            assert!(gather.pieces() > gather.len());
            let places = photons.iter().step_by(10);
            places
                .map(|at| gather.irradiance(at.position, Vec3::Y))
                .collect()
        };
        assert_eq!(lit_with(1), lit_with(4));
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
