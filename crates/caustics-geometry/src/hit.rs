/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in units of the ray direction's length.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex; 0 on a sphere.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex; 0 on a sphere.
    pub v: f32,
    /// Index of the primitive in the order in which the scene lists them: first its triangles,
    /// then its spheres.
    pub primitive: u32,
}
