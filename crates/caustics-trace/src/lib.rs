//! To be written.

mod aim;
mod area_emission;
mod differential;
mod emission;
mod ledger;
mod media;
mod optics;
mod options;
mod photon;
mod refine;
mod scatter;
mod trace;
mod tracer;

pub use differential::RayDifferential;
pub use emission::{Emission, EmissionSample, Emitter};
pub use glam;
pub use ledger::{EnergyLedger, Fate, LedgerEntry};
pub use media::{Crossing, MediumStack};
pub use optics::{
    CHANNEL_WAVELENGTHS, beer_lambert, dispersed_ior, fresnel_dielectric, fresnel_schlick, reflect,
    refract,
};
pub use options::{Aim, Branching, Refinement, TraceError, TraceOptions};
pub use photon::{Photon, PhotonMap};
pub use scatter::{Event, Outgoing, Scattering, scatter};
pub use trace::trace_photons;
