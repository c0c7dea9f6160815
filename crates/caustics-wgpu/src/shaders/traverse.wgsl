// The loop over nodes of the binary hierarchy.

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

fn traverse(ray: Ray, sheared_by: ShearedRay, inverse: vec3<f32>, left: ptr<function, Traversal>) -> u32 {
    var apart = NO_PRIMITIVE;
    while (*left).current != NO_PRIMITIVE && apart == NO_PRIMITIVE {
        let current = (*left).current;
        let first = nodes[current].first;
        var next = NO_PRIMITIVE;
        if nodes[current].is_leaf != 0u {
            let found = test_leaf(sheared_by, first);
            apart = select(NO_PRIMITIVE, first, found.t == DOUBTFUL);
            (*left).closest = closer_hit(found, (*left).closest);
        } else {
            let limit = (*left).closest.t * WIDEN;
            let one = enter_box(nodes[first].low, nodes[first].high, ray.origin, inverse, limit);
            let other = enter_box(
                nodes[first + 1u].low, nodes[first + 1u].high, ray.origin, inverse, limit);
            let one_first = one <= other;
            if min(one, other) < FAR {
                next = first + select(1u, 0u, one_first);
            }
            if max(one, other) < FAR {
                let_wait(left, first + select(0u, 1u, one_first));
            }
        }
        if next == NO_PRIMITIVE {
            next = next_waiting(left);
        }
        (*left).current = next;
    }
    return apart;
}
