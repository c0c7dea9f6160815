use caustics_accel::Intersect;
use caustics_sampling::{CounterRng, PointSet, Sequence};
use caustics_scene::World;

use crate::emission::{Emission, EmissionSample, Emitter};
use crate::ledger::EnergyLedger;
use crate::media::MediumStack;
use crate::options::{TraceError, TraceOptions};
use crate::photon::{Photon, PhotonMap};
use crate::refine::trace_refined;
use crate::tracer::PathTracer;

/// Photons that one task traces: enough to share out, few enough to balance.
const CHUNK: u32 = 2048;

/// Traces photons from all lights of `world` and returns those that landed after at least one
/// specular event, with the ledger of where all the energy went.
///
/// The photons are shared among the lights by the power that each sends towards the specular
/// objects. The result does not depend on the number of threads. `progress` is called with the
/// number of photons just finished, from any thread.
///
/// # Errors
/// If the options are out of range.
pub fn trace_photons<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    options: &TraceOptions,
    progress: &(dyn Fn(u32) + Sync),
) -> Result<PhotonMap, TraceError> {
    options.validate()?;
    let emitters = Emitter::all(world, options.aim);
    let counts = Emitter::share(&emitters, options.photons);
    let mut map = PhotonMap::default();
    let mut first = 0u32;
    for (emitter, &count) in emitters.iter().zip(&counts) {
        let media = emitter.start().map_or(MediumStack::EMPTY, |start| {
            MediumStack::at(world, intersect, start)
        });
        let batch = Batch {
            world,
            intersect,
            options,
            emitter,
            media,
            first,
            count,
        };
        let before = map.ledger.emitted().flux;
        if batch.is_refined() {
            let levels = options.refinement.levels;
            let detail = options.refinement.detail * world.specular_bounds().diagonal().length();
            let mut refined = trace_refined(&batch, levels, detail, progress);
            map.photons.append(&mut refined.photons);
            map.ledger.merge(&refined.ledger);
        } else if emitter.dimensions() == 2 {
            batch.trace::<2>(&mut map, progress);
        } else {
            batch.trace::<4>(&mut map, progress);
        }
        let aimed = map.ledger.emitted().flux - before;
        map.ledger.emit_unaimed(emitter.power() - aimed);
        first += count;
    }
    Ok(map)
}

/// What one emitted photon came to, as [`trace_photon`] returns it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonTrail {
    /// Its parts that were stored, in the order in which they landed.
    pub photons: Vec<Photon>,
    /// For each of them, a hash of the objects that it met and of what it did there. Photons of one
    /// path are parts of one smooth sheet of light.
    pub paths: Vec<u32>,
    /// Where its energy went.
    pub ledger: EnergyLedger,
}

/// Follows one photon and all its branches, as [`trace_photons`] does for all: for hosts that emit
/// photons of their own, and for comparing tracers photon by photon.
///
/// `media` are those around its start, `number` is its number among the photons of all lights, which
/// chooses its random numbers. Of the options, those that concern emission are not used.
///
/// # Errors
/// If the options are out of range.
pub fn trace_photon<I: Intersect + ?Sized, const N: usize>(
    world: &World,
    intersect: &I,
    options: &TraceOptions,
    emission: &Emission<N>,
    media: MediumStack,
    number: u32,
) -> Result<PhotonTrail, TraceError> {
    options.validate()?;
    let mut tracer = PathTracer::<I, N>::new(world, intersect, options);
    let mut rng = CounterRng::new(options.seed, u64::from(number));
    tracer.trace(emission, media, &mut rng);
    Ok(PhotonTrail {
        photons: tracer.photons,
        paths: tracer.paths,
        ledger: tracer.ledger,
    })
}

/// The photons of one emitter.
pub(crate) struct Batch<'a, I: ?Sized> {
    pub(crate) world: &'a World,
    pub(crate) intersect: &'a I,
    pub(crate) options: &'a TraceOptions,
    pub(crate) emitter: &'a Emitter<'a>,
    /// The media around the light.
    pub(crate) media: MediumStack,
    /// Number of its first photon among all.
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl<I: Intersect + ?Sized> Batch<'_, I> {
    /// Whether its lattice is made finer where it must.
    fn is_refined(&self) -> bool {
        self.options.refinement.levels > 0
            && self.options.sequence == Sequence::Grid
            && self.emitter.dimensions() == 2
            && self.count > 0
    }

    fn trace<const N: usize>(&self, map: &mut PhotonMap, progress: &(dyn Fn(u32) + Sync)) {
        let chunks = self.count.div_ceil(CHUNK);
        let run = |chunk: u32| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.count);
            let finished = range.len() as u32;
            let traced = self.trace_range::<N>(range);
            progress(finished);
            traced
        };
        #[cfg(feature = "parallel")]
        let parts: Vec<PhotonMap> = {
            use rayon::prelude::*;
            (0..chunks).into_par_iter().map(run).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let parts: Vec<PhotonMap> = (0..chunks).map(run).collect();

        map.photons
            .reserve(parts.iter().map(|part| part.photons.len()).sum());
        for mut part in parts {
            map.photons.append(&mut part.photons);
            map.ledger.merge(&part.ledger);
        }
    }

    fn trace_range<const N: usize>(&self, range: std::ops::Range<u32>) -> PhotonMap {
        let mut tracer = PathTracer::<I, N>::new(self.world, self.intersect, self.options);
        let points = PointSet::new(self.options.sequence, self.count, self.options.seed);
        for index in range {
            let sample = EmissionSample::of(&points, index);
            let Some(emission) = self.emitter.emit::<N>(&sample) else {
                continue;
            };
            let mut rng = CounterRng::new(self.options.seed, u64::from(self.first + index));
            tracer.trace(&emission, self.media, &mut rng);
        }
        PhotonMap {
            photons: tracer.photons,
            ledger: tracer.ledger,
        }
    }
}
