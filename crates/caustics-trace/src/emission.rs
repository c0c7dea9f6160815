use caustics_geometry::{Frame, Ray};
use caustics_sampling::warp::{Cone, WarpSample, square_to_sphere_octahedral};
use caustics_sampling::{PointSet, apportion};
use caustics_scene::{AreaLight, Light, World};
use glam::{DVec3, Vec2, Vec3};

use crate::aim::Casters;
use crate::area_emission::AreaDomain;
use crate::differential::RayDifferential;
use crate::emitter_domain::EmitterDomain;
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

/// A point of the unit cube from which a photon is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionSample {
    /// Chooses the direction or, for a directional light, the place.
    pub point: Vec2,
    /// The edges of the cell that `point` stands for.
    pub spacing: [Vec2; 2],
    /// Chooses the place on an area light.
    pub place: Vec2,
    /// Photons that share the light's flux.
    pub count: u32,
}

impl EmissionSample {
    /// Number `index` of a set.
    #[must_use]
    pub fn of(points: &PointSet, index: u32) -> Self {
        Self {
            point: points.point(index),
            spacing: points.spacing(index),
            place: Vec2::new(points.sample(index, 2), points.sample(index, 3)),
            count: points.count(),
        }
    }
}

/// The rays that one light sends out, as an image of the unit square or, for area lights, of the
/// unit cube of four dimensions.
///
/// All maps preserve area: photons at equally spaced points have an equal share of the domain. A
/// photon's differential is its cell's edges times the derivative of the map.
#[derive(Clone, Debug)]
pub struct Emitter<'a> {
    domain: Domain<'a>,
    power: DVec3,
    aimed_power: DVec3,
}

#[derive(Clone, Debug)]
enum Domain<'a> {
    /// All directions from a point.
    Sphere { light: &'a Light, origin: Vec3 },
    /// Directions from a point around an axis.
    Cone {
        light: &'a Light,
        origin: Vec3,
        frame: Frame,
        cone: Cone,
    },
    /// Parallel rays from a rectangle across them.
    Rectangle {
        corner: Vec3,
        edges: [Vec3; 2],
        direction: Vec3,
        irradiance: Vec3,
    },
    /// Rays from a side of a surface.
    Area(AreaDomain<'a>),
    /// No rays: the light cannot reach what it is aimed at.
    Nothing,
}

impl<'a> Emitter<'a> {
    /// The emitters of all lights of a world: one for each point, spot and directional light and
    /// one for each emitting side of each emissive object.
    #[must_use]
    pub fn all(world: &'a World, aim: Aim) -> Vec<Self> {
        let target = match aim {
            Aim::Everywhere => Target::Everything,
            Aim::Casters => Casters::of(world).map_or(Target::Nothing, Target::Casters),
        };
        let mut emitters: Vec<Self> = world
            .lights()
            .iter()
            .map(|light| Self::of_light(world, light, &target))
            .collect();
        for light in world.emitters() {
            emitters.push(Self::of_area(world, light, true, &target));
            if light.double_sided() {
                emitters.push(Self::of_area(world, light, false, &target));
            }
        }
        emitters
    }

    /// How many of `total` photons each emitter gets, in proportion to its aimed power. The photons
    /// of all are numbered in this order, from 0.
    #[must_use]
    pub fn share(emitters: &[Self], total: u32) -> Vec<u32> {
        let weights: Vec<f64> = emitters
            .iter()
            .map(|it| it.aimed_power().element_sum())
            .collect();
        apportion(&weights, total as usize).map_or_else(
            |_| vec![0; emitters.len()],
            |counts| counts.into_iter().map(|it| it as u32).collect(),
        )
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

    /// On how many parameters its photons depend: 2 or 4.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        if matches!(self.domain, Domain::Area(_)) {
            4
        } else {
            2
        }
    }

    /// How many times as long along its first parameter the domain is as along its second.
    pub(crate) fn aspect(&self) -> f32 {
        match &self.domain {
            Domain::Rectangle {
                edges: [along, across],
                ..
            } => along.length() / across.length(),
            _ => 1.0,
        }
    }

    /// A point where its rays start, to find the media around it: `None` for a light that is
    /// infinitely far away.
    #[must_use]
    pub fn start(&self) -> Option<Vec3> {
        match &self.domain {
            Domain::Sphere { origin, .. } | Domain::Cone { origin, .. } => Some(*origin),
            Domain::Area(area) => area.start(),
            Domain::Rectangle { .. } | Domain::Nothing => None,
        }
    }

    /// The photon of a sample.
    ///
    /// `None` for a sample that stands for no light: outside a spot light's cone, below the horizon
    /// of an area light.
    #[must_use]
    pub fn emit<const N: usize>(&self, sample: &EmissionSample) -> Option<Emission<N>> {
        let share = 1.0 / sample.count as f32;
        match &self.domain {
            Domain::Sphere { light, origin } => {
                let warped = square_to_sphere_octahedral(sample.point);
                let solid_angle = 4.0 * std::f32::consts::PI;
                from_point(light, *origin, &warped, solid_angle * share, sample)
            }
            Domain::Cone {
                light,
                origin,
                frame,
                cone,
            } => {
                let local = cone.sample_concentric(sample.point);
                let warped = WarpSample {
                    value: frame.to_world(local.value),
                    pdf: local.pdf,
                    d_du: frame.to_world(local.d_du),
                    d_dv: frame.to_world(local.d_dv),
                };
                from_point(light, *origin, &warped, cone.solid_angle() * share, sample)
            }
            Domain::Rectangle {
                corner,
                edges,
                direction,
                irradiance,
            } => {
                let [along, across] = *edges;
                let origin = corner + sample.point.x * along + sample.point.y * across;
                let area = along.length() * across.length();
                Some(Emission {
                    ray: Ray::new(origin, *direction),
                    flux: *irradiance * (area * share),
                    differential: differential(
                        &sample.spacing.map(|edge| edge.x * along + edge.y * across),
                        &[],
                    ),
                })
            }
            Domain::Area(area) => area.emit(sample),
            Domain::Nothing => None,
        }
    }

    /// The rays that it sends out, for those who make the photons elsewhere.
    #[must_use]
    pub fn domain(&self) -> EmitterDomain<'a> {
        match &self.domain {
            Domain::Sphere { light, origin } => EmitterDomain::Sphere {
                light,
                origin: *origin,
            },
            Domain::Cone {
                light,
                origin,
                frame,
                cone,
            } => EmitterDomain::Cone {
                light,
                origin: *origin,
                frame: *frame,
                cone: *cone,
            },
            Domain::Rectangle {
                corner,
                edges,
                direction,
                irradiance,
            } => EmitterDomain::Rectangle {
                corner: *corner,
                edges: *edges,
                direction: *direction,
                irradiance: *irradiance,
            },
            Domain::Area(area) => area.domain(),
            Domain::Nothing => EmitterDomain::Nothing,
        }
    }

    fn of_light(world: &World, light: &'a Light, target: &Target) -> Self {
        match *light {
            Light::Directional {
                direction,
                irradiance,
            } => Self::of_sun(world, direction, irradiance, target),
            _ => Self::of_lamp(light, target),
        }
    }

    fn of_sun(world: &World, direction: Vec3, irradiance: Vec3, target: &Target) -> Self {
        if world.bounds().is_empty() {
            return Self::nothing(DVec3::ZERO);
        }
        let (center, radius) = world.bounds().bounding_sphere();
        // The rectangle stands outside the scene, so that what stands before the casters shades
        // them.
        let distance = center.dot(direction) - 1.001 * radius;
        let at_distance = |point: Vec3| point + (distance - point.dot(direction)) * direction;
        let (tangent, bitangent) = direction.any_orthonormal_pair();
        let whole = (
            at_distance(center - radius * (tangent + bitangent)),
            [2.0 * radius * tangent, 2.0 * radius * bitangent],
        );
        let flux = |edges: &[Vec3; 2]| {
            irradiance.as_dvec3() * f64::from(edges[0].length()) * f64::from(edges[1].length())
        };
        let power = flux(&whole.1);
        let (corner, edges) = match target {
            Target::Everything => whole,
            Target::Nothing => return Self::nothing(power),
            Target::Casters(casters) => {
                let (corner, edges) = casters.rectangle_across(direction);
                (at_distance(corner), edges)
            }
        };
        let aimed_power = flux(&edges);
        Self {
            domain: Domain::Rectangle {
                corner,
                edges,
                direction,
                irradiance,
            },
            power: power.max(aimed_power),
            aimed_power,
        }
    }

    fn of_lamp(light: &'a Light, target: &Target) -> Self {
        let power = light.flux().unwrap_or(Vec3::ZERO).as_dvec3();
        // A spot light's own cone; its constructor keeps the cosine in 0..1.
        let (origin, own) = match *light {
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
            _ => return Self::nothing(power),
        };
        let around = match target {
            Target::Everything => None,
            Target::Nothing => return Self::nothing(power),
            Target::Casters(casters) => casters.cone_from(origin),
        };
        let narrower = match (own, around) {
            (Some((axis, own)), Some((towards, around))) => {
                let separation = towards.angle_between(axis);
                if separation > own.cosine().acos() + around.cosine().acos() {
                    return Self::nothing(power);
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
        let domain = match narrower {
            Some((axis, cone)) => Domain::Cone {
                light,
                origin,
                frame: Frame::from_normal(axis),
                cone,
            },
            None => Domain::Sphere { light, origin },
        };
        Self {
            domain,
            power,
            aimed_power: DVec3::ZERO,
        }
        .measured()
    }

    fn of_area(world: &'a World, light: &'a AreaLight, front: bool, target: &Target) -> Self {
        let sides = if light.double_sided() { 0.5 } else { 1.0 };
        let power = sides * light.power().as_dvec3();
        let aimed_at = match target {
            Target::Everything => None,
            Target::Nothing => return Self::nothing(power),
            Target::Casters(casters) => Some(*casters.bounding()),
        };
        let domain = Domain::Area(AreaDomain::new(world, light, front, aimed_at));
        Self {
            domain,
            power,
            aimed_power: DVec3::ZERO,
        }
        .measured()
    }

    fn nothing(power: DVec3) -> Self {
        Self {
            domain: Domain::Nothing,
            power,
            aimed_power: DVec3::ZERO,
        }
    }

    /// Measures the flux into the domain by a fixed set of photons: good enough to share the
    /// photons by, and no light's brightness depends on it.
    fn measured(mut self) -> Self {
        const COUNT: u32 = 256;
        let points = PointSet::new(caustics_sampling::Sequence::Halton, COUNT, 0);
        self.aimed_power = (0..COUNT)
            .filter_map(|index| self.emit::<2>(&EmissionSample::of(&points, index)))
            .map(|emission| emission.flux.as_dvec3())
            .sum();
        self
    }
}

/// What all lights are aimed at.
enum Target {
    Everything,
    Casters(Casters),
    Nothing,
}

/// A photon from a point, in a direction that stands for `solid_angle`.
fn from_point<const N: usize>(
    light: &Light,
    origin: Vec3,
    warped: &WarpSample<Vec3>,
    solid_angle: f32,
    sample: &EmissionSample,
) -> Option<Emission<N>> {
    let direction = warped.value.normalize();
    let flux = light.intensity_towards(direction) * solid_angle;
    (flux != Vec3::ZERO).then(|| Emission {
        ray: Ray::new(origin, direction),
        flux,
        differential: differential(
            &[],
            &sample
                .spacing
                .map(|edge| edge.x * warped.d_du + edge.y * warped.d_dv),
        ),
    })
}

/// The differential of a ray that depends on its direction's parameters first and then on its
/// position's, as far as it has them.
pub(crate) fn differential<const N: usize>(
    positions: &[Vec3],
    directions: &[Vec3],
) -> RayDifferential<N> {
    let mut result = RayDifferential::ZERO;
    for (slot, &change) in result.direction.iter_mut().zip(directions) {
        *slot = change;
    }
    for (slot, &moved) in result
        .position
        .iter_mut()
        .skip(directions.len())
        .zip(positions)
    {
        *slot = moved;
    }
    result
}
