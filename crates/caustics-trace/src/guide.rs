use caustics_accel::Intersect;
use caustics_sampling::warp::DensityTable;
use caustics_sampling::{PointSet, Sequence};
use caustics_scene::World;

use crate::casters::Casters;
use crate::domain::EmissionDomain;
use crate::emission_batch::EmissionBatch;
use crate::options::TraceOptions;
use crate::parallel;
use crate::photon::Photon;

/// One of so many photons may go ahead.
const PILOT_PART: u32 = 12;

/// The most that go ahead of one emitter's photons, along each axis.
const MAX_SIDE: u32 = 64;

/// With fewer along each axis nothing is known.
const LEAST_SIDE: u32 = 8;

/// Pilots along each axis of a cell of the table.
const SIDE_OF_CELL: u32 = 2;

/// Footprints that are wider than this part of all count as wide as that one: what lands far away, or at a
/// grazing angle, is not worth so many photons.
const WIDEST: f64 = 0.9;

/// Irradiance that counts for half, relative to the mean of all footprints.
const DIM: f32 = 0.3;

/// The least density, relative to the mean.
const LEAST_DENSITY: f32 = 0.3;

/// How many times as dense one node of the table may be as the next.
const MAX_STEP: f32 = 1.75;

/// Where a pilot's light landed.
struct Landing {
    /// The square of its footprint's longer axis, in m².
    width: f32,
    /// In watts, all channels together.
    flux: f32,
    /// Flux over the area of the footprint, in W/m².
    irradiance: f32,
}

impl Landing {
    fn of(photon: &Photon) -> Option<Self> {
        let [a, b] = photon.axes;
        let flux = photon.flux.element_sum();
        let landing = Self {
            width: a.length_squared().max(b.length_squared()),
            flux,
            irradiance: flux / a.cross(b).length(),
        };
        (landing.width.is_finite() && landing.irradiance.is_finite()).then_some(landing)
    }
}

/// Whether an emitter's photons are guided, as far as there are enough of them. An environment's are chosen by
/// its picture.
pub(crate) fn is_wanted(batch: &EmissionBatch, options: &TraceOptions) -> bool {
    let is_sky = matches!(batch.emitter().domain(), EmissionDomain::Sky { .. });
    options.guide_emission && options.differentials && batch.emitter().caster().is_some() && !is_sky
}

/// How dense the points of an emitter's photons should be over its unit square; `None` where that is not
/// to be found out.
///
/// Points that are evenly spread light some places by thousands of photons a pixel and leave others,
/// such as what a ball's rim throws far around, to one photon for hundreds. With n photons where
/// there would be one, a footprint of area A covers A / n, and what the light does within it is lost.
/// With an error in proportion to the area that a footprint covers, or any other power of it, the
/// sum of all errors for a given number of photons is least where footprints are equally large: n in
/// proportion to A. A few pilots tell A, of which the longer axis' square is taken, since thin
/// footprints cannot be cut along their length alone. Light that is dim beside the mean counts less, as
/// it does in a relative error.
///
/// The density is the root of that, by measurement: where the pilots are right it gains less, and where they
/// are wrong, as at folds, it loses less. It changes slowly, so that the cells of the lattice stay about as
/// large as their neighbours and their footprints side by side.
pub(crate) fn density<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    casters: &Casters,
    batch: &EmissionBatch,
    options: &TraceOptions,
) -> Option<DensityTable> {
    let side = f64::from(batch.share / PILOT_PART).sqrt() as u32;
    let side = side.min(MAX_SIDE) / SIDE_OF_CELL * SIDE_OF_CELL;
    if side < LEAST_SIDE || !is_wanted(batch, options) {
        return None;
    }
    let landings = if batch.emitter().dimensions() == 2 {
        landings::<I, 2>(world, intersect, casters, batch, side, options)
    } else {
        landings::<I, 4>(world, intersect, casters, batch, side, options)
    };
    table(side, &landings)
}

/// Where the light of each pilot landed, of as many rows of as many pilots as `side` says.
fn landings<I: Intersect + ?Sized, const N: usize>(
    world: &World,
    intersect: &I,
    casters: &Casters,
    batch: &EmissionBatch,
    side: u32,
    options: &TraceOptions,
) -> Vec<Vec<Landing>> {
    let points = PointSet::new(Sequence::Grid, side * side, 0);
    let of_row = |row: u32| -> Vec<Vec<Landing>> {
        let mut tracer = batch.pilot_tracer::<I, N>(world, intersect, casters, options);
        let of_pilot = |index: u32| {
            tracer.photons.clear();
            batch.send_pilot(&mut tracer, world, &points, index);
            tracer.photons.iter().filter_map(Landing::of).collect()
        };
        (row * side..(row + 1) * side).map(of_pilot).collect()
    };
    let rows = parallel::made(side, of_row);
    rows.into_iter().flatten().collect()
}

fn table(side: u32, landings: &[Vec<Landing>]) -> Option<DensityTable> {
    let mut widths: Vec<f32> = landings.iter().flatten().map(|it| it.width).collect();
    let last = widths.len().checked_sub(1)?;
    let (_, &mut widest, _) =
        widths.select_nth_unstable_by((last as f64 * WIDEST) as usize, f32::total_cmp);
    let covered: f32 = widths.iter().map(|it| it.min(widest)).sum();
    let flux: f32 = landings.iter().flatten().map(|it| it.flux).sum();
    let dim = DIM * flux / covered;
    let wanted = |landing: &Landing| {
        let width = landing.width.min(widest);
        let brightness = landing.irradiance * landing.irradiance;
        brightness / (brightness + dim * dim) * (width * width)
    };
    let cells = side / SIDE_OF_CELL;
    let of_cell = |cell: u32| {
        let first = (cell / cells * side + cell % cells) * SIDE_OF_CELL;
        let pilots = (0..SIDE_OF_CELL * SIDE_OF_CELL)
            .map(|it| first + it / SIDE_OF_CELL * side + it % SIDE_OF_CELL);
        let sum: f32 = pilots
            .flat_map(|it| &landings[it as usize])
            .map(wanted)
            .sum();
        sum.sqrt()
    };
    let of_cells: Vec<f32> = (0..cells * cells).map(of_cell).collect();
    let mut nodes = smoothed(cells as i32, &of_cells);
    nodes.iter_mut().for_each(|node| *node = node.sqrt());
    let mean = nodes.iter().sum::<f32>() / nodes.len() as f32;
    for node in &mut nodes {
        *node = node.max(LEAST_DENSITY * mean);
    }
    limit_steps(cells as usize + 1, &mut nodes);
    DensityTable::new(cells, &nodes).ok()
}

/// Values at the corners of cells from values in their middles: of four by four cells with binomial weights,
/// or as many of them as there are.
fn smoothed(cells: i32, values: &[f32]) -> Vec<f32> {
    const WEIGHTS: [f32; 4] = [1.0, 3.0, 3.0, 1.0];
    let node = |row: i32, column: i32| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (down, by_row) in (row - 2..).zip(WEIGHTS) {
            for (along, by_column) in (column - 2..).zip(WEIGHTS) {
                if (0..cells).contains(&down) && (0..cells).contains(&along) {
                    sum += by_row * by_column * values[(down * cells + along) as usize];
                    weights += by_row * by_column;
                }
            }
        }
        sum / weights
    };
    (0..=cells)
        .flat_map(|row| (0..=cells).map(move |column| (row, column)))
        .map(|(row, column)| node(row, column))
        .collect()
}

/// Raises values of a square until none is less than the one beside it over [`MAX_STEP`].
fn limit_steps(width: usize, values: &mut [f32]) {
    let count = values.len();
    let mut raise = |at: usize, by: usize| values[at] = values[at].max(values[by] / MAX_STEP);
    // Two passes do: a way to the right or down is taken in the first, its rest up or left in the second.
    for at in 0..count {
        if at % width > 0 {
            raise(at, at - 1);
        }
        if at >= width {
            raise(at, at - width);
        }
    }
    for at in (0..count).rev() {
        if at % width + 1 < width {
            raise(at, at + 1);
        }
        if at + width < count {
            raise(at, at + width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 16;

    fn landing(width: f32, flux: f32) -> Landing {
        Landing {
            width,
            flux,
            irradiance: flux / width,
        }
    }

    /// A table where light of the left half lands as that, and of the right half as that.
    fn halves(left: (f32, f32), right: (f32, f32)) -> DensityTable {
        let landings: Vec<_> = (0..SIDE * SIDE)
            .map(|it| {
                let (width, flux) = if it % SIDE < SIDE / 2 { left } else { right };
                vec![landing(width, flux)]
            })
            .collect();
        table(SIDE, &landings).unwrap()
    }

    /// How many times as dense the middle of the right half is as that of the left.
    fn ratio(table: &DensityTable) -> f32 {
        let at = |x: f32| table.density(glam::Vec2::new(x, 0.5));
        at(0.75) / at(0.25)
    }

    #[test]
    fn wide_footprints_ask_for_more_photons_and_dim_ones_for_fewer() {
        // As bright, and four times as large: twice as many, by the root.
        let found = ratio(&halves((1.0, 1.0), (4.0, 4.0)));
        assert!((found - 2.0).abs() < 0.05, "{found}");
        // As large, and dim.
        let found = ratio(&halves((1.0, 1.0), (1.0, 0.01)));
        assert!(found < 0.5, "{found}");
        let found = ratio(&halves((1.0, 1.0), (1.0, 1.0)));
        assert!((found - 1.0).abs() < 1e-6, "{found}");
    }

    #[test]
    fn densities_have_a_floor_and_no_steps() {
        let (left, right) = ((1e-6, 1.0), (1.0, 1.0));
        let table = halves(left, right);
        let width = table.resolution() as usize + 1;
        let nodes = table.densities();
        let mean = nodes.iter().sum::<f32>() / nodes.len() as f32;
        for (at, &node) in nodes.iter().enumerate() {
            // What is raised for the sake of even steps raises the mean.
            assert!(node > 0.8 * LEAST_DENSITY * mean, "{node} of {mean}");
            let beside = [(at % width > 0).then(|| at - 1), at.checked_sub(width)];
            for other in beside.into_iter().flatten() {
                let step = (node / nodes[other]).max(nodes[other] / node);
                assert!(step < 1.0001 * MAX_STEP, "{step}");
            }
        }
        let most = nodes.iter().copied().fold(0.0, f32::max);
        assert!(most > 1.2 * mean, "{most} of {mean}");
    }

    #[test]
    fn where_nothing_lands_nothing_is_known() {
        let none: Vec<_> = (0..SIDE * SIDE).map(|_| Vec::new()).collect();
        assert_eq!(table(SIDE, &none), None);
        let dark: Vec<_> = (0..SIDE * SIDE).map(|_| vec![landing(0.0, 0.0)]).collect();
        assert_eq!(table(SIDE, &dark), None);
    }
}
