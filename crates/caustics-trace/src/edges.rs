use std::ops::Range;

use caustics_accel::Intersect;
use glam::Vec2;

use crate::give_back::give_back;
use crate::ledger::EnergyLedger;
use crate::narrow_sheets::narrow_axis;
use crate::neighbours::{EDGE_EXTENT, EDGE_SHIFT, LIMIT, LatticePhotons, MAX_RATIO, in_plane};
use crate::path_guide::{MOST_SURFACES, PathGuide};
use crate::photon::{FootprintSource, Photon};
use crate::silhouette::Silhouette;
use crate::trace::Batch;
use crate::tracer::PathTracer;

/// How often the stretch in which a row's end lies is halved: it is known to a part in 32 of a cell
/// then, which is the most that the narrowest stratum can do with. Where rows end in both axes, one
/// halving less often takes the wrong one, and the edge has teeth.
const HALVINGS: u32 = 4;

/// The strata that the light of a row's last photon is divided into, from the inside to the edge, in
/// parts of it. In steps of two, since the sum of footprints is uneven where their widths differ by
/// more.
const STRATA: [(f32, f32); PARTS] = [(0.0, 0.5), (0.5, 0.75), (0.75, 0.875), (0.875, 1.0)];
/// Parts of a divided photon.
pub(crate) const PARTS: usize = 4;

/// Photons with less than this part of the flux of their cell's brightest are not divided.
const SIGNIFICANT: f32 = 0.1;

/// The last photons of a lattice's rows, divided.
///
/// A sheet of light, the photons of one path that landed the same side up, ends somewhere between the last point of a row that has
/// it and the next, which has not. Nobody knows where, so that as many cells' light is drawn as there
/// are points, with a jagged edge; and where the sheet ends at a silhouette, Fresnel's terms and the
/// place of landing change within that last cell as much as over many others. Both are found by a few
/// more rays. The end is found by halving; what lies between it and the cell's inner side is divided
/// into strata, each of which is traced as a photon of its own, with a footprint as wide as it is. How
/// the end runs from row to row, half a row on, gives the slant of the strata.
///
/// A sheet that ends on both sides of a photon is narrower than that: see
/// [`divide_narrow`](Self::divide_narrow).
///
/// Cells at edges are few: of N cells as many as the root of N, so that all this costs less the more
/// photons there are.
pub(crate) struct EdgeTracer<'a, 'b, I: ?Sized> {
    batch: &'b Batch<'a, I>,
    tracer: PathTracer<'a, I, 2>,
    /// Counts, but for the rays.
    ledger: EnergyLedger,
}

/// A point of the lattice, the path of one of its photons, and the axis along which that path ends.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// Number of the point in the whole lattice.
    pub(crate) number: u32,
    pub(crate) path: u32,
    pub(crate) axis: usize,
    /// Whether it ends towards larger or smaller coordinates.
    pub(crate) sign: f32,
}

impl Row {
    /// What is `along` cells from the point towards the end, and `across` cells beside the row.
    pub(crate) fn offset(&self, along: f32, across: f32) -> Vec2 {
        let mut offset = Vec2::splat(across);
        offset[self.axis] = self.sign * along;
        offset
    }
}

impl<'a, 'b, I: Intersect + ?Sized> EdgeTracer<'a, 'b, I> {
    pub(crate) fn new(batch: &'b Batch<'a, I>) -> Self {
        let mut tracer = batch.tracer();
        tracer.guide = Some(PathGuide::default());
        Self {
            batch,
            tracer,
            ledger: EnergyLedger::default(),
        }
    }

    /// The photons of some points, with checked footprints and divided at the ends of rows, and what
    /// was counted: rays, photons divided and footprints replaced.
    pub(crate) fn checked(
        mut self,
        lattice: &LatticePhotons<'_>,
        points: Range<u32>,
    ) -> (Vec<Photon>, EnergyLedger) {
        let mut checked = Vec::new();
        for point in points {
            self.check(lattice, point, &mut checked);
        }
        self.ledger.rays = self.tracer.ledger.rays;
        (checked, self.ledger)
    }

    fn check(&mut self, lattice: &LatticePhotons<'_>, point: u32, checked: &mut Vec<Photon>) {
        let own = lattice.photons_of(point);
        let flux = |photon: &Photon| photon.flux.max_element();
        let brightest = lattice.photons[own.clone()].iter().map(flux);
        let brightest = brightest.fold(0.0, f32::max);
        let neighbours = lattice.lattice.neighbours(point);
        for (index, footprint) in own.zip(lattice.checked(point)) {
            let photon = &lattice.photons[index];
            // Of longer paths the way would not be known, after all of a point's were traced for it.
            let is_worth_it = photon.source != FootprintSource::Thinned
                && photon.events as usize <= MOST_SURFACES
                && flux(photon) >= SIGNIFICANT * brightest;
            let path = lattice.paths[index];
            let landed = lattice.landed(index, &neighbours);
            let number = lattice.lattice.number(point);
            let is_divided = is_worth_it
                && match narrow_axis(photon, &neighbours, &landed) {
                    Some(axis) => self.divide_narrow(photon, number, path, axis, &landed, checked),
                    None => self.divide(photon, number, path, &landed, checked),
                };
            if is_divided {
                self.ledger.divided_photons += 1;
            } else {
                let is_replaced = footprint.source == FootprintSource::Neighbour;
                self.ledger.replaced_differentials += u64::from(is_replaced);
                checked.push(footprint.of(photon));
            }
        }
    }

    /// Divides a photon, if its path ends beside it and goes on behind it.
    fn divide(
        &mut self,
        photon: &Photon,
        number: u32,
        path: u32,
        landed: &[[Option<&Photon>; 2]; 2],
        divided: &mut Vec<Photon>,
    ) -> bool {
        let mut nearest: Option<(Row, f32)> = None;
        let mut ends = 0;
        let mut inner = photon;
        for (axis, pair) in landed.iter().enumerate() {
            let (sign, before) = match pair {
                [Some(before), None] => (1.0, before),
                [None, Some(before)] => (-1.0, before),
                _ => continue,
            };
            if before.object != photon.object || !self.knows(number, path) {
                continue;
            }
            let row = Row {
                number,
                path,
                axis,
                sign,
            };
            let reach = self.end(&row, 0.0, 0.0, HALVINGS);
            ends += 1;
            // The axis that crosses the edge the more steeply.
            if nearest.is_none_or(|(_, least)| reach < least) {
                nearest = Some((row, reach));
                inner = before;
            }
        }
        let Some((row, reach)) = nearest else {
            return false;
        };
        let slant = 2.0 * row.sign * (self.end(&row, 0.5, reach - 0.5, HALVINGS) - reach);
        let cells = 0.5 + reach;
        let strata = STRATA.map(|(low, high)| {
            let at = 0.5 * (low + high) * cells - 0.5;
            let photon = self.photon_at(&row, row.offset(at, 0.0))?;
            Some(Stratum {
                photon,
                at,
                width: (high - low) * cells,
                slant: 0.5 * (low + high) * slant,
            })
        });
        let Some(strata) = strata.into_iter().collect::<Option<Vec<_>>>() else {
            return false;
        };
        let across = 1 - row.axis;
        // Along the edge the photon's neighbours may have landed nearer than its differential says.
        let narrowing = if ends == 1 {
            checked_ratio(photon, across, &landed[across])
        } else {
            1.0
        };
        let edge = Edge {
            axis: row.axis,
            sign: row.sign,
            narrowing,
        };
        let mut before = Stratum {
            photon: *inner,
            at: -1.0,
            width: 1.0,
            slant: 0.0,
        };
        let mut parts: [Photon; PARTS] = std::array::from_fn(|number| {
            let own = &strata[number];
            let part = edge.footprint(own, Some(&before), strata.get(number + 1));
            before = *own;
            part
        });
        // As long as its neighbour lets it be.
        let step = -in_plane(photon, inner);
        let mut unit = row.sign * inner.axes[row.axis];
        if unit.length_squared() > LIMIT * LIMIT * step.length_squared() {
            unit = step;
        }
        let back = give_back(&mut parts, inner.position, unit, row.axis);
        let mut all = parts.iter().chain([&back]);
        let are_finite = all.all(Photon::is_finite);
        if are_finite {
            divided.extend(parts);
            divided.push(back);
        }
        are_finite
    }

    /// Makes sure that the way of a path is known.
    pub(crate) fn knows(&mut self, number: u32, path: u32) -> bool {
        let Some(guide) = &mut self.tracer.guide else {
            return false;
        };
        if guide.follow(path) {
            return true;
        }
        guide.follow_all();
        self.send(number, Vec2::ZERO);
        self.tracer
            .guide
            .as_mut()
            .is_some_and(|guide| guide.follow(path))
    }

    /// How far a row goes, `across` cells beside it, in cells from its point: somewhere in the cell
    /// that begins `from` there, which is halved so often.
    pub(crate) fn end(&mut self, row: &Row, across: f32, from: f32, halvings: u32) -> f32 {
        let mut width = 0.5;
        let mut at = from;
        for _ in 0..halvings {
            if self
                .photon_at(row, row.offset(at + width, across))
                .is_some()
            {
                at += width;
            }
            width *= 0.5;
        }
        at + width
    }

    /// The photon of the row's path that is sent from beside its point.
    pub(crate) fn photon_at(&mut self, row: &Row, offset: Vec2) -> Option<Photon> {
        self.send(row.number, offset);
        let found = self.tracer.paths.iter().position(|&it| it == row.path)?;
        Some(self.tracer.photons[found])
    }

    /// Traces what is sent from beside a point, in cells from it.
    fn send(&mut self, number: u32, offset: Vec2) {
        self.tracer.photons.clear();
        self.tracer.paths.clear();
        let planned = self.batch.planned;
        let sample = planned.sample_beside(number, offset);
        let emission = sample.and_then(|sample| planned.emitter().emit(self.batch.world, &sample));
        if let Some(emission) = emission {
            let mut random = planned.random(self.batch.options.seed, u64::from(number));
            self.tracer.trace(&emission, planned.media(), &mut random);
        }
    }
}

/// How many times as long as its axis a photon's neighbours let its footprint be, at most once.
pub(crate) fn checked_ratio(photon: &Photon, axis: usize, pair: &[Option<&Photon>; 2]) -> f32 {
    let neighbours = pair.iter().flatten();
    let same = neighbours.filter(|it| it.object == photon.object);
    let farthest = same
        .map(|it| in_plane(photon, it).length())
        .reduce(f32::max);
    let length = photon.axes[axis].length();
    match farthest {
        Some(farthest) if length > LIMIT * farthest => farthest / length,
        _ => 1.0,
    }
}

/// A part of the light of a row's last photon.
#[derive(Clone, Copy)]
pub(crate) struct Stratum {
    /// As if it stood for a whole cell.
    pub(crate) photon: Photon,
    /// Its middle, in cells from the point towards the edge.
    pub(crate) at: f32,
    /// In cells.
    pub(crate) width: f32,
    /// How far it leads along the row from one row to the next, in cells.
    pub(crate) slant: f32,
}

/// An edge beside a point of a lattice.
pub(crate) struct Edge {
    /// Of the lattice, the axis of the rows that end there.
    pub(crate) axis: usize,
    /// Whether towards larger or smaller coordinates.
    pub(crate) sign: f32,
    /// By what axes along the edge are shortened.
    pub(crate) narrowing: f32,
}

impl Edge {
    /// The photon of a stratum, by those before and after it.
    pub(crate) fn footprint(
        &self,
        own: &Stratum,
        before: Option<&Stratum>,
        after: Option<&Stratum>,
    ) -> Photon {
        let mut photon = own.photon;
        photon.source = FootprintSource::Divided;
        photon.flux *= own.width;
        // For one cell towards the edge.
        let mut unit = self.sign * photon.axes[self.axis];
        let (mut inwards, mut extent) = (0.0, 1.0);
        let steps = [before, after].into_iter().flatten();
        let steps = steps
            .filter(|it| it.photon.object == photon.object)
            .map(|it| in_plane(&photon, &it.photon) / (it.at - own.at));
        let farthest = steps.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        if let Some(step) = farthest {
            let length = unit.length();
            let ratio = (length / step.length()).min(MAX_RATIO);
            let mut is_fitted = false;
            if after.is_none() {
                let beside = before.map_or(length, |it| it.photon.axes[self.axis].length());
                let slope = length / beside;
                (inwards, extent) = match Silhouette::of(ratio, slope) {
                    Some(silhouette) => {
                        is_fitted = true;
                        let fit = silhouette.fit();
                        (fit.inwards, fit.extent)
                    }
                    None => (EDGE_SHIFT, EDGE_EXTENT),
                };
            }
            if is_fitted || ratio > LIMIT {
                unit = step;
            }
        }
        photon.position -= inwards * own.width * unit;
        photon.axes[self.axis] = self.sign * extent * own.width * unit;
        let along = &mut photon.axes[1 - self.axis];
        *along = self.narrowing * *along + self.sign * own.slant * unit;
        photon
    }
}
