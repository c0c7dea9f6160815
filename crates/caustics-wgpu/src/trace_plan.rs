use std::collections::HashMap;
use std::ops::Range;

use caustics_accel::Intersect;
use caustics_sampling::Sequence;
use caustics_scene::World;
use caustics_trace::{
    AreaSurface, Boundaries, Branching, Culling, EmissionBatch, EmissionDomain, EmissionPlan,
    TraceOptions,
};
use glam::DVec3;

use crate::GpuError;
use crate::body_order::{BodyOrder, at_most};
use crate::emitter_mirror::{largest_flux, mirror, sample_from, set_media};
use crate::trace_params::{Emitter as Mirror, MAX_EMITTERS, NO_CASTER, TraceParams};

/// The largest flux of a photon, in units of the ledger's sums.
const LARGEST_FLUX: f32 = (1 << 30) as f32;

/// Words of the start and the end of an edge. Mirrors the constant in `shaders/boundary.wgsl`.
pub(crate) const BOUNDARY_WORDS: u32 = 6;

/// The photons of all lights, as the shaders emit them: the same light for the same number as
/// [`trace_photons`](caustics_trace::trace_photons) emits with the same options.
#[derive(Clone, Debug)]
pub struct TracePlan {
    pub(crate) emitters: Vec<PlannedEmitter>,
    /// What the emitters refer to: cumulative areas, runs of points, projection maps, densities; and
    /// boundaries.
    pub(crate) lists: Vec<u32>,
    /// Where in the lists the boundaries begin: for each object where its edges start, where the last
    /// one's end, and the edges' ends.
    pub(crate) first_boundary: u32,
    pub(crate) options: TraceOptions,
    pub(crate) flux_scale: f32,
    power: DVec3,
    photons: u32,
}

/// An emitter's photons.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlannedEmitter {
    /// As the shader is told, but with the first emitter of the light among all.
    pub(crate) mirror: Mirror,
    /// Parameters of its rays: 2 or 4.
    pub(crate) dimensions: u32,
}

impl TracePlan {
    /// The most photons of one plan.
    pub const MAX_PHOTONS: u32 = 1 << 30;

    /// Aims the lights and shares the photons among them. `intersect` finds the media around them,
    /// and follows the few photons by which the others are shared.
    ///
    /// # Errors
    /// [`GpuError::Options`] for options out of range, [`GpuError::Unsupported`] for [`Culling`],
    /// and [`GpuError::TooMany`].
    pub fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Result<Self, GpuError> {
        let plan = EmissionPlan::new(world, intersect, options)?;
        Self::of(world, &plan, options)
    }

    /// The photons of a plan of the CPU, made for the same world and options: for hosts that keep one
    /// from frame to frame.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(
        world: &World,
        emission: &EmissionPlan,
        options: &TraceOptions,
    ) -> Result<Self, GpuError> {
        options.validate()?;
        if let Some(what) = unsupported(options) {
            return Err(GpuError::Unsupported { what });
        }
        let photons = emission.batches().iter().map(|it| u64::from(it.count()));
        at_most("photons", photons.sum(), Self::MAX_PHOTONS.into())?;
        let order = BodyOrder::new(world)?;
        let mut plan = Self {
            emitters: Vec::with_capacity(emission.batches().len()),
            lists: Vec::new(),
            first_boundary: TraceParams::NO_BOUNDARIES,
            options: *options,
            flux_scale: 1.0,
            power: DVec3::ZERO,
            photons: 0,
        };
        let mut strongest = 0.0f32;
        let mut cumulative = HashMap::new();
        for of_light in emission.lights() {
            plan.power += of_light
                .first()
                .map_or(DVec3::ZERO, |it| it.emitter().power());
            let first_of_light = plan.emitters.len() as u32;
            for batch in of_light {
                let Some(mut mirror) = mirror(world, &order, batch.emitter().domain())? else {
                    continue;
                };
                mirror.first_of_light = first_of_light;
                plan.set_samples(&mut mirror, batch);
                set_media(&mut mirror, &batch.media(), &order);
                if let EmissionDomain::Area {
                    surface: AreaSurface::Object { emitter, .. },
                    ..
                } = *batch.emitter().domain()
                {
                    let light = &world.emitters()[emitter as usize];
                    let lists = &mut plan.lists;
                    mirror.first_cumulative = *cumulative.entry(emitter).or_insert_with(|| {
                        let first = lists.len() as u32;
                        lists.extend(light.cumulative_area().iter().map(|it| it.to_bits()));
                        first
                    });
                }
                strongest = strongest.max(largest_flux(&mirror, batch.density()));
                plan.photons += mirror.count;
                plan.emitters.push(PlannedEmitter {
                    mirror,
                    dimensions: batch.emitter().dimensions() as u32,
                });
            }
            let emitters = plan.emitters.len() as u64 - u64::from(first_of_light);
            at_most("emitters of one light", emitters, MAX_EMITTERS as u64)?;
        }
        plan.set_boundaries(world, emission.boundaries());
        if plan.lists.is_empty() {
            // A buffer has at least one word.
            plan.lists.push(0);
        }
        if strongest > 0.0 {
            // A power of two, so that scaling does not round.
            plan.flux_scale = (LARGEST_FLUX / strongest).log2().floor().exp2();
        }
        Ok(plan)
    }

    /// How many photons there are, of all lights together: numbers 0 and up.
    #[must_use]
    pub fn photons(&self) -> u32 {
        self.photons
    }

    /// Everything that the lights emit, in watts: what is aimed and what is not.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        self.power
    }

    /// Lists what footprints are reflected at.
    fn set_boundaries(&mut self, world: &World, boundaries: &Boundaries) {
        let edges = boundaries.edges();
        if edges.is_empty() {
            return;
        }
        self.first_boundary = self.lists.len() as u32;
        let objects = world.objects().len() as u32;
        let first_edge = self.first_boundary + objects + 1;
        // In the order of their objects.
        let before = |object: u32| edges.partition_point(|edge| edge.object < object) as u32;
        let starts = (0..=objects).map(|object| first_edge + BOUNDARY_WORDS * before(object));
        self.lists.extend(starts);
        let ends = edges.iter().flat_map(|edge| edge.vertices);
        let places = ends.map(|vertex| world.positions()[vertex as usize].to_array());
        self.lists.extend(places.flatten().map(f32::to_bits));
    }

    /// Sets what an emitter's photons are made from.
    fn set_samples(&mut self, mirror: &mut Mirror, batch: &EmissionBatch) {
        mirror.first = self.photons;
        mirror.count = batch.count();
        mirror.points = batch.points().count();
        mirror.share = 1.0 / mirror.points as f32;
        mirror.stream = batch.stream();
        mirror.caster = batch.emitter().caster().unwrap_or(NO_CASTER);
        if let Some(spans) = batch.spans() {
            mirror.first_span = self.lists.len() as u32;
            self.lists
                .extend(spans.flat_map(|(first, before)| [first, before]));
            mirror.span_count = (self.lists.len() as u32 - mirror.first_span) / 2;
        }
        mirror.first_map = Mirror::NO_MAP;
        if let Some(map) = batch.map() {
            mirror.first_map = self.lists.len() as u32;
            self.lists.extend_from_slice(map.words());
        }
        if let Some(density) = batch.density() {
            mirror.first_density = self.lists.len() as u32;
            mirror.density_cells = density.resolution();
            let row = density.resolution() as usize + 1;
            let marginals: Vec<f32> = density
                .row_integrals()
                .chunks(row)
                .map(|it| it[row - 1])
                .collect();
            let tables = [
                &marginals[..],
                density.cumulative(),
                density.densities(),
                density.row_integrals(),
            ];
            let words = tables.into_iter().flatten().map(|it| it.to_bits());
            self.lists.extend(words);
        }
        sample_from(mirror, &self.options);
    }

    /// Whether footprints of rays with so many parameters are checked against where the photons
    /// beside them land.
    pub(crate) fn checks_footprints(&self, dimensions: u32) -> bool {
        self.options.check_footprints
            && self.options.differentials
            && self.options.sequence == Sequence::Grid
            && dimensions == 2
    }

    /// Whether photons of rays with so many parameters are divided at the edges of sheets of light.
    pub(crate) fn divides_edges(&self, dimensions: u32) -> bool {
        self.options.divide_edges
            && self.options.branching == Branching::SplitAll
            && self.checks_footprints(dimensions)
    }

    /// The photons of a batch with those that the check of its footprints asks for: on either side
    /// up to a row of the lattice.
    pub(crate) fn with_neighbours(&self, photons: &Range<u32>) -> Range<u32> {
        let mut all = photons.clone();
        for PlannedEmitter { mirror, dimensions } in &self.emitters {
            if mirror.count == 0 || !self.checks_footprints(*dimensions) {
                continue;
            }
            let own = mirror.first..mirror.first + mirror.count;
            let row = mirror.points.div_ceil(mirror.rows.max(1)) + 1;
            if own.contains(&photons.start) {
                all.start = own.start.max(photons.start.saturating_sub(row));
            }
            if photons.start < photons.end && own.contains(&(photons.end - 1)) {
                all.end = own.end.min(photons.end.saturating_add(row));
            }
        }
        all
    }

    pub(crate) fn sequence(&self) -> u32 {
        match self.options.sequence {
            Sequence::Halton => 0,
            Sequence::Sobol => 1,
            Sequence::Fibonacci => 3,
            Sequence::Kronecker => 4,
            _ => 2,
        }
    }

    pub(crate) fn branching(&self) -> u32 {
        match self.options.branching {
            Branching::Roulette => 0,
            Branching::SplitFirst => 1,
            _ => 2,
        }
    }
}

/// What the options ask for that the shaders do not do.
fn unsupported(options: &TraceOptions) -> Option<&'static str> {
    let none = Culling::default();
    if options.culling.min_flux != none.min_flux {
        Some("photons that are culled by their flux (`Culling::min_flux`)")
    } else if options.culling.max_area != none.max_area {
        Some("photons that are culled by their footprint's area (`Culling::max_area`)")
    } else if options.culling.max_solid_angle != none.max_solid_angle {
        Some("photons that are culled by solid angle (`Culling::max_solid_angle`)")
    } else if options.culling.view != none.view {
        Some("photons that are culled by a view (`Culling::view`)")
    } else {
        None
    }
}
