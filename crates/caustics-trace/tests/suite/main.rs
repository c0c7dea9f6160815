//! Tests of photons and their differentials.
//!
//! One program, which takes less time to build than one for each file.

mod aimed_pairs;
mod common;
mod culling;
mod differential_chains;
mod differential_limits;
mod differential_operations;
mod divided_edges;
mod emission_differentials;
mod emission_flux;
mod energy_ledger;
mod folded_sheets;
mod footprint_check;
mod guided_emission;
mod live_photons;
mod nested_media;
mod optics_properties;
mod photon_stream;
mod projection_maps;
mod scatter_properties;
mod sky_emission;
mod traced_meshes;
mod traced_spheres;
