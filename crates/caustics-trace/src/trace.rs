use std::ops::Range;

use caustics_accel::Intersect;
use caustics_sampling::CounterRng;
use caustics_scene::World;
use glam::DVec3;

use crate::edges::EdgeTracer;
use crate::emission::Emission;
use crate::emission_batch::EmissionBatch;
use crate::lattice::Lattice;
use crate::ledger::{EnergyLedger, Fate};
use crate::options::{Branching, TraceError, TraceOptions};
use crate::parallel;
use crate::photon::{Photon, PhotonMap};
use crate::plan::EmissionPlan;
use crate::traced::Traced;
use crate::tracer::PathTracer;
use crate::wave::{WAVE, Wave};

/// The least photons that one task traces, and points whose photons one task divides at edges: what a task
/// begins with costs little beside them.
const LEAST_OF_TASK: u32 = 256;

/// The most, so that what a task holds stays small.
const MOST_OF_TASK: u32 = 2048;

/// So many tasks are balanced.
const TASKS: u32 = 64;

/// How many of `all` one task does: as many for any number of threads, so that what comes of it is the same.
fn of_task(all: u32) -> u32 {
    (all / TASKS).clamp(LEAST_OF_TASK, MOST_OF_TASK)
}

/// Traces photons from all lights of `world` and returns those that landed after at least one
/// specular event, with the ledger of where all the energy went.
///
/// The photons are shared among the pairs of a light and a caster as [`EmissionPlan`] says. The
/// result does not depend on the number of threads. `progress` is called with the number of photons
/// just finished, from any thread.
///
/// # Errors
/// If the options are out of range.
pub fn trace_photons<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    options: &TraceOptions,
    progress: &(dyn Fn(u32) + Sync),
) -> Result<PhotonMap, TraceError> {
    let plan = EmissionPlan::new(world, intersect, options)?;
    trace_plan(world, intersect, &plan, options, progress)
}

/// Traces the photons of a plan that was made for the same world and options.
///
/// # Errors
/// If the options are out of range.
pub fn trace_plan<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    plan: &EmissionPlan,
    options: &TraceOptions,
    progress: &(dyn Fn(u32) + Sync),
) -> Result<PhotonMap, TraceError> {
    options.validate()?;
    let mut map = PhotonMap::default();
    for of_light in plan.lights() {
        let before = counted(&map);
        for (number, planned) in of_light.iter().enumerate() {
            let batch = Batch {
                world,
                intersect,
                options,
                plan,
                planned,
                earlier: &of_light[..number],
            };
            batch.trace(&mut map, 0..planned.count(), progress);
        }
        if let Some(first) = of_light.first() {
            let aimed = counted(&map) - before;
            map.ledger.emit_unaimed(first.emitter().power() - aimed);
        }
    }
    Ok(map)
}

/// Traces some of the photons of a plan, counted over all its batches in their order; numbers from
/// [`EmissionPlan::count`] on are no photons.
///
/// Over ranges that join to all of them, photons and ledgers are those of [`trace_plan`], but for
/// what is not aimed at, which no ledger of a part has, and but for footprints, which are checked
/// against their neighbours only in a part that has all photons of a pair. A host that takes all
/// photons in their order loses neither with [`PhotonStream`](crate::PhotonStream).
///
/// # Errors
/// If the options are out of range.
pub fn trace_part<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    plan: &EmissionPlan,
    options: &TraceOptions,
    photons: Range<u32>,
) -> Result<PhotonMap, TraceError> {
    options.validate()?;
    let mut map = PhotonMap::default();
    let mut first = 0u32;
    for of_light in plan.lights() {
        for (number, planned) in of_light.iter().enumerate() {
            let batch = Batch {
                world,
                intersect,
                options,
                plan,
                planned,
                earlier: &of_light[..number],
            };
            let count = planned.count();
            let within = photons.start.saturating_sub(first).min(count)
                ..photons.end.saturating_sub(first).min(count);
            batch.trace(&mut map, within, &|_| {});
            first = first.saturating_add(count);
        }
    }
    Ok(map)
}

/// What one emitted photon came to, as [`trace_photon`] returns it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonTrail {
    /// Its parts that were stored, in the order in which they landed.
    pub photons: Vec<Photon>,
    /// For each of them, a hash of the objects that it met before it landed and of what it did there.
    /// Photons of one path on one object are parts of one smooth sheet of light.
    pub paths: Vec<u32>,
    /// Where its energy went.
    pub ledger: EnergyLedger,
}

/// Traces one photon of a plan, counted over all its batches in their order, and all its branches:
/// what [`trace_part`] does for a range, with its paths. A number from [`EmissionPlan::count`] on has
/// an empty trail.
///
/// # Errors
/// If the options are out of range.
pub fn trace_photon<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    plan: &EmissionPlan,
    options: &TraceOptions,
    photon: u32,
) -> Result<PhotonTrail, TraceError> {
    options.validate()?;
    let mut index = photon;
    for of_light in plan.lights() {
        for (number, planned) in of_light.iter().enumerate() {
            if index >= planned.count() {
                index -= planned.count();
                continue;
            }
            let batch = Batch {
                world,
                intersect,
                options,
                plan,
                planned,
                earlier: &of_light[..number],
            };
            return Ok(if planned.emitter().dimensions() == 2 {
                batch.trail::<2>(index)
            } else {
                batch.trail::<4>(index)
            });
        }
    }
    Ok(PhotonTrail::default())
}

/// The flux of all photons so far, that of directions which two pairs cover counted once.
fn counted(map: &PhotonMap) -> DVec3 {
    map.ledger.emitted().flux - map.ledger.entry(Fate::Overlap).flux
}

/// The photons of one emitter, and all that it takes to trace them.
pub(crate) struct Batch<'a, I: ?Sized> {
    pub(crate) world: &'a World,
    pub(crate) intersect: &'a I,
    pub(crate) options: &'a TraceOptions,
    pub(crate) plan: &'a EmissionPlan,
    pub(crate) planned: &'a EmissionBatch,
    /// Of the same light.
    pub(crate) earlier: &'a [EmissionBatch],
}

impl<'a, I: Intersect + ?Sized> Batch<'a, I> {
    /// A tracer for its photons.
    pub(crate) fn tracer<const N: usize>(&self) -> PathTracer<'a, I, N> {
        let caster = self.planned.emitter().caster();
        PathTracer::new(self.world, self.intersect, self.options)
            .aimed_at(caster.map(|it| (self.plan.casters(), it)), self.earlier)
            .reflected_at(self.plan.boundaries())
    }

    fn trace_tasks<const N: usize>(
        &self,
        photons: Range<u32>,
        progress: &(dyn Fn(u32) + Sync),
    ) -> Traced {
        let size = of_task(photons.len() as u32);
        let tasks = (photons.len() as u32).div_ceil(size);
        let parts = parallel::made(tasks, |task| {
            let start = photons.start + task * size;
            let range = start..photons.end.min(start.saturating_add(size));
            let finished = range.len() as u32;
            let traced = self.trace_range::<N>(range);
            progress(finished);
            traced
        });
        Traced::joined(parts)
    }

    /// Traces the photons with these numbers, on all threads.
    pub(crate) fn traced(&self, photons: Range<u32>, progress: &(dyn Fn(u32) + Sync)) -> Traced {
        if !self.options.differentials {
            self.trace_tasks::<0>(photons, progress)
        } else if self.planned.emitter().dimensions() == 2 {
            self.trace_tasks::<2>(photons, progress)
        } else {
            self.trace_tasks::<4>(photons, progress)
        }
    }

    /// The same, checked as far as all neighbours are among them, and culled.
    fn trace(&self, map: &mut PhotonMap, photons: Range<u32>, progress: &(dyn Fn(u32) + Sync)) {
        let mut all = self.traced(photons, progress);
        let is_whole = all.starts.len() == self.planned.count() as usize;
        if is_whole && Traced::are_checked(self.options, self.planned) {
            all.photons = self.checked(&mut all, self.planned.lattice(), 0..self.planned.count());
        }
        let culling = &self.options.culling;
        culling.apply(&mut all.photons, &mut all.ledger);
        map.photons.append(&mut all.photons);
        map.ledger.merge(&all.ledger);
    }

    /// Those of `traced` that come from some points, with checked footprints and divided at edges as
    /// far as is asked for; `lattice` has all points that there are photons of there.
    pub(crate) fn checked(
        &self,
        traced: &mut Traced,
        lattice: &Lattice,
        points: Range<u32>,
    ) -> Vec<Photon> {
        if !self.options.divide_edges || self.options.branching != Branching::SplitAll {
            return traced.checked(lattice, points);
        }
        let size = of_task(points.len() as u32);
        let tasks = (points.len() as u32).div_ceil(size);
        let parts = traced.with_neighbours(lattice, |photons| {
            parallel::made(tasks, |task| {
                let start = points.start + task * size;
                let end = points.end.min(start.saturating_add(size));
                EdgeTracer::new(self).checked(photons, start..end)
            })
        });
        let mut checked = Vec::with_capacity(parts.iter().map(|(it, _)| it.len()).sum());
        for (mut photons, ledger) in parts {
            checked.append(&mut photons);
            traced.ledger.merge(&ledger);
        }
        traced.book_edges(points, &checked);
        checked
    }

    fn trace_range<const N: usize>(&self, range: Range<u32>) -> Traced {
        let mut tracer = self.tracer::<N>();
        let mut starts = Vec::with_capacity(range.len());
        let mut wave = Wave::new();
        for start in range.clone().step_by(WAVE) {
            let photons = start..range.end.min(start.saturating_add(WAVE as u32));
            let emitted = photons.map(|index| self.emitted(index));
            wave.trace(&mut tracer, emitted, self.planned.media(), &mut starts);
        }
        Traced {
            photons: tracer.photons,
            paths: tracer.paths,
            starts,
            ledger: tracer.ledger,
        }
    }

    fn trail<const N: usize>(&self, index: u32) -> PhotonTrail {
        let mut tracer = self.tracer::<N>();
        if let Some((emission, mut rng)) = self.emitted(index) {
            tracer.trace(&emission, self.planned.media(), &mut rng);
        }
        let culling = &self.options.culling;
        let mut ledger = tracer.ledger;
        let landed = tracer.photons.into_iter().zip(tracer.paths);
        let (photons, paths) = landed
            .filter_map(|(mut photon, path)| {
                let is_kept = culling.keeps(&mut photon, &mut ledger);
                is_kept.then_some((photon, path))
            })
            .unzip();
        PhotonTrail {
            photons,
            paths,
            ledger,
        }
    }

    /// A photon as its light sends it, and its random numbers.
    fn emitted<const N: usize>(&self, index: u32) -> Option<(Emission<N>, CounterRng)> {
        let number = self.planned.point_number(index);
        let sample = self.planned.sample_of(number);
        let emission = self.planned.emitter().emit::<N>(self.world, &sample)?;
        let rng = self.planned.random(self.options.seed, u64::from(number));
        Some((emission, rng))
    }
}
