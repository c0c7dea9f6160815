use std::f32::consts::FRAC_1_PI;

use caustics_accel::Intersect;
use caustics_geometry::{Frame, Ray};
use caustics_sampling::CounterRng;
use caustics_sampling::warp::Cone;
use caustics_scene::{AreaLight, Light, World};
use glam::{Vec2, Vec3};

use crate::eye::Receiver;

/// How far short of a light a shadow ray stops, relative to its length, so that it does not meet
/// the light's own surface.
const SHADOW_STOP: f32 = 1e-4;

/// Light that comes straight from the lights to a receiver.
///
/// Everything in the way casts a full shadow, glass as well: what comes through it is the
/// caustic's.
#[derive(Clone, Copy)]
pub struct DirectLight<'a, I: ?Sized> {
    world: &'a World,
    intersect: &'a I,
}

impl<'a, I: Intersect + ?Sized> DirectLight<'a, I> {
    /// The direct light of a world.
    #[must_use]
    pub fn new(world: &'a World, intersect: &'a I) -> Self {
        Self { world, intersect }
    }

    /// Radiance that a Lambertian receiver reflects towards the eye, in W/(sr m²): exact for
    /// point, spot and directional lights, from one random point on each light with an area.
    pub fn radiance(&self, receiver: &Receiver, rng: &mut CounterRng) -> Vec3 {
        let mut irradiance = Vec3::ZERO;
        for light in self.world.lights() {
            irradiance += match *light {
                Light::Sphere {
                    center,
                    radius,
                    radiance,
                } => self.arriving_from_ball(receiver, center, radius, radiance, rng),
                _ if light.area().is_some() => self.arriving_from_surface(receiver, light, rng),
                _ => self.arriving_from(receiver, light),
            };
        }
        for light in self.world.emitters() {
            irradiance += self.arriving_from_area(receiver, light, rng);
        }
        receiver.albedo * FRAC_1_PI * irradiance
    }

    fn arriving_from(&self, receiver: &Receiver, light: &Light) -> Vec3 {
        let position = receiver.point.spawn.position;
        let (direction, distance, facing) = match *light {
            Light::Point { position: lamp, .. } | Light::Spot { position: lamp, .. } => {
                let to_light = lamp - position;
                let distance = to_light.length();
                if distance <= 0.0 {
                    return Vec3::ZERO;
                }
                let direction = to_light / distance;
                (
                    direction,
                    distance,
                    light.intensity_towards(-direction) / (distance * distance),
                )
            }
            Light::Directional {
                direction,
                irradiance,
            } => (-direction, f32::INFINITY, irradiance),
            _ => return Vec3::ZERO,
        };
        let cosine = self.cosine(receiver, direction);
        if cosine <= 0.0 || facing == Vec3::ZERO || self.is_blocked(receiver, direction, distance) {
            return Vec3::ZERO;
        }
        cosine * facing
    }

    /// From one random point of a rectangle or a disc.
    fn arriving_from_surface(
        &self,
        receiver: &Receiver,
        light: &Light,
        rng: &mut CounterRng,
    ) -> Vec3 {
        let (Some(on_light), Some(area)) = (light.point_on(rng.next_vec2()), light.area()) else {
            return Vec3::ZERO;
        };
        let to_light = on_light.position - receiver.point.spawn.position;
        let distance = to_light.length();
        if distance <= 0.0 {
            return Vec3::ZERO;
        }
        let direction = to_light / distance;
        let leaving = -direction.dot(on_light.normal);
        let cosine = self.cosine(receiver, direction);
        if leaving <= 0.0 || cosine <= 0.0 || self.is_blocked(receiver, direction, distance) {
            return Vec3::ZERO;
        }
        light.radiance() * (area * leaving * cosine / (distance * distance))
    }

    /// From one random direction into the cone that a ball fills; it shines outwards only.
    fn arriving_from_ball(
        &self,
        receiver: &Receiver,
        center: Vec3,
        radius: f32,
        radiance: Vec3,
        rng: &mut CounterRng,
    ) -> Vec3 {
        let sample = rng.next_vec2();
        let to_center = center - receiver.point.spawn.position;
        let distance = to_center.length();
        if distance <= radius {
            return Vec3::ZERO;
        }
        let Ok(cone) = Cone::from_sine(radius / distance) else {
            return Vec3::ZERO;
        };
        let local = cone.sample_concentric(sample).value;
        let direction = Frame::from_normal(to_center / distance)
            .to_world(local)
            .normalize();
        let cosine = self.cosine(receiver, direction);
        if cosine <= 0.0 {
            return Vec3::ZERO;
        }
        // The nearer end of the chord.
        let along = to_center.dot(direction);
        let across = (to_center - along * direction).length_squared();
        let near = along - (radius * radius - across).max(0.0).sqrt();
        if self.is_blocked(receiver, direction, near) {
            return Vec3::ZERO;
        }
        radiance * (cone.solid_angle() * cosine)
    }

    fn arriving_from_area(
        &self,
        receiver: &Receiver,
        light: &AreaLight,
        rng: &mut CounterRng,
    ) -> Vec3 {
        let sample = rng.next_vec2();
        let (primitive, along) = light.choose(sample.x);
        let Some(on_light) = self.world.point_on(primitive, Vec2::new(along, sample.y)) else {
            return Vec3::ZERO;
        };
        let to_light = on_light.spawn.position - receiver.point.spawn.position;
        let distance = to_light.length();
        if distance <= 0.0 {
            return Vec3::ZERO;
        }
        let direction = to_light / distance;
        let mut leaving = -direction.dot(on_light.geometric_normal);
        if light.double_sided() {
            leaving = leaving.abs();
        }
        let cosine = self.cosine(receiver, direction);
        if leaving <= 0.0 || cosine <= 0.0 || self.is_blocked(receiver, direction, distance) {
            return Vec3::ZERO;
        }
        light.radiance() * (light.area() * leaving * cosine / (distance * distance))
    }

    /// The cosine of the incident light, 0 if it does not reach the side that is seen. The smooth
    /// normal shades, the geometric one decides the side.
    fn cosine(&self, receiver: &Receiver, direction: Vec3) -> f32 {
        if receiver.normal.dot(direction) <= 0.0 {
            return 0.0;
        }
        receiver.shading_normal.dot(direction)
    }

    fn is_blocked(&self, receiver: &Receiver, direction: Vec3, distance: f32) -> bool {
        let origin = receiver
            .point
            .spawn
            .origin_towards(receiver.normal, direction);
        let stop = if distance.is_finite() {
            distance * (1.0 - SHADOW_STOP)
        } else {
            distance
        };
        self.intersect
            .is_occluded(&Ray::with_range(origin, direction, 0.0, stop))
    }
}
