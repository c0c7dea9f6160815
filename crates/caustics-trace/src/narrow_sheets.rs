use caustics_accel::Intersect;
use glam::Vec3;

use crate::edges::{Edge, EdgeTracer, PARTS, Row, Stratum, checked_ratio};
use crate::photon::Photon;

/// How often the stretch in which an end lies is halved. With one more the error of a scene of three
/// glasses is at most 2 % less, and a fifth more time goes into tracing; with one less that of a brass ring is
/// a quarter more.
const HALVINGS: u32 = 3;

/// Parts of the light of a narrow sheet.
const STRIPS: usize = PARTS + 1;

/// The parts' ends, in the width of the sheet.
const ENDS: [f32; STRIPS + 1] = [0.0, 0.125, 0.375, 0.625, 0.875, 1.0];

/// The most irradiance that a photon is given, in that of its sheet.
const BRIGHTEST: f32 = 2.0;

/// The axis of the lattice along which a photon's sheet of light is too narrow for those beside it to be
/// part of it, though there are some on both sides: `neighbours` are the numbers of its point's, `landed`
/// where they landed. None if its footprint is the shorter along it: only the longer is a streak.
pub(crate) fn narrow_axis(
    photon: &Photon,
    neighbours: &[[Option<u32>; 2]; 2],
    landed: &[[Option<&Photon>; 2]; 2],
) -> Option<usize> {
    let squares = photon.axes.map(Vec3::length_squared);
    [0, 1].into_iter().find(|&axis| {
        neighbours[axis].iter().all(Option::is_some)
            && landed[axis].iter().all(Option::is_none)
            && squares[axis] >= squares[1 - axis]
    })
}

impl<I: Intersect + ?Sized> EdgeTracer<'_, '_, I> {
    /// Divides a photon of a sheet of light that is narrow along an `axis`, if the parts land.
    ///
    /// Nothing bears out the differential there, and a whole cell is more than the sheet: at the tips of
    /// sheets footprints are streaks that reach far into the dark. So both ends are found by a few rays, at the
    /// middle of what of the cell's column is lit, how they run a quarter of that on either side of it, and the
    /// sheet's width is traced in parts.
    ///
    /// A sheet as wide as c cells, c below 1, has a point of the lattice in a part c of its rows: the photons
    /// of these have the whole light of their cells, so that all have the sheet's. Where they would be brighter
    /// than [`BRIGHTEST`] times the sheet, they are not: that loses a little light, which
    /// [`edge_gain`](crate::EnergyLedger::edge_gain) counts.
    pub(crate) fn divide_narrow(
        &mut self,
        photon: &Photon,
        number: u32,
        path: u32,
        axis: usize,
        landed: &[[Option<&Photon>; 2]; 2],
        divided: &mut Vec<Photon>,
    ) -> bool {
        if !self.knows(number, path) {
            return false;
        }
        let across = 1 - axis;
        let row = |axis: usize, side: usize| Row {
            number,
            path,
            axis,
            sign: if side == 0 { -1.0 } else { 1.0 },
        };
        let beside = [0, 1].map(|side| match landed[across][side] {
            Some(_) => 0.5,
            None => self.end(&row(across, side), 0.0, 0.0, HALVINGS),
        });
        let rows = beside[0] + beside[1];
        let middle_row = 0.5 * (beside[1] - beside[0]);
        let reach = [0, 1].map(|side| self.end(&row(axis, side), middle_row, 0.0, HALVINGS));
        let cells = reach[0] + reach[1];
        let middle = 0.5 * (reach[1] - reach[0]);
        let is_alone = landed[across].iter().all(Option::is_none);
        let slants = [0, 1].map(|side| {
            if is_alone {
                return 0.0;
            }
            let row = row(axis, side);
            let [fore, aft] = [0.25 * rows, -0.25 * rows]
                .map(|beyond| self.end(&row, middle_row + beyond, 0.0, HALVINGS));
            2.0 * row.sign * (fore - aft)
        });
        let lit = cells.max(1.0) * if is_alone { rows.max(1.0) } else { rows };
        let weight = lit.min(BRIGHTEST * cells * rows) / cells;
        let along = row(axis, 1);
        let strata: [Option<Stratum>; STRIPS] = std::array::from_fn(|strip| {
            let at = 0.5 * (ENDS[strip] + ENDS[strip + 1]);
            let offset = middle + (at - 0.5) * cells;
            let mut photon = self.photon_at(&along, along.offset(offset, middle_row))?;
            photon.flux *= weight;
            Some(Stratum {
                photon,
                at: offset,
                width: (ENDS[strip + 1] - ENDS[strip]) * cells,
                slant: slants[0] + (slants[1] - slants[0]) * at,
            })
        });
        let Some(strata) = strata.into_iter().collect::<Option<Vec<_>>>() else {
            return false;
        };
        let narrowing = checked_ratio(photon, across, &landed[across]).min(rows);
        let first = divided.len();
        for (strip, own) in strata.iter().enumerate() {
            // Outwards from the middle.
            let is_low = strip < STRIPS / 2;
            let sign = if is_low { -1.0 } else { 1.0 };
            let outwards = |it: &Stratum| Stratum {
                at: sign * it.at,
                ..*it
            };
            let below = strip.checked_sub(1).and_then(|it| strata.get(it));
            let above = strata.get(strip + 1);
            let (before, after) = if is_low {
                (above, below)
            } else {
                (below, above)
            };
            let edge = Edge {
                axis,
                sign,
                narrowing,
            };
            let [before, after] = [before, after].map(|it| it.map(outwards));
            divided.push(edge.footprint(&outwards(own), before.as_ref(), after.as_ref()));
        }
        let are_finite = divided[first..].iter().all(Photon::is_finite);
        if !are_finite {
            divided.truncate(first);
        }
        are_finite
    }
}
