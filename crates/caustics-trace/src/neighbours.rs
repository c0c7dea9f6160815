use std::ops::Range;

use glam::Vec3;

use crate::between::Between;
use crate::lattice::Lattice;
use crate::path_guide::{signed_area, turned_over};
use crate::photon::{FootprintSource, Photon};
use crate::silhouette::Silhouette;

/// How many times as far as its neighbours landed a photon's axis may reach.
///
/// Where the map from the lattice to the receiver is smooth, axis and distance differ by a part
/// that shrinks with the spacing. Just inside a silhouette light turns with the square root of the
/// distance to it, whose derivative has no bound: the first photon inside, wherever it may stand in
/// its cell, lands at most twice the cell's mean from its neighbour.
pub(crate) const LIMIT: f32 = 1.5;

/// At an edge of a sheet of light, how far inwards the footprint's middle is moved and by what its
/// axis is shortened, in its length.
///
/// Even light should end at the end of the last cell instead of fading out over two. A normal
/// distribution of standard deviation 0.55 with what lies beyond the cell's end turned back inside
/// has its mean at 0.108 and 0.78 times that deviation; a shift of 0.15 and an axis of 0.6 let still
/// less light out, and leave a ridge. These lie between. At 131,072 photons they have less than half
/// the error of none at all where the light of a mirror ring or of a cube's face ends in the dark.
pub(crate) const EDGE_SHIFT: f32 = 0.13;
pub(crate) const EDGE_EXTENT: f32 = 0.69;

/// The largest ratio of a differential to the distance of a neighbour that is told from a larger
/// one.
pub(crate) const MAX_RATIO: f32 = 1e3;

/// The largest part of the footprint of the photon before it that the footprint of the last photon
/// before a smooth fold covers.
///
/// Divided like the last photons before other edges, those at smooth folds make less of an error where
/// cells are wide, a third of it in folded water seen by 2^10 photons, but about twice as much from 2^18
/// on, and behind a ball of glass the largest errors of pixels are several times as large.
///
/// Light that turns round smoothly lands at the square of the distance to the fold, in cells: where the
/// last photon stands `k` before it, with `k` below 1, their areas are as `k` and `k + 1`. Where a surface
/// has a kink light turns round at full speed.
const SLOWING: f32 = 0.6;

/// Whether the fold beyond a photon, with the photon before it, is smooth: what is nearest to the fold then
/// has narrow footprints by itself, and the neighbour on the other side is one like all.
fn folds_smoothly(photon: &Photon, before: &Photon) -> bool {
    let area = |it: &Photon| signed_area(&it.axes, photon.normal).abs();
    area(photon) < SLOWING * area(before)
}

/// The photons of an emitter, in the order of a lattice, with what their paths met.
pub(crate) struct LatticePhotons<'a> {
    pub(crate) lattice: &'a Lattice,
    pub(crate) photons: &'a [Photon],
    /// For each photon, a hash of what its path met and did there.
    pub(crate) paths: &'a [u32],
    /// For each point of the lattice, where its photons start; one more than there are points.
    pub(crate) starts: &'a [usize],
}

impl LatticePhotons<'_> {
    /// The footprints of the photons of one point, checked against where the neighbours of the same
    /// path landed.
    pub(crate) fn checked(&self, point: u32) -> impl Iterator<Item = CheckedFootprint> + '_ {
        let neighbours = self.lattice.neighbours(point);
        self.photons_of(point).map(move |index| {
            let photon = &self.photons[index];
            if photon.source == FootprintSource::Thinned {
                return checked(photon, &[[None; 2]; 2]);
            }
            checked(photon, &self.landed(index, &neighbours))
        })
    }

    /// The photons before and after one along each axis, where they are parts of its sheet of light;
    /// `neighbours` are the numbers of its point's neighbours.
    pub(crate) fn landed(
        &self,
        index: usize,
        neighbours: &[[Option<u32>; 2]; 2],
    ) -> [[Option<&Photon>; 2]; 2] {
        let (photon, path) = (&self.photons[index], self.paths[index]);
        [0, 1].map(|axis| {
            let at = neighbours[axis];
            let beyond = |side: usize| self.photon_of(at[side]?, turned_over(path));
            match at.map(|at| self.photon_of(at?, path)) {
                [Some(before), None] if folds_smoothly(photon, before) => [Some(before), beyond(1)],
                [None, Some(before)] if folds_smoothly(photon, before) => [beyond(0), Some(before)],
                pair => pair,
            }
        })
    }

    /// The photons of one point with checked footprints.
    pub(crate) fn checked_photons(&self, point: u32) -> impl Iterator<Item = Photon> + '_ {
        let own = self.photons[self.photons_of(point)].iter();
        own.zip(self.checked(point))
            .map(|(photon, footprint)| footprint.of(photon))
    }

    /// Where the photons of a point are.
    pub(crate) fn photons_of(&self, point: u32) -> Range<usize> {
        self.starts[point as usize]..self.starts[point as usize + 1]
    }

    /// The photon of a point that took a path.
    pub(crate) fn photon_of(&self, point: u32, path: u32) -> Option<&Photon> {
        let range = self.photons_of(point);
        let found = self.paths[range.clone()]
            .iter()
            .position(|&it| it == path)?;
        Some(&self.photons[range.start + found])
    }
}

/// A footprint, as it is after a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CheckedFootprint {
    pub(crate) position: Vec3,
    pub(crate) axes: [Vec3; 2],
    /// How many cells of the lattice its flux is that of: other than one at a silhouette, which
    /// leaves the last cell a part of its light, or adds what falls into the next.
    pub(crate) cells: f32,
    pub(crate) source: FootprintSource,
}

impl CheckedFootprint {
    /// The photon that has it.
    pub(crate) fn of(self, photon: &Photon) -> Photon {
        Photon {
            position: self.position,
            flux: self.cells * photon.flux,
            axes: self.axes,
            source: self.source,
            ..*photon
        }
    }
}

/// What the neighbours along an axis say.
struct Landed {
    /// To the farthest of them, in the plane of the footprint.
    farthest: Vec3,
    /// How many times as long as that the axis is.
    ratio: f32,
    /// Where the light ends on one side of the photon.
    edge: Option<Edge>,
    /// What the two say together.
    between: Option<Between>,
}

/// From where a photon landed to where another did, in its receiver's plane.
pub(crate) fn in_plane(photon: &Photon, other: &Photon) -> Vec3 {
    let displacement = other.position - photon.position;
    displacement - photon.normal * displacement.dot(photon.normal)
}

enum Edge {
    Even,
    Silhouette(Silhouette),
}

impl Landed {
    /// Of the neighbours before and after a photon along one axis; `None` without one on the same
    /// object: past a corner light goes on, on a receiver whose plane says nothing about this one.
    fn of(photon: &Photon, number: usize, pair: &[Option<&Photon>; 2]) -> Option<Self> {
        let axis = photon.axes[number];
        let steps = pair.map(|it| {
            let neighbour = it.filter(|it| it.object == photon.object)?;
            Some((in_plane(photon, neighbour), neighbour.axes[number]))
        });
        let (farthest, beside) = steps
            .into_iter()
            .flatten()
            .max_by(|(a, _), (b, _)| a.length_squared().total_cmp(&b.length_squared()))?;
        let distance = farthest.length();
        // By its largest coordinate where the square of a long axis overflows.
        let largest = axis.abs().max_element();
        let length = if largest > LIMIT * distance {
            largest
        } else {
            axis.length()
        };
        let ratio = (length / distance).min(MAX_RATIO);
        let is_edge = pair.iter().flatten().count() == 1;
        let slope = length / beside.length();
        let edge =
            is_edge.then(|| Silhouette::of(ratio, slope).map_or(Edge::Even, Edge::Silhouette));
        let between = match (pair, steps) {
            ([Some(before), Some(after)], [Some(_), Some(_)]) => {
                Between::of(photon, [before, after], axis, length)
            }
            _ => None,
        };
        Some(Self {
            farthest,
            ratio,
            edge,
            between,
        })
    }

    /// Of how many cells the photon has the light, if a silhouette says so.
    fn cells(&self) -> Option<f32> {
        match &self.edge {
            Some(Edge::Silhouette(silhouette)) => silhouette.cells(),
            _ => None,
        }
    }
}

/// A photon's footprint, no longer along each axis than its neighbours are far away, and drawn in
/// where it has one on one side only; `landed` are the neighbours before and after it along each
/// axis, where they have its path.
///
/// A silhouette ends the rows of the lattice that it crosses more steeply than the columns: the last
/// photon of each has all of its row's light from the silhouette on, so that of both axes the one on
/// which the silhouette is nearer says how much. That takes out the chance of where in a cell the rows
/// end, and the sectors of too much and too little light around a glass ball that come of it. Where
/// cells are wide the distance is found a little too small; what is lost so shrinks with them.
pub(crate) fn checked(photon: &Photon, neighbours: &[[Option<&Photon>; 2]; 2]) -> CheckedFootprint {
    let mut footprint = CheckedFootprint {
        position: photon.position,
        axes: photon.axes,
        cells: 1.0,
        source: photon.source,
    };
    let landed = [0, 1].map(|i| Landed::of(photon, i, &neighbours[i]));
    let cells = landed.iter().flatten().filter_map(Landed::cells);
    if let Some(cells) = cells.min_by(f32::total_cmp) {
        footprint.cells = cells;
    }
    for (axis, landed) in footprint.axes.iter_mut().zip(&landed) {
        let Some(landed) = landed else { continue };
        let is_fitted = matches!(landed.edge, Some(Edge::Silhouette(_)));
        let is_replaced = match &landed.between {
            Some(between) => between.is_replaced,
            None => landed.ratio > LIMIT || is_fitted,
        };
        if is_replaced {
            footprint.source = FootprintSource::Neighbour;
        } else if footprint.source == FootprintSource::Differential {
            footprint.source = FootprintSource::Checked;
        }
        if let Some(between) = &landed.between {
            footprint.position += between.shift;
            *axis = between.axis;
            continue;
        }
        let (inwards, extent) = match &landed.edge {
            Some(Edge::Silhouette(silhouette)) => {
                let fit = silhouette.fit();
                (fit.inwards, fit.extent)
            }
            Some(Edge::Even) => (EDGE_SHIFT, EDGE_EXTENT),
            None => (0.0, 1.0),
        };
        let unit = if is_replaced { landed.farthest } else { *axis };
        // The axis may point either way.
        footprint.position += inwards * landed.farthest.dot(unit).signum() * unit;
        *axis = extent * unit;
    }
    footprint
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_kept_where_a_neighbour_bears_it_out_and_else_shortened_to_it() {
        let middle = Photon::landed(Vec3::ZERO, [1.4 * Vec3::X, 9.0 * Vec3::Z]);
        let right = Photon::landed(Vec3::X, middle.axes);
        let left = Photon::landed(-0.8 * Vec3::X, middle.axes);
        let above = Photon::landed(0.5 * Vec3::Z + 0.1 * Vec3::Y, middle.axes);
        let below = Photon::landed(-0.25 * Vec3::Z, middle.axes);
        let along = [Some(&left), Some(&right)];
        let found = checked(&middle, &[along, [Some(&below), Some(&above)]]);
        assert_eq!(found.axes, [1.4 * Vec3::X, 0.5 * Vec3::Z]);
        assert_eq!(found.position, middle.position);
        assert_eq!(found.source, FootprintSource::Neighbour);
        let found = checked(&middle, &[along, [None; 2]]);
        assert_eq!(found.axes, middle.axes);
        assert_eq!(found.source, FootprintSource::Checked);
        let found = checked(&middle, &[[None; 2]; 2]);
        assert_eq!(found.axes, middle.axes);
        assert_eq!(found.source, FootprintSource::Differential);
    }

    #[test]
    fn the_last_photon_of_even_light_is_drawn_in() {
        let last = Photon::landed(Vec3::ZERO, [Vec3::X, Vec3::Z]);
        let inner = Photon::landed(-Vec3::X, last.axes);
        let found = checked(&last, &[[Some(&inner), None], [None; 2]]);
        assert_eq!(found.position, -EDGE_SHIFT * Vec3::X);
        assert_eq!(found.axes, [EDGE_EXTENT * Vec3::X, Vec3::Z]);
    }

    #[test]
    fn light_that_goes_on_past_a_corner_has_no_edge_there() {
        let last = Photon::landed(Vec3::ZERO, [Vec3::X, Vec3::Z]);
        let inner = Photon::landed(-Vec3::X, last.axes);
        let beyond = Photon {
            object: 1,
            ..Photon::landed(40.0 * Vec3::Y, last.axes)
        };
        let found = checked(&last, &[[Some(&inner), Some(&beyond)], [None; 2]]);
        assert_eq!((found.position, found.axes), (last.position, last.axes));
    }

    #[test]
    fn at_a_silhouette_the_footprint_is_where_the_cells_light_lands() {
        // Light that lands at sqrt(x); the photon stands x inside the silhouette, its cell is 1 wide.
        for x in [0.003f32, 0.1, 0.4, 0.9, 3.0] {
            let at =
                |x: f32| Photon::landed(x.sqrt() * Vec3::X, [Vec3::X / (2.0 * x.sqrt()), Vec3::Z]);
            let found = checked(&at(x), &[[None, Some(&at(x + 1.0))], [None; 2]]);
            let low = f64::from(x - 0.5).max(0.0);
            let high = f64::from(x) + 0.5;
            const STEPS: u32 = 100_000;
            let landings = (0..STEPS).map(|step| {
                (low + (high - low) * (f64::from(step) + 0.5) / f64::from(STEPS)).sqrt()
            });
            let mean = landings.clone().sum::<f64>() / f64::from(STEPS);
            let variance = landings.map(|it| (it - mean).powi(2)).sum::<f64>() / f64::from(STEPS);
            assert!(
                (f64::from(found.position.x) - mean).abs() < 2e-3 * mean,
                "{x}"
            );
            let expected = 0.78 * (12.0 * variance).sqrt();
            let width = f64::from(found.axes[0].length());
            assert!(
                (width - expected).abs() < 0.02 * expected,
                "{x}: {width} for {expected}"
            );
            // The last photon has all light from the silhouette on.
            let cells = if x < 1.0 { high } else { 1.0 };
            assert!((f64::from(found.cells) - cells).abs() < 2e-3, "{x}");
            assert_eq!(found.source, FootprintSource::Neighbour);
        }
    }

    #[test]
    fn a_slanted_silhouette_is_told_by_the_axis_that_crosses_it_steeply() {
        // Light that lands at the root of the distance to a line that the columns cross at 3 cells
        // where the rows cross it at one.
        let at = |x: f32, y: f32| {
            let root = (x + y / 3.0).sqrt();
            let along_x = Vec3::X / (2.0 * root);
            Photon::landed(
                root * Vec3::X + y * Vec3::Z,
                [along_x, along_x / 3.0 + Vec3::Z],
            )
        };
        let last = at(0.2, 0.0);
        let (right, above) = (at(1.2, 0.0), at(0.2, 1.0));
        let found = checked(&last, &[[None, Some(&right)], [None, Some(&above)]]);
        assert!((found.cells - 0.7).abs() < 1e-3, "{}", found.cells);
    }

    #[test]
    fn axes_whose_squares_overflow_are_shortened() {
        let long = Photon::landed(Vec3::ZERO, [1e30 * Vec3::X, Vec3::INFINITY]);
        let near = Photon::landed(Vec3::ONE, long.axes);
        let around = [Some(&near), Some(&near)];
        let found = checked(&long, &[around; 2]);
        assert_eq!(found.axes, [Vec3::new(1.0, 0.0, 1.0); 2]);
        let found = checked(&long, &[[Some(&near), None]; 2]);
        assert!(found.axes.iter().all(|axis| axis.length() < 2.0));
        assert!(found.position.is_finite());
    }
}
