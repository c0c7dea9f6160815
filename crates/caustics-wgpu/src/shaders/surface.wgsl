// What a ray finds where it hits. Twins: surface_point.rs and point_on.rs in caustics-scene,
// triangle.rs and normal_derivative.rs in caustics-geometry.

struct SurfacePoint {
    spawn: SpawnPoint,
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    body: u32,
    primitive: u32,
    u: f32,
    v: f32,
    from_outside: bool,
    // False where the primitive has no normal.
    is_valid: bool,
}

struct Corners {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
}

fn corners_of(triangle: u32) -> Corners {
    let corners = triangles[triangle];
    return Corners(
        vertices[corners.a].position,
        vertices[corners.b].position,
        vertices[corners.c].position,
    );
}

// The unit normal of the front and the area; zero where there is no area.
fn normal_and_area(triangle: Corners) -> vec4<f32> {
    let ab = triangle.b - triangle.a;
    let ac = triangle.c - triangle.a;
    let ab_size = largest(abs(ab));
    let ac_size = largest(abs(ac));
    if ab_size == 0.0 || ac_size == 0.0 {
        return vec4(0.0);
    }
    let perpendicular = cross(ab / ab_size, ac / ac_size);
    let scale = largest(abs(perpendicular));
    if scale == 0.0 {
        return vec4(0.0);
    }
    let scaled = perpendicular / scale;
    let length = length_of(scaled);
    return vec4(scaled / length, 0.5 * (scale * length) * ab_size * ac_size);
}

// The vertex normals' mean by weight; zero where they cancel.
fn interpolated_normal(triangle: u32, u: f32, v: f32) -> vec3<f32> {
    let corners = triangles[triangle];
    let normal = (1.0 - u - v) * vertex_normal(corners.a)
        + u * vertex_normal(corners.b) + v * vertex_normal(corners.c);
    return select(vec3(0.0), normal, dot(normal, normal) > 1e-8);
}

// Steps of a normal's coordinates by which flat faces are told apart.
const FACE_STEPS: f32 = 512.0;

// Twin: `World::flat_face`.
fn flat_face(point: SurfacePoint) -> u32 {
    if (point.primitive & SPHERE_BIT) != 0u {
        return 0u;
    }
    let corners = triangles[point.primitive];
    let normal = vertex_normal(corners.a);
    if any(normal != vertex_normal(corners.b)) || any(normal != vertex_normal(corners.c)) {
        return 0u;
    }
    let steps = vec3<i32>(floor(rounded_vector(FACE_STEPS * normal) + 0.5));
    var word = 0u;
    for (var i = 0u; i < 3u; i++) {
        word = (word ^ u32(steps[i])) * 0x01000193u;
        word = (word << 9u) | (word >> 23u);
    }
    return word | 1u;
}

fn surface_at(ray: Ray, hit: Hit) -> SurfacePoint {
    var point: SurfacePoint;
    point.primitive = hit.primitive;
    point.u = hit.u;
    point.v = hit.v;
    point.is_valid = true;
    if (hit.primitive & SPHERE_BIT) != 0u {
        point.body = hit.primitive ^ SPHERE_BIT;
        let center = bodies[point.body].center;
        let met = ray.origin + hit.t * ray.direction;
        point.spawn = spawn_on_sphere(center, bodies[point.body].radius, met);
        let normal = single_vector(from_sphere_center(point.spawn.position, center));
        point.geometric_normal = normal;
        point.shading_normal = normal;
    } else {
        point.body = triangles[hit.primitive].body;
        let triangle = corners_of(hit.primitive);
        let normal = normal_and_area(triangle).xyz;
        point.is_valid = any(normal != vec3(0.0));
        point.spawn = spawn_on_triangle(triangle.a, triangle.b, triangle.c, hit.u, hit.v);
        point.geometric_normal = normal;
        let between = interpolated_normal(hit.primitive, hit.u, hit.v);
        point.shading_normal = normal;
        if any(between != vec3(0.0)) {
            let unit = normalized(between);
            point.shading_normal = select(unit, -unit, dot(unit, normal) < 0.0);
        }
    }
    point.from_outside = dot(ray.direction, point.geometric_normal) < 0.0;
    return point;
}

fn outer(column: vec3<f32>, row: vec3<f32>) -> mat3x3<f32> {
    return mat3x3(row.x * column, row.y * column, row.z * column);
}

// Takes a displacement to the change of the shading normal.
fn normal_gradient(point: SurfacePoint) -> mat3x3<f32> {
    let flat = mat3x3(vec3(0.0), vec3(0.0), vec3(0.0));
    if (point.primitive & SPHERE_BIT) != 0u {
        let normal = point.geometric_normal;
        let identity = mat3x3(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0));
        return (identity - outer(normal, normal)) * (1.0 / bodies[point.body].radius);
    }
    let sum = interpolated_normal(point.primitive, point.u, point.v);
    if all(sum == vec3(0.0)) {
        return flat;
    }
    let triangle = corners_of(point.primitive);
    let across = normal_and_area(triangle);
    let per_area = 0.5 / across.w;
    let u_gradient = cross(triangle.c - triangle.a, across.xyz) * per_area;
    let v_gradient = cross(across.xyz, triangle.b - triangle.a) * per_area;
    let length = length_of(sum);
    let normal = sum * (1.0 / length);
    let corners = triangles[point.primitive];
    let first = vertex_normal(corners.a);
    let dn_u = vertex_normal(corners.b) - first;
    let dn_v = vertex_normal(corners.c) - first;
    let per_u = (dn_u - dot(normal, dn_u) * normal) / length;
    let per_v = (dn_v - dot(normal, dn_v) * normal) / length;
    let derivative = outer(per_u, u_gradient) + outer(per_v, v_gradient);
    if !(all_finite(derivative[0]) && all_finite(derivative[1]) && all_finite(derivative[2])) {
        return flat;
    }
    return derivative * select(1.0, -1.0, dot(normal, point.geometric_normal) < 0.0);
}

struct PointOn {
    spawn: SpawnPoint,
    normal: vec3<f32>,
    is_valid: bool,
}

// The point of a primitive at a sample of the unit square.
fn point_on(primitive: u32, along: f32, across: f32) -> PointOn {
    if (primitive & SPHERE_BIT) != 0u {
        let body = primitive ^ SPHERE_BIT;
        let height = 1.0 - 2.0 * along;
        let ring = sqrt(max(1.0 - height * height, 0.0));
        let angle = sine_cosine(2.0 * PI * across);
        let normal = vec3(ring * angle.y, height, ring * angle.x);
        let center = bodies[body].center;
        let radius = bodies[body].radius;
        let spawn = spawn_on_sphere(center, radius, center + radius * normal);
        return PointOn(spawn, normal, true);
    }
    let triangle = corners_of(primitive);
    let normal = normalized_or_zero(cross(triangle.b - triangle.a, triangle.c - triangle.a));
    let root = sqrt(clamp(along, 0.0, 1.0));
    let spawn = spawn_on_triangle(
        triangle.a, triangle.b, triangle.c, root * (1.0 - across), root * across);
    return PointOn(spawn, normal, any(normal != vec3(0.0)));
}
