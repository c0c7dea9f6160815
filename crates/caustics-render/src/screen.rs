use caustics_scene::{Camera, Projection};
use glam::{Vec2, Vec3};

/// The map between the pixels of a picture and the world, with its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Screen {
    eye: Vec3,
    /// The view axis, a unit vector.
    forward: Vec3,
    /// What a step of one pixel does to the ray: to its direction at depth 1 in perspective, to
    /// its origin else.
    step_x: Vec3,
    step_y: Vec3,
    center: Vec2,
    is_perspective: bool,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Screen {
    pub(crate) fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let half_height = 0.5 * height as f32;
        let (extent, is_perspective) = match camera.projection {
            Projection::Orthographic { ymag, .. } => (ymag, false),
            Projection::Perspective { yfov } => ((0.5 * yfov).tan(), true),
            // No other projection exists; one that is added must be added here.
            _ => (1.0, true),
        };
        let pixel = extent / half_height;
        let axes = camera.transform.matrix3;
        Self {
            eye: camera.transform.translation.into(),
            forward: (-axes.z_axis).into(),
            step_x: (pixel * axes.x_axis).into(),
            step_y: (-pixel * axes.y_axis).into(),
            center: Vec2::new(0.5 * width as f32, half_height),
            is_perspective,
            width,
            height,
        }
    }

    /// Distance of a point along the view axis, in metres.
    pub(crate) fn depth(&self, point: Vec3) -> f32 {
        (point - self.eye).dot(self.forward)
    }

    /// The cosine between a surface's unit normal and the direction to the eye.
    pub(crate) fn facing_cosine(&self, point: Vec3, normal: Vec3) -> f32 {
        self.direction_to_eye(point).dot(normal)
    }

    /// The unit direction from a point to the eye.
    pub(crate) fn direction_to_eye(&self, point: Vec3) -> Vec3 {
        if self.is_perspective {
            (self.eye - point).normalize_or_zero()
        } else {
            -self.forward
        }
    }

    /// The pixel coordinates of a point in front of the camera; `None` behind it.
    pub(crate) fn project(&self, point: Vec3) -> Option<Vec2> {
        let relative = point - self.eye;
        let depth = relative.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let scale = if self.is_perspective {
            depth.recip()
        } else {
            1.0
        };
        let pixel = Vec2::new(
            relative.dot(self.step_x) / self.step_x.length_squared(),
            relative.dot(self.step_y) / self.step_y.length_squared(),
        );
        Some(self.center + scale * pixel)
    }

    /// The point of a plane, through `point` with unit `normal`, at pixel coordinates; `None` where
    /// it is not in front of the camera.
    pub(crate) fn on_plane(&self, pixel: Vec2, point: Vec3, normal: Vec3) -> Option<Vec3> {
        let offset = pixel - self.center;
        let step = offset.x * self.step_x + offset.y * self.step_y;
        let (origin, direction) = if self.is_perspective {
            (self.eye, self.forward + step)
        } else {
            (self.eye + step, self.forward)
        };
        let distance = (point - origin).dot(normal) / direction.dot(normal);
        (distance > 0.0 && distance.is_finite()).then(|| origin + distance * direction)
    }

    /// The edges of a pixel on a surface at `point` that faces the view, in metres.
    pub(crate) fn facing_axes(&self, point: Vec3) -> [Vec3; 2] {
        let scale = if self.is_perspective {
            self.depth(point)
        } else {
            1.0
        };
        [self.step_x, self.step_y].map(|step| scale * step)
    }

    /// How the point of a plane that a pixel sees moves with the pixel's two coordinates, in
    /// metres a pixel: the edges of the pixel's own footprint at `point` on a plane with unit
    /// `normal`. `None` where the plane is seen edge-on or from behind the camera.
    pub(crate) fn pixel_axes(&self, point: Vec3, normal: Vec3) -> Option<[Vec3; 2]> {
        let depth = self.depth(point);
        let (view, scale) = if self.is_perspective {
            (point - self.eye, depth)
        } else {
            (self.forward, 1.0)
        };
        let facing = view.dot(normal);
        if depth <= 0.0 || facing == 0.0 {
            return None;
        }
        // The step across the view, slid along the view ray back into the plane.
        let slide = |step: Vec3| scale * (step - view * (step.dot(normal) / facing));
        let axes = [slide(self.step_x), slide(self.step_y)];
        axes.iter().all(|axis| axis.is_finite()).then_some(axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 2] {
        let perspective =
            Camera::look_at("p", [1.0, 2.0, 3.0], [0.2, 0.0, -0.3], Vec3::Y, 0.8).unwrap();
        let orthographic = Camera::new(
            "o",
            perspective.transform,
            Projection::Orthographic {
                xmag: 2.0,
                ymag: 1.5,
            },
        )
        .unwrap();
        [perspective, orthographic]
    }

    #[test]
    fn projection_agrees_with_the_camera() {
        for camera in cameras() {
            let screen = Screen::new(&camera, 640, 480);
            for point in [Vec3::ZERO, Vec3::new(0.5, 0.3, -1.0)] {
                let expected = camera.project(point, 640, 480).unwrap();
                assert!(screen.project(point).unwrap().abs_diff_eq(expected, 1e-2));
            }
            assert_eq!(screen.project(Vec3::new(5.0, 10.0, 30.0)), None);
        }
    }

    #[test]
    fn pixel_axes_are_the_difference_of_neighbouring_pixels_on_the_plane() {
        for camera in cameras() {
            let screen = Screen::new(&camera, 640, 480);
            let normal = Vec3::new(0.1, 1.0, 0.2).normalize();
            let on_plane = |x: f32, y: f32| {
                let ray = camera.ray(x, y, 640, 480);
                ray.at(-ray.origin.dot(normal) / ray.direction.dot(normal))
            };
            let (x, y) = (350.0, 260.0);
            let expected = on_plane(x, y);
            let found = screen
                .on_plane(Vec2::new(x, y), Vec3::ZERO, normal)
                .unwrap();
            assert!(found.abs_diff_eq(expected, 1e-4), "{found} {expected}");
            let [along_x, along_y] = screen.pixel_axes(on_plane(x, y), normal).unwrap();
            let central_x = 0.5 * (on_plane(x + 1.0, y) - on_plane(x - 1.0, y));
            let central_y = 0.5 * (on_plane(x, y + 1.0) - on_plane(x, y - 1.0));
            assert!(along_x.abs_diff_eq(central_x, 2e-3 * central_x.length()));
            assert!(along_y.abs_diff_eq(central_y, 2e-3 * central_y.length()));
        }
    }
}
