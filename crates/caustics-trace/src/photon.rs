use glam::Vec3;

use crate::ledger::EnergyLedger;

/// Light that landed on a receiver after at least one specular event: `L S+ D`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it landed, in metres.
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
}

/// The photons of one tracing, and where the energy went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonMap {
    /// All stored photons, in the order of emission.
    pub photons: Vec<Photon>,
    /// Where the energy went.
    pub ledger: EnergyLedger,
}
