use caustics_accel::BoxTree;
use caustics_geometry::Aabb;
use caustics_trace::Photon;

use super::FootprintGather;
use crate::density::{Adjustment, Density};
use crate::error::RenderError;
use crate::extent_bounds::ExtentBounds;
use crate::footprint::FootprintOptions;
use crate::footprint_piece::{Cutting, Footprint, Piece};
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
    use glam::Vec3;

    use super::*;
    use crate::footprint_kernel::FootprintKernel;
    use crate::landed::landed;

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
}
