use caustics_accel::Intersect;
use caustics_sampling::{CounterRng, PointSet, Sequence, apportion_with_floor};
use caustics_scene::World;

use crate::casters::Casters;
use crate::emission::EmissionSample;
use crate::emitter::Emitter;
use crate::ledger::Fate;
use crate::media::MediumStack;
use crate::options::{Aim, TraceError, TraceOptions};
use crate::tracer::PathTracer;

/// The most photons that go ahead of each emitter's, to see how much of its light becomes a caustic.
const PILOTS: u32 = 256;

/// The part of all photons that may go ahead, for all emitters together.
const PILOT_PART: u32 = 8;

/// What an emitter counts for whose pilots all went astray, relative to its aimed power: enough to
/// be given its floor.
const LEAST_WEIGHT: f64 = 1e-6;

/// Which photons are emitted: every light's emitters, one for each caster, and how many photons each
/// of them gets.
///
/// Photons are shared by the flux that each pair of a light and a caster brings to receivers, as a
/// few pilot paths find it, with a floor for each pair
/// ([`TraceOptions::share_floor`]). The shares sum to
/// [`TraceOptions::photons`] exactly.
///
/// Photon `i` of a pair is made from point `i` of the pair's own set and draws its random decisions
/// from a stream of its own, so that it does not depend on what other pairs there are. It does
/// depend on how many photons its pair has: [`following`](Self::following) keeps these numbers from
/// one frame to the next.
#[derive(Clone, Debug)]
pub struct EmissionPlan {
    casters: Casters,
    batches: Vec<EmissionBatch>,
}

/// The photons of one emitter.
#[derive(Clone, Debug)]
pub struct EmissionBatch {
    emitter: Emitter,
    points: PointSet,
    count: u32,
    /// What the pair counts for when photons are shared.
    weight: f64,
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
        let mut plan = Self::weighed(world, intersect, options);
        let weights: Vec<f64> = plan.batches.iter().map(|batch| batch.weight).collect();
        let counts = share(&weights, options.photons, options.share_floor);
        for (batch, count) in plan.batches.iter_mut().zip(counts) {
            batch.set_count(count, options);
        }
        Ok(plan)
    }

    /// The same photons for a world that has changed since: each pair that there was before keeps
    /// its number of photons, so that what did not move does not change by a bit.
    ///
    /// Where a pair has come or gone, or one counts for more than twice or less than half of what it
    /// did, all photons are shared anew.
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
        let mut plan = Self::weighed(world, intersect, options);
        let total: u32 = self.batches.iter().map(|batch| batch.count).sum();
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
        for (new, old) in plan.batches.iter_mut().zip(&self.batches) {
            // The old weight stays, or slow changes would never add up to a new sharing.
            new.weight = old.weight;
            new.set_count(old.count, options);
        }
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

    /// The batches of each light.
    pub(crate) fn lights(&self) -> impl Iterator<Item = &[EmissionBatch]> {
        self.batches
            .chunk_by(|a, b| a.emitter.source() == b.emitter.source())
    }

    /// All emitters with what they count for, and no photons yet.
    fn weighed<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Self {
        let casters = Casters::of(world);
        let emitters = Emitter::all(world, &casters, options.aim);
        let lit = emitters
            .iter()
            .filter(|it| it.aimed_power().element_sum() > 0.0)
            .count() as u32;
        let mut batches: Vec<EmissionBatch> = emitters
            .into_iter()
            .map(|emitter| EmissionBatch::new(world, intersect, emitter, &casters, options))
            .collect();
        if lit > 1 && options.aim != Aim::Everywhere {
            let pilots = (options.photons / PILOT_PART / lit).clamp(1, PILOTS);
            let weigh = |batch: &mut EmissionBatch| {
                let stored = stored_by_pilots(world, intersect, batch, &casters, options, pilots);
                batch.weight = stored.max(LEAST_WEIGHT * batch.weight);
            };
            #[cfg(feature = "parallel")]
            {
                use rayon::prelude::*;
                batches.par_iter_mut().for_each(weigh);
            }
            #[cfg(not(feature = "parallel"))]
            batches.iter_mut().for_each(weigh);
        }
        Self { casters, batches }
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
            points: PointSet::new(options.sequence, 0, options.seed),
            count: 0,
            weight: emitter.aimed_power().element_sum(),
            stream: emitter.identity(casters),
            media,
            emitter,
        }
    }

    fn set_count(&mut self, count: u32, options: &TraceOptions) {
        self.count = count;
        self.points = PointSet::new(options.sequence, count, options.seed);
    }

    /// The light, the caster, and the map from samples to rays.
    #[must_use]
    pub fn emitter(&self) -> &Emitter {
        &self.emitter
    }

    /// Number of photons.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The set of points that the photons are made from.
    #[must_use]
    pub fn points(&self) -> &PointSet {
        &self.points
    }

    /// The sample of photon `index`, below [`count`](Self::count).
    #[must_use]
    pub fn sample(&self, index: u32) -> EmissionSample {
        EmissionSample::of(&self.points, index)
    }

    /// Where photon `index` draws its random decisions from.
    #[must_use]
    pub fn random(&self, seed: u64, index: u64) -> CounterRng {
        CounterRng::new(seed, (u64::from(self.stream) << 32) ^ index)
    }

    /// The media around the light.
    #[must_use]
    pub fn media(&self) -> MediumStack {
        self.media
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

/// The flux that a few photons of an emitter bring to receivers, in watts, over all channels.
fn stored_by_pilots<I: Intersect + ?Sized>(
    world: &World,
    intersect: &I,
    batch: &EmissionBatch,
    casters: &Casters,
    options: &TraceOptions,
    pilots: u32,
) -> f64 {
    let points = PointSet::new(Sequence::Halton, pilots, 0);
    let trace = |tracer: &mut dyn FnMut(EmissionSample, CounterRng)| {
        for index in 0..pilots {
            tracer(
                EmissionSample::of(&points, index),
                batch.random(0, u64::from(index)),
            );
        }
    };
    let aimed = batch.emitter.caster().map(|caster| (casters, caster));
    let ledger = if batch.emitter.dimensions() == 2 {
        let mut tracer = PathTracer::<I, 2>::new(world, intersect, options).aimed_at(aimed, &[]);
        trace(&mut |sample, mut rng| {
            if let Some(emission) = batch.emitter.emit::<2>(world, &sample) {
                tracer.trace(&emission, batch.media, &mut rng);
            }
        });
        tracer.ledger
    } else {
        let mut tracer = PathTracer::<I, 4>::new(world, intersect, options).aimed_at(aimed, &[]);
        trace(&mut |sample, mut rng| {
            if let Some(emission) = batch.emitter.emit::<4>(world, &sample) {
                tracer.trace(&emission, batch.media, &mut rng);
            }
        });
        tracer.ledger
    };
    ledger.entry(Fate::Stored).flux.element_sum()
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
        assert_eq!(
            share(&[1.0, 2.0], u32::MAX, 1.0)
                .iter()
                .map(|&it| u64::from(it))
                .sum::<u64>(),
            u64::from(u32::MAX)
        );
    }
}
