// The closest hit of a ray in the binary hierarchy. Twins: `Intersect::closest_hit` of
// `SceneIntersector` and `TriangleBvh`, which give the same hits.

// Levels of the hierarchy; the builder sees to it that it has no more.
const MAX_LEVELS: u32 = 64u;

// Widens the far side of every box, so that no rounding lets a ray slip between two of them: the
// twin's factor, and what WGSL's division may be off by on top.
const WIDEN: f32 = 1.0000031;

// Components of directions are taken as at least this long. A ray in the plane of a box's side would
// otherwise have 0 times infinity there; the boxes are a little wider than what they hold, so that
// such a ray is well inside.
const SHORTEST: f32 = 1e-18;

// Where the ray enters the box, or `FAR` where it passes by or enters beyond the limit.
fn enter_box(low: vec3<f32>, high: vec3<f32>, origin: vec3<f32>, inverse: vec3<f32>, limit: f32) -> f32 {
    let one = (low - origin) * inverse;
    let other = (high - origin) * inverse;
    let enters = min(one, other);
    let leaves = max(one, other) * WIDEN;
    let near = max(max(enters.x, enters.y), max(enters.z, 0.0));
    let far = min(min(leaves.x, leaves.y), min(leaves.z, limit));
    return select(FAR, near, near <= far);
}

fn closest_hit(ray: Ray) -> Hit {
    var closest = Hit(FAR, 0.0, 0.0, NO_PRIMITIVE);
    let sheared_by = sheared_ray(ray);
    let size = max(abs(ray.direction), vec3(SHORTEST));
    let inverse = select(1.0 / size, -1.0 / size, ray.direction < vec3(0.0));
    var waiting: array<vec2<u32>, MAX_LEVELS>;
    var waiting_count = 0u;
    var current = trace.root;
    if current == NO_PRIMITIVE {
        return closest;
    }
    loop {
        let first = nodes[current].first;
        var descends = false;
        if nodes[current].is_leaf != 0u {
            if (first & SPHERE_BIT) != 0u {
                let body = first ^ SPHERE_BIT;
                let t = intersect_sphere(ray, bodies[body].center, bodies[body].radius);
                if t > 0.0 && t < closest.t {
                    closest = Hit(t, 0.0, 0.0, first);
                }
            } else {
                let triangle = triangles[first];
                let found = intersect_triangle(
                    sheared_by,
                    vertices[triangle.a].position,
                    vertices[triangle.b].position,
                    vertices[triangle.c].position,
                );
                // Of equal hits the lowest number wins.
                let is_closer = found.x < closest.t
                    || (found.x == closest.t && first < closest.primitive);
                if found.x > 0.0 && is_closer {
                    closest = Hit(found.x, found.y, found.z, first);
                }
            }
        } else {
            let limit = closest.t * WIDEN;
            let left = enter_box(nodes[first].low, nodes[first].high, ray.origin, inverse, limit);
            let right = enter_box(
                nodes[first + 1u].low, nodes[first + 1u].high, ray.origin, inverse, limit);
            if left < FAR || right < FAR {
                let left_first = left <= right;
                current = first + select(1u, 0u, left_first);
                descends = true;
                if left < FAR && right < FAR {
                    let farther = first + select(0u, 1u, left_first);
                    waiting[waiting_count] = vec2(farther, bitcast<u32>(max(left, right)));
                    waiting_count += 1u;
                }
            }
        }
        while !descends && waiting_count > 0u {
            waiting_count -= 1u;
            let next = waiting[waiting_count];
            if bitcast<f32>(next.y) <= closest.t * WIDEN {
                current = next.x;
                descends = true;
            }
        }
        if !descends {
            break;
        }
    }
    return closest;
}
