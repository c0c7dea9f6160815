use caustics_accel::Intersect;
use caustics_scene::World;
use glam::DVec3;

use crate::emission_batch::EmissionBatch;
use crate::ledger::Fate;
use crate::options::{TraceError, TraceOptions};
use crate::photon::PhotonMap;
use crate::plan::EmissionPlan;
use crate::trace::Batch;
use crate::traced::Traced;

/// The photons of a plan, traced in parts of any size: for a host that has a few milliseconds in each
/// frame, or that hands photons on as they come.
///
/// All parts together are what [`trace_plan`](crate::trace_plan) gives at once, photons and ledger,
/// footprints checked against their neighbours and divided at edges included; only of rays there are a
/// few more, since each part finds anew the ways of the paths that end in it. For that the last rows of
/// a lattice wait for the ones after them: what comes out of a part are the photons that have met all their neighbours,
/// and what stays in memory is three rows at most, besides the last part.
///
/// ```
/// use caustics_scene::{BvhOptions, World, builtin};
/// use caustics_trace::{EmissionPlan, PhotonStream, TraceOptions, trace_plan};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let world = World::new(&builtin::cognac_glass())?;
/// let rays = world.intersector(&BvhOptions::default())?;
/// let options = TraceOptions { photons: 2000, ..TraceOptions::default() };
/// let plan = EmissionPlan::new(&world, &rays, &options)?;
/// let mut stream = PhotonStream::default();
/// let mut photons = Vec::new();
/// while !stream.is_finished(&plan) {
///     photons.extend(stream.advance(&world, &rays, &plan, &options, 700)?.photons);
/// }
/// let at_once = trace_plan(&world, &rays, &plan, &options, &|_| {})?;
/// assert!(photons == at_once.photons);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct PhotonStream {
    /// Which of the plan's batches is on its way.
    batch: usize,
    /// Points of it that are traced.
    traced: u32,
    /// Points of it whose photons have been given away.
    given: u32,
    /// The first point that is in `window`.
    first: u32,
    /// What is still to be given away, and its neighbours.
    window: Traced,
    /// The flux that the light of the batch has emitted so far, what two pairs cover counted once.
    counted: DVec3,
}

impl PhotonStream {
    /// Traces the next photons, and returns those that are settled with the part of the ledger that
    /// has come since, in which only they count as stored. World, plan and options are to be the
    /// same in each call.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn advance<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        plan: &EmissionPlan,
        options: &TraceOptions,
        photons: u32,
    ) -> Result<PhotonMap, TraceError> {
        options.validate()?;
        let mut map = PhotonMap::default();
        let mut left = photons;
        let batches = plan.batches();
        while let Some(planned) = batches.get(self.batch) {
            let source = planned.emitter().source();
            let is_same_light = |it: &EmissionBatch| it.emitter().source() == source;
            let earlier = batches[..self.batch]
                .iter()
                .rev()
                .take_while(|it| is_same_light(it))
                .count();
            let until = planned.count().min(self.traced.saturating_add(left));
            left -= until - self.traced;
            let batch = Batch {
                world,
                intersect,
                options,
                plan,
                planned,
                earlier: &batches[self.batch - earlier..self.batch],
            };
            self.window
                .append(batch.traced(self.traced..until, &|_| {}));
            self.traced = until;
            self.give(&mut map, &batch);
            if self.traced < planned.count() {
                break;
            }
            let is_last = batches
                .get(self.batch + 1)
                .is_none_or(|next| !is_same_light(next));
            if is_last {
                let aimed = std::mem::take(&mut self.counted);
                map.ledger.emit_unaimed(planned.emitter().power() - aimed);
            }
            self.batch += 1;
            (self.traced, self.given, self.first) = (0, 0, 0);
        }
        Ok(map)
    }

    /// Whether all photons of the plan have been given away.
    #[must_use]
    pub fn is_finished(&self, plan: &EmissionPlan) -> bool {
        self.batch >= plan.batches().len()
    }

    /// Photons that wait for their neighbours, or that later ones will be checked against.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.window.photons.len()
    }

    /// Moves to the map what is settled.
    fn give<I: Intersect + ?Sized>(&mut self, map: &mut PhotonMap, batch: &Batch<'_, I>) {
        let Batch {
            planned, options, ..
        } = *batch;
        let (mut settled, needed);
        if Traced::are_checked(options, planned) {
            let lattice = planned.lattice();
            let points;
            (points, needed) = lattice.settled(self.traced);
            let window = lattice.window(self.first..self.traced);
            let range = self.given - self.first..points - self.first;
            settled = batch.checked(&mut self.window, &window, range);
            self.given = points;
        } else {
            settled = std::mem::take(&mut self.window.photons);
            (self.given, needed) = (self.traced, self.traced);
            self.window.paths.clear();
        }
        self.window.drop_first((needed - self.first) as usize);
        self.first = needed;
        let mut ledger = std::mem::take(&mut self.window.ledger);
        self.counted += ledger.emitted().flux - ledger.entry(Fate::Overlap).flux;
        // What waits is booked when it comes.
        ledger.store(&settled);
        options.culling.apply(&mut settled, &mut ledger);
        map.ledger.merge(&ledger);
        map.photons.append(&mut settled);
    }
}
