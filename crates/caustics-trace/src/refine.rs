use std::ops::Range;

use caustics_accel::Intersect;
use caustics_sampling::CounterRng;
use glam::{IVec2, UVec2, Vec2, Vec3};

use crate::emission::EmissionSample;
use crate::ledger::EnergyLedger;
use crate::photon::{Photon, PhotonMap};
use crate::projection_map::ProjectionMap;
use crate::trace::Batch;
use crate::wave::{WAVE, Wave};

/// The part of all photons that the first, even lattice gets.
const FIRST_SHARE: f64 = 0.5;

/// Sub-cells along each side of a cell that is divided. No more: where cells of two sizes meet, the
/// sum of their footprints is uneven, and the more so the more they differ.
const DIVISION: u32 = 2;

/// The part of the photons left that a level may use, so that the next has some too.
const LEVEL_SHARE: f64 = 0.6;

/// Photons with less than this part of their cell's emission do not have it divided.
const SIGNIFICANT: f32 = 0.04;

/// How far from its neighbour's prediction a photon may land, in the lengths of their axes, before
/// the map between them is too curved for a first derivative.
const MISMATCH: f32 = 0.5;

/// Cells that one task traces.
const CHUNK: usize = 512;

/// Photons emitted on a lattice that is divided where neighbours take other paths or land where
/// their differentials do not say: at the edges of caustics, at folds and at silhouettes.
///
/// A cell whose photon's neighbour meets other surfaces stands for light that its one photon
/// cannot describe. Such cells are traced again as smaller ones, and again, until the footprints
/// are as small as the detail asked for or the photons are used up; where there are more of them
/// than photons, those that matter most come first. Everywhere else the first lattice is enough.
pub(crate) fn trace_refined<I: Intersect + ?Sized>(
    batch: &Batch<'_, I>,
    levels: u32,
    detail: f32,
    progress: &(dyn Fn(u32) + Sync),
) -> PhotonMap {
    let budget = batch.planned.count();
    let mut map = PhotonMap::default();
    let map_of_caster = batch.planned.map();
    // Of a lattice with a projection map only the cells are traced that may reach the caster.
    let coverage = map_of_caster.map_or(1.0, ProjectionMap::coverage);
    let resolution = first_resolution(budget, coverage, batch.planned.emitter().aspect());
    let cells = (0..resolution.y).flat_map(|y| (0..resolution.x).map(move |x| UVec2::new(x, y)));
    let size = resolution.as_vec2().recip();
    let cells = cells.filter(|cell| {
        map_of_caster
            .is_none_or(|map| map.meets(cell.as_vec2() * size, (cell + 1).as_vec2() * size))
    });
    let mut level = Level::trace(batch, resolution, cells.collect());
    let mut spent = level.cells.len() as u32;
    progress(spent);
    for number in 0..levels {
        let flagged = level.flagged(detail);
        let is_last = number + 1 == levels;
        let left = budget.saturating_sub(spent);
        let share = if is_last { 1.0 } else { LEVEL_SHARE };
        let room = (share * f64::from(left / (DIVISION * DIVISION))) as usize;
        let divided = level.with_rings(flagged, room);
        if divided.is_empty() {
            break;
        }
        let next = level.divide(batch, &divided);
        level.keep_others(batch, &divided, &mut map);
        level = next;
        let traced = level.cells.len() as u32;
        spent += traced;
        progress(traced);
    }
    level.keep_others(batch, &[], &mut map);
    progress(budget.saturating_sub(spent));
    map
}

/// Columns and rows of cells as square as can be, in a domain `aspect` times as long as wide of which
/// the part `coverage` is traced.
fn first_resolution(budget: u32, coverage: f32, aspect: f32) -> UVec2 {
    let most = f64::from(u32::MAX / 256);
    let cells = (f64::from(budget) * FIRST_SHARE / f64::from(coverage)).clamp(1.0, most);
    let columns = (cells * f64::from(aspect)).sqrt().round().clamp(1.0, cells);
    let rows = (cells / columns).floor().max(1.0);
    UVec2::new(columns as u32, rows as u32)
}

/// The cells of one size, and their photons.
struct Level {
    /// Columns and rows of the whole domain at this size.
    resolution: UVec2,
    cells: Vec<UVec2>,
    photons: Vec<Photon>,
    /// For each photon, what its path met.
    paths: Vec<u32>,
    /// For each cell, where its photons start; one more than there are cells.
    starts: Vec<usize>,
    ledger: EnergyLedger,
    /// For each place of a coarser lattice, the first of the cells that divide it.
    blocks: Blocks,
}

/// Where the cells of a level lie: whole blocks of `division` by `division`, one for each cell of
/// the level before that was divided.
struct Blocks {
    columns: u32,
    division: u32,
    first: Vec<u32>,
}

/// The steps to a cell itself and to its eight neighbours.
const NEIGHBOURHOOD: [(i32, i32); 9] = [
    (-1, -1),
    (0, -1),
    (1, -1),
    (-1, 0),
    (0, 0),
    (1, 0),
    (-1, 1),
    (0, 1),
    (1, 1),
];

/// No block.
const NONE: u32 = u32::MAX;

impl Level {
    fn trace<I: Intersect + ?Sized>(
        batch: &Batch<'_, I>,
        resolution: UVec2,
        cells: Vec<UVec2>,
    ) -> Self {
        let columns = resolution.x;
        let mut first = vec![NONE; (resolution.x * resolution.y) as usize];
        for (number, cell) in (0u32..).zip(&cells) {
            first[(cell.y * columns + cell.x) as usize] = number;
        }
        let blocks = Blocks {
            columns,
            division: 1,
            first,
        };
        Self::trace_blocks(batch, resolution, cells, blocks)
    }

    fn trace_blocks<I: Intersect + ?Sized>(
        batch: &Batch<'_, I>,
        resolution: UVec2,
        cells: Vec<UVec2>,
        blocks: Blocks,
    ) -> Self {
        let run = |cells: &[UVec2]| trace_cells(batch, resolution, cells);
        #[cfg(feature = "parallel")]
        let parts: Vec<Part> = {
            use rayon::prelude::*;
            cells.par_chunks(CHUNK).map(run).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let parts: Vec<Part> = cells.chunks(CHUNK).map(run).collect();

        let mut level = Self {
            resolution,
            photons: Vec::with_capacity(parts.iter().map(|part| part.photons.len()).sum()),
            paths: Vec::new(),
            starts: Vec::with_capacity(cells.len() + 1),
            cells,
            ledger: EnergyLedger::default(),
            blocks,
        };
        for mut part in parts {
            let base = level.photons.len();
            level
                .starts
                .extend(part.starts.iter().map(|start| base + start));
            level.photons.append(&mut part.photons);
            level.paths.append(&mut part.paths);
            level.ledger.merge(&part.ledger);
        }
        level.starts.push(level.photons.len());
        level
    }

    fn photons_of(&self, cell: usize) -> Range<usize> {
        self.starts[cell]..self.starts[cell + 1]
    }

    /// The cell at a place, if this level has it.
    fn cell_at(&self, place: UVec2) -> Option<usize> {
        let division = self.blocks.division;
        let block = place / division;
        let first = *self
            .blocks
            .first
            .get((block.y * self.blocks.columns + block.x) as usize)?;
        let within = place % division;
        (first != NONE).then(|| (first + within.y * division + within.x) as usize)
    }

    /// The cells to divide, with the flux that asks for it.
    fn flagged(&self, detail: f32) -> Vec<(usize, f32)> {
        let mut scores = vec![0.0f32; self.cells.len()];
        for (cell, &place) in self.cells.iter().enumerate() {
            for (axis, step) in [UVec2::X, UVec2::Y].into_iter().enumerate() {
                let next = place + step;
                if next.x >= self.resolution.x || next.y >= self.resolution.y {
                    continue;
                }
                let Some(neighbour) = self.cell_at(next) else {
                    continue;
                };
                let score = self.mismatch(cell, neighbour, axis, 1.0, detail)
                    + self.mismatch(neighbour, cell, axis, -1.0, detail);
                scores[cell] += score;
                scores[neighbour] += score;
            }
        }
        scores
            .into_iter()
            .enumerate()
            .filter(|&(_, score)| score > 0.0)
            .collect()
    }

    /// The flagged cells and all around them, in their order, as many as there is room for: those
    /// with the highest scores first.
    ///
    /// The ring keeps an edge one cell away from where the lattice changes, see
    /// [`spread`](Self::spread).
    fn with_rings(&self, mut flagged: Vec<(usize, f32)>, room: usize) -> Vec<usize> {
        flagged.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut is_divided = vec![false; self.cells.len()];
        let mut count = 0;
        for (cell, _) in flagged {
            let around: Vec<usize> = self.around(cell).filter(|&it| !is_divided[it]).collect();
            if count + around.len() > room {
                break;
            }
            count += around.len();
            for it in around {
                is_divided[it] = true;
            }
        }
        (0..self.cells.len())
            .filter(|&cell| is_divided[cell])
            .collect()
    }

    /// A cell and those of its eight neighbours that this level has.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> {
        let place = self.cells[cell].as_ivec2();
        NEIGHBOURHOOD.into_iter().filter_map(move |(x, y)| {
            let at = place + IVec2::new(x, y);
            let inside = at.cmpge(IVec2::ZERO).all() && at.as_uvec2().cmplt(self.resolution).all();
            inside.then(|| self.cell_at(at.as_uvec2())).flatten()
        })
    }

    /// How many times wider than its cell a photon is spread.
    ///
    /// Footprints of one width sum to an even light. Where cells of two sizes meet they do not:
    /// the wide ones reach in among the narrow ones, which do not reach out as far. So the width
    /// goes from the one to the other in steps, over the ring of cells that need no division
    /// themselves and can do with a wider footprint.
    fn spread(&self, cell: usize) -> f32 {
        let division = self.blocks.division;
        if division == 1 {
            return 1.0;
        }
        let place = self.cells[cell];
        let block = (place / division).as_ivec2();
        let blocks = (self.resolution / division).as_ivec2();
        let within = ((place % division).as_vec2() + 0.5) / division as f32;
        let mut nearest = 1.0f32;
        for (x, y) in NEIGHBOURHOOD {
            let at = block + IVec2::new(x, y);
            let inside = at.cmpge(IVec2::ZERO).all() && at.cmplt(blocks).all();
            if inside && self.blocks.first[(at.y * blocks.x + at.x) as usize] == NONE {
                let along = |step: i32, within: f32| match step {
                    0 => 0.0,
                    1 => 1.0 - within,
                    _ => within,
                };
                nearest = nearest.min(along(x, within.x).max(along(y, within.y)));
            }
        }
        let division = division as f32;
        division - (division - 1.0) * nearest
    }

    /// The flux of a cell's photons that their neighbour in a direction does not continue, times
    /// how wide they are spread.
    fn mismatch(&self, cell: usize, neighbour: usize, axis: usize, sign: f32, detail: f32) -> f32 {
        let own = self.photons_of(cell);
        let brightest = self.photons[own.clone()]
            .iter()
            .map(|it| it.flux.max_element())
            .fold(0.0, f32::max);
        let mut score = 0.0;
        for index in own {
            let photon = &self.photons[index];
            let flux = photon.flux.max_element();
            let [a, b] = photon.axes.map(Vec3::length);
            if flux < SIGNIFICANT * brightest || a.max(b) < detail {
                continue;
            }
            let path = self.paths[index];
            let continued = self.photons_of(neighbour).any(|other| {
                self.paths[other] == path
                    && self.photons[other].object == photon.object
                    && lands_as_predicted(photon, &self.photons[other], axis, sign, detail)
            });
            if !continued {
                score += flux * (a + b);
            }
        }
        score
    }

    /// Traces the sub-cells of some cells.
    fn divide<I: Intersect + ?Sized>(&self, batch: &Batch<'_, I>, divided: &[usize]) -> Self {
        let division = DIVISION;
        let mut first = vec![NONE; (self.resolution.x * self.resolution.y) as usize];
        let mut cells = Vec::with_capacity(divided.len() * (division * division) as usize);
        for &cell in divided {
            let place = self.cells[cell];
            first[(place.y * self.resolution.x + place.x) as usize] = cells.len() as u32;
            for y in 0..division {
                for x in 0..division {
                    cells.push(place * division + UVec2::new(x, y));
                }
            }
        }
        let blocks = Blocks {
            columns: self.resolution.x,
            division,
            first,
        };
        Self::trace_blocks(batch, self.resolution * division, cells, blocks)
    }

    /// Moves the photons of all cells but the divided ones to the result, and books them.
    fn keep_others<I: Intersect + ?Sized>(
        &mut self,
        batch: &Batch<'_, I>,
        divided: &[usize],
        map: &mut PhotonMap,
    ) {
        // What the divided cells' photons did is undone in the ledger; their rays were traced.
        let places: Vec<UVec2> = divided.iter().map(|&cell| self.cells[cell]).collect();
        for chunk in places.chunks(CHUNK) {
            self.ledger
                .retract(&trace_cells(batch, self.resolution, chunk).ledger);
        }
        map.ledger.merge(&self.ledger);
        let mut next = divided.iter().peekable();
        for cell in 0..self.cells.len() {
            if next.next_if(|&&it| it == cell).is_none() {
                let spread = self.spread(cell);
                let photons = &self.photons[self.photons_of(cell)];
                map.photons.extend(photons.iter().map(|photon| Photon {
                    axes: photon.axes.map(|axis| spread * axis),
                    ..*photon
                }));
            }
        }
    }
}

/// Whether two neighbours' differentials each say where the other landed.
fn lands_as_predicted(
    photon: &Photon,
    other: &Photon,
    axis: usize,
    sign: f32,
    detail: f32,
) -> bool {
    let displacement = other.position - photon.position;
    let off = (displacement - sign * photon.axes[axis]).length();
    let longest = photon.axes[axis].length().max(other.axes[axis].length());
    off < (MISMATCH * longest).max(detail)
}

/// What a task returns.
struct Part {
    photons: Vec<Photon>,
    paths: Vec<u32>,
    starts: Vec<usize>,
    ledger: EnergyLedger,
}

fn trace_cells<I: Intersect + ?Sized>(
    batch: &Batch<'_, I>,
    resolution: UVec2,
    cells: &[UVec2],
) -> Part {
    let mut tracer = batch.tracer::<2>();
    let seed = batch.options.seed;
    let place = if seed == 0 {
        Vec2::splat(0.5)
    } else {
        CounterRng::new(seed, 0).next_vec2()
    };
    let size = resolution.as_vec2().recip();
    let emitted = |&cell: &UVec2| {
        let sample = EmissionSample {
            point: ((cell.as_vec2() + place) * size).min(Vec2::splat(1.0f32.next_down())),
            spacing: [Vec2::new(size.x, 0.0), Vec2::new(0.0, size.y)],
            place: Vec2::ZERO,
            count: resolution.x * resolution.y,
        };
        let emission = batch.planned.emitter().emit::<2>(batch.world, &sample)?;
        let number = u64::from(cell.y) * u64::from(resolution.x) + u64::from(cell.x);
        let stream = number ^ (u64::from(resolution.x) << 40);
        Some((emission, batch.planned.random(seed, stream)))
    };
    let mut starts = Vec::with_capacity(cells.len());
    let mut wave = Wave::new();
    for cells in cells.chunks(WAVE) {
        let media = batch.planned.media();
        wave.trace(&mut tracer, cells.iter().map(emitted), media, &mut starts);
    }
    Part {
        photons: tracer.photons,
        paths: tracer.paths,
        starts,
        ledger: tracer.ledger,
    }
}
