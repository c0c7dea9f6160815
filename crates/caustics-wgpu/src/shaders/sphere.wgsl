// Rays against exact spheres (Haines, Günther and Akenine-Möller 2019). Twin: sphere.rs in
// caustics-geometry, which computes in f64.

// The nearest positive parameter at which the ray meets the sphere; not above 0 where it does not.
fn intersect_sphere(ray: Ray, center: vec3<f32>, radius: f32) -> f32 {
    let direction = double_vector(ray.direction);
    let from_center = double_difference(ray.origin, center);
    let radius_squared = exact_product(radius, radius);
    let a = double_dot(direction, direction);
    let b = double_negated(double_dot(from_center, direction));
    let nearest =
        double_vector_sum(from_center, double_scaled(direction, double_quotient(b, a)));
    let discriminant =
        double_sum(radius_squared, double_negated(double_dot(nearest, nearest)));
    if !(discriminant.high >= 0.0) {
        return -1.0;
    }
    let root = double_root(double_product(a, discriminant));
    var q = double_sum(b, root);
    if b.high < 0.0 {
        q = double_sum(b, double_negated(root));
    }
    if q.high == 0.0 {
        return -1.0;
    }
    let product =
        double_sum(double_dot(from_center, from_center), double_negated(radius_squared));
    let first = double_quotient(product, q).high;
    let second = double_quotient(q, a).high;
    let near = min(first, second);
    return select(max(first, second), near, near > 0.0);
}

// The unit vector from the centre to a point, or up from the centre itself. Twin:
// `Sphere::normal_at`.
fn from_sphere_center(point: vec3<f32>, center: vec3<f32>) -> DoubleVector {
    let outward = double_difference(point, center);
    let length = double_root(double_dot(outward, outward));
    if length.high <= 0.0 {
        return double_vector(vec3(0.0, 1.0, 0.0));
    }
    return double_scaled(outward, double_quotient(double_of(1.0), length));
}
