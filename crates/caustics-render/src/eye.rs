use caustics_accel::Intersect;
use caustics_geometry::Ray;
use caustics_sampling::CounterRng;
use caustics_scene::{Brdf, Surface, SurfacePoint, World};
use caustics_trace::{Event, MediumStack, Scattering, beer_lambert, scatter};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Branches whose part of the pixel falls below this meet Russian roulette.
const MIN_WEIGHT: f32 = 0.02;

/// A receiver that an eye path reached.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point on the surface.
    pub point: SurfacePoint,
    /// Unit geometric normal on the side that is seen.
    pub normal: Vec3,
    /// Unit interpolated normal on the same side.
    pub shading_normal: Vec3,
    /// How it reflects.
    pub brdf: Brdf,
    /// Unit direction from the receiver towards the eye.
    pub outgoing: Vec3,
    /// The part of the radiance that leaves the receiver which reaches the eye, for each channel.
    pub weight: Vec3,
    /// Whether the camera sees it without a mirror or a glass between.
    pub seen_directly: bool,
}

impl Receiver {
    /// The part of the light from the unit direction `to_light` that goes towards the eye, in 1/sr,
    /// for each channel: radiance over irradiance.
    ///
    /// The smooth normal shades, unless it faces away from the eye.
    #[must_use]
    pub fn reflectance(&self, to_light: Vec3) -> Vec3 {
        let normal = serving_normal(self.normal, self.shading_normal, self.outgoing);
        reflectance(&self.brdf, normal, to_light, self.outgoing)
    }
}

/// The interpolated normal if the eye is on its side, else the geometric one.
pub(crate) fn serving_normal(geometric: Vec3, shading: Vec3, to_eye: Vec3) -> Vec3 {
    if shading.dot(to_eye) > 0.0 {
        shading
    } else {
        geometric
    }
}

/// As [`Brdf::evaluate`]; a Lambertian receiver reflects the same whatever the shading normal is.
#[inline]
pub(crate) fn reflectance(brdf: &Brdf, normal: Vec3, to_light: Vec3, to_eye: Vec3) -> Vec3 {
    if brdf.is_lambertian() {
        FRAC_1_PI * brdf.base()
    } else {
        brdf.evaluate(normal, to_light, to_eye)
    }
}

/// Follows eye paths through mirrors and glass to the receivers that they end on: Whitted's
/// algorithm (Whitted 1980), both ways at each dielectric, with Russian roulette for what adds
/// little.
pub struct EyeTracer<'a, I: ?Sized> {
    world: &'a World,
    intersect: &'a I,
    max_depth: u32,
    pending: Vec<EyeBranch>,
    /// Rays traced so far.
    pub rays: u64,
}

#[derive(Clone, Copy)]
struct EyeBranch {
    ray: Ray,
    weight: Vec3,
    media: MediumStack,
    depth: u32,
    seen_directly: bool,
    channel: Option<u8>,
}

impl<'a, I: Intersect + ?Sized> EyeTracer<'a, I> {
    /// A tracer whose paths meet at most `max_depth` surfaces.
    #[must_use]
    pub fn new(world: &'a World, intersect: &'a I, max_depth: u32) -> Self {
        Self {
            world,
            intersect,
            max_depth,
            pending: Vec::new(),
            rays: 0,
        }
    }

    /// Calls `visit` for each receiver that the path along `ray` reaches, and returns the radiance
    /// that emissive surfaces on its way, and the environment beyond, send to the eye.
    ///
    /// `media` are those around the ray's origin; the ray's direction must be a unit vector.
    pub fn trace(
        &mut self,
        ray: Ray,
        media: MediumStack,
        rng: &mut CounterRng,
        mut visit: impl FnMut(&Receiver, &mut CounterRng),
    ) -> Vec3 {
        let mut emitted = Vec3::ZERO;
        self.pending.push(EyeBranch {
            ray,
            weight: Vec3::ONE,
            media,
            depth: 0,
            seen_directly: true,
            channel: None,
        });
        while let Some(branch) = self.pending.pop() {
            emitted += self.advance(branch, rng, &mut visit);
        }
        emitted
    }

    fn advance(
        &mut self,
        mut branch: EyeBranch,
        rng: &mut CounterRng,
        visit: &mut impl FnMut(&Receiver, &mut CounterRng),
    ) -> Vec3 {
        self.rays += 1;
        let hit = self.intersect.closest_hit(&branch.ray);
        if hit.is_none()
            && let Some(sky) = self.world.environment()
        {
            return branch.weight * sky.radiance(branch.ray.direction);
        }
        let Some((hit, point)) =
            hit.and_then(|hit| Some((hit, self.world.surface(&branch.ray, &hit)?)))
        else {
            return Vec3::ZERO;
        };
        let material = &self.world.materials()[point.material as usize];
        branch.weight *= beer_lambert(branch.media.attenuation(self.world), hit.t);
        branch.depth += 1;
        let emits = point.from_outside || material.double_sided;
        let emitted = if emits {
            branch.weight * material.emission
        } else {
            Vec3::ZERO
        };
        match (material.surface, material.surface.brdf()) {
            (_, Some(brdf)) => {
                let side = if point.from_outside { 1.0 } else { -1.0 };
                let receiver = Receiver {
                    point,
                    normal: side * point.geometric_normal,
                    shading_normal: side * point.shading_normal,
                    brdf,
                    outgoing: -branch.ray.direction,
                    weight: branch.weight,
                    seen_directly: branch.seen_directly,
                };
                visit(&receiver, rng);
            }
            (Surface::Dielectric { dispersion, .. }, _)
                if dispersion > 0.0 && branch.channel.is_none() =>
            {
                for channel in 0..3usize {
                    let mut part = branch;
                    part.weight = Vec3::ZERO;
                    part.weight[channel] = branch.weight[channel];
                    part.channel = Some(channel as u8);
                    self.scatter_from(&part, &point, rng);
                }
            }
            _ => self.scatter_from(&branch, &point, rng),
        }
        emitted
    }

    fn scatter_from(&mut self, branch: &EyeBranch, point: &SurfacePoint, rng: &mut CounterRng) {
        if branch.depth >= self.max_depth {
            return;
        }
        let direction = branch.ray.direction;
        if let Some(scattering) =
            scatter(self.world, point, direction, &branch.media, branch.channel)
        {
            self.branch_out(branch, point, &scattering, rng);
        }
    }

    fn branch_out(
        &mut self,
        branch: &EyeBranch,
        point: &SurfacePoint,
        scattering: &Scattering,
        rng: &mut CounterRng,
    ) {
        for outgoing in scattering.outgoing() {
            // Radiance is squeezed into a smaller solid angle on its way into a denser medium, and
            // an eye path goes the other way: L / n² is what stays the same.
            let mut weight = branch.weight * outgoing.weight * (outgoing.eta * outgoing.eta);
            let strongest = weight.max_element();
            if strongest < MIN_WEIGHT {
                let survival = strongest / MIN_WEIGHT;
                if rng.next_f32() >= survival {
                    continue;
                }
                weight /= survival;
            }
            let origin = point
                .spawn
                .origin_towards(point.geometric_normal, outgoing.direction);
            self.pending.push(EyeBranch {
                ray: Ray::new(origin, outgoing.direction),
                weight,
                media: outgoing.media,
                depth: branch.depth,
                seen_directly: branch.seen_directly && outgoing.event == Event::Passage,
                channel: branch.channel,
            });
        }
    }
}
