use caustics_accel::Intersect;
use caustics_geometry::Aabb;
use caustics_scene::World;

use crate::emitter::LightSource;
use crate::ledger::Fate;
use crate::live_chunk::{Chunk, Stale};
use crate::options::{TraceError, TraceOptions};
use crate::photon::PhotonMap;
use crate::plan::EmissionPlan;
use crate::trace::Batch;
use crate::trail::{Space, Trail};

/// Points of an emitter's set whose photons are kept together.
const CHUNK: u32 = 2048;

/// What is different in a world from the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// A caster, by its number in the plan's [`Casters`](crate::Casters), moved or has another
    /// material.
    Caster(u32),
    /// A light moved, or shines otherwise.
    Light(LightSource),
    /// Whatever is or was in a box, such as a receiver where it was and where it is now.
    Region(Aabb),
}

/// The photons of a world that changes from frame to frame: what stays as it was is not traced
/// again, and is the same to the bit.
///
/// Each photon remembers which casters its path met and through which parts of space it went. After
/// a change that the host names, [`invalidate`](Self::invalidate) traces anew what met it or might
/// meet it now, and the result is that of tracing everything. For changes that go on,
/// [`refresh`](Self::refresh) traces a part of the photons in each frame, every one in turn.
///
/// ```
/// use caustics_scene::{BvhOptions, World, builtin};
/// use caustics_trace::{LivePhotons, TraceOptions};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let world = World::new(&builtin::cognac_glass())?;
/// let rays = world.intersector(&BvhOptions::default())?;
/// let options = TraceOptions { photons: 2000, ..TraceOptions::default() };
/// let mut live = LivePhotons::new(&world, &rays, &options)?;
/// let before = live.map();
/// // A tenth of the photons anew, in a world that stands still: nothing changes.
/// let traced = live.refresh(&world, &rays, 0.1)?;
/// assert!((150..250).contains(&traced));
/// assert!(live.map().photons == before.photons);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct LivePhotons {
    options: TraceOptions,
    plan: EmissionPlan,
    space: Space,
    /// For each pair, its chunks.
    batches: Vec<Vec<Chunk>>,
    /// Where in the order of multiples of the golden section the next refresh begins.
    turn: u32,
}

impl LivePhotons {
    /// Traces all photons.
    ///
    /// Photons are not divided at edges ([`TraceOptions::divide_edges`]): what lies beside a path is not
    /// followed from frame to frame.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Result<Self, TraceError> {
        let plan = EmissionPlan::new(world, intersect, options)?;
        let mut live = Self {
            options: *options,
            space: Space::around(&world.bounds()),
            batches: vec![Vec::new(); plan.batches().len()],
            plan,
            turn: 0,
        };
        let all = vec![Stale::NONE; live.plan.batches().len()];
        live.trace(world, intersect, &all);
        Ok(live)
    }

    /// Moves on to a changed world and traces anew what the changes reach: photons whose path met
    /// them, or goes where they are now. Returns how many that were.
    ///
    /// If the changes name all that is different, the photons are those that tracing all of this
    /// plan in the new world would give.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn invalidate<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        changes: &[Change],
    ) -> Result<u32, TraceError> {
        let mut stale = self.follow(world, intersect)?;
        for (stale, batch) in stale.iter_mut().zip(self.plan.batches()) {
            for change in changes {
                match change {
                    Change::Caster(caster) => {
                        stale.touched |= 1u32.checked_shl(*caster).unwrap_or(0);
                        let bounds = self.plan.casters().bounds(*caster);
                        stale.passed |= self.space.blocks(&bounds);
                    }
                    Change::Light(source) => stale.all |= batch.emitter().source() == *source,
                    Change::Region(bounds) => stale.passed |= self.space.blocks(bounds),
                }
            }
        }
        Ok(self.trace(world, intersect, &stale))
    }

    /// Moves on to a changed world and traces `fraction` of the photons anew (clamped to 0..=1),
    /// others than in the last frames: all of them once in `1 / fraction` frames. Returns how many
    /// that were.
    ///
    /// What is traced in a frame is spread evenly over each emitter. Where a caster has left the
    /// directions that its pair covers, all of the pair is traced.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn refresh<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        fraction: f32,
    ) -> Result<u32, TraceError> {
        const WHOLE: f64 = 4_294_967_296.0;
        // Rounded up, so that the frames cover all; a NaN is nothing.
        let turns = (f64::from(fraction).clamp(0.0, 1.0) * WHOLE).ceil() as u64;
        let mut stale = self.follow(world, intersect)?;
        for stale in &mut stale {
            (stale.first, stale.turns) = (self.turn, turns);
        }
        self.turn = self.turn.wrapping_add(turns as u32);
        Ok(self.trace(world, intersect, &stale))
    }

    /// The emitters, casters and shares that the photons are of.
    #[must_use]
    pub fn plan(&self) -> &EmissionPlan {
        &self.plan
    }

    /// The photons as they are now, in the order of emission, with their ledger.
    #[must_use]
    pub fn map(&self) -> PhotonMap {
        let mut map = PhotonMap::default();
        let count = self.batches.iter().flatten().map(|it| it.photons.len());
        map.photons.reserve(count.sum());
        let lights = self
            .plan
            .batches()
            .chunk_by(|a, b| a.emitter().source() == b.emitter().source());
        let mut batches = self.batches.iter();
        for of_light in lights {
            let before = map.ledger.emitted().flux - map.ledger.entry(Fate::Overlap).flux;
            for (planned, chunks) in of_light.iter().zip(batches.by_ref()) {
                let mut traced = Chunk::joined(chunks);
                traced.check_footprints(&self.options, planned);
                let culling = &self.options.culling;
                culling.apply(&mut traced.photons, &mut traced.ledger);
                map.photons.append(&mut traced.photons);
                map.ledger.merge(&traced.ledger);
            }
            let after = map.ledger.emitted().flux - map.ledger.entry(Fate::Overlap).flux;
            if let Some(first) = of_light.first() {
                map.ledger
                    .emit_unaimed(first.emitter().power() - (after - before));
            }
        }
        map
    }

    /// Lets the plan follow, and says what of each pair cannot be kept.
    fn follow<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
    ) -> Result<Vec<Stale>, TraceError> {
        let plan = self.plan.following(world, intersect, &self.options)?;
        let (old, new) = (self.plan.batches(), plan.batches());
        let same_casters = plan.casters().len() == self.plan.casters().len()
            && (0..plan.casters().len() as u32)
                .all(|it| plan.casters().objects(it) == self.plan.casters().objects(it));
        if old.len() != new.len() || !same_casters {
            self.batches = vec![Vec::new(); new.len()];
            let stale = vec![Stale::NONE; new.len()];
            self.plan = plan;
            return Ok(stale);
        }
        let mut stale = Vec::with_capacity(new.len());
        // Whether an earlier pair of the same light covers other directions than before.
        let mut has_moved = false;
        for (index, (old, new)) in old.iter().zip(new).enumerate() {
            let source = new.emitter().source();
            if index == 0 || source != plan.batches()[index - 1].emitter().source() {
                has_moved = false;
            }
            let same_rays = old.emitter().domain() == new.emitter().domain()
                && source == old.emitter().source()
                && old.points() == new.points()
                && old.density() == new.density()
                && old.media() == new.media();
            stale.push(Stale {
                all: !same_rays,
                unmet: has_moved,
                ..Stale::NONE
            });
            has_moved |= !same_rays || old.map() != new.map();
        }
        self.plan = plan;
        Ok(stale)
    }

    /// Traces what is stale, and points that are new among those used.
    fn trace<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        stale: &[Stale],
    ) -> u32 {
        let mut traced = 0;
        let mut offset = 0;
        for of_light in self.plan.lights() {
            for (number, planned) in of_light.iter().enumerate() {
                let batch = Batch {
                    world,
                    intersect,
                    options: &self.options,
                    plan: &self.plan,
                    planned,
                    earlier: &of_light[..number],
                };
                let (chunks, stale) = (&mut self.batches[offset], &stale[offset]);
                traced += if planned.emitter().dimensions() == 2 {
                    retrace::<I, 2>(&batch, chunks, stale, self.space)
                } else {
                    retrace::<I, 4>(&batch, chunks, stale, self.space)
                };
                offset += 1;
            }
        }
        traced
    }
}

/// Traces the stale photons of a pair; returns how many.
fn retrace<I: Intersect + ?Sized, const N: usize>(
    batch: &Batch<'_, I>,
    chunks: &mut Vec<Chunk>,
    stale: &Stale,
    space: Space,
) -> u32 {
    let count = batch.planned.count();
    // The points that each chunk has now: used ones come in the order of their numbers.
    let chunk_count = if count == 0 {
        0
    } else {
        batch.planned.point_number(count - 1) / CHUNK + 1
    };
    chunks.resize_with(chunk_count as usize, Chunk::default);
    let first_of = |chunk: u32| -> u32 {
        let (mut low, mut high) = (0, count);
        while low < high {
            let middle = low + (high - low) / 2;
            if batch.planned.point_number(middle) < chunk * CHUNK {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    };
    let run = |(number, chunk): (usize, &mut Chunk)| -> u32 {
        let number = number as u32;
        let used = first_of(number)..first_of(number + 1);
        let unchanged = used.len() == chunk.records.len()
            && chunk
                .records
                .iter()
                .zip(used.clone())
                .all(|(record, index)| {
                    record.number == batch.planned.point_number(index) && !stale.holds(record)
                });
        if unchanged {
            return 0;
        }
        let (next, traced) = renewed::<I, N>(batch, chunk, used, stale, space);
        *chunk = next;
        traced
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        chunks.par_iter_mut().enumerate().map(run).sum()
    }
    #[cfg(not(feature = "parallel"))]
    chunks.iter_mut().enumerate().map(run).sum()
}

/// A chunk with its stale photons traced anew, and how many they were.
fn renewed<I: Intersect + ?Sized, const N: usize>(
    batch: &Batch<'_, I>,
    old: &Chunk,
    used: std::ops::Range<u32>,
    stale: &Stale,
    space: Space,
) -> (Chunk, u32) {
    let mut next = Chunk::default();
    let mut tracer = batch.tracer::<N>();
    tracer.trail = Some(Trail::new(batch.plan.casters(), space));
    let mut traced = 0;
    let mut kept = 0;
    for index in used {
        let number = batch.planned.point_number(index);
        while old.records.get(kept).is_some_and(|it| it.number < number) {
            kept += 1;
        }
        if let Some(record) = old.records.get(kept)
            && record.number == number
            && !stale.holds(record)
        {
            next.keep(old, kept);
            continue;
        }
        traced += 1;
        let sample = batch.planned.sample_of(number);
        if let Some(trail) = &mut tracer.trail {
            trail.clear();
        }
        if let Some(emission) = batch.planned.emitter().emit::<N>(batch.world, &sample) {
            let mut rng = batch.planned.random(batch.options.seed, u64::from(number));
            tracer.trace(&emission, batch.planned.media(), &mut rng);
        }
        next.photons.append(&mut tracer.photons);
        next.paths.append(&mut tracer.paths);
        let ledger = std::mem::take(&mut tracer.ledger);
        let (touched, passed) = tracer
            .trail
            .map_or((0, 0), |trail| (trail.touched, trail.passed));
        next.note(number, touched, passed, &ledger);
    }
    (next, traced)
}
