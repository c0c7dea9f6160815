// Rays against exact spheres (Haines, Günther and Akenine-Möller 2019). Twin: sphere.rs in
// caustics-geometry, which computes in f64.

// The nearest positive parameter at which the ray meets the sphere; not above 0 where it does not.
fn intersect_sphere(ray: Ray, center: vec3<f32>, radius: f32) -> f32 {
    let from_center = ray.origin - center;
    let a = dot(ray.direction, ray.direction);
    let b = -dot(from_center, ray.direction);
    let nearest = from_center + b / a * ray.direction;
    let discriminant = (radius - length_of(nearest)) * (radius + length_of(nearest));
    if !(discriminant >= 0.0) {
        return -1.0;
    }
    let q = b + select(1.0, -1.0, b < 0.0) * sqrt(a * discriminant);
    if q == 0.0 {
        return -1.0;
    }
    let distance = length_of(from_center);
    let product = (distance - radius) * (distance + radius);
    let first = product / q;
    let second = q / a;
    let near = min(first, second);
    return select(max(first, second), near, near > 0.0);
}
