use caustics_sampling::Sequence;

use crate::culling::Culling;
use crate::ledger::EnergyLedger;
use crate::neighbours::{CheckedFootprint, LatticePhotons};
use crate::options::TraceOptions;
use crate::photon::{FootprintSource, Photon};
use crate::plan::EmissionBatch;

/// What some points of a light's lattice became.
pub(crate) struct Traced {
    pub(crate) photons: Vec<Photon>,
    /// For each photon, a hash of what its path met and did there: photons of one path are parts of
    /// one smooth sheet of light.
    pub(crate) paths: Vec<u32>,
    /// For each point, where its photons start.
    pub(crate) starts: Vec<usize>,
    pub(crate) ledger: EnergyLedger,
}

impl Traced {
    /// Parts in their order as one.
    pub(crate) fn joined(parts: Vec<Self>) -> Self {
        let photons = parts.iter().map(|part| part.photons.len()).sum();
        let points = parts.iter().map(|part| part.starts.len()).sum();
        let mut all = Self {
            photons: Vec::with_capacity(photons),
            paths: Vec::with_capacity(photons),
            starts: Vec::with_capacity(points),
            ledger: EnergyLedger::default(),
        };
        for mut part in parts {
            let base = all.photons.len();
            all.starts
                .extend(part.starts.iter().map(|start| base + start));
            all.photons.append(&mut part.photons);
            all.paths.append(&mut part.paths);
            all.ledger.merge(&part.ledger);
        }
        all
    }

    /// Checks every footprint against where the photon's neighbours landed, if that is asked for and
    /// they are all the photons of a lattice of two parameters.
    pub(crate) fn check_footprints(&mut self, options: &TraceOptions, planned: &EmissionBatch) {
        let is_lattice = planned.points().sequence() == Sequence::Grid
            && planned.emitter().dimensions() == 2
            && self.starts.len() == planned.count() as usize;
        // Where photons were culled, those beside them would seem to stand at an edge.
        let is_whole = options.culling == Culling::default();
        if !(options.check_footprints && options.differentials && is_lattice && is_whole) {
            return;
        }
        let lattice = planned.lattice();
        self.starts.push(self.photons.len());
        let photons = LatticePhotons {
            lattice,
            photons: &self.photons,
            paths: &self.paths,
            starts: &self.starts,
        };
        let count = self.starts.len() as u32 - 1;
        #[cfg(feature = "parallel")]
        let checked: Vec<CheckedFootprint> = {
            use rayon::prelude::*;
            (0..count)
                .into_par_iter()
                .with_min_len(1024)
                .flat_map_iter(|point| photons.checked(point))
                .collect()
        };
        #[cfg(not(feature = "parallel"))]
        let checked: Vec<CheckedFootprint> = (0..count)
            .flat_map(|point| photons.checked(point))
            .collect();
        for (photon, footprint) in self.photons.iter_mut().zip(checked) {
            photon.position = footprint.position;
            photon.axes = footprint.axes;
            if footprint.cells != 1.0 {
                let weighted = footprint.cells * photon.flux;
                self.ledger.silhouette_gain += (weighted - photon.flux).as_dvec3();
                photon.flux = weighted;
            }
            photon.source = footprint.source;
            self.ledger.replaced_differentials +=
                u64::from(footprint.source == FootprintSource::Neighbour);
        }
    }
}
