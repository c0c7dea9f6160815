use std::sync::Arc;

use caustics_accel::Intersect;
use caustics_geometry::Ray;
use caustics_sampling::{CounterRng, PointSet, Sequence, apportion_with_floor};
use caustics_scene::World;

use crate::boundary::Boundaries;
use crate::casters::Casters;
use crate::culling::Culling;
use crate::emission::EmissionSample;
use crate::emitter::Emitter;
use crate::lattice::Lattice;
use crate::ledger::{EnergyLedger, Fate};
use crate::media::MediumStack;
use crate::options::{Aim, TraceError, TraceOptions};
use crate::projection_map::ProjectionMap;
use crate::tracer::PathTracer;

/// The most photons that go ahead of each emitter's, to see how much of its light becomes a caustic.
const PILOTS: u32 = 256;

/// The part of all photons that may go ahead, for all emitters together.
const PILOT_PART: u32 = 8;

/// What an emitter counts for whose pilots all went astray, relative to its aimed power: enough to
/// be given its floor.
const LEAST_WEIGHT: f64 = 1e-6;

/// What a projection map costs, in rays that miss: measured in processor time at 5 ms for a sun and
/// 20 ms for a lamp, against 0.2 µs a ray.
const MAP_COST: f64 = 50_000.0;

/// What each triangle that is drawn into it costs, likewise: 0.08 to 0.16 µs.
const TRIANGLE_COST: f64 = 0.5;

/// Where more of an emitter's square than this is marked, its projection map is not used.
const FULL_COVERAGE: f32 = 0.9;

/// Sequences without rows are searched point by point for those in marked cells; not where fewer
/// than this part are.
const LEAST_SEARCHED: f32 = 1.0 / 16.0;

/// A lattice is kept from one frame to the next while at least this part of its share is used.
const LEAST_KEPT: f64 = 0.8;

/// Which photons are emitted: every light's emitters, one for each caster, and how many photons each
/// of them gets.
///
/// Photons are shared by the flux that each pair of a light and a caster brings to receivers, as a
/// few pilot paths find it, with a floor for each pair
/// ([`TraceOptions::share_floor`]). The shares sum to
/// [`TraceOptions::photons`] exactly; a pair with a projection map may leave a few of its own unused.
///
/// Photon `i` of a pair is made from point `i` of the pair's own set and draws its random decisions
/// from a stream of its own, so that it does not depend on what other pairs there are. It does
/// depend on how many photons its pair has: [`following`](Self::following) keeps these numbers from
/// one frame to the next.
#[derive(Clone, Debug)]
pub struct EmissionPlan {
    casters: Casters,
    batches: Vec<EmissionBatch>,
    boundaries: Arc<Boundaries>,
}

/// The photons of one emitter.
#[derive(Clone, Debug)]
pub struct EmissionBatch {
    emitter: Emitter,
    map: Option<ProjectionMap>,
    lattice: Lattice,
    /// The most photons that it may have.
    share: u32,
    /// What the pair counts for when photons are shared.
    weight: f64,
    /// The part of its photons that meet their caster first, without a projection map.
    accuracy: f64,
    /// Which of the random streams are its own.
    stream: u32,
    media: MediumStack,
}

impl EmissionPlan {
    /// Aims all lights of a world and shares the photons.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Result<Self, TraceError> {
        options.validate()?;
        let casters = Casters::of(world);
        let emitters = Emitter::all(world, &casters, options.aim);
        let mut plan = Self::weighed(world, intersect, casters, emitters, &[], options);
        if plan.reflects(options) {
            plan.boundaries = Arc::new(Boundaries::of(world));
        }
        plan.share(world, options);
        Ok(plan)
    }

    /// The same photons for a world that has changed since: each pair that there was before keeps
    /// its number of photons, and as far as its caster still fits in them the directions or the
    /// rectangle that it covers, so that what did not move does not change by a bit and what moved
    /// changes smoothly.
    ///
    /// Where a pair has come or gone, or one that covers other directions now counts for more than
    /// twice or less than half of what it did, all photons are shared anew.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn following<I: Intersect + ?Sized>(
        &self,
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Result<Self, TraceError> {
        options.validate()?;
        let casters = Casters::of(world);
        let before: Vec<&Emitter> = self.batches.iter().map(EmissionBatch::emitter).collect();
        let emitters = Emitter::following(world, &casters, options.aim, &before);
        let mut plan = Self::weighed(world, intersect, casters, emitters, &self.batches, options);
        if plan.reflects(options) {
            plan.boundaries = Arc::new(self.boundaries.following(world));
        }
        let total: u32 = self.batches.iter().map(|batch| batch.share).sum();
        let is_alike = plan.batches.len() == self.batches.len()
            && (total == options.photons || total == 0)
            && plan.batches.iter().zip(&self.batches).all(|(new, old)| {
                let same_pair = new.stream == old.stream
                    && new.emitter.source() == old.emitter.source()
                    && new.emitter.caster() == old.emitter.caster();
                let (least, most) = (0.5 * old.weight, 2.0 * old.weight);
                same_pair && (least..=most).contains(&new.weight)
            });
        if !is_alike {
            return Self::new(world, intersect, options);
        }
        let settle = |(new, old): (&mut EmissionBatch, &EmissionBatch)| {
            // The old weight stays, or slow changes would never add up to a new sharing.
            new.weight = old.weight;
            new.follow(old, world, &plan.casters, options);
        };
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            plan.batches
                .par_iter_mut()
                .zip(&self.batches)
                .for_each(settle);
        }
        #[cfg(not(feature = "parallel"))]
        plan.batches.iter_mut().zip(&self.batches).for_each(settle);
        Ok(plan)
    }

    /// What the photons are aimed at.
    #[must_use]
    pub fn casters(&self) -> &Casters {
        &self.casters
    }

    /// The photons of each emitter, those of one light side by side.
    #[must_use]
    pub fn batches(&self) -> &[EmissionBatch] {
        &self.batches
    }

    /// Photons of all emitters together.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.batches.iter().map(EmissionBatch::count).sum()
    }

    /// The batches of each light.
    pub fn lights(&self) -> impl Iterator<Item = &[EmissionBatch]> {
        self.batches
            .chunk_by(|a, b| a.emitter.source() == b.emitter.source())
    }

    /// All emitters with what they count for, and no photons yet.
    fn weighed<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        casters: Casters,
        emitters: Vec<Emitter>,
        before: &[EmissionBatch],
        options: &TraceOptions,
    ) -> Self {
        let is_lit = |it: &&Emitter| it.aimed_power().element_sum() > 0.0;
        let lit = emitters.iter().filter(is_lit).count() as u32;
        let pilots = (options.photons / PILOT_PART / lit.max(1)).clamp(1, PILOTS);
        let weigh = |emitter: Emitter| {
            let mut batch = EmissionBatch::new(world, intersect, emitter, &casters, options);
            // A pair that covers the same directions as before counts for as much.
            let known = before.iter().find(|old| {
                old.stream == batch.stream && old.emitter.domain() == batch.emitter.domain()
            });
            if let Some(known) = known {
                (batch.weight, batch.accuracy) = (known.weight, known.accuracy);
            } else if options.aim != Aim::Everywhere && batch.weight > 0.0 {
                batch.send_pilots(world, intersect, &casters, options, pilots);
            }
            batch
        };
        #[cfg(feature = "parallel")]
        let batches = {
            use rayon::prelude::*;
            emitters.into_par_iter().map(weigh).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let batches = emitters.into_iter().map(weigh).collect();
        Self {
            casters,
            batches,
            boundaries: Arc::default(),
        }
    }

    /// Whether footprints are reflected where receivers end, as far as any may be.
    fn reflects(&self, options: &TraceOptions) -> bool {
        let may_overlap = |batch: &EmissionBatch| batch.emitter.dimensions() > 2;
        options.reflect_at_boundaries
            && options.differentials
            && self.batches.iter().any(may_overlap)
    }

    /// What footprints are reflected at; none where they are not.
    #[must_use]
    pub fn boundaries(&self) -> &Boundaries {
        &self.boundaries
    }

    /// Gives each pair its photons.
    fn share(&mut self, world: &World, options: &TraceOptions) {
        let weights: Vec<f64> = self.batches.iter().map(|batch| batch.weight).collect();
        let shares = share(&weights, options.photons, options.share_floor);
        let casters = &self.casters;
        let settle = |(batch, share): (&mut EmissionBatch, u32)| {
            batch.share = share;
            batch.map = batch.worthwhile_map(world, casters, options);
            batch.lattice = batch.fresh_lattice(options);
        };
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            self.batches.par_iter_mut().zip(shares).for_each(settle);
        }
        #[cfg(not(feature = "parallel"))]
        self.batches.iter_mut().zip(shares).for_each(settle);
    }
}

impl EmissionBatch {
    fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        emitter: Emitter,
        casters: &Casters,
        options: &TraceOptions,
    ) -> Self {
        let media = emitter
            .domain()
            .start(world)
            .map_or(MediumStack::EMPTY, |start| {
                MediumStack::at(world, intersect, start)
            });
        Self {
            map: None,
            lattice: Lattice::whole(options.sequence, 0, options.seed),
            share: 0,
            weight: emitter.aimed_power().element_sum(),
            accuracy: 1.0,
            stream: emitter.identity(casters),
            media,
            emitter,
        }
    }

    /// The light, the caster, and the map from samples to rays.
    #[must_use]
    pub fn emitter(&self) -> &Emitter {
        &self.emitter
    }

    /// Number of photons.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.lattice.count()
    }

    /// The set of points that the photons are made from. With a [`map`](Self::map) only those in
    /// marked cells are; each still stands for one part in [`PointSet::count`].
    #[must_use]
    pub fn points(&self) -> &PointSet {
        self.lattice.points()
    }

    /// Which cells of the unit square send photons; `None` where all do.
    #[must_use]
    pub fn map(&self) -> Option<&ProjectionMap> {
        self.map.as_ref()
    }

    /// The number of photon `index`, below [`count`](Self::count), in the set of points.
    #[must_use]
    pub fn point_number(&self, index: u32) -> u32 {
        self.lattice.number(index)
    }

    /// The runs of consecutive points that photons are made from, in order: the number of the first
    /// in the set of points, and the photons before it. `None` where all points are used.
    #[must_use]
    pub fn spans(&self) -> Option<impl Iterator<Item = (u32, u32)>> {
        self.lattice.spans()
    }

    /// The first word of the streams that photons draw from: with the number of a point as the
    /// second, a stream of [`random`](Self::random).
    #[must_use]
    pub fn stream(&self) -> u32 {
        self.stream
    }

    /// The sample of photon `index`, below [`count`](Self::count).
    #[must_use]
    pub fn sample(&self, index: u32) -> EmissionSample {
        self.lattice.sample(index)
    }

    /// Where the photon of point `number` draws its random decisions from.
    #[must_use]
    pub fn random(&self, seed: u64, number: u64) -> CounterRng {
        CounterRng::new(seed, (u64::from(self.stream) << 32) ^ number)
    }

    /// The media around the light.
    #[must_use]
    pub fn media(&self) -> MediumStack {
        self.media
    }

    /// The points of its photons.
    pub(crate) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Whether a ray of the same light is one that these photons stand for, within rounding.
    pub(crate) fn covers(&self, ray: &Ray) -> bool {
        let domain = self.emitter.domain();
        domain.covers(ray)
            && self.map.as_ref().is_none_or(|map| {
                domain
                    .point_of(ray)
                    .is_some_and(|point| map.contains(point))
            })
    }

    /// Finds by a few photons what the pair counts for, and how many of them meet their caster.
    fn send_pilots<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
        pilots: u32,
    ) {
        // A camera that turns moves no photons.
        let options = &TraceOptions {
            culling: Culling::default(),
            ..*options
        };
        let ledger = if self.emitter.dimensions() == 2 {
            self.pilots::<I, 2>(world, intersect, casters, options, pilots)
        } else {
            self.pilots::<I, 4>(world, intersect, casters, options, pilots)
        };
        let flux = |fate| ledger.entry(fate).flux.element_sum();
        let astray = flux(Fate::Missed) + flux(Fate::Direct) + flux(Fate::Overlap);
        let emitted = ledger.emitted().flux.element_sum();
        self.accuracy = if emitted > 0.0 {
            1.0 - astray / emitted
        } else {
            0.0
        };
        self.weight = flux(Fate::Stored).max(LEAST_WEIGHT * self.weight);
    }

    fn pilots<I: Intersect + ?Sized, const N: usize>(
        &self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
        pilots: u32,
    ) -> EnergyLedger {
        let points = PointSet::new(Sequence::Halton, pilots, 0);
        let aimed = self.emitter.caster().map(|caster| (casters, caster));
        let mut tracer = PathTracer::<I, N>::new(world, intersect, options).aimed_at(aimed, &[]);
        for index in 0..pilots {
            let sample = EmissionSample::of(&points, index);
            if let Some(emission) = self.emitter.emit::<N>(world, &sample) {
                let mut rng = self.random(0, u64::from(index));
                tracer.trace(&emission, self.media, &mut rng);
            }
        }
        tracer.ledger
    }

    /// The projection map, where drawing it costs less than it saves: photons that would miss.
    fn worthwhile_map(
        &self,
        world: &World,
        casters: &Casters,
        options: &TraceOptions,
    ) -> Option<ProjectionMap> {
        let objects = casters.objects(self.emitter.caster()?);
        let triangles: u64 = objects
            .iter()
            .map(|&object| world.objects()[object as usize].triangles.len() as u64)
            .sum();
        let saved = (1.0 - self.accuracy) / self.accuracy.max(1e-3) * f64::from(self.share);
        let cost = MAP_COST + TRIANGLE_COST * triangles as f64;
        if options.aim != Aim::Casters || saved < cost {
            return None;
        }
        let map = ProjectionMap::of(world, objects, self.emitter.domain())?;
        let searched = options.sequence != Sequence::Grid;
        let is_sparse = searched && map.coverage() < LEAST_SEARCHED;
        let is_useful = map.coverage() > 0.0 && map.coverage() <= FULL_COVERAGE && !is_sparse;
        is_useful.then_some(map)
    }

    fn fresh_lattice(&self, options: &TraceOptions) -> Lattice {
        match &self.map {
            Some(map) => Lattice::marked(options.sequence, self.share, options.seed, map),
            None => Lattice::whole(options.sequence, self.share, options.seed),
        }
    }

    /// Takes over the photons of the same pair in the frame before.
    fn follow(&mut self, old: &Self, world: &World, casters: &Casters, options: &TraceOptions) {
        self.share = old.share;
        // With or without a map, as before: to change over would move all photons.
        self.map = match &old.map {
            Some(_) => self.emitter.caster().and_then(|caster| {
                ProjectionMap::of(world, casters.objects(caster), self.emitter.domain())
            }),
            None => None,
        };
        let points = *old.lattice.points();
        let is_same_set = points == PointSet::new(options.sequence, points.count(), options.seed);
        let kept = match &self.map {
            None => old.lattice.clone(),
            Some(map) => Lattice::within(points, map),
        };
        let range = (LEAST_KEPT * f64::from(self.share)) as u32..=self.share;
        let is_full = range.contains(&kept.count()) || self.map.is_none();
        self.lattice = if is_same_set && is_full {
            kept
        } else {
            self.fresh_lattice(options)
        };
    }
}

/// How many of `total` photons each pair gets: in proportion to its weight, but at least
/// `floor` of an equal share.
fn share(weights: &[f64], total: u32, floor: f32) -> Vec<u32> {
    let pairs = weights.iter().filter(|&&weight| weight > 0.0).count();
    let least = f64::from(floor) * f64::from(total) / pairs.max(1) as f64;
    apportion_with_floor(weights, total as usize, least as usize).map_or_else(
        // Nothing to share them among.
        |_| vec![0; weights.len()],
        |counts| counts.into_iter().map(|it| it as u32).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_have_a_floor_and_sum_to_the_budget() {
        assert_eq!(share(&[1000.0, 1.0], 1000, 0.25), [875, 125]);
        assert_eq!(share(&[1000.0, 0.0, 1.0], 1000, 0.0), [999, 0, 1]);
        assert_eq!(share(&[0.0, 0.0], 1000, 0.25), [0, 0]);
        assert!(share(&[], 1000, 0.25).is_empty());
        // Fewer photons than pairs.
        assert_eq!(share(&[1.0; 5], 3, 1.0).iter().sum::<u32>(), 3);
        let shares = share(&[1.0, 2.0], u32::MAX, 1.0);
        let sum: u64 = shares.into_iter().map(u64::from).sum();
        assert_eq!(sum, u64::from(u32::MAX));
    }
}
