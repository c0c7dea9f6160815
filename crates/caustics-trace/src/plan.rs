use std::sync::Arc;

use caustics_accel::Intersect;
use caustics_sampling::apportion_with_floor;
use caustics_scene::World;

use crate::boundary::Boundaries;
use crate::casters::Casters;
use crate::culling::Culling;
use crate::emission_batch::EmissionBatch;
use crate::emitter::Emitter;
use crate::options::{Aim, TraceError, TraceOptions};

/// The most photons that go ahead of each emitter's, to see how much of its light becomes a caustic.
const PILOTS: u32 = 256;

/// The part of all photons that may go ahead, for all emitters together.
const PILOT_PART: u32 = 8;

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
        let options = &unculled(options);
        let casters = Casters::of(world);
        let emitters = Emitter::all(world, &casters, options.aim);
        let mut plan = Self::weighed(world, intersect, casters, emitters, &[], options);
        if plan.reflects(options) {
            plan.boundaries = Arc::new(Boundaries::of(world));
        }
        plan.share(world, intersect, options);
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
        let options = &unculled(options);
        let casters = Casters::of(world);
        let before: Vec<&Emitter> = self.batches.iter().map(EmissionBatch::emitter).collect();
        let emitters = Emitter::following(world, &casters, options.aim, &before);
        let mut plan = Self::weighed(world, intersect, casters, emitters, &self.batches, options);
        if plan.reflects(options) {
            // To find them takes half as long as to build a hierarchy.
            plan.boundaries = if self.boundaries.are_of(world) {
                self.boundaries.clone()
            } else {
                Arc::new(Boundaries::of(world))
            };
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
            new.follow(old, world, intersect, &plan.casters, options);
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
    fn share<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) {
        let weights: Vec<f64> = self.batches.iter().map(|batch| batch.weight).collect();
        let shares = share(&weights, options.photons, options.share_floor);
        let casters = &self.casters;
        let settle = |(batch, share): (&mut EmissionBatch, u32)| {
            batch.settle(world, intersect, casters, options, share);
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

/// The same photons whatever the camera sees: one that turns moves none.
fn unculled(options: &TraceOptions) -> TraceOptions {
    TraceOptions {
        culling: Culling::default(),
        ..*options
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
