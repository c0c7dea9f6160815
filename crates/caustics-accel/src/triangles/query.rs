//! What holds for a ray in every tree of triangles.

use caustics_geometry::Ray;

/// Widens the far side of every box, so that no rounding lets a ray slip between two of them.
///
/// With e = 2^-24, a computed slab distance (b - o) * (1/d) is off by a factor of at most
/// (1 + e)^3, the near and the far one together by 6 e. The leaf test sees the ray through
/// vertices whose sheared x and y are off by a factor of at most (1 + e)^5, which shifts where it
/// crosses the two slabs by another 10 e. 20 e covers both and the rounding of this product
/// (after Ize, *Robust BVH Ray Traversal*, JCGT 2013, whose factor covers the slabs alone).
pub(crate) const WIDEN: f32 = 1.0 + 20.0 * (f32::EPSILON / 2.0);

/// Whether a ray can hit anything: it is finite and its range is not empty.
#[inline(always)]
pub(crate) fn is_usable(ray: &Ray) -> bool {
    // The comparison also turns away a NaN.
    ray.origin.is_finite() && ray.direction.is_finite() && lower_end(ray) < ray.t_max
}

/// Lower end of the ray's range: boxes are entered at no negative parameter.
#[inline(always)]
pub(crate) fn lower_end(ray: &Ray) -> f32 {
    // A negative zero would sort above everything.
    ray.t_min.max(0.0) + 0.0
}
