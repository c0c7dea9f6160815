use std::ops::Range;

use caustics_sampling::Sequence;
use glam::DVec3;

use crate::emission_batch::EmissionBatch;
use crate::lattice::Lattice;
use crate::ledger::EnergyLedger;
use crate::neighbours::LatticePhotons;
use crate::options::TraceOptions;
use crate::photon::{FootprintSource, Photon};

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
            self.photons = self.checked(planned.lattice(), 0..count);
        }
    }

    /// The photons of some points with checked footprints; `lattice` has all points that there are
    /// photons of here.
    pub(crate) fn checked(&mut self, lattice: &Lattice, points: Range<u32>) -> Vec<Photon> {
        let checked = self.with_neighbours(lattice, |photons| {
            #[cfg(feature = "parallel")]
            let checked: Vec<Photon> = {
                use rayon::prelude::*;
                let points = points.clone().into_par_iter().with_min_len(1024);
                points
                    .flat_map_iter(|it| photons.checked_photons(it))
                    .collect()
            };
            #[cfg(not(feature = "parallel"))]
            let checked: Vec<Photon> = points
                .clone()
                .flat_map(|it| photons.checked_photons(it))
                .collect();
            checked
        });
        let replaced = checked.iter().map(|it| it.source);
        let replaced = replaced.filter(|it| *it == FootprintSource::Neighbour);
        self.ledger.replaced_differentials += replaced.count() as u64;
        self.book_edges(points, &checked);
        checked
    }

    /// These photons, in the order of a lattice that has all points that there are photons of here.
    pub(crate) fn with_neighbours<T>(
        &mut self,
        lattice: &Lattice,
        look: impl FnOnce(&LatticePhotons<'_>) -> T,
    ) -> T {
        self.starts.push(self.photons.len());
        let result = look(&LatticePhotons {
            lattice,
            photons: &self.photons,
            paths: &self.paths,
            starts: &self.starts,
        });
        self.starts.pop();
        result
    }

    /// Books what the photons of some points have more, now that they are checked.
    pub(crate) fn book_edges(&mut self, points: Range<u32>, checked: &[Photon]) {
        let place = |point: u32| {
            let start = self.starts.get(point as usize).copied();
            start.unwrap_or(self.photons.len())
        };
        let before = &self.photons[place(points.start)..place(points.end)];
        let flux = |photons: &[Photon]| -> DVec3 {
            photons.iter().map(|photon| photon.flux.as_dvec3()).sum()
        };
        let gain = flux(checked) - flux(before);
        let more = checked.len() as u64 - before.len() as u64;
        self.ledger.gain_at_edges(more, gain);
    }
}
