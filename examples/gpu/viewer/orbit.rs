use caustics::glam::{Quat, Vec3};
use caustics::prelude::{Camera, Light, Scene, World};
use caustics::scene::Projection;
use caustics_gpu_examples::Failure;
use caustics_gpu_examples::engine::Look;
use caustics_gpu_examples::picture::main_light;

/// Radians for a pixel that the mouse moves.
const SPEED: f32 = 0.006;

/// A camera and a light that go round the scene.
#[derive(Clone, Debug)]
pub(crate) struct Orbit {
    target: Vec3,
    eye: Vec3,
    yfov: f32,
    light: Light,
}

impl Orbit {
    pub(crate) fn new(scene: &Scene) -> Result<Self, Failure> {
        let world = World::new(scene)?;
        let casters = world.specular_bounds();
        let around = if casters.is_empty() {
            world.bounds()
        } else {
            casters
        };
        let (center, radius) = around.bounding_sphere();
        let (eye, yfov, target) = match scene.cameras().first() {
            Some(camera) => {
                let yfov = match camera.projection {
                    Projection::Perspective { yfov } => yfov,
                    _ => 0.7,
                };
                let eye = camera.position();
                let away = (center - eye).dot(camera.forward()).max(radius);
                (eye, yfov, eye + away * camera.forward())
            }
            None => (center + radius * Vec3::new(1.0, 2.0, 3.5), 0.7, center),
        };
        Ok(Self {
            target,
            eye,
            yfov,
            light: main_light(scene).ok_or("the scene has no light that the engine knows")?,
        })
    }

    /// Goes round by a movement of the mouse in pixels.
    pub(crate) fn turn(&mut self, x: f32, y: f32) {
        self.eye = self.target + turned(self.eye - self.target, x, y);
    }

    pub(crate) fn zoom(&mut self, factor: f32) {
        self.eye = self.target + factor * (self.eye - self.target);
    }

    /// Moves the light round the scene; a spot goes on shining at what it shone at.
    pub(crate) fn drag_light(&mut self, x: f32, y: f32) {
        match &mut self.light {
            Light::Point { position, .. } => {
                *position = self.target + turned(*position - self.target, x, y);
            }
            Light::Spot {
                position,
                direction,
                ..
            } => {
                let offset = *position - self.target;
                let after = turned(offset, x, y);
                let rotation = Quat::from_rotation_arc(offset.normalize(), after.normalize());
                *position = self.target + after;
                *direction = (rotation * *direction).normalize();
            }
            Light::Directional { direction, .. } => *direction = turned(*direction, x, -y),
            _ => {}
        }
    }

    pub(crate) fn light(&self) -> Light {
        self.light
    }

    pub(crate) fn look(&self, exposure_ev: f32) -> Result<Look, Failure> {
        Ok(Look {
            camera: Camera::look_at("orbit", self.eye, self.target, Vec3::Y, self.yfov)?,
            light: self.light(),
            exposure_ev,
        })
    }
}

/// A vector turned about the vertical, and up or down but not over the top.
fn turned(vector: Vec3, x: f32, y: f32) -> Vec3 {
    let around = Quat::from_rotation_y(-SPEED * x) * vector;
    let side = around.cross(Vec3::Y).normalize_or(Vec3::X);
    let tilted = Quat::from_axis_angle(side, -SPEED * y) * around;
    if tilted.normalize_or_zero().y.abs() < 0.98 {
        tilted
    } else {
        around
    }
}
