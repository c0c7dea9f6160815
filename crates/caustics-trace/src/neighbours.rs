use glam::Vec3;

use crate::lattice::Lattice;
use crate::photon::{FootprintSource, Photon};

/// How many times as far as its neighbours landed a photon's axis may reach.
///
/// Where the map from the lattice to the receiver is smooth, axis and distance differ by a part
/// that shrinks with the spacing. Just inside a silhouette light turns with the square root of the
/// distance to it, whose derivative has no bound: the first photon inside, wherever it may stand in
/// its cell, lands at most twice the cell's mean from its neighbour.
const LIMIT: f32 = 1.5;

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
    pub(crate) fn checked(
        &self,
        point: u32,
    ) -> impl Iterator<Item = ([Vec3; 2], FootprintSource)> + '_ {
        let neighbours = self.lattice.neighbours(point);
        let own = self.starts[point as usize]..self.starts[point as usize + 1];
        own.map(move |index| {
            let photon = &self.photons[index];
            if photon.source == FootprintSource::Thinned {
                return (photon.axes, photon.source);
            }
            let path = self.paths[index];
            let landed = neighbours.map(|pair| pair.map(|at| self.photon_of(at?, path)));
            checked(photon, &landed)
        })
    }

    fn photon_of(&self, point: u32, path: u32) -> Option<&Photon> {
        let range = self.starts[point as usize]..self.starts[point as usize + 1];
        let found = self.paths[range.clone()].iter().position(|&it| it == path)?;
        Some(&self.photons[range.start + found])
    }
}

/// A photon's axes, each no longer than neighbours in its direction are far away, and whether they
/// had to be shortened; `landed` are the neighbours before and after it along each axis, where they
/// have its path.
pub(crate) fn checked(
    photon: &Photon,
    landed: &[[Option<&Photon>; 2]; 2],
) -> ([Vec3; 2], FootprintSource) {
    let mut axes = photon.axes;
    let mut source = photon.source;
    for (axis, pair) in axes.iter_mut().zip(landed) {
        let farthest = pair
            .iter()
            .flatten()
            .map(|neighbour| neighbour.position - photon.position)
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let Some(farthest) = farthest else { continue };
        let limit = LIMIT * farthest.length();
        // Lengths first scaled to the limit: the square of a long axis overflows.
        if axis.abs().max_element() > limit || axis.length() > limit {
            *axis = farthest - photon.normal * farthest.dot(photon.normal);
            source = FootprintSource::Neighbour;
        } else if source == FootprintSource::Differential {
            source = FootprintSource::Checked;
        }
    }
    (axes, source)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photon(position: Vec3, axes: [Vec3; 2]) -> Photon {
        Photon {
            position,
            incoming: Vec3::NEG_Y,
            flux: Vec3::ONE,
            normal: Vec3::Y,
            axes,
            object: 0,
            events: 1,
            source: FootprintSource::Differential,
        }
    }

    #[test]
    fn an_axis_is_kept_where_a_neighbour_bears_it_out_and_else_shortened_to_it() {
        let middle = photon(Vec3::ZERO, [1.4 * Vec3::X, 9.0 * Vec3::Z]);
        let right = photon(Vec3::X, middle.axes);
        let above = photon(0.5 * Vec3::Z + 0.1 * Vec3::Y, middle.axes);
        let (axes, source) = checked(&middle, &[[None, Some(&right)], [Some(&above), None]]);
        assert_eq!(axes, [1.4 * Vec3::X, 0.5 * Vec3::Z]);
        assert_eq!(source, FootprintSource::Neighbour);
        let (axes, source) = checked(&middle, &[[None, Some(&right)], [None, None]]);
        assert_eq!((axes, source), (middle.axes, FootprintSource::Checked));
        let (axes, source) = checked(&middle, &[[None; 2]; 2]);
        assert_eq!((axes, source), (middle.axes, FootprintSource::Differential));
    }

    #[test]
    fn axes_whose_squares_overflow_are_shortened() {
        let long = photon(Vec3::ZERO, [1e30 * Vec3::X, Vec3::INFINITY]);
        let near = photon(Vec3::ONE, long.axes);
        let (axes, _) = checked(&long, &[[Some(&near), None], [Some(&near), None]]);
        assert_eq!(axes, [Vec3::new(1.0, 0.0, 1.0); 2]);
    }
}
