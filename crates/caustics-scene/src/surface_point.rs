//! What a ray finds where it hits.

use crate::world::World;
use caustics_geometry::{BarycentricGradient, Hit, Ray, SpawnPoint, Sphere, Triangle, interpolate};
use glam::{Mat3, Vec3};

/// A point on a surface of a [`World`], and what a tracer wants to know there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The position, and where to start rays from it so that they do not hit it again.
    pub spawn: SpawnPoint,
    /// Unit normal of the surface itself, outward for closed solids.
    pub geometric_normal: Vec3,
    /// Unit normal for directions and Fresnel terms: interpolated between a triangle's vertices,
    /// and turned, where need be, to the same side as the geometric one.
    pub shading_normal: Vec3,
    /// Index into [`World::objects`].
    pub object: u32,
    /// Index into [`World::materials`].
    pub material: u32,
    /// The primitive's number.
    pub primitive: u32,
    /// Barycentric weight of the triangle's second vertex.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex.
    pub v: f32,
    /// Whether the ray came from the side to which the geometric normal points.
    pub from_outside: bool,
}

impl World {
    /// The surface where `ray` has its `hit`; `None` where no primitive has the hit's number or it
    /// has no area, so that it has no normal.
    #[must_use]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Option<SurfacePoint> {
        let object = self.object_of(hit.primitive)?;
        let material = self.objects()[object as usize].material;
        let (spawn, geometric_normal, shading_normal) =
            if let Some(triangle) = self.triangle(hit.primitive) {
                let geometric_normal = triangle.unit_normal()?;
                let shading_normal = self
                    .interpolated_normal(hit.primitive, hit.u, hit.v)
                    .and_then(Vec3::try_normalize)
                    .map_or(geometric_normal, |normal| towards(normal, geometric_normal));
                let Triangle { a, b, c } = triangle;
                (
                    SpawnPoint::on_triangle(a, b, c, hit.u, hit.v),
                    geometric_normal,
                    shading_normal,
                )
            } else {
                let sphere = self.sphere(hit.primitive)?;
                let spawn = SpawnPoint::on_sphere(sphere, ray.at(hit.t));
                let normal = sphere.normal_at(ray.at(hit.t));
                (spawn, normal, normal)
            };
        Some(SurfacePoint {
            spawn,
            geometric_normal,
            shading_normal,
            object,
            material,
            primitive: hit.primitive,
            u: hit.u,
            v: hit.v,
            from_outside: ray.direction.dot(geometric_normal) < 0.0,
        })
    }

    /// How the unit shading normal changes along the surface: the matrix that maps a displacement of
    /// the point, in metres, to the change of its shading normal. Only the part of a displacement in
    /// the surface's plane counts. Zero where the shading normal is the geometric one of a triangle.
    ///
    /// For a triangle, `n = sum of barycentric weight * vertex normal`, and the unit normal changes
    /// by `((n.n) dn - (n.dn) n) / (n.n)^(3/2)` (Igehy, "Tracing ray differentials", 1999).
    #[must_use]
    pub fn normal_jacobian(&self, point: &SurfacePoint) -> Mat3 {
        if let Some(sphere) = self.sphere(point.primitive) {
            let normal = point.geometric_normal;
            return (Mat3::IDENTITY - outer(normal, normal)) * sphere.radius.recip();
        }
        self.triangle_normal_jacobian(point)
            .filter(Mat3::is_finite)
            .unwrap_or(Mat3::ZERO)
    }

    fn triangle_normal_jacobian(&self, point: &SurfacePoint) -> Option<Mat3> {
        let gradient = BarycentricGradient::new(&self.triangle(point.primitive)?)?;
        let [a, b, c] = self.triangle_normals(point.primitive)?;
        let raw = self.interpolated_normal(point.primitive, point.u, point.v)?;
        let raw_jacobian = outer(b - a, gradient.u_gradient) + outer(c - a, gradient.v_gradient);
        let square = raw.length_squared();
        let unit_from_raw =
            (Mat3::IDENTITY * square - outer(raw, raw)) * (square * square.sqrt()).recip();
        let jacobian = unit_from_raw * raw_jacobian;
        Some(if raw.dot(point.geometric_normal) < 0.0 {
            -jacobian
        } else {
            jacobian
        })
    }

    /// The triangle with this primitive number; `None` where the primitive is not a triangle.
    #[must_use]
    pub fn triangle(&self, primitive: u32) -> Option<Triangle> {
        let corners = self.triangles().get(primitive as usize)?;
        let [a, b, c] = corners.map(|vertex| self.positions()[vertex as usize]);
        Some(Triangle { a, b, c })
    }

    /// Vertex normals of a triangle; `None` where the primitive is not a triangle.
    #[must_use]
    pub fn triangle_normals(&self, primitive: u32) -> Option<[Vec3; 3]> {
        let triangle = self.triangles().get(primitive as usize)?;
        Some(triangle.map(|vertex| self.normals()[vertex as usize]))
    }

    /// The sphere with this primitive number; `None` where the primitive is not a sphere.
    #[must_use]
    pub fn sphere(&self, primitive: u32) -> Option<&Sphere> {
        let index = (primitive as usize).checked_sub(self.triangles().len())?;
        self.spheres().get(index)
    }

    /// The vertex normals weighted by barycentric coordinates, not of unit length.
    fn interpolated_normal(&self, primitive: u32, u: f32, v: f32) -> Option<Vec3> {
        let normal = interpolate(self.triangle_normals(primitive)?, u, v);
        // Where opposite normals cancel, what is left is rounding.
        (normal.length_squared() > 1e-8).then_some(normal)
    }
}

/// `normal`, or its opposite, whichever is on the side of `side`.
fn towards(normal: Vec3, side: Vec3) -> Vec3 {
    if normal.dot(side) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// The matrix that maps `v` to `a (b . v)`.
fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3::from_cols(a * b.x, a * b.y, a * b.z)
}
