// Points on surfaces that rays start from, with bounds on their rounding. Twin: spawn.rs in
// caustics-geometry.

struct SpawnPoint {
    position: vec3<f32>,
    error: vec3<f32>,
}

fn spawn_on_triangle(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, u: f32, v: f32) -> SpawnPoint {
    let ab = b - a;
    let ac = c - a;
    let across = ac - ab;
    let longest_squared = max(max(dot(ab, ab), dot(ac, ac)), dot(across, across));
    let normal = cross(ab, ac);
    let area = length_of(normal);
    var relative = 1.0 / 1024.0;
    if area > 0.0 {
        relative = min(relative, UNIT_ROUNDOFF * longest_squared / area);
    }
    let plane_error = sqrt(longest_squared) * relative;
    let part_a = (1.0 - u - v) * a;
    let part_b = u * b;
    let part_c = v * c;
    return SpawnPoint(
        part_a + part_b + part_c,
        gamma(7.0) * (abs(part_a) + abs(part_b) + abs(part_c)) + plane_error,
    );
}

// The point of the sphere nearest to `point`.
fn spawn_on_sphere(center: vec3<f32>, radius: f32, point: vec3<f32>) -> SpawnPoint {
    let outward = from_sphere_center(point, center);
    let position = single_vector(
        double_vector_sum(double_vector(center), double_scaled(outward, double_of(radius))));
    return SpawnPoint(position, gamma(2.0) * abs(position));
}

fn origin_towards(spawn: SpawnPoint, geometric_normal: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let distance = dot(abs(geometric_normal), spawn.error);
    let side = select(distance, -distance, dot(direction, geometric_normal) < 0.0);
    let offset = side * geometric_normal;
    let moved = spawn.position + offset;
    return vec3(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z));
}
