use std::borrow::Cow;
use std::f32::consts::PI;

use caustics_trace::Photon;

use crate::footprint::FootprintOptions;
use crate::truncated_kernel::Kernels;

/// Photons from which the size of the scene is taken.
const SAMPLES: usize = 8192;

/// Bins of the histogram of areas for each doubling.
const BINS_PER_OCTAVE: i32 = 4;

/// Octaves of the histogram below the area of the whole scene.
const OCTAVES: i32 = 48;

/// Photons of which wide footprints are few enough that a point of the scene lies in about
/// [`FootprintOptions::max_overlaps`] of them at most.
///
/// Chains of inner reflections spread a little light over the whole scene, from so many photons
/// that each point would have to look at thousands. Of the footprints that are wider than a common
/// area, found so that the mean comes out, every one stands for several: along the order of the
/// photons, which is that of the lattice, each survives in proportion to its area's inverse, with
/// as much more flux (systematic sampling). No flux is lost but the last photon's part.
pub(crate) fn thin_wide<'a>(
    photons: &'a [Photon],
    options: &FootprintOptions,
) -> Cow<'a, [Photon]> {
    let scene = busy_area(photons);
    let budget = options.max_overlaps * scene;
    if !(scene > 0.0 && budget.is_finite()) {
        return Cow::Borrowed(photons);
    }
    let kernels = Kernels::of(options);
    let area = |photon: &Photon| {
        let reach = options.scale * kernels.get(photon.coverage).reach();
        let [a, b] = photon.axes;
        let squared = a.length_squared() + b.length_squared();
        (PI * reach * reach * squared).min(scene)
    };
    let limit = common_area(photons.iter().map(area), scene, budget);
    if limit >= scene {
        return Cow::Borrowed(photons);
    }
    let mut due = 0.5;
    photons
        .iter()
        .filter_map(|photon| {
            let survival = (limit / area(photon)).min(1.0);
            due += survival;
            if due < 1.0 {
                return None;
            }
            due -= 1.0;
            Some(Photon {
                flux: photon.flux / survival,
                ..*photon
            })
        })
        .collect()
}

/// The largest face of the box around the middle of the photons: stray ones, far away, do not make
/// a scene large.
fn busy_area(photons: &[Photon]) -> f32 {
    let stride = photons.len().div_ceil(SAMPLES).max(1);
    let size = [0, 1, 2].map(|axis| {
        let mut places: Vec<f32> = photons
            .iter()
            .step_by(stride)
            .map(|photon| photon.position[axis])
            .collect();
        places.sort_by(f32::total_cmp);
        let at = |part: usize| places.get(places.len() * part / 10).copied().unwrap_or(0.0);
        at(9) - at(1)
    });
    (size[0] * size[1])
        .max(size[1] * size[2])
        .max(size[2] * size[0])
}

/// The largest area to which all larger ones may be cut so that their sum is at most `budget`.
fn common_area(areas: impl Iterator<Item = f32>, scene: f32, budget: f32) -> f32 {
    let bins = (BINS_PER_OCTAVE * OCTAVES) as usize;
    let mut counts = vec![0u64; bins];
    let mut sums = vec![0.0f64; bins];
    for area in areas {
        let below = ((area / scene).log2() * BINS_PER_OCTAVE as f32).floor();
        let bin = (below as i32 + bins as i32).clamp(0, bins as i32 - 1) as usize;
        counts[bin] += 1;
        sums[bin] += f64::from(area);
    }
    let mut smaller: f64 = sums.iter().sum();
    let mut wider = 0u64;
    for bin in (0..bins).rev() {
        let octaves = (bin as i32 + 1 - bins as i32) as f32 / BINS_PER_OCTAVE as f32;
        let area = scene * octaves.exp2();
        // Everything above this bin cut to its upper end.
        if smaller + wider as f64 * f64::from(area) <= f64::from(budget) {
            return area;
        }
        smaller -= sums[bin];
        wider += counts[bin];
    }
    (f64::from(budget) / wider.max(1) as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn photons() -> Vec<Photon> {
        (0..10_000u32)
            .map(|index| Photon {
                position: Vec3::new((index % 100) as f32, 0.0, (index / 100) as f32),
                incoming: Vec3::NEG_Y,
                flux: Vec3::splat(1.0),
                normal: Vec3::Y,
                axes: if index % 2 == 0 {
                    [Vec3::X, Vec3::Z]
                } else {
                    [40.0 * Vec3::X, 40.0 * Vec3::Z]
                },
                object: 0,
                events: 1,
                source: caustics_trace::FootprintSource::Differential,
                coverage: caustics_trace::Coverage::Cell,
            })
            .collect()
    }

    #[test]
    fn wide_footprints_become_few_and_keep_their_flux() {
        let all = photons();
        let options = FootprintOptions {
            max_overlaps: 100.0,
            ..FootprintOptions::default()
        };
        let thinned = thin_wide(&all, &options);
        let is_wide = |photon: &&Photon| photon.axes[0].x > 1.0;
        // Narrow footprints stay as they are.
        assert_eq!(thinned.iter().filter(|it| !is_wide(it)).count(), 5000);
        assert!(
            thinned
                .iter()
                .filter(|it| !is_wide(it))
                .all(|it| it.flux.x == 1.0)
        );
        let wide = thinned.iter().filter(is_wide).count();
        assert!((20..200).contains(&wide), "{wide}");
        let flux: f32 = thinned.iter().map(|photon| photon.flux.x).sum();
        let largest = thinned
            .iter()
            .map(|photon| photon.flux.x)
            .fold(0.0, f32::max);
        assert!((flux - 10_000.0).abs() <= largest, "{flux}");
    }

    #[test]
    fn with_room_enough_nothing_changes() {
        let all = photons();
        for max_overlaps in [1e6, f32::INFINITY] {
            let options = FootprintOptions {
                max_overlaps,
                ..FootprintOptions::default()
            };
            assert_eq!(*thin_wide(&all, &options), all);
            assert_eq!(*thin_wide(&[], &options), []);
        }
    }
}
