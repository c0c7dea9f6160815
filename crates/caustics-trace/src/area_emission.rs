use std::f32::consts::PI;

use caustics_geometry::{Frame, Ray, SpawnPoint, Sphere};
use caustics_sampling::warp::{
    Cone, WarpSample, square_to_cosine_hemisphere, square_to_disc_concentric, square_to_triangle,
};
use caustics_scene::{Light, World};
use glam::{Vec2, Vec3};

use crate::differential::BLUR_EDGE;
use crate::domain::to_world;
use crate::emission::{Emission, EmissionSample, differential};

/// A surface that emits the same radiance everywhere and in all directions of one side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum AreaSurface {
    /// A parallelogram, mapped linearly.
    Rectangle {
        /// One corner, in metres.
        corner: Vec3,
        /// The edges from there, in metres.
        edges: [Vec3; 2],
        /// The unit normal of the side that shines.
        normal: Vec3,
        /// Radiance, in W/(sr m²).
        radiance: Vec3,
    },
    /// A triangle, by [`square_to_triangle`].
    Triangle {
        /// Its corners, in metres.
        corners: [Vec3; 3],
        /// The unit normal of the side that shines.
        normal: Vec3,
        /// Radiance, in W/(sr m²).
        radiance: Vec3,
    },
    /// A disc, by [`square_to_disc_concentric`].
    Disc {
        /// Where it is, in metres.
        center: Vec3,
        /// Its axes; the normal is that of the side that shines.
        frame: Frame,
        /// In metres.
        radius: f32,
        /// Radiance, in W/(sr m²).
        radiance: Vec3,
    },
    /// The part of a ball that faces what it is aimed at, by [`Cone::sample_concentric`].
    Cap {
        /// Where the ball is, in metres.
        center: Vec3,
        /// In metres.
        radius: f32,
        /// Axes at the ball's centre; the normal goes to the middle of the cap.
        frame: Frame,
        /// The directions from the centre to the cap.
        cone: Cone,
        /// Radiance, in W/(sr m²).
        radiance: Vec3,
    },
    /// One side of an emissive object, by
    /// [`AreaLight::choose`](caustics_scene::AreaLight::choose) and
    /// [`World::point_on`].
    Object {
        /// Index into [`World::emitters`].
        emitter: u32,
        /// Whether it is the side that the geometric normals point to.
        front: bool,
    },
}

/// A place on a surface.
struct Place {
    spawn: SpawnPoint,
    /// The unit normal of the side that shines.
    normal: Vec3,
    /// How it moves with the sample, where that is known.
    derivatives: Option<[Vec3; 2]>,
}

impl AreaSurface {
    /// The surface of a light, or of the part of it that faces `target`; `None` where the light has
    /// no area or turns its back on the target.
    pub(crate) fn of(light: &Light, target: Option<&Sphere>) -> Option<Self> {
        // Whether something of the target is before a plane.
        let faces = |point: Vec3, normal: Vec3| {
            target.is_none_or(|sphere| (sphere.center - point).dot(normal) > -sphere.radius)
        };
        match *light {
            Light::Rectangle {
                corner,
                edges,
                radiance,
            } => {
                let normal = edges[0].cross(edges[1]).try_normalize()?;
                faces(corner, normal).then_some(Self::Rectangle {
                    corner,
                    edges,
                    normal,
                    radiance,
                })
            }
            Light::Triangle { corners, radiance } => {
                let [a, b, c] = corners;
                let normal = (b - a).cross(c - a).try_normalize()?;
                faces(a, normal).then_some(Self::Triangle {
                    corners,
                    normal,
                    radiance,
                })
            }
            Light::Disc {
                center,
                normal,
                radius,
                radiance,
            } => faces(center, normal).then_some(Self::Disc {
                center,
                frame: Frame::from_normal(normal),
                radius,
                radiance,
            }),
            Light::Sphere {
                center,
                radius,
                radiance,
            } => {
                // From a place on the ball, something of the target is above the horizon only if
                // the cosine of its normal to the target's centre exceeds this.
                let towards = target.and_then(|sphere| {
                    let to_target = sphere.center - center;
                    let distance = to_target.length();
                    let cosine = (radius - sphere.radius) / distance;
                    (cosine < 1.0).then(|| (to_target / distance, cosine.max(-1.0)))
                });
                if target.is_some() && towards.is_none() {
                    return None;
                }
                let (axis, cosine) = towards.unwrap_or((Vec3::Y, -1.0));
                Some(Self::Cap {
                    center,
                    radius,
                    frame: Frame::from_normal(axis),
                    cone: Cone::from_cosine(cosine).unwrap_or(Cone::SPHERE),
                    radiance,
                })
            }
            _ => None,
        }
    }

    /// Its area in square metres.
    #[must_use]
    pub fn area(&self, world: &World) -> f32 {
        match self {
            Self::Rectangle { edges, .. } => edges[0].cross(edges[1]).length(),
            Self::Triangle {
                corners: [a, b, c], ..
            } => 0.5 * (b - a).cross(c - a).length(),
            Self::Disc { radius, .. } => PI * radius * radius,
            Self::Cap { radius, cone, .. } => cone.solid_angle() * radius * radius,
            Self::Object { emitter, .. } => world
                .emitters()
                .get(*emitter as usize)
                .map_or(0.0, caustics_scene::AreaLight::area),
        }
    }

    /// The radiance that it emits, in W/(sr m²).
    #[must_use]
    pub fn radiance(&self, world: &World) -> Vec3 {
        match self {
            Self::Rectangle { radiance, .. }
            | Self::Triangle { radiance, .. }
            | Self::Disc { radiance, .. }
            | Self::Cap { radiance, .. } => *radiance,
            Self::Object { emitter, .. } => world
                .emitters()
                .get(*emitter as usize)
                .map_or(Vec3::ZERO, caustics_scene::AreaLight::radiance),
        }
    }

    /// A point on it or just above it.
    pub(crate) fn start(&self, world: &World) -> Option<Vec3> {
        let place = match self {
            Self::Object { emitter, .. } => {
                let first = world.emitters().get(*emitter as usize)?.primitives().start;
                self.on_primitive(world, first, Vec2::splat(0.25))?
            }
            _ => self.place(world, Vec2::splat(0.5))?,
        };
        Some(place.spawn.origin_towards(place.normal, place.normal))
    }

    /// Whether a ray of the same light from this place is one of the surface's own; a cap is a part
    /// of its ball.
    pub(crate) fn covers(&self, position: Vec3) -> bool {
        match self {
            Self::Cap {
                center,
                frame,
                cone,
                ..
            } => (position - center)
                .try_normalize()
                .is_some_and(|direction| cone.contains(frame.to_local(direction))),
            _ => true,
        }
    }

    fn place(&self, world: &World, sample: Vec2) -> Option<Place> {
        match self {
            Self::Rectangle {
                corner,
                edges,
                normal,
                ..
            } => Some(Place {
                spawn: SpawnPoint::free(corner + sample.x * edges[0] + sample.y * edges[1]),
                normal: *normal,
                derivatives: Some(*edges),
            }),
            Self::Triangle {
                corners, normal, ..
            } => {
                let warped = square_to_triangle(sample, *corners);
                Some(Place {
                    spawn: SpawnPoint::free(warped.value),
                    normal: *normal,
                    derivatives: Some([warped.d_du, warped.d_dv]),
                })
            }
            Self::Disc {
                center,
                frame,
                radius,
                ..
            } => {
                let local = square_to_disc_concentric(sample);
                let across = |it: Vec2| frame.to_world((radius * it).extend(0.0));
                Some(Place {
                    spawn: SpawnPoint::free(center + across(local.value)),
                    normal: frame.normal,
                    derivatives: Some([across(local.d_du), across(local.d_dv)]),
                })
            }
            Self::Cap {
                center,
                radius,
                frame,
                cone,
                ..
            } => {
                let warped = to_world(frame, &cone.sample_concentric(sample));
                Some(Place {
                    spawn: SpawnPoint::free(center + radius * warped.value),
                    normal: warped.value.normalize(),
                    derivatives: Some([radius * warped.d_du, radius * warped.d_dv]),
                })
            }
            Self::Object { emitter, .. } => {
                let light = world.emitters().get(*emitter as usize)?;
                let (primitive, along) = light.choose(sample.x);
                self.on_primitive(world, primitive, Vec2::new(along, sample.y))
            }
        }
    }

    fn on_primitive(&self, world: &World, primitive: u32, sample: Vec2) -> Option<Place> {
        let point = world.point_on(primitive, sample)?;
        let front = matches!(self, Self::Object { front: true, .. });
        Some(Place {
            spawn: point.spawn,
            normal: if front {
                point.geometric_normal
            } else {
                -point.geometric_normal
            },
            derivatives: None,
        })
    }
}

/// A photon from a place that is even over the surface, into a direction that is even over the cone
/// to the target.
///
/// The four parameters of its differential are those of the direction, from a place held still, and
/// those of the place, with the direction held still: neighbours among all rays, whatever cone each
/// place has. Directions are the lattice's steps; places are what blurs, by [`BLUR_EDGE`].
pub(crate) fn emit<const N: usize>(
    world: &World,
    surface: &AreaSurface,
    target: Option<&Sphere>,
    sample: &EmissionSample,
) -> Option<Emission<N>> {
    let place = surface.place(world, sample.place)?;
    let (warped, solid_angle) =
        direction(target, place.spawn.position, place.normal, sample.point)?;
    let direction = warped.value.normalize();
    let cosine = direction.dot(place.normal);
    if cosine <= 0.0 {
        return None;
    }
    let area = surface.area(world);
    let share = sample.share();
    let step = share.sqrt();
    let (positions, directions) = match place.derivatives {
        Some(moved) => {
            let turned = [warped.d_du, warped.d_dv];
            (moved.map(|it| BLUR_EDGE * it), turned.map(|it| step * it))
        }
        // The places of an object jump from triangle to triangle: as wide a square instead.
        None => {
            let (tangent, bitangent) = direction.any_orthonormal_pair();
            let frame = Frame::from_normal(place.normal);
            let length = BLUR_EDGE * area.sqrt();
            let angle = step * solid_angle.sqrt();
            (
                [length * frame.tangent, length * frame.bitangent],
                [angle * tangent, angle * bitangent],
            )
        }
    };
    Some(Emission {
        ray: Ray::new(
            place.spawn.origin_towards(place.normal, direction),
            direction,
        ),
        flux: surface.radiance(world) * (cosine * solid_angle * area * share),
        differential: differential(&positions, &directions),
    })
}

/// A direction and the reciprocal of its density, in steradians.
fn direction(
    target: Option<&Sphere>,
    origin: Vec3,
    normal: Vec3,
    sample: Vec2,
) -> Option<(WarpSample<Vec3>, f32)> {
    if let Some((axis, cone)) = target.and_then(|sphere| cone_to(sphere, origin)) {
        let warped = to_world(&Frame::from_normal(axis), &cone.sample_concentric(sample));
        return Some((warped, cone.solid_angle()));
    }
    let local = square_to_cosine_hemisphere(sample);
    let solid_angle = PI / local.value.z;
    let warped = to_world(&Frame::from_normal(normal), &local);
    solid_angle.is_finite().then_some((warped, solid_angle))
}

/// The cone of directions from a point that just holds a sphere, and its axis; `None` from inside.
pub(crate) fn cone_to(sphere: &Sphere, origin: Vec3) -> Option<(Vec3, Cone)> {
    let to_sphere = sphere.center - origin;
    let distance = to_sphere.length();
    if distance <= sphere.radius {
        return None;
    }
    Cone::from_sine(sphere.radius / distance)
        .ok()
        .map(|cone| (to_sphere / distance, cone))
}
