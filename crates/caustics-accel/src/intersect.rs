use caustics_geometry::{Hit, Ray};

/// Something that rays can be shot at.
///
/// This is where an engine's own ray tracer plugs in: everything that traces photons or eye rays
/// asks only these questions, of which the first is the one that must be answered. Primitive numbers must be the scene's.
pub trait Intersect: Sync {
    /// The hit with the smallest `t` strictly between `ray.t_min` and `ray.t_max`, from either
    /// side of the surface.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// The closest hits of many rays, the same as of one after the other; `hits` is as long as `rays`.
    ///
    /// Photons come in the order of a lattice, so that rays which follow each other mostly lie close
    /// together: what traces such rays faster than single ones does so here.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest_hit(ray);
        }
    }

    /// Whether anything lies strictly between `ray.t_min` and `ray.t_max`.
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }
}
