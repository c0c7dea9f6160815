use glam::Vec3;

use crate::ledger::EnergyLedger;

/// Light that landed on a receiver after at least one specular event: `L S+ D`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it landed, in metres; for a photon at the edge of a sheet of light, the middle of what
    /// its cell lights.
    pub position: Vec3,
    /// Unit direction in which it travelled.
    pub incoming: Vec3,
    /// Flux that it carries, in watts, for each channel.
    pub flux: Vec3,
    /// Unit geometric normal of the receiver, on the side on which the photon landed.
    pub normal: Vec3,
    /// How far away its neighbours landed: the displacements in the receiver's tangent plane, in
    /// metres, for one sample spacing along each of two emission parameters. Their parallelogram
    /// is the photon's share of the receiver.
    pub axes: [Vec3; 2],
    /// Index of the receiver among the world's objects.
    pub object: u32,
    /// Specular events on its way, at least 1.
    pub events: u32,
    /// How `axes` were found.
    pub source: FootprintSource,
    /// How its footprint lies among those of other photons.
    pub coverage: Coverage,
}

impl Photon {
    /// Whether its position and its axes are.
    pub(crate) fn is_finite(&self) -> bool {
        self.position.is_finite() && self.axes.iter().all(|axis| axis.is_finite())
    }
}

#[cfg(test)]
impl Photon {
    /// One of unit flux that fell from above.
    pub(crate) fn landed(position: Vec3, axes: [Vec3; 2]) -> Self {
        Self {
            position,
            incoming: Vec3::NEG_Y,
            flux: Vec3::ONE,
            normal: Vec3::Y,
            axes,
            object: 0,
            events: 1,
            source: FootprintSource::Differential,
            coverage: Coverage::Cell,
        }
    }
}

/// How the footprints of neighbouring photons lie to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Coverage {
    /// Side by side, as the cells of a lattice: they have to join without a seam.
    #[default]
    Cell,
    /// One over the other: lights with an area, and skies, send photons from places of all their width,
    /// so that a footprint covers at least four steps of the lattice and no seam between two shows. See
    /// [`RayDifferential::footprint`](crate::RayDifferential::footprint).
    Overlap,
    /// One over the other, and the image of another photon behind the end of its receiver: it stands for
    /// what that one's footprint spreads beyond, and carries no light of its own
    /// ([`TraceOptions::reflect_at_boundaries`]).
    ///
    /// [`TraceOptions::reflect_at_boundaries`]: crate::TraceOptions::reflect_at_boundaries
    Reflected,
}

impl Coverage {
    /// Whether its footprint lies over others.
    #[must_use]
    pub fn overlaps(self) -> bool {
        self != Self::Cell
    }
}

/// How a photon's footprint was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FootprintSource {
    /// From its ray differential, which nothing was there to check against: the photons are not on
    /// a lattice of two parameters, or no neighbour took the same path.
    #[default]
    Differential,
    /// From its ray differential, and neighbours landed where it says or farther away. Where those on
    /// both sides land about as far as it says, they are half of it.
    Checked,
    /// From its ray differential, which was shortened on the way: at a critical angle, where a surface
    /// bends too fast, or, of a light with an area or a sky, at a silhouette.
    Bounded,
    /// From the finite difference to a neighbour on the lattice, which landed nearer than the
    /// differential said.
    Neighbour,
    /// From its ray differential, widened for the paths that ended by Russian roulette where this
    /// one went on.
    Thinned,
    /// From the ray differential of a part of its cell, or the finite difference to the part beside
    /// it: a sheet of light ends there, or is narrower than a cell ([`TraceOptions::divide_edges`]).
    ///
    /// [`TraceOptions::divide_edges`]: crate::TraceOptions::divide_edges
    Divided,
}

impl FootprintSource {
    /// All sources.
    pub const ALL: [Self; 6] = [
        Self::Differential,
        Self::Checked,
        Self::Bounded,
        Self::Neighbour,
        Self::Thinned,
        Self::Divided,
    ];
}

/// The photons of one tracing, and where the energy went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonMap {
    /// All stored photons, in the order of emission, each with its [images](Coverage::Reflected) behind it.
    pub photons: Vec<Photon>,
    /// Where the energy went.
    pub ledger: EnergyLedger,
}
