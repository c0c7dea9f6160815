//! Paths over planes, spheres and triangles with interpolated normals: once in f64 and written
//! without differentials, once with the crate's.

use caustics_geometry::{
    NormalGradient, Plane, PrecomputedTriangle, Ray, SpawnPoint, Sphere, Triangle,
};
use caustics_sampling::CounterRng;
use caustics_trace::glam::{DMat3, DVec3, Vec3};
use caustics_trace::{RayDifferential, reflect, refract};

use super::central::{PointAndDirection, derivative};
use super::{MARGIN, reflect_exactly, refract_exactly};

/// A surface that a path meets. Its numbers are f32, so that both ways of following the path see
/// the same surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Plane(Plane),
    Sphere {
        sphere: Sphere,
        /// Whether the path comes from within.
        inside: bool,
    },
    Triangle {
        triangle: Triangle,
        /// Unit normals of the vertices.
        normals: [Vec3; 3],
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Change {
    Reflect,
    /// With the index left over the index entered.
    Refract(f32),
    /// The end of the path.
    Land,
}

#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    pub(crate) differential: RayDifferential<2>,
    pub(crate) events: Vec<(Shape, Change)>,
    /// A length that is typical of it, in metres.
    pub(crate) scale: f64,
}

/// A change of the start and the direction of every ray, of every normal, and of the displacement
/// between neighbours by a few roundings of f32, the same at every evaluation of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jitter {
    pub(crate) seed: u64,
    pub(crate) relative: f64,
}

impl Jitter {
    pub(crate) const NONE: Self = Self {
        seed: 0,
        relative: 0.0,
    };

    fn vector(&self, rng: &mut CounterRng) -> DVec3 {
        let mut coordinate = || f64::from(rng.next_f32()) * 2.0 - 1.0;
        let vector = DVec3::new(coordinate(), coordinate(), coordinate());
        self.relative * vector.normalize_or_zero()
    }

    fn matrix(&self, rng: &mut CounterRng) -> DMat3 {
        DMat3::from_cols(self.vector(rng), self.vector(rng), self.vector(rng))
    }
}

/// Where a straight line meets a shape, in f64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactHit {
    pub(crate) position: DVec3,
    /// Unit, facing the light.
    pub(crate) geometric: DVec3,
    /// Unit, facing the light.
    pub(crate) shading: DVec3,
}

impl Shape {
    /// The largest coordinate that an intersection calculates with, in metres.
    fn extent(&self) -> f64 {
        let points = match self {
            Self::Plane(plane) => [plane.point; 3],
            Self::Sphere { sphere, .. } => [
                sphere.center - sphere.radius,
                sphere.center,
                sphere.center + sphere.radius,
            ],
            Self::Triangle { triangle, .. } => [triangle.a, triangle.b, triangle.c],
        };
        f64::from(
            points
                .map(|point| point.abs().max_element())
                .into_iter()
                .fold(0.0, f32::max),
        )
    }

    pub(crate) fn hit(&self, origin: DVec3, direction: DVec3) -> Option<ExactHit> {
        let (position, geometric, shading) = match self {
            Self::Plane(plane) => {
                let normal = plane.normal.as_dvec3().normalize();
                let t = (plane.point.as_dvec3() - origin).dot(normal) / direction.dot(normal);
                (origin + t * direction, normal, normal)
            }
            Self::Sphere { sphere, inside } => {
                let center = sphere.center.as_dvec3();
                let radius = f64::from(sphere.radius);
                let along = (center - origin).dot(direction);
                let nearest = origin + along * direction - center;
                let half_squared = radius * radius - nearest.length_squared();
                if half_squared <= 0.0 {
                    return None;
                }
                let half = half_squared.sqrt();
                let t = if *inside { along + half } else { along - half };
                let position = origin + t * direction;
                let normal = (position - center).normalize();
                (position, normal, normal)
            }
            Self::Triangle { triangle, normals } => {
                let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
                let cross = (b - a).cross(c - a);
                let t = (a - origin).dot(cross) / direction.dot(cross);
                let position = origin + t * direction;
                let u = (position - a).cross(c - a).dot(cross) / cross.length_squared();
                let v = (b - a).cross(position - a).dot(cross) / cross.length_squared();
                let [na, nb, nc] = normals.map(Vec3::as_dvec3);
                let shading = ((1.0 - u - v) * na + u * nb + v * nc).normalize();
                (position, cross.normalize(), shading)
            }
        };
        let facing = |normal: DVec3| {
            if normal.dot(direction) < 0.0 {
                normal
            } else {
                -normal
            }
        };
        Some(ExactHit {
            position,
            geometric: facing(geometric),
            shading: facing(shading),
        })
    }
}

/// The direction in which light goes on in f64, or `None` where it is reflected instead.
pub(crate) fn changed(change: Change, direction: DVec3, normal: DVec3) -> Option<DVec3> {
    match change {
        Change::Reflect => Some(reflect_exactly(direction, normal)),
        Change::Refract(eta) => refract_exactly(direction, normal, f64::from(eta)),
        Change::Land => Some(direction),
    }
}

/// Whether derivatives at this event are held to the tolerance: it is far enough from a silhouette
/// and from the critical angle, on whichever side.
pub(crate) fn is_regular(change: Change, direction: DVec3, hit: &ExactHit) -> bool {
    let steepest = std::f64::consts::FRAC_PI_2 - MARGIN;
    let angle = |normal: DVec3| (-direction.dot(normal)).clamp(0.0, 1.0).acos();
    if angle(hit.geometric) > steepest || angle(hit.shading) > steepest {
        return false;
    }
    match change {
        Change::Refract(eta) if eta > 1.0 => {
            angle(hit.shading) < (1.0 / f64::from(eta)).asin() - MARGIN
        }
        _ => true,
    }
}

impl Chain {
    /// The end of the path, in f64, of the neighbour `step` away in `parameter`.
    fn follow(&self, parameter: usize, step: f64, jitter: Jitter) -> Option<PointAndDirection> {
        let mut rng = CounterRng::new(jitter.seed, 0);
        let start = |value: Vec3, change: Vec3| value.as_dvec3() + step * change.as_dvec3();
        let mut center = PointAndDirection {
            position: self.origin.as_dvec3(),
            direction: self.direction.as_dvec3().normalize(),
        };
        let mut path = PointAndDirection {
            position: start(self.origin, self.differential.position[parameter]),
            direction: start(self.direction, self.differential.direction[parameter]).normalize(),
        };
        for (shape, change) in &self.events {
            // To move the start moves the hit, along the ray as far as its slope demands.
            let size = center.position.abs().max_element().max(shape.extent());
            let moved = size * jitter.vector(&mut rng);
            let turned = jitter.vector(&mut rng);
            let bent = jitter.vector(&mut rng);
            let onwards = |path: PointAndDirection| {
                let direction = (path.direction + turned).normalize();
                let hit = shape.hit(path.position + moved, direction)?;
                let normal = (hit.shading + bent).normalize();
                let direction = changed(*change, direction, normal)?;
                Some(PointAndDirection {
                    position: hit.position,
                    direction,
                })
            };
            (center, path) = (onwards(center)?, onwards(path)?);
            // What lies between neighbours is rounded, too.
            let between = path.position - center.position;
            path.position += jitter.matrix(&mut rng) * between;
            let between = path.direction - center.direction;
            path.direction = (path.direction + jitter.matrix(&mut rng) * between).normalize();
        }
        Some(path)
    }

    /// The derivatives of the path's end in each of the two parameters, in f64.
    pub(crate) fn exact(&self, jitter: Jitter) -> Option<[PointAndDirection; 2]> {
        let in_parameter = |parameter: usize| {
            let moved = self.differential.position[parameter].as_dvec3().length() / self.scale;
            let turned = self.differential.direction[parameter].as_dvec3().length();
            let widest = 1e-3 / (moved + turned);
            derivative(widest, |step| self.follow(parameter, step, jitter))
        };
        Some([in_parameter(0)?, in_parameter(1)?])
    }
}

/// The operations that carry a differential along, as a chain needs them: the crate's, or wrong
/// ones, which a comparison has to reject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Operations {
    Crate,
    /// Refraction without the derivative of mu.
    WithoutMuSlope,
    /// Normals that do not turn.
    WithoutNormalChange,
    /// Every neighbour travels equally far.
    WithoutDistanceChange,
}

/// What the crate's surfaces say where a ray hits a shape.
struct Met {
    t: f32,
    spawn: SpawnPoint,
    geometric: Vec3,
    gradient: NormalGradient,
}

fn meet(shape: &Shape, ray: &Ray) -> Option<Met> {
    match shape {
        Shape::Plane(plane) => {
            let t = plane.intersect(ray)?;
            let gradient = NormalGradient::flat(plane.normal);
            Some(Met {
                t,
                spawn: SpawnPoint::free(ray.at(t)),
                geometric: plane.normal,
                gradient,
            })
        }
        Shape::Sphere { sphere, .. } => {
            let t = sphere.intersect(ray)?;
            let spawn = SpawnPoint::on_sphere(sphere, ray.at(t));
            let gradient = NormalGradient::on_sphere(sphere, spawn.position);
            Some(Met {
                t,
                spawn,
                geometric: gradient.normal,
                gradient,
            })
        }
        Shape::Triangle { triangle, normals } => {
            let hit = PrecomputedTriangle::new(triangle).intersect(ray)?;
            let Triangle { a, b, c } = *triangle;
            let spawn = SpawnPoint::on_triangle(a, b, c, hit.u, hit.v);
            let gradient = NormalGradient::on_triangle(triangle, *normals, hit.u, hit.v)?;
            Some(Met {
                t: hit.t,
                spawn,
                geometric: triangle.unit_normal()?,
                gradient,
            })
        }
    }
}

impl Chain {
    /// The differential at the path's end, by the crate.
    pub(crate) fn differentiated(&self, operations: Operations) -> Option<RayDifferential<2>> {
        let mut ray = Ray::new(self.origin, self.direction);
        let mut differential = self.differential;
        for (shape, change) in &self.events {
            let direction = ray.direction;
            let met = meet(shape, &ray)?;
            differential = if operations == Operations::WithoutDistanceChange {
                let moved = |i: usize| differential.position[i] + met.t * differential.direction[i];
                RayDifferential {
                    position: [moved(0), moved(1)],
                    ..differential
                }
            } else {
                differential.transferred(direction, met.t, met.geometric)
            };
            let gradient = if met.gradient.normal.dot(direction) < 0.0 {
                met.gradient
            } else {
                met.gradient.reversed()
            };
            let normal = gradient.normal;
            let normal_change = if operations == Operations::WithoutNormalChange {
                [Vec3::ZERO; 2]
            } else {
                differential.position.map(|moved| gradient.along(moved))
            };
            let onwards = match *change {
                Change::Land => return Some(differential),
                Change::Reflect => {
                    differential = differential.reflected(direction, normal, normal_change);
                    reflect(direction, normal).normalize()
                }
                Change::Refract(eta) => {
                    let refracted = refract(direction, normal, eta)?;
                    differential = if operations == Operations::WithoutMuSlope {
                        let mu = eta * direction.dot(normal) - refracted.dot(normal);
                        let turned =
                            |i: usize| eta * differential.direction[i] - mu * normal_change[i];
                        RayDifferential {
                            direction: [turned(0), turned(1)],
                            ..differential
                        }
                    } else {
                        differential.refracted(direction, refracted, normal, eta, normal_change)
                    };
                    refracted
                }
            };
            ray = Ray::new(met.spawn.origin_towards(met.geometric, onwards), onwards);
        }
        None
    }
}
