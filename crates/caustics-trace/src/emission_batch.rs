use std::sync::Arc;

use caustics_accel::Intersect;
use caustics_geometry::Ray;
use caustics_sampling::warp::DensityTable;
use caustics_sampling::{CounterRng, PointSet, Sequence};
use caustics_scene::World;
use glam::Vec2;

use crate::casters::Casters;
use crate::emission::EmissionSample;
use crate::emitter::Emitter;
use crate::guide;
use crate::lattice::Lattice;
use crate::ledger::{EnergyLedger, Fate};
use crate::media::MediumStack;
use crate::options::{Aim, TraceOptions};
use crate::parallel;
use crate::projection_map::ProjectionMap;
use crate::tracer::PathTracer;

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

/// Photons that one task sends ahead.
const PILOTS_OF_TASK: u32 = 32;

/// The photons of one emitter.
#[derive(Clone, Debug)]
pub struct EmissionBatch {
    pub(crate) emitter: Emitter,
    map: Option<ProjectionMap>,
    density: Option<Arc<DensityTable>>,
    lattice: Lattice,
    /// The most photons that it may have.
    pub(crate) share: u32,
    /// What the pair counts for when photons are shared.
    pub(crate) weight: f64,
    /// The part of its photons that meet their caster first, without a projection map.
    pub(crate) accuracy: f64,
    /// Which of the random streams are its own.
    pub(crate) stream: u32,
    media: MediumStack,
}

impl EmissionBatch {
    pub(crate) fn new<I: Intersect + ?Sized>(
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
            density: None,
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
    /// marked cells are; each still stands for one part in [`PointSet::count`], or with a
    /// [`density`](Self::density) for that over its own.
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

    /// How dense points are over the unit square; `None` where they are evenly spread. See
    /// [`TraceOptions::guide_emission`].
    #[must_use]
    pub fn density(&self) -> Option<&DensityTable> {
        self.density.as_deref()
    }

    /// The sample of photon `index`, below [`count`](Self::count).
    #[must_use]
    pub fn sample(&self, index: u32) -> EmissionSample {
        self.sample_of(self.point_number(index))
    }

    /// The sample of point `number`.
    pub(crate) fn sample_of(&self, number: u32) -> EmissionSample {
        self.guided(self.unguided(self.points(), number))
    }

    /// Number `index` of a set of points, with as many coordinates as the light has parameters.
    fn unguided(&self, points: &PointSet, index: u32) -> EmissionSample {
        if self.emitter.dimensions() == 2 {
            EmissionSample::without_place(points, index)
        } else {
            EmissionSample::of(points, index)
        }
    }

    /// Of a light without an area, what is beside point `number`, in cells from it; `None` outside
    /// the square.
    pub(crate) fn sample_beside(&self, number: u32, offset: Vec2) -> Option<EmissionSample> {
        let mut sample = EmissionSample::without_place(self.points(), number);
        sample.point += offset.x * sample.spacing[0] + offset.y * sample.spacing[1];
        let is_inside = sample.point.cmpge(Vec2::ZERO).all() && sample.point.cmplt(Vec2::ONE).all();
        is_inside.then(|| self.guided(sample))
    }

    fn guided(&self, sample: EmissionSample) -> EmissionSample {
        match &self.density {
            Some(density) => sample.guided(density),
            None => sample,
        }
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
    pub(crate) fn send_pilots<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
        pilots: u32,
    ) {
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
        let ledgers = parallel::made(pilots.div_ceil(PILOTS_OF_TASK), |task| {
            let mut tracer = self.pilot_tracer::<I, N>(world, intersect, casters, options);
            let first = task * PILOTS_OF_TASK;
            for index in first..pilots.min(first + PILOTS_OF_TASK) {
                self.send_pilot(&mut tracer, world, &points, index);
            }
            tracer.ledger
        });
        let mut all = EnergyLedger::default();
        for ledger in &ledgers {
            all.merge(ledger);
        }
        all
    }

    /// A tracer of photons that go ahead of the others.
    pub(crate) fn pilot_tracer<'a, I: Intersect + ?Sized, const N: usize>(
        &self,
        world: &'a World,
        intersect: &'a I,
        casters: &'a Casters,
        options: &'a TraceOptions,
    ) -> PathTracer<'a, I, N> {
        let aimed = self.emitter.caster().map(|caster| (casters, caster));
        PathTracer::new(world, intersect, options).aimed_at(aimed, &[])
    }

    /// Traces one of them, from a point of a set of their own.
    pub(crate) fn send_pilot<I: Intersect + ?Sized, const N: usize>(
        &self,
        tracer: &mut PathTracer<'_, I, N>,
        world: &World,
        points: &PointSet,
        index: u32,
    ) {
        let sample = self.unguided(points, index);
        if let Some(emission) = self.emitter.emit::<N>(world, &sample) {
            let mut random = self.random(0, u64::from(index));
            tracer.trace(&emission, self.media, &mut random);
        }
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

    /// Takes a number of photons, and finds where they should go.
    pub(crate) fn settle<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
        share: u32,
    ) {
        self.share = share;
        self.map = self.worthwhile_map(world, casters, options);
        self.guide(world, intersect, casters, options);
        self.lattice = self.fresh_lattice(options);
    }

    /// Finds by a few photons where more of them are wanted.
    fn guide<I: Intersect + ?Sized>(
        &mut self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
    ) {
        let density = guide::density(world, intersect, casters, self, options);
        self.density = density.map(Arc::new);
    }

    fn fresh_lattice(&self, options: &TraceOptions) -> Lattice {
        match &self.map {
            Some(map) => {
                let density = self.density();
                Lattice::marked(options.sequence, self.share, options.seed, map, density)
            }
            None => Lattice::whole(options.sequence, self.share, options.seed),
        }
    }

    /// Takes over the photons of the same pair in the frame before.
    pub(crate) fn follow<I: Intersect + ?Sized>(
        &mut self,
        old: &Self,
        world: &World,
        intersect: &I,
        casters: &Casters,
        options: &TraceOptions,
    ) {
        self.share = old.share;
        let is_still = old.emitter.domain() == self.emitter.domain();
        if is_still && old.density.is_some() && guide::is_wanted(self, options) {
            self.density.clone_from(&old.density);
        } else {
            self.guide(world, intersect, casters, options);
        }
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
            Some(map) => Lattice::within(points, map, self.density()),
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

#[cfg(test)]
mod tests {
    use caustics_geometry::shapes::quad;
    use caustics_scene::{BvhOptions, Instance, Light, Material, Scene, Shape};
    use glam::Vec3;

    use super::*;

    #[test]
    fn every_pilot_is_sent_once() -> Result<(), Box<dyn std::error::Error>> {
        let mut scene = Scene::new();
        let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
        let white = scene.add_material(Material::diffuse("white", [0.8; 3]))?;
        let ball = Shape::Sphere {
            center: Vec3::Y,
            radius: 0.5,
        };
        scene.add_instance(Instance::new("ball", ball, glass))?;
        let sides = [[10.0, 0.0, 0.0], [0.0, 0.0, -10.0]];
        let floor = quad([-5.0, 0.0, 5.0], sides[0], sides[1])?;
        let floor = Shape::Mesh(scene.add_mesh(floor));
        scene.add_instance(Instance::new("floor", floor, white))?;
        scene.add_light(Light::point([0.0, 6.0, 0.0], [10.0; 3])?)?;
        let world = World::new(&scene)?;
        let rays = world.intersector(&BvhOptions::default())?;

        let options = TraceOptions::default();
        let casters = Casters::of(&world);
        let emitter = Emitter::all(&world, &casters, options.aim).remove(0);
        let batch = EmissionBatch::new(&world, &rays, emitter, &casters, &options);
        // More than a whole number of tasks.
        let pilots = 3 * PILOTS_OF_TASK + 5;
        let found = batch.pilots::<_, 2>(&world, &rays, &casters, &options, pilots);
        let points = PointSet::new(Sequence::Halton, pilots, 0);
        let mut tracer = batch.pilot_tracer::<_, 2>(&world, &rays, &casters, &options);
        for index in 0..pilots {
            batch.send_pilot(&mut tracer, &world, &points, index);
        }
        for fate in Fate::ALL {
            let (found, expected) = (found.entry(fate), tracer.ledger.entry(fate));
            assert_eq!(found.count, expected.count, "{fate:?}");
            assert!(found.flux.abs_diff_eq(expected.flux, 1e-12), "{fate:?}");
        }
        assert_eq!(found.emitted().count, u64::from(pilots));
        assert!(found.entry(Fate::Stored).count > u64::from(pilots) / 2);
        Ok(())
    }
}
