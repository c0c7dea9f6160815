use caustics_geometry::{Frame, Ray, Sphere};
use caustics_sampling::warp::{
    Cone, square_to_cosine_hemisphere, square_to_disc_concentric,
};
use caustics_scene::{AreaLight, Light, World};
use glam::{DVec3, Vec2, Vec3};

use crate::differential::RayDifferential;
use crate::options::Aim;

/// A photon as it leaves its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission<const N: usize> {
    /// Where it starts and goes; the direction is a unit vector.
    pub ray: Ray,
    /// Its flux in watts, for each channel.
    pub flux: Vec3,
    /// The displacement of its neighbours, one sample spacing away in each parameter.
    pub differential: RayDifferential<N>,
}

/// The rays that one light sends out, as an image of the unit square or, for area lights, of the
/// unit cube of four dimensions.
///
/// All maps preserve area, so that equally spaced points are photons of equal share. The
/// differentials are taken along orthonormal directions of the emission domain itself, scaled to
/// the share of one photon: they need no derivative of the map, and have no seam or pole.
#[derive(Clone, Debug)]
pub struct Emitter<'a> {
    domain: Domain<'a>,
    power: DVec3,
    aimed_power: DVec3,
}

#[derive(Clone, Debug)]
enum Domain<'a> {
    /// Directions from a point.
    Cone { light: &'a Light, origin: Vec3, frame: Frame, cone: Cone },
    /// Parallel rays from a disc across them.
    Disc { center: Vec3, frame: Frame, radius: f32, irradiance: Vec3 },
    /// Rays from a side of a surface, towards a sphere if one is given.
    Area { world: &'a World, light: &'a AreaLight, front: bool, target: Option<Sphere> },
    /// No rays: the light cannot reach what it is aimed at.
    Nothing,
}

impl<'a> Emitter<'a> {
    /// The emitters of all lights of a world: one for each point, spot and directional light and
    /// one for each emitting side of each emissive object.
    #[must_use]
    pub fn all(world: &'a World, aim: Aim) -> Vec<Self> {
        let mut emitters: Vec<Self> =
            world.lights().iter().map(|light| Self::of_light(world, light, aim)).collect();
        for light in world.emitters() {
            emitters.push(Self::of_area(world, light, true, aim));
            if light.double_sided() {
                emitters.push(Self::of_area(world, light, false, aim));
            }
        }
        emitters
    }

    /// Everything that the light emits, in watts; for a directional light, onto the bounding
    /// sphere of the scene.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        self.power
    }

    /// About how much of it goes where the photons are aimed: what photons are shared by.
    #[must_use]
    pub fn aimed_power(&self) -> DVec3 {
        self.aimed_power
    }

    /// How many dimensions of the unit cube the photons depend on: 2 or 4.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        if matches!(self.domain, Domain::Area { .. }) { 4 } else { 2 }
    }

    /// A point where its rays start, to find the media around it: `None` for a light that is
    /// infinitely far away.
    #[must_use]
    pub fn start(&self) -> Option<Vec3> {
        match &self.domain {
            Domain::Cone { origin, .. } => Some(*origin),
            Domain::Area { world, light, front, .. } => {
                let point = world.point_on(light.primitives().start, Vec2::splat(0.25))?;
                let side = if *front { 1.0 } else { -1.0 };
                let normal = side * point.geometric_normal;
                Some(point.spawn.origin_towards(normal, normal))
            }
            Domain::Disc { .. } | Domain::Nothing => None,
        }
    }

    /// The photon at a point of the unit cube, one of `count` that share the emitter's flux. The
    /// last two coordinates are those of the start on an area light.
    ///
    /// `None` for a point that stands for no light, below the horizon of an area light.
    #[must_use]
    pub fn emit<const N: usize>(&self, sample: [f32; 4], count: u32) -> Option<Emission<N>> {
        let [u, v, s, t] = sample;
        let (direction_sample, position_sample) = (Vec2::new(u, v), Vec2::new(s, t));
        let share = 1.0 / count as f32;
        match &self.domain {
            Domain::Cone { light, origin, frame, cone } => {
                let direction =
                    frame.to_world(cone.sample_concentric(direction_sample).value).normalize();
                let solid_angle = cone.solid_angle();
                let spacing = (solid_angle * share).sqrt();
                let (tangent, bitangent) = direction.any_orthonormal_pair();
                Some(Emission {
                    ray: Ray::new(*origin, direction),
                    flux: light.intensity_towards(direction) * (solid_angle * share),
                    differential: differential(&[], &[spacing * tangent, spacing * bitangent]),
                })
            }
            Domain::Disc { center, frame, radius, irradiance } => {
                let point = *radius * square_to_disc_concentric(direction_sample).value;
                let area = std::f32::consts::PI * radius * radius;
                let spacing = (area * share).sqrt();
                let origin = *center + point.x * frame.tangent + point.y * frame.bitangent;
                Some(Emission {
                    ray: Ray::new(origin, frame.normal),
                    flux: *irradiance * (area * share),
                    differential: differential(
                        &[spacing * frame.tangent, spacing * frame.bitangent],
                        &[],
                    ),
                })
            }
            Domain::Area { world, light, front, target } => {
                area_emission(world, light, *front, target.as_ref(), direction_sample, position_sample, share)
            }
            Domain::Nothing => None,
        }
    }

    fn of_light(world: &'a World, light: &'a Light, aim: Aim) -> Self {
        let target = match aim {
            Aim::Everywhere => None,
            Aim::Casters => Some(bounding_sphere(world.specular_bounds())),
        };
        match *light {
            Light::Directional { direction, irradiance } => {
                Self::of_sun(world, direction, irradiance, target)
            }
            _ => Self::of_lamp(light, target),
        }
    }

    fn of_sun(
        world: &World,
        direction: Vec3,
        irradiance: Vec3,
        target: Option<Option<Sphere>>,
    ) -> Self {
        let Some(scene) = bounding_sphere(world.bounds()) else {
            return Self::nothing(DVec3::ZERO);
        };
        let flux_through = |sphere: &Sphere| {
            irradiance.as_dvec3() * std::f64::consts::PI * f64::from(sphere.radius).powi(2)
        };
        let power = flux_through(&scene);
        let Some(aimed) = target.unwrap_or(Some(scene)) else {
            return Self::nothing(power);
        };
        // The disc stands outside the scene, so that what stands before the casters shades them.
        let along = (scene.center - aimed.center).dot(direction) - scene.radius;
        Self {
            domain: Domain::Disc {
                center: aimed.center + along * direction,
                frame: Frame::from_normal(direction),
                radius: aimed.radius,
                irradiance,
            },
            power,
            aimed_power: flux_through(&aimed),
        }
    }

    fn of_lamp(light: &'a Light, target: Option<Option<Sphere>>) -> Self {
        let power = light.flux().unwrap_or(Vec3::ZERO).as_dvec3();
        let (origin, axis, own) = match *light {
            Light::Point { position, .. } => (position, Vec3::Y, Cone::SPHERE),
            Light::Spot { position, direction, outer_cos, .. } => {
                // The constructor keeps the outer cosine in 0..1.
                (position, direction, Cone::from_cosine(outer_cos).unwrap_or(Cone::SPHERE))
            }
            _ => return Self::nothing(power),
        };
        let (axis, cone) = match target {
            None => (axis, own),
            Some(None) => return Self::nothing(power),
            Some(Some(sphere)) => match aimed_cone(origin, axis, own, &sphere) {
                Some(aimed) => aimed,
                None => return Self::nothing(power),
            },
        };
        let domain =
            Domain::Cone { light, origin, frame: Frame::from_normal(axis), cone };
        let mut emitter = Self { domain, power, aimed_power: DVec3::ZERO };
        emitter.aimed_power = emitter.measured_power();
        emitter
    }

    fn of_area(world: &'a World, light: &'a AreaLight, front: bool, aim: Aim) -> Self {
        let sides = if light.double_sided() { 0.5 } else { 1.0 };
        let power = sides * light.power().as_dvec3();
        let target = match aim {
            Aim::Everywhere => None,
            Aim::Casters => match bounding_sphere(world.specular_bounds()) {
                Some(sphere) => Some(sphere),
                None => return Self::nothing(power),
            },
        };
        let domain = Domain::Area { world, light, front, target };
        let mut emitter = Self { domain, power, aimed_power: DVec3::ZERO };
        emitter.aimed_power = emitter.measured_power();
        emitter
    }

    fn nothing(power: DVec3) -> Self {
        Self { domain: Domain::Nothing, power, aimed_power: DVec3::ZERO }
    }

    /// The flux into the domain, by the mean of a fixed set of photons: good enough to share the
    /// photons by, no light's brightness depends on it.
    fn measured_power(&self) -> DVec3 {
        const COUNT: u32 = 256;
        (0..COUNT)
            .filter_map(|index| {
                let sample = std::array::from_fn(|dimension| {
                    caustics_sampling::halton(index, dimension as u32)
                });
                self.emit::<2>(sample, COUNT)
            })
            .map(|emission| emission.flux.as_dvec3())
            .sum()
    }
}

/// The differential of the first `N` parameters: those of the direction where the light has no
/// area, those of the position where it has no directions, else directions and then positions.
fn differential<const N: usize>(positions: &[Vec3], directions: &[Vec3]) -> RayDifferential<N> {
    let mut result = RayDifferential::ZERO;
    for (slot, &change) in result.direction.iter_mut().zip(directions) {
        *slot = change;
    }
    for (slot, &moved) in result.position.iter_mut().skip(directions.len()).zip(positions) {
        *slot = moved;
    }
    result
}

/// The sphere around a box, `None` around an empty one.
fn bounding_sphere(bounds: caustics_geometry::Aabb) -> Option<Sphere> {
    if bounds.is_empty() {
        return None;
    }
    let (center, radius) = bounds.bounding_sphere();
    // A little more than the box needs, so that rounding cuts nothing off.
    Some(Sphere { center, radius: radius * 1.0001 })
}

/// The narrower of a light's own cone and the cone that holds a sphere, with its axis; `None`
/// where the two do not meet.
fn aimed_cone(origin: Vec3, axis: Vec3, own: Cone, sphere: &Sphere) -> Option<(Vec3, Cone)> {
    let to_sphere = sphere.center - origin;
    let distance = to_sphere.length();
    if distance <= sphere.radius {
        return Some((axis, own));
    }
    let towards = to_sphere / distance;
    let around = Cone::from_sine(sphere.radius / distance).ok()?;
    let separation = towards.angle_between(axis);
    if separation > own.cosine().acos() + around.cosine().acos() {
        return None;
    }
    if around.solid_angle() < own.solid_angle() { Some((towards, around)) } else { Some((axis, own)) }
}

/// Emission from a point of an area light, uniform over its area; its directions fill the cone to
/// the target uniformly, or the whole hemisphere in proportion to the cosine.
fn area_emission<const N: usize>(
    world: &World,
    light: &AreaLight,
    front: bool,
    target: Option<&Sphere>,
    direction_sample: Vec2,
    position_sample: Vec2,
    share: f32,
) -> Option<Emission<N>> {
    let (primitive, along) = light.choose(position_sample.x);
    let point = world.point_on(primitive, Vec2::new(along, position_sample.y))?;
    let normal = if front { point.geometric_normal } else { -point.geometric_normal };
    let origin = point.spawn.position;

    let cone_to_target = target.and_then(|sphere| {
        let to_sphere = sphere.center - origin;
        let distance = to_sphere.length();
        let cone = Cone::from_sine(sphere.radius / distance).ok()?;
        (distance > sphere.radius).then_some((to_sphere / distance, cone))
    });
    let (direction, pdf) = match cone_to_target {
        Some((axis, cone)) => {
            let local = cone.sample_concentric(direction_sample);
            (Frame::from_normal(axis).to_world(local.value), local.pdf)
        }
        None => {
            let local = square_to_cosine_hemisphere(direction_sample);
            (Frame::from_normal(normal).to_world(local.value), local.pdf)
        }
    };
    let direction = direction.normalize();
    let cosine = direction.dot(normal);
    if cosine <= 0.0 || pdf <= 0.0 {
        return None;
    }
    // One photon's share of the four-dimensional domain, alike in all its dimensions.
    let side = share.powf(0.25);
    let angle = side * pdf.recip().sqrt();
    let length = side * light.area().sqrt();
    let (tangent, bitangent) = direction.any_orthonormal_pair();
    let frame = Frame::from_normal(normal);
    Some(Emission {
        ray: Ray::new(point.spawn.origin_towards(normal, direction), direction),
        flux: light.radiance() * (cosine * light.area() * share / pdf),
        differential: differential(
            &[length * frame.tangent, length * frame.bitangent],
            &[angle * tangent, angle * bitangent],
        ),
    })
}
