// The closest hit of a ray in the binary hierarchy. Twins: `Intersect::closest_hit` of
// `SceneIntersector` and `TriangleBvh`, which give the same hits.

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
    let inverse = inverse_direction(ray.direction);
    var waiting: array<u32, MAX_WAITING>;
    var waiting_count = 0u;
    var current = trace.root;
    while current != NO_PRIMITIVE {
        var apart = NO_PRIMITIVE;
        while current != NO_PRIMITIVE && apart == NO_PRIMITIVE {
            let first = nodes[current].first;
            var next = NO_PRIMITIVE;
            if nodes[current].is_leaf != 0u {
                let found = test_leaf(sheared_by, first);
                apart = select(NO_PRIMITIVE, first, found.t == DOUBTFUL);
                closest = closer_hit(found, closest);
            } else {
                let limit = closest.t * WIDEN;
                let left = enter_box(nodes[first].low, nodes[first].high, ray.origin, inverse, limit);
                let right = enter_box(
                    nodes[first + 1u].low, nodes[first + 1u].high, ray.origin, inverse, limit);
                let left_first = left <= right;
                if min(left, right) < FAR {
                    next = first + select(1u, 0u, left_first);
                }
                if max(left, right) < FAR {
                    waiting[waiting_count] = first + select(0u, 1u, left_first);
                    waiting_count += 1u;
                }
            }
            if next == NO_PRIMITIVE && waiting_count > 0u {
                waiting_count -= 1u;
                next = waiting[waiting_count];
            }
            current = next;
        }
        if apart != NO_PRIMITIVE {
            closest = closer_hit(test_apart(ray, sheared_by, apart), closest);
        }
    }
    return closest;
}
