use caustics_accel::Intersect;
use caustics_geometry::{Hit, Ray};
use caustics_sampling::CounterRng;
use caustics_scene::{Surface, SurfacePoint, World};
use glam::Vec3;

use crate::boundary::Boundaries;
use crate::casters::Casters;
use crate::differential::RayDifferential;
use crate::emission::Emission;
use crate::emission_batch::EmissionBatch;
use crate::grazing::Grazing;
use crate::ledger::{EnergyLedger, Fate};
use crate::media::MediumStack;
use crate::optics::beer_lambert;
use crate::options::{Branching, TraceOptions};
use crate::path_guide::{PathGuide, extended, path_landed};
use crate::photon::{FootprintSource, Photon};
use crate::scatter::{Event, Outgoing, Scattering, scatter};
use crate::trail::Trail;

/// The longest change of direction, in radians for one sample spacing, that a differential keeps.
/// Beyond it a first derivative says nothing about where the neighbour goes.
/// It is less for lights with an area, by as much as their photons are narrowed.
const DIRECTION_CHANGE_LIMIT: f32 = 0.5;

/// A path, or a branch of one, on its way to the next surface.
#[derive(Clone, Copy)]
pub(crate) struct Branch<const N: usize> {
    pub(crate) ray: Ray,
    differential: RayDifferential<N>,
    flux: Vec3,
    media: MediumStack,
    /// Surfaces met so far.
    depth: u32,
    /// Specular events so far.
    events: u32,
    has_split: bool,
    channel: Option<u8>,
    /// A hash of what the path met and did there.
    path: u32,
    source: FootprintSource,
}

/// Takes photons on their ways; holds the memory that they share.
pub(crate) struct PathTracer<'a, I: ?Sized, const N: usize> {
    world: &'a World,
    intersect: &'a I,
    options: &'a TraceOptions,
    /// Branches of the photon that is being traced.
    pub(crate) pending: Vec<Branch<N>>,
    pub(crate) photons: Vec<Photon>,
    /// For each photon, a hash of what its path met and did there, and of whether its light landed turned
    /// over: photons of one path are parts of one smooth sheet of light.
    pub(crate) paths: Vec<u32>,
    pub(crate) ledger: EnergyLedger,
    /// What the photons are aimed at; `None` where all count.
    caster: Option<(&'a Casters, u32)>,
    /// The emitters of the same light whose photons come before these.
    earlier: &'a [EmissionBatch],
    /// What footprints are reflected at; `None` where they are not.
    boundaries: Option<&'a Boundaries>,
    /// Where the paths go, if that is asked for.
    pub(crate) trail: Option<Trail<'a>>,
    /// Which branches are followed; all without one.
    pub(crate) guide: Option<PathGuide>,
}

impl<'a, I: Intersect + ?Sized, const N: usize> PathTracer<'a, I, N> {
    pub(crate) fn new(world: &'a World, intersect: &'a I, options: &'a TraceOptions) -> Self {
        Self {
            world,
            intersect,
            options,
            pending: Vec::new(),
            photons: Vec::new(),
            paths: Vec::new(),
            ledger: EnergyLedger::default(),
            caster: None,
            earlier: &[],
            boundaries: None,
            trail: None,
            guide: None,
        }
    }

    /// With photons that count only if the first object in their way is of this caster. The
    /// `earlier` emitters of the same light stand for what reaches no caster in directions that
    /// they share.
    pub(crate) fn aimed_at(
        self,
        caster: Option<(&'a Casters, u32)>,
        earlier: &'a [EmissionBatch],
    ) -> Self {
        Self {
            caster,
            earlier,
            ..self
        }
    }

    /// With footprints reflected where receivers end.
    pub(crate) fn reflected_at(self, boundaries: &'a Boundaries) -> Self {
        Self {
            boundaries: Some(boundaries),
            ..self
        }
    }

    /// Follows one emitted photon and all its branches to their ends.
    pub(crate) fn trace(
        &mut self,
        emission: &Emission<N>,
        media: MediumStack,
        rng: &mut CounterRng,
    ) {
        let threshold = self.threshold(emission);
        let first = self.sent(emission, media);
        self.pending.push(first);
        while let Some(branch) = self.next() {
            let hit = self.intersect.closest_hit(&branch.ray);
            self.advance(branch, hit, threshold, rng);
        }
    }

    /// Flux below which the branches of an emitted photon play roulette.
    pub(crate) fn threshold(&self, emission: &Emission<N>) -> f32 {
        self.options.min_weight * emission.flux.max_element()
    }

    /// Books an emitted photon, and returns it at the start of its way.
    pub(crate) fn sent(&mut self, emission: &Emission<N>, media: MediumStack) -> Branch<N> {
        self.ledger.emit(emission.flux);
        Branch {
            ray: emission.ray,
            differential: emission.differential,
            flux: emission.flux,
            media,
            depth: 0,
            events: 0,
            has_split: false,
            channel: None,
            path: 0,
            source: FootprintSource::Differential,
        }
    }

    /// What rays meet.
    pub(crate) fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.intersect.closest_hits(rays, hits);
    }

    /// The branch that goes on next, whose ray is then to be traced.
    pub(crate) fn next(&mut self) -> Option<Branch<N>> {
        while let Some(branch) = self.pending.pop() {
            if branch.ray.origin.is_finite() && branch.ray.direction.is_finite() {
                self.ledger.rays += 1;
                return Some(branch);
            }
            self.ledger.book(Fate::Invalid, branch.flux);
        }
        None
    }

    /// Takes a branch to the surface that its ray meets and queues what leaves it.
    pub(crate) fn advance(
        &mut self,
        mut branch: Branch<N>,
        hit: Option<Hit>,
        threshold: f32,
        rng: &mut CounterRng,
    ) {
        if let Some(trail) = &mut self.trail {
            trail.passes(self.world, &branch.ray, hit.as_ref());
        }
        let Some(hit) = hit else {
            let fate = if branch.depth == 0 && self.is_overlap(&branch.ray, None) {
                Fate::Overlap
            } else if branch.events == 0 {
                Fate::Missed
            } else {
                Fate::Escaped
            };
            self.ledger.book(fate, branch.flux);
            return;
        };
        let Some(point) = self.world.surface(&branch.ray, &hit) else {
            self.ledger.book(Fate::Invalid, branch.flux);
            return;
        };
        if branch.depth == 0 && self.is_overlap(&branch.ray, Some(point.object)) {
            self.ledger.book(Fate::Overlap, branch.flux);
            return;
        }
        self.absorb(&mut branch, hit.t);
        branch.differential =
            branch
                .differential
                .transferred(branch.ray.direction, hit.t, point.geometric_normal);
        branch.depth += 1;

        let split = branch.channel.is_none() && self.disperses(&point);
        for channel in 0..if split { 3usize } else { 1 } {
            let mut part = branch;
            if split {
                part.flux = Vec3::ZERO;
                part.flux[channel] = branch.flux[channel];
                part.channel = Some(channel as u8);
                // Each colour is a sheet of light of its own.
                part.path = extended(branch.path, channel as u32, 0);
                if part.flux == Vec3::ZERO || !self.admits(part.path, branch.path) {
                    continue;
                }
            }
            match scatter(
                self.world,
                &point,
                part.ray.direction,
                &part.media,
                part.channel,
            ) {
                None => self.receive(&part, &point),
                Some(_) if part.depth >= self.options.max_depth => {
                    self.ledger.book(Fate::TooDeep, part.flux);
                }
                Some(scattering) => self.branch_out(&part, &point, &scattering, threshold, rng),
            }
        }
    }

    /// Whether another emitter of the same light stands for an emitted ray that first meets this
    /// object, or nothing.
    fn is_overlap(&self, ray: &Ray, object: Option<u32>) -> bool {
        let Some((casters, caster)) = self.caster else {
            return false;
        };
        match object.and_then(|object| casters.of_object(object)) {
            Some(met) => met != caster,
            None => self.earlier.iter().any(|it| it.covers(ray)),
        }
    }

    fn admits(&mut self, path: u32, before: u32) -> bool {
        self.guide
            .as_mut()
            .is_none_or(|guide| guide.admits(path, before))
    }

    fn disperses(&self, point: &SurfacePoint) -> bool {
        matches!(
            self.world.materials()[point.material as usize].surface,
            Surface::Dielectric { dispersion, .. } if dispersion > 0.0
        )
    }

    fn absorb(&mut self, branch: &mut Branch<N>, distance: f32) {
        let attenuation = branch.media.attenuation(self.world);
        if attenuation != Vec3::ZERO {
            let arriving = branch.flux * beer_lambert(attenuation, distance);
            self.ledger.book(Fate::Absorbed, branch.flux - arriving);
            branch.flux = arriving;
        }
    }

    fn receive(&mut self, branch: &Branch<N>, point: &SurfacePoint) {
        if branch.events == 0 {
            self.ledger.book(Fate::Direct, branch.flux);
            return;
        }
        self.ledger.book(Fate::Stored, branch.flux);
        let side = if point.from_outside { 1.0 } else { -1.0 };
        let (axes, coverage) = branch.differential.footprint(point.geometric_normal);
        let normal = side * point.geometric_normal;
        let path = path_landed(branch.path, &axes, normal);
        let photon = Photon {
            position: point.spawn.position,
            incoming: branch.ray.direction,
            flux: branch.flux,
            normal,
            axes,
            object: point.object,
            events: branch.events,
            source: branch.source,
            coverage,
        };
        self.paths.push(path);
        self.photons.push(photon);
        if let Some(boundaries) = self.boundaries
            && coverage.overlaps()
        {
            boundaries.reflect(self.intersect, &photon, |image| {
                self.paths.push(path);
                self.photons.push(image);
            });
        }
    }

    fn branch_out(
        &mut self,
        branch: &Branch<N>,
        point: &SurfacePoint,
        scattering: &Scattering,
        threshold: f32,
        rng: &mut CounterRng,
    ) {
        self.ledger.normal_fallbacks += u64::from(scattering.fallbacks);
        if scattering.absorbed != Vec3::ZERO {
            self.ledger
                .book(Fate::Absorbed, branch.flux * scattering.absorbed);
        }
        let both = scattering.outgoing().count() == 2;
        let splits = match self.options.branching {
            Branching::Roulette => false,
            Branching::SplitFirst => !branch.has_split,
            Branching::SplitAll => true,
        };
        let event = &SpecularEvent {
            branch,
            point,
            normal_change: self.normal_change(branch, point, scattering),
            has_split: branch.has_split || (both && splits),
            threshold,
        };
        if both && !splits {
            // The Fresnel term is the same for all channels, so the choice leaves the flux as it is.
            let choice = rng.next_f32();
            let mut below = 0.0;
            let chosen = scattering.outgoing().find(|it| {
                below += it.weight.x;
                choice < below
            });
            if let Some(outgoing) = chosen.or(scattering.outgoing().last()) {
                let kept = outgoing.weight.x;
                self.follow(event, outgoing, branch.flux, kept, rng);
            }
        } else {
            for outgoing in scattering.outgoing() {
                let flux = branch.flux * outgoing.weight;
                self.follow(event, outgoing, flux, 1.0, rng);
            }
        }
    }

    /// Queues one outgoing direction, if roulette lets it live. `kept` is the part of such paths
    /// that were chosen to go on here.
    fn follow(
        &mut self,
        event: &SpecularEvent<'_, N>,
        outgoing: &Outgoing,
        flux: Vec3,
        mut kept: f32,
        rng: &mut CounterRng,
    ) {
        let SpecularEvent {
            branch,
            point,
            threshold,
            ..
        } = *event;
        let strongest = flux.max_element();
        if strongest <= 0.0 {
            return;
        }
        // A flat face's light is a sheet of its own.
        let face = point.object ^ self.world.flat_face(point);
        let path = extended(branch.path, face, 1 + outgoing.event as u32);
        if !self.admits(path, branch.path) {
            return;
        }
        let mut flux = flux;
        if strongest < threshold {
            let survival = strongest / threshold;
            if rng.next_f32() >= survival {
                self.ledger.book(Fate::Roulette, flux);
                return;
            }
            self.ledger.gain(flux / survival - flux);
            flux /= survival;
            kept *= survival;
        }
        // Where only a part of the paths goes on, those that do stand farther apart.
        // By roots, which round alike on every machine, as powers do not.
        let mut differential = event.scattered(outgoing);
        let mut is_grazing = false;
        // With two parameters what stands beside a photon says more than its derivative.
        if N > 2 && outgoing.event != Event::Passage {
            (differential, is_grazing) = event.grazing(outgoing).bounded(differential);
        }
        if kept < 1.0 {
            let root = kept.sqrt();
            differential = differential.scaled(1.0 / if N > 2 { root.sqrt() } else { root });
        }
        let (differential, is_long) = differential.bounded(DIRECTION_CHANGE_LIMIT);
        let shortened = is_grazing || is_long;
        self.ledger.bounded_differentials += u64::from(shortened);
        let source = if kept < 1.0 || branch.source == FootprintSource::Thinned {
            FootprintSource::Thinned
        } else if shortened {
            FootprintSource::Bounded
        } else {
            branch.source
        };
        let origin = point
            .spawn
            .origin_towards(point.geometric_normal, outgoing.direction);
        self.pending.push(Branch {
            ray: Ray::new(origin, outgoing.direction),
            differential,
            flux,
            media: outgoing.media,
            depth: branch.depth,
            events: branch.events + u32::from(outgoing.event != Event::Passage),
            has_split: event.has_split,
            channel: branch.channel,
            path,
            source,
        });
    }

    /// How the normal turns from a photon to its neighbours.
    ///
    /// It does as the interpolated one also where the geometric normal stood in, just inside a
    /// silhouette: most neighbours have the interpolated one. A flat facet's footprint would stay as
    /// narrow as the beam that met it, and burn a spot.
    fn normal_change(
        &self,
        branch: &Branch<N>,
        point: &SurfacePoint,
        scattering: &Scattering,
    ) -> [Vec3; N] {
        let is_passed = scattering.outgoing().all(|it| it.event == Event::Passage);
        if N == 0 || is_passed {
            return [Vec3::ZERO; N];
        }
        let side = if point.from_outside { 1.0 } else { -1.0 };
        let gradient = self.world.normal_gradient(point);
        let moved = branch.differential.position;
        moved.map(|moved| side * gradient.along(moved))
    }
}

/// A branch at a specular surface.
struct SpecularEvent<'a, const N: usize> {
    branch: &'a Branch<N>,
    point: &'a SurfacePoint,
    /// What a step along each parameter turns the normal by.
    normal_change: [Vec3; N],
    has_split: bool,
    /// Flux below which roulette is played.
    threshold: f32,
}

impl<const N: usize> SpecularEvent<'_, N> {
    fn grazing(&self, outgoing: &Outgoing) -> Grazing<N> {
        Grazing::of(
            &self.branch.differential,
            self.branch.ray.direction,
            outgoing,
            &self.normal_change,
        )
    }

    /// The differential of what leaves in one direction.
    fn scattered(&self, outgoing: &Outgoing) -> RayDifferential<N> {
        let before = &self.branch.differential;
        let direction = self.branch.ray.direction;
        let normal_change = self.normal_change;
        match outgoing.event {
            Event::Passage => *before,
            Event::Reflection => before.reflected(direction, outgoing.normal, normal_change),
            Event::Refraction => before.refracted(
                direction,
                outgoing.direction,
                outgoing.normal,
                outgoing.eta,
                normal_change,
            ),
        }
    }
}
