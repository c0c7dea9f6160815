//! Where the picture is taken from.

use caustics_geometry::Ray;
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};
use std::f32::consts::PI;
use thiserror::Error;

/// How a camera maps the world to its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Projection {
    /// Rays through one point.
    Perspective {
        /// The picture's height as an angle in radians, between 0 and pi, both exclusive. The width
        /// follows from the picture's shape.
        yfov: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the width of what the camera sees in its file's own shape of picture, in metres.
        /// Kept for reference: the width seen follows from `ymag` and the picture's shape.
        xmag: f32,
        /// Half the height of what the camera sees, in metres.
        ymag: f32,
    },
}

/// A pinhole or orthographic camera. It looks along its own -Z axis, with +Y up and +X to the right.
///
/// Pixels count from the picture's upper left corner, so that the middle of the first one is
/// (0.5, 0.5).
///
/// ```
/// use caustics_scene::Camera;
/// use glam::Vec3;
///
/// let camera = Camera::look_at("front", [0.0, 1.0, 4.0], [0.0, 1.0, 0.0], Vec3::Y, 0.6)?;
/// let ray = camera.ray(320.0, 240.0, 640, 480);
/// assert!(ray.direction.abs_diff_eq(Vec3::NEG_Z, 1e-6));
/// let pixel = camera.project(ray.at(3.0), 640, 480).expect("a point in front");
/// assert!((pixel.x - 320.0).abs() < 1e-3 && (pixel.y - 240.0).abs() < 1e-3);
/// # Ok::<(), caustics_scene::CameraError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// A name for messages; need not be unique.
    pub name: String,
    /// World from camera: a rotation and a translation, no scale.
    pub transform: Affine3A,
    /// Perspective or orthographic.
    pub projection: Projection,
}

impl Camera {
    /// A camera with this pose and projection. A scale or shear in the transform is left out: the
    /// view axis stays, and the others are made perpendicular to it and to each other.
    ///
    /// # Errors
    /// The transform is not finite or has no view axis or no up, or the projection is out of range.
    pub fn new(
        name: impl Into<String>,
        transform: Affine3A,
        projection: Projection,
    ) -> Result<Self, CameraError> {
        let matrix = transform.matrix3;
        let transform = pose(transform.translation, matrix.z_axis, matrix.y_axis)?;
        let camera = Self {
            name: name.into(),
            transform,
            projection,
        };
        camera.validate().map(|()| camera)
    }

    /// A perspective camera at `eye` that has `target` in the middle of its picture, with `up`
    /// pointing upwards in it, and the height of the picture as an angle in radians.
    ///
    /// # Errors
    /// A point is not finite, `eye` is `target`, `up` is along the view, or `yfov` is not between 0
    /// and pi.
    pub fn look_at(
        name: impl Into<String>,
        eye: impl Into<Vec3>,
        target: impl Into<Vec3>,
        up: impl Into<Vec3>,
        yfov: f32,
    ) -> Result<Self, CameraError> {
        let eye = Vec3A::from(eye.into());
        let backward = eye - Vec3A::from(target.into());
        let transform = pose(eye, backward, Vec3A::from(up.into()))?;
        let camera = Self {
            name: name.into(),
            transform,
            projection: Projection::Perspective { yfov },
        };
        camera.validate().map(|()| camera)
    }

    /// The ray through a point of a picture `width` by `height` pixels, with a direction of unit
    /// length. Fractions of a pixel count, and points outside the picture are allowed.
    #[must_use]
    pub fn ray(&self, pixel_x: f32, pixel_y: f32, width: u32, height: u32) -> Ray {
        let half_height = 0.5 * height as f32;
        // Both in units of half the picture's height.
        let x = (pixel_x - 0.5 * width as f32) / half_height;
        let y = (half_height - pixel_y) / half_height;
        match self.projection {
            Projection::Perspective { yfov } => {
                let slope = (0.5 * yfov).tan();
                let direction = Vec3A::new(x * slope, y * slope, -1.0);
                let direction = self.transform.matrix3 * direction;
                Ray::new(self.transform.translation, direction.normalize())
            }
            Projection::Orthographic { ymag, .. } => {
                let origin = self
                    .transform
                    .transform_point3a(Vec3A::new(x * ymag, y * ymag, 0.0));
                Ray::new(origin, -self.transform.matrix3.z_axis)
            }
        }
    }

    /// Where a point of the world falls in a picture `width` by `height` pixels, in pixels, inside
    /// the picture or out; `None` where it is not in front of the camera.
    #[must_use]
    pub fn project(&self, point: impl Into<Vec3>, width: u32, height: u32) -> Option<Vec2> {
        let relative = Vec3A::from(point.into()) - self.transform.translation;
        // The matrix is a rotation, so that its transpose is its inverse.
        let local = self.transform.matrix3.transpose() * relative;
        let depth = -local.z;
        let half_height = 0.5 * height as f32;
        let scale = match self.projection {
            Projection::Perspective { yfov } => half_height / (depth * (0.5 * yfov).tan()),
            Projection::Orthographic { ymag, .. } => half_height / ymag,
        };
        let pixel = Vec2::new(
            0.5 * width as f32 + scale * local.x,
            half_height - scale * local.y,
        );
        (depth > 0.0 && pixel.is_finite()).then_some(pixel)
    }

    /// Where the camera is, in metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.transform.translation.into()
    }

    /// The unit direction in which it looks.
    #[must_use]
    pub fn forward(&self) -> Vec3 {
        (-self.transform.matrix3.z_axis).into()
    }

    /// Whether the pose is a rotation and a translation, and the projection in range.
    ///
    /// # Errors
    /// Names what is not.
    pub fn validate(&self) -> Result<(), CameraError> {
        let m = self.transform.matrix3;
        let orthonormal = (m.transpose() * m).abs_diff_eq(Mat3A::IDENTITY, 1e-4)
            && m.determinant() > 0.0
            && self.transform.translation.is_finite();
        if !orthonormal {
            return Err(CameraError::Pose);
        }
        match self.projection {
            Projection::Perspective { yfov } if !(yfov > 0.0 && yfov < PI) => {
                Err(CameraError::FieldOfView { yfov })
            }
            Projection::Orthographic { xmag, ymag } => match [xmag, ymag]
                .into_iter()
                .find(|m| !(m.is_finite() && *m > 0.0))
            {
                Some(value) => Err(CameraError::Magnification { value }),
                None => Ok(()),
            },
            Projection::Perspective { .. } => Ok(()),
        }
    }
}

/// The rotation and translation of a camera that looks away from `backward`.
fn pose(eye: Vec3A, backward: Vec3A, up: Vec3A) -> Result<Affine3A, CameraError> {
    // Scaled first, so that neither tiny nor huge vectors lose their length in its square.
    let unit = |v: Vec3A| (v / v.abs().max_element()).try_normalize();
    let back = unit(backward).ok_or(CameraError::Pose)?;
    let up = unit(up).ok_or(CameraError::Pose)?;
    let right = up.cross(back).try_normalize().ok_or(CameraError::Pose)?;
    let matrix3 = Mat3A::from_cols(right, back.cross(right), back);
    Ok(Affine3A {
        matrix3,
        translation: eye,
    })
}

/// A camera that cannot take a picture.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CameraError {
    /// A transform from which no rotation and position can be had.
    #[error("the camera's transform is not finite, or has no view axis or no upward one")]
    Pose,
    /// A field of view out of range.
    #[error("vertical field of view {yfov} is not between 0 and pi")]
    FieldOfView {
        /// The angle in radians.
        yfov: f32,
    },
    /// A magnification that is not positive and finite.
    #[error("magnification {value} is not a finite number above 0")]
    Magnification {
        /// The value in metres.
        value: f32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_field_of_view_is_the_pictures_height() {
        let yfov = 0.8_f32;
        let camera = Camera::look_at("c", [0.0; 3], [0.0, 0.0, -1.0], Vec3::Y, yfov).unwrap();
        for (width, height) in [(640, 480), (100, 400)] {
            let middle = 0.5 * width as f32;
            let top = camera.ray(middle, 0.0, width, height).direction;
            let bottom = camera.ray(middle, height as f32, width, height).direction;
            assert_relative_eq!(top.angle_between(bottom), yfov, max_relative = 1e-5);
            assert!(top.y > 0.0 && bottom.y < 0.0);
        }
        // A pixel is as wide as it is high: tan of the half width over tan of the half height.
        let right = camera.ray(640.0, 240.0, 640, 480).direction;
        assert_relative_eq!(
            right.x / -right.z,
            (0.5 * yfov).tan() * 640.0 / 480.0,
            max_relative = 1e-5
        );
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let pose = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0));
        let projection = Projection::Orthographic {
            xmag: 4.0,
            ymag: 2.0,
        };
        let camera = Camera::new("o", pose, projection).unwrap();
        let corner = camera.ray(0.0, 0.0, 200, 100);
        assert_eq!(corner.direction, Vec3::NEG_Z);
        assert_eq!(corner.origin, Vec3::new(1.0 - 4.0, 2.0 + 2.0, 3.0));
        assert_eq!(camera.project(corner.at(7.0), 200, 100), Some(Vec2::ZERO));
        assert_eq!(camera.project(corner.at(-7.0), 200, 100), None);
    }

    #[test]
    fn scale_is_left_out() {
        let rotation = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, -0.7, 0.2);
        let scale = Vec3::new(3.0, 0.5, 20.0);
        let scaled = Affine3A::from_scale_rotation_translation(scale, rotation, Vec3::ONE);
        let plain = Affine3A::from_rotation_translation(rotation, Vec3::ONE);
        let projection = Projection::Perspective { yfov: 1.0 };
        let camera = Camera::new("c", scaled, projection).unwrap();
        assert!(camera.transform.abs_diff_eq(plain, 1e-6));
    }

    #[test]
    fn nonsense_is_refused() {
        let up = Vec3::Y;
        let look =
            |eye: [f32; 3], target: [f32; 3], yfov| Camera::look_at("c", eye, target, up, yfov);
        assert_eq!(look([0.0; 3], [0.0; 3], 1.0), Err(CameraError::Pose));
        assert_eq!(look([0.0; 3], [0.0, 5.0, 0.0], 1.0), Err(CameraError::Pose));
        assert_eq!(look([f32::NAN; 3], [0.0; 3], 1.0), Err(CameraError::Pose));
        for yfov in [0.0, PI, -1.0, f32::INFINITY] {
            let error = look([0.0; 3], [1.0; 3], yfov).unwrap_err();
            assert_eq!(error, CameraError::FieldOfView { yfov });
        }
        assert!(look([0.0; 3], [1.0; 3], f32::NAN).is_err());
        let flat = Projection::Orthographic {
            xmag: 1.0,
            ymag: 0.0,
        };
        assert!(Camera::new("c", Affine3A::IDENTITY, flat).is_err());
        let mut sheared = look([0.0; 3], [1.0; 3], 1.0).unwrap();
        sheared.transform.matrix3.x_axis *= 2.0;
        assert_eq!(sheared.validate(), Err(CameraError::Pose));
    }
}
