use caustics_geometry::{Hit, Ray};

/// Something that rays can be shot at.
///
/// This is where an engine's own ray tracer plugs in: everything that traces photons or eye rays
/// asks only these two questions. Primitive numbers must be the scene's.
pub trait Intersect: Sync {
    /// The hit with the smallest `t` strictly between `ray.t_min` and `ray.t_max`, from either
    /// side of the surface.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// Whether anything lies strictly between `ray.t_min` and `ray.t_max`.
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }
}
