use caustics_geometry::{SpawnPoint, Triangle};
use glam::{Vec2, Vec3};

use crate::{SurfacePoint, World};

impl World {
    /// The surface at a point of the unit square mapped evenly over a primitive's area, with
    /// [`SurfacePoint::from_outside`] set; `None` where no primitive has the number or it has no
    /// area.
    ///
    /// Triangles by folding the square's root (Turk, *Graphics Gems*, 1990), spheres by
    /// Archimedes' map of the cylinder.
    #[must_use]
    pub fn point_on(&self, primitive: u32, sample: Vec2) -> Option<SurfacePoint> {
        let object = self.object_of(primitive)?;
        let material = self.objects()[object as usize].material;
        let (spawn, geometric_normal, u, v) =
            if let Some(Triangle { a, b, c }) = self.triangle(primitive) {
                let normal = (b - a).cross(c - a).try_normalize()?;
                let root = sample.x.clamp(0.0, 1.0).sqrt();
                let (u, v) = (root * (1.0 - sample.y), root * sample.y);
                (SpawnPoint::on_triangle(a, b, c, u, v), normal, u, v)
            } else {
                let sphere = self.sphere(primitive)?;
                let height = 1.0 - 2.0 * sample.x;
                let ring = (1.0 - height * height).max(0.0).sqrt();
                let (sin, cos) = (std::f32::consts::TAU * sample.y).sin_cos();
                let normal = Vec3::new(ring * cos, height, ring * sin);
                let point = sphere.center + sphere.radius * normal;
                (SpawnPoint::on_sphere(sphere, point), normal, 0.0, 0.0)
            };
        Some(SurfacePoint {
            spawn,
            geometric_normal,
            shading_normal: geometric_normal,
            object,
            material,
            primitive,
            u,
            v,
            from_outside: true,
        })
    }
}
