use caustics_sampling::Sequence;

use crate::lattice::Lattice;
use crate::ledger::EnergyLedger;
use crate::neighbours::LatticePhotons;
use crate::options::TraceOptions;
use crate::photon::{FootprintSource, Photon};
use crate::plan::EmissionBatch;

/// What some points of a light's lattice became.
#[derive(Clone, Debug, Default)]
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
        for part in parts {
            all.append(part);
        }
        all
    }

    /// Takes the photons of the points after these.
    pub(crate) fn append(&mut self, mut next: Self) {
        let base = self.photons.len();
        self.starts
            .extend(next.starts.iter().map(|start| base + start));
        self.photons.append(&mut next.photons);
        self.paths.append(&mut next.paths);
        self.ledger.merge(&next.ledger);
    }

    /// Forgets the photons of the first points.
    pub(crate) fn drop_first(&mut self, points: usize) {
        let photons = self.starts.get(points).copied();
        let photons = photons.unwrap_or(self.photons.len());
        self.photons.drain(..photons);
        self.paths.drain(..photons);
        self.starts.drain(..points.min(self.starts.len()));
        for start in &mut self.starts {
            *start -= photons;
        }
    }

    /// Whether footprints of the photons of this batch are checked against where neighbours landed:
    /// if that is asked for and they are on a lattice of two parameters.
    pub(crate) fn are_checked(options: &TraceOptions, planned: &EmissionBatch) -> bool {
        options.check_footprints
            && options.differentials
            && planned.points().sequence() == Sequence::Grid
            && planned.emitter().dimensions() == 2
    }

    /// Checks every footprint against where the photon's neighbours landed, where that is to be done
    /// and these are all photons of the batch.
    pub(crate) fn check_footprints(&mut self, options: &TraceOptions, planned: &EmissionBatch) {
        let count = planned.count();
        if Self::are_checked(options, planned) && self.starts.len() == count as usize {
            let before = self.ledger.silhouette_gain;
            self.photons = self.checked(planned.lattice(), 0..count);
            let gain = self.ledger.silhouette_gain - before;
            self.ledger.strengthen(gain);
        }
    }

    /// The photons of some points with checked footprints; `lattice` has all points that there are
    /// photons of here. Those that are booked as stored are so with the flux that they had before.
    pub(crate) fn checked(
        &mut self,
        lattice: &Lattice,
        points: std::ops::Range<u32>,
    ) -> Vec<Photon> {
        self.starts.push(self.photons.len());
        let first = self.starts[points.start as usize];
        let photons = LatticePhotons {
            lattice,
            photons: &self.photons,
            paths: &self.paths,
            starts: &self.starts,
        };
        let of_point = |point: u32| {
            let own = self.starts[point as usize]..self.starts[point as usize + 1];
            let own = self.photons[own].iter();
            own.zip(photons.checked(point))
                .map(|(photon, footprint)| Photon {
                    position: footprint.position,
                    flux: footprint.cells * photon.flux,
                    axes: footprint.axes,
                    source: footprint.source,
                    ..*photon
                })
        };
        #[cfg(feature = "parallel")]
        let checked: Vec<Photon> = {
            use rayon::prelude::*;
            points
                .into_par_iter()
                .with_min_len(1024)
                .flat_map_iter(of_point)
                .collect()
        };
        #[cfg(not(feature = "parallel"))]
        let checked: Vec<Photon> = points.flat_map(of_point).collect();
        self.starts.pop();
        for (before, after) in self.photons[first..].iter().zip(&checked) {
            let gain = after.flux.as_dvec3() - before.flux.as_dvec3();
            self.ledger.silhouette_gain += gain;
            let is_replaced = after.source == FootprintSource::Neighbour;
            self.ledger.replaced_differentials += u64::from(is_replaced);
        }
        checked
    }
}
