//! What a ray finds where it hits.

use crate::world::World;
use caustics_geometry::{Hit, NormalGradient, Ray, SpawnPoint, Sphere, Triangle, interpolate};
use glam::Vec3;

/// Steps of a normal's coordinates by which flat faces are told apart.
const FACE_STEPS: f32 = 512.0;

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
                let facet = self.facet(hit.primitive)?;
                let geometric_normal = facet.normal;
                let shading_normal = self
                    .interpolated_normal(hit.primitive, hit.u, hit.v)
                    .and_then(Vec3::try_normalize)
                    .map_or(geometric_normal, |normal| towards(normal, geometric_normal));
                (
                    facet.spawn_point(&triangle, hit.u, hit.v),
                    geometric_normal,
                    shading_normal,
                )
            } else {
                let sphere = self.sphere(hit.primitive)?;
                let spawn = SpawnPoint::on_sphere(sphere, ray.at(hit.t));
                // Of the rounded point, as `normal_gradient` has it.
                let normal = sphere.normal_at(spawn.position);
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

    /// The shading normal and how it turns along the surface, as ray differentials need it. It does
    /// not turn where the shading normal is a triangle's geometric one.
    #[must_use]
    pub fn normal_gradient(&self, point: &SurfacePoint) -> NormalGradient {
        if let Some(sphere) = self.sphere(point.primitive) {
            return NormalGradient::on_sphere(sphere, point.spawn.position);
        }
        self.triangle_normal_gradient(point)
            .filter(|gradient| gradient.derivative.is_finite())
            .map_or(NormalGradient::flat(point.shading_normal), |gradient| {
                if gradient.normal.dot(point.geometric_normal) < 0.0 {
                    gradient.reversed()
                } else {
                    gradient
                }
            })
    }

    fn triangle_normal_gradient(&self, point: &SurfacePoint) -> Option<NormalGradient> {
        let normals = self.triangle_normals(point.primitive)?;
        self.interpolated_normal(point.primitive, point.u, point.v)?;
        self.facet(point.primitive)?
            .normal_gradient(normals, point.u, point.v)
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

    /// A number that tells the flat faces of an object apart: the same for all triangles whose vertices
    /// have one normal, other for other normals but by rare chance, and 0 for what curves. Parallel faces
    /// of one object have the same.
    #[must_use]
    pub fn flat_face(&self, point: &SurfacePoint) -> u32 {
        match self.triangle_normals(point.primitive) {
            Some([a, b, c]) if a == b && a == c => {
                // Coarsely: coplanar triangles may have normals that differ by rounding.
                let steps = (FACE_STEPS * a + 0.5).floor().as_ivec3();
                let word = |word: u32, step: i32| {
                    (word ^ step as u32)
                        .wrapping_mul(0x0100_0193)
                        .rotate_left(9)
                };
                1 | [steps.x, steps.y, steps.z].into_iter().fold(0, word)
            }
            _ => 0,
        }
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
