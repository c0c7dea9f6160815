use caustics_scene::{Camera, Projection};
use glam::Mat4;
use glam::camera::rh::proj::directx;

/// A camera's view-projection, as [`ViewParams::view_projection`](crate::ViewParams) takes it: depth
/// 0 at `near` and 1 at `far`, in metres along the view. The height of the picture is what the
/// camera says, the width follows from its size in pixels.
///
/// ```
/// use caustics_scene::Camera;
/// use caustics_wgpu::camera_matrix;
/// use caustics_wgpu::glam::{Mat4, Vec3};
///
/// let camera = Camera::look_at("c", [0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8)?;
/// let matrix = Mat4::from_cols_array_2d(&camera_matrix(&camera, [640, 480], 1.0, 10.0));
/// let middle = matrix.project_point3(Vec3::ZERO);
/// assert!(middle.truncate().length() < 1e-6 && middle.z > 0.0 && middle.z < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn camera_matrix(camera: &Camera, size: [u32; 2], near: f32, far: f32) -> [[f32; 4]; 4] {
    let aspect = size[0] as f32 / size[1] as f32;
    let projection = match camera.projection {
        Projection::Orthographic { ymag, .. } => {
            directx::orthographic(-ymag * aspect, ymag * aspect, -ymag, ymag, near, far)
        }
        Projection::Perspective { yfov } => directx::perspective(yfov, aspect, near, far),
        // No other projection exists; one that is added must be added here.
        _ => Mat4::IDENTITY,
    };
    (projection * Mat4::from(camera.transform.inverse())).to_cols_array_2d()
}
