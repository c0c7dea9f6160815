use caustics_accel::Intersect;
use caustics_geometry::{Hit, Ray};
use caustics_sampling::CounterRng;

use crate::emission::Emission;
use crate::media::MediumStack;
use crate::photon::Photon;
use crate::tracer::{Branch, PathTracer};

/// Photons that go on together: enough that neighbours' rays make bundles, few enough that their
/// branches stay in a core's own memory.
pub(crate) const WAVE: usize = 256;

/// Photons that are traced side by side, each a surface further in every step, so that the rays of
/// neighbours in the lattice come one after the other and share their way through the scene.
///
/// Each photon's branches go their ways in the same order as alone, and draw the same random numbers:
/// what comes of it is the same, but for the order in which a ledger is summed.
pub(crate) struct Wave<const N: usize> {
    paths: Vec<Path<N>>,
    /// Which of them are still on their way.
    active: Vec<usize>,
    moving: Vec<Branch<N>>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// What was stored, in the order of landing, with the hash of what its path met.
    landed: Vec<(Photon, u32)>,
    /// The path that each of these is a part of.
    owners: Vec<usize>,
}

/// One photon on its way.
struct Path<const N: usize> {
    pending: Vec<Branch<N>>,
    threshold: f32,
    rng: CounterRng,
}

impl<const N: usize> Wave<N> {
    pub(crate) fn new() -> Self {
        Self {
            paths: Vec::with_capacity(WAVE),
            active: Vec::with_capacity(WAVE),
            moving: Vec::with_capacity(WAVE),
            rays: Vec::with_capacity(WAVE),
            hits: Vec::with_capacity(WAVE),
            landed: Vec::new(),
            owners: Vec::new(),
        }
    }

    /// Takes photons to their ends and stores what lands, in the order of the photons; in `starts`,
    /// where the parts of each begin. `emitted` has none in the place of one that its light does not
    /// send.
    pub(crate) fn trace<I: Intersect + ?Sized>(
        &mut self,
        tracer: &mut PathTracer<'_, I, N>,
        emitted: impl Iterator<Item = Option<(Emission<N>, CounterRng)>>,
        media: MediumStack,
        starts: &mut Vec<usize>,
    ) {
        let first = tracer.photons.len();
        self.owners.clear();
        let count = self.send(tracer, emitted, media);
        loop {
            self.moving.clear();
            self.rays.clear();
            let (paths, moving, rays) = (&mut self.paths, &mut self.moving, &mut self.rays);
            self.active.retain(|&number| {
                std::mem::swap(&mut tracer.pending, &mut paths[number].pending);
                let next = tracer.next();
                std::mem::swap(&mut tracer.pending, &mut paths[number].pending);
                rays.extend(next.map(|branch| branch.ray));
                moving.extend(next);
                next.is_some()
            });
            if self.rays.is_empty() {
                break;
            }
            self.hits.clear();
            self.hits.resize(self.rays.len(), None);
            tracer.closest_hits(&self.rays, &mut self.hits);
            for ((&number, branch), hit) in self.active.iter().zip(&self.moving).zip(&self.hits) {
                let path = &mut self.paths[number];
                std::mem::swap(&mut tracer.pending, &mut path.pending);
                tracer.advance(*branch, *hit, path.threshold, &mut path.rng);
                std::mem::swap(&mut tracer.pending, &mut path.pending);
                self.owners.resize(tracer.photons.len() - first, number);
            }
        }
        self.sort(tracer, first, count, starts);
    }

    /// Puts all photons at the start of their ways, and returns how many there are.
    fn send<I: Intersect + ?Sized>(
        &mut self,
        tracer: &mut PathTracer<'_, I, N>,
        emitted: impl Iterator<Item = Option<(Emission<N>, CounterRng)>>,
        media: MediumStack,
    ) -> usize {
        self.active.clear();
        let mut count = 0;
        for one in emitted {
            let number = count;
            count += 1;
            if self.paths.len() < count {
                self.paths.push(Path {
                    pending: Vec::new(),
                    threshold: 0.0,
                    rng: CounterRng::new(0, 0),
                });
            }
            if let Some((emission, rng)) = one {
                let path = &mut self.paths[number];
                path.threshold = tracer.threshold(&emission);
                path.rng = rng;
                path.pending.push(tracer.sent(&emission, media));
                self.active.push(number);
            }
        }
        count
    }

    /// Brings what landed, from `first` on, into the order of the photons.
    fn sort<I: Intersect + ?Sized>(
        &mut self,
        tracer: &mut PathTracer<'_, I, N>,
        first: usize,
        count: usize,
        starts: &mut Vec<usize>,
    ) {
        let mut places = vec![0; count];
        for &owner in &self.owners {
            places[owner] += 1;
        }
        let mut next = first;
        for place in &mut places {
            starts.push(next);
            next += std::mem::replace(place, next);
        }
        let (photons, paths) = (&mut tracer.photons[first..], &mut tracer.paths[first..]);
        self.landed.clear();
        self.landed
            .extend(photons.iter().copied().zip(paths.iter().copied()));
        for (&(photon, path), &owner) in self.landed.iter().zip(&self.owners) {
            let place = places[owner] - first;
            (photons[place], paths[place]) = (photon, path);
            places[owner] += 1;
        }
    }
}
