use caustics_geometry::{Frame, Ray, Sphere};
use caustics_sampling::warp::{
    Cone, WarpSample, sphere_octahedral_to_square, square_to_sphere_octahedral,
};
use caustics_scene::{Light, World};
use glam::{Vec2, Vec3};

use crate::area_emission::{self, AreaSurface};
use crate::emission::{Emission, EmissionSample, differential};
use crate::sky_emission;

/// The rays that an emitter sends out, as an image of the unit square or, for lights with an area,
/// of the unit cube of four dimensions.
///
/// All maps preserve area: photons at equally spaced points have an equal share of the domain. It
/// is plain data, a kind and a few vectors, so that a host can hand it to a shader.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EmissionDomain {
    /// All directions from a point, by [`square_to_sphere_octahedral`].
    Sphere {
        /// The point or spot light, whose intensity depends on the direction.
        light: Light,
        /// Where it is, in metres.
        origin: Vec3,
    },
    /// Directions from a point around an axis, by [`Cone::sample_concentric`].
    Cone {
        /// The point or spot light, whose intensity depends on the direction.
        light: Light,
        /// Where it is, in metres.
        origin: Vec3,
        /// The cone's frame; its axis is the normal.
        frame: Frame,
        /// How wide it is.
        cone: Cone,
    },
    /// Parallel rays from a rectangle across them.
    Rectangle {
        /// Where it begins, in metres.
        corner: Vec3,
        /// Its perpendicular edges, in metres.
        edges: [Vec3; 2],
        /// The unit direction of all rays.
        direction: Vec3,
        /// Irradiance on the rectangle, in W/m².
        irradiance: Vec3,
    },
    /// Rays from a surface.
    Area {
        /// The surface; places on it are even over its area.
        surface: AreaSurface,
        /// Directions from a place fill the cone around this sphere evenly, by
        /// [`Cone::sample_concentric`] in a [`Frame::from_normal`] of its axis. Without a sphere,
        /// or from inside it, they fill the hemisphere in proportion to the cosine.
        target: Option<Sphere>,
    },
    /// Rays from the world's environment: directions by
    /// [`Environment::sample`](caustics_scene::Environment::sample), of whose tables a shader can make
    /// the same, places on the disc across them
    /// by [`square_to_disc_concentric`](caustics_sampling::warp::square_to_disc_concentric) in a
    /// [`Frame::from_normal`] of the direction towards the light.
    Sky {
        /// The ball that the discs just cover.
        target: Sphere,
        /// How far before the ball's centre rays start, in metres.
        distance: f32,
    },
    /// No rays: the light cannot reach what it is aimed at.
    Nothing,
}

impl EmissionDomain {
    /// On how many parameters a ray depends: 2 or 4.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        match self {
            Self::Area { .. } | Self::Sky { .. } => 4,
            _ => 2,
        }
    }

    /// A point where rays start, to find the media around it: `None` for a light that is infinitely
    /// far away.
    #[must_use]
    pub fn start(&self, world: &World) -> Option<Vec3> {
        match self {
            Self::Sphere { origin, .. } | Self::Cone { origin, .. } => Some(*origin),
            Self::Area { surface, .. } => surface.start(world),
            Self::Rectangle { .. } | Self::Sky { .. } | Self::Nothing => None,
        }
    }

    /// The photon of a sample; `None` where the sample stands for no light.
    #[must_use]
    pub fn emit<const N: usize>(
        &self,
        world: &World,
        sample: &EmissionSample,
    ) -> Option<Emission<N>> {
        let share = sample.share();
        match self {
            Self::Sphere { light, origin } => {
                let warped = square_to_sphere_octahedral(sample.point);
                let solid_angle = 4.0 * std::f32::consts::PI;
                from_point(light, *origin, &warped, solid_angle * share, sample)
            }
            Self::Cone {
                light,
                origin,
                frame,
                cone,
            } => {
                let warped = to_world(frame, &cone.sample_concentric(sample.point));
                from_point(light, *origin, &warped, cone.solid_angle() * share, sample)
            }
            Self::Rectangle {
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
            Self::Area { surface, target } => {
                area_emission::emit(world, surface, target.as_ref(), sample)
            }
            Self::Sky { target, distance } => {
                sky_emission::emit(world.environment()?, target, *distance, sample)
            }
            Self::Nothing => None,
        }
    }

    /// Whether a ray of the same light is one of the domain's, within rounding.
    pub(crate) fn covers(&self, ray: &Ray) -> bool {
        match self {
            Self::Sphere { .. } => true,
            Self::Cone { frame, cone, .. } => cone.contains(frame.to_local(ray.direction)),
            Self::Rectangle { .. } => self
                .point_of(ray)
                .is_some_and(|at| at.cmpge(Vec2::ZERO).all() && at.cmple(Vec2::ONE).all()),
            Self::Area { surface, target } => {
                surface.covers(ray.origin)
                    && match target
                        .as_ref()
                        .and_then(|sphere| area_emission::cone_to(sphere, ray.origin))
                    {
                        Some((axis, cone)) => {
                            cone.contains(Frame::from_normal(axis).to_local(ray.direction))
                        }
                        None => true,
                    }
            }
            Self::Sky { target, .. } => {
                let across = (target.center - ray.origin).cross(ray.direction);
                across.length() <= target.radius
            }
            Self::Nothing => false,
        }
    }

    /// The point of the unit square that a ray of a light without area comes from; outside the
    /// square for a ray beside a rectangle.
    pub(crate) fn point_of(&self, ray: &Ray) -> Option<Vec2> {
        match self {
            Self::Sphere { .. } => Some(sphere_octahedral_to_square(ray.direction)),
            Self::Cone { frame, cone, .. } => {
                Some(cone.invert_concentric(frame.to_local(ray.direction)))
            }
            Self::Rectangle { corner, edges, .. } => {
                let from_corner = ray.origin - corner;
                let along = |edge: Vec3| from_corner.dot(edge) / edge.length_squared();
                Some(Vec2::new(along(edges[0]), along(edges[1])))
            }
            Self::Area { .. } | Self::Sky { .. } | Self::Nothing => None,
        }
    }
}

/// A sample of directions in a frame, turned to the world's axes.
pub(crate) fn to_world(frame: &Frame, local: &WarpSample<Vec3>) -> WarpSample<Vec3> {
    WarpSample {
        value: frame.to_world(local.value),
        pdf: local.pdf,
        d_du: frame.to_world(local.d_du),
        d_dv: frame.to_world(local.d_dv),
    }
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
