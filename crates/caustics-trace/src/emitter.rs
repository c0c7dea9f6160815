use caustics_geometry::{Frame, Sphere};
use caustics_sampling::warp::Cone;
use caustics_sampling::{PointSet, Sequence};
use caustics_scene::{Environment, Light, World};
use glam::{DVec3, Vec3};

use crate::area_emission::AreaSurface;
use crate::casters::Casters;
use crate::domain::EmissionDomain;
use crate::domain_reuse::{is_kept, widened};
use crate::emission::{Emission, EmissionSample};
use crate::options::Aim;
use crate::outline::Outline;

/// Which light of a world an emitter is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum LightSource {
    /// An entry of [`World::lights`].
    Light {
        /// Its index.
        index: u32,
    },
    /// One side of an entry of [`World::emitters`].
    Object {
        /// Its index.
        emitter: u32,
        /// Whether it is the side that the geometric normals point to.
        front: bool,
    },
    /// The world's [`Environment`](caustics_scene::Environment).
    Environment,
}

/// The rays that one light sends towards one caster, or everywhere.
///
/// Plain data: the light, the caster, and the [`EmissionDomain`] that says how a point of the unit
/// square becomes a ray. A photon counts only where the first object in its way is of the emitter's
/// caster.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    source: LightSource,
    caster: Option<u32>,
    domain: EmissionDomain,
    power: DVec3,
    aimed_power: DVec3,
}

impl Emitter {
    /// The emitters of all lights of a world, those of one light side by side: one for each caster,
    /// or with [`Aim::Everywhere`] one in all.
    #[must_use]
    pub fn all(world: &World, casters: &Casters, aim: Aim) -> Vec<Self> {
        Self::following(world, casters, aim, &[])
    }

    /// Like [`all`](Self::all), but with the domains of the emitters `before` wherever the caster
    /// still fits in, so that the rays stay the same while it moves a little.
    pub(crate) fn following(
        world: &World,
        casters: &Casters,
        aim: Aim,
        before: &[&Self],
    ) -> Vec<Self> {
        let mut sources: Vec<LightSource> = (0..world.lights().len() as u32)
            .map(|index| LightSource::Light { index })
            .collect();
        for (emitter, light) in (0u32..).zip(world.emitters()) {
            let front = true;
            sources.push(LightSource::Object { emitter, front });
            if light.double_sided() {
                let front = false;
                sources.push(LightSource::Object { emitter, front });
            }
        }
        if world.environment().is_some() {
            sources.push(LightSource::Environment);
        }
        let mut emitters = Vec::new();
        for source in sources {
            match aim {
                Aim::Everywhere => emitters.push(Self::new(world, source, None)),
                _ => {
                    let first = emitters.len();
                    emitters.extend(casters.outlines().map(|target| {
                        Self::new(world, source, Some(target)).settled(world, target.1, before)
                    }));
                    if emitters.len() == first {
                        let nothing = EmissionDomain::Nothing;
                        let power = power(world, source);
                        emitters.push(Self::with_domain(world, source, None, nothing, power));
                    }
                }
            }
        }
        emitters
    }

    /// The light.
    #[must_use]
    pub fn source(&self) -> LightSource {
        self.source
    }

    /// The number of the caster among the world's [`Casters`]; `None` where the light shines
    /// everywhere.
    #[must_use]
    pub fn caster(&self) -> Option<u32> {
        self.caster
    }

    /// The rays, as a map of the unit square.
    #[must_use]
    pub fn domain(&self) -> &EmissionDomain {
        &self.domain
    }

    /// Everything that the light emits, towards all casters and elsewhere, in watts; for a
    /// directional light, onto a square around the scene, for an environment onto a ball around it.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        self.power
    }

    /// About how much of it goes where the photons are aimed, in watts.
    #[must_use]
    pub fn aimed_power(&self) -> DVec3 {
        self.aimed_power
    }

    /// On how many parameters its photons depend: 2 or 4.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.domain.dimensions()
    }

    /// The photon of a sample.
    ///
    /// `None` for a sample that stands for no light: outside a spot light's cone, below the horizon
    /// of an area light.
    #[must_use]
    pub fn emit<const N: usize>(
        &self,
        world: &World,
        sample: &EmissionSample,
    ) -> Option<Emission<N>> {
        self.domain.emit(world, sample)
    }

    /// A number that is the same in every frame, and for no other pair of the scene (but for one
    /// chance in four thousand million): what random decisions are drawn from.
    ///
    /// It depends on the light's own number and on the caster's first object, not on what else
    /// there is.
    #[must_use]
    pub(crate) fn identity(&self, casters: &Casters) -> u32 {
        let light = match self.source {
            LightSource::Light { index } => index << 2,
            LightSource::Object { emitter, front } => (emitter << 2) | 2 | u32::from(front),
            LightSource::Environment => 1,
        };
        let object = self
            .caster
            .and_then(|caster| casters.objects(caster).first().copied())
            .map_or(0, |object| object + 1);
        light.wrapping_mul(0x9E37_79B1) ^ object.wrapping_mul(0x85EB_CA6B).rotate_left(16)
    }

    fn new(world: &World, source: LightSource, target: Option<(u32, &Outline)>) -> Self {
        let (caster, outline) = target.unzip();
        let domain = match source {
            LightSource::Light { index } => match world.lights()[index as usize] {
                Light::Directional {
                    direction,
                    irradiance,
                } => sun_domain(world, direction, irradiance, outline),
                light if light.area().is_some() => light_area_domain(&light, outline),
                light => lamp_domain(light, outline),
            },
            LightSource::Object { emitter, front } => EmissionDomain::Area {
                surface: AreaSurface::Object { emitter, front },
                target: outline.map(|it| *it.bounding()),
            },
            LightSource::Environment => sky_domain(world, outline),
        };
        Self::with_domain(world, source, caster, domain, power(world, source))
    }

    /// With the domain that the same pair had before, or one that is a little wider than need be,
    /// so that it may serve for some time.
    fn settled(self, world: &World, outline: &Outline, before: &[&Self]) -> Self {
        let same = |it: &&&Self| it.source == self.source && it.caster == self.caster;
        let Some(old) = before.iter().find(same) else {
            return self;
        };
        let is_still = old.domain == self.domain;
        let domain = if is_still || is_kept(&old.domain, &self.domain, outline) {
            old.domain
        } else {
            widened(&self.domain)
        };
        Self::with_domain(world, self.source, self.caster, domain, self.power)
    }

    fn with_domain(
        world: &World,
        source: LightSource,
        caster: Option<u32>,
        domain: EmissionDomain,
        power: DVec3,
    ) -> Self {
        let aimed_power = aimed_power(world, &domain);
        Self {
            source,
            caster,
            domain,
            power,
            aimed_power,
        }
    }
}

/// Everything that a light emits, in watts.
fn power(world: &World, source: LightSource) -> DVec3 {
    match source {
        LightSource::Light { index } => {
            let light = &world.lights()[index as usize];
            match *light {
                Light::Directional {
                    direction,
                    irradiance,
                } => match whole_rectangle(world, direction) {
                    Some((_, edges)) => flux_through(irradiance, &edges),
                    None => DVec3::ZERO,
                },
                _ => light.flux().unwrap_or(Vec3::ZERO).as_dvec3(),
            }
        }
        LightSource::Object { emitter, .. } => {
            let light = &world.emitters()[emitter as usize];
            let sides = if light.double_sided() { 0.5 } else { 1.0 };
            sides * light.power().as_dvec3()
        }
        LightSource::Environment => {
            let total = world.environment().map_or(Vec3::ZERO, Environment::total);
            let (_, radius) = world.bounds().bounding_sphere();
            let area = if world.bounds().is_empty() {
                0.0
            } else {
                std::f64::consts::PI * f64::from(radius).powi(2)
            };
            area * total.as_dvec3()
        }
    }
}

fn flux_through(irradiance: Vec3, edges: &[Vec3; 2]) -> DVec3 {
    irradiance.as_dvec3() * f64::from(edges[0].length()) * f64::from(edges[1].length())
}

/// How far along `direction` a sun's rays start: outside the scene, so that what stands before the
/// casters shades them. In coarse steps, so that the rays stay the same, to the bit, while objects
/// move about at the scene's border.
fn start_along(world: &World, direction: Vec3) -> f32 {
    let (center, radius) = world.bounds().bounding_sphere();
    let distance = center.dot(direction) - 1.001 * radius;
    let step = radius.log2().ceil().exp2() / 4.0;
    if step > 0.0 && step.is_finite() {
        (distance / step).floor() * step
    } else {
        distance
    }
}

/// The square across `direction` around the whole scene: a corner and two edges.
fn whole_rectangle(world: &World, direction: Vec3) -> Option<(Vec3, [Vec3; 2])> {
    if world.bounds().is_empty() {
        return None;
    }
    let (center, radius) = world.bounds().bounding_sphere();
    let (tangent, bitangent) = direction.any_orthonormal_pair();
    // A little larger, so that nothing that is aimed at reaches beyond it.
    let radius = 1.001 * radius;
    let corner = center - radius * (tangent + bitangent);
    let edges = [2.0 * radius * tangent, 2.0 * radius * bitangent];
    Some((corner, edges))
}

fn sun_domain(
    world: &World,
    direction: Vec3,
    irradiance: Vec3,
    target: Option<&Outline>,
) -> EmissionDomain {
    let Some(whole) = whole_rectangle(world, direction) else {
        return EmissionDomain::Nothing;
    };
    let (corner, edges) = target.map_or(whole, |outline| outline.rectangle_across(direction));
    let start = start_along(world, direction);
    EmissionDomain::Rectangle {
        corner: corner + (start - corner.dot(direction)) * direction,
        edges,
        direction,
        irradiance,
    }
}

fn sky_domain(world: &World, target: Option<&Outline>) -> EmissionDomain {
    if world.bounds().is_empty() {
        return EmissionDomain::Nothing;
    }
    let (center, radius) = world.bounds().bounding_sphere();
    let target = target.map_or(Sphere { center, radius }, |it| *it.bounding());
    // Outside the scene, in coarse steps as for a sun.
    let reach = target.center.distance(center) + 1.001 * radius;
    EmissionDomain::Sky {
        target,
        distance: reach.log2().ceil().exp2(),
    }
}

fn lamp_domain(light: Light, target: Option<&Outline>) -> EmissionDomain {
    // A spot light's own cone; its constructor keeps the cosine in 0..1.
    let (origin, own) = match light {
        Light::Point { position, .. } => (position, None),
        Light::Spot {
            position,
            direction,
            outer_cos,
            ..
        } => (
            position,
            Cone::from_cosine(outer_cos)
                .ok()
                .map(|cone| (direction, cone)),
        ),
        _ => return EmissionDomain::Nothing,
    };
    let around = target.and_then(|outline| outline.cone_from(origin));
    let narrower = match (own, around) {
        (Some((axis, own)), Some((towards, around))) => {
            let separation = towards.angle_between(axis);
            if separation > own.cosine().acos() + around.cosine().acos() {
                return EmissionDomain::Nothing;
            }
            let aimed = around.solid_angle() < own.solid_angle();
            Some(if aimed {
                (towards, around)
            } else {
                (axis, own)
            })
        }
        (own, around) => own.or(around),
    };
    match narrower {
        Some((axis, cone)) => EmissionDomain::Cone {
            light,
            origin,
            frame: Frame::from_normal(axis),
            cone,
        },
        None => EmissionDomain::Sphere { light, origin },
    }
}

fn light_area_domain(light: &Light, target: Option<&Outline>) -> EmissionDomain {
    let target = target.map(|it| *it.bounding());
    AreaSurface::of(light, target.as_ref()).map_or(EmissionDomain::Nothing, |surface| {
        EmissionDomain::Area { surface, target }
    })
}

/// Measures the flux into a domain by a fixed set of photons: good enough to share the photons by,
/// and no light's brightness depends on it.
fn aimed_power(world: &World, domain: &EmissionDomain) -> DVec3 {
    const COUNT: u32 = 256;
    if let EmissionDomain::Rectangle {
        edges, irradiance, ..
    } = domain
    {
        return flux_through(*irradiance, edges);
    }
    let points = PointSet::new(Sequence::Halton, COUNT, 0);
    (0..COUNT)
        .filter_map(|index| domain.emit::<2>(world, &EmissionSample::of(&points, index)))
        .map(|emission| emission.flux.as_dvec3())
        .sum()
}
