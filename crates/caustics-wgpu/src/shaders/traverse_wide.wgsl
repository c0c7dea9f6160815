// The loop over nodes of the hierarchy of four children a node, whose boxes are quantised after
// Ylitie, Karras and Laine 2017. `Hierarchy` in tracer_shaders.rs says what other forms cost.

struct Children {
    // Where the ray enters each, or `FAR` where it passes by or enters beyond the limit.
    enters: vec4<f32>,
    nodes: vec4<u32>,
}

fn unpacked(bytes: u32) -> vec4<f32> {
    return vec4<f32>((vec4(bytes) >> vec4(0u, 8u, 16u, 24u)) & vec4(255u));
}

fn wide_scale(exponents: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(((vec3(exponents) >> vec3(0u, 8u, 16u)) & vec3(255u)) << vec3(23u));
}

fn enter_children(node: u32, origin: vec3<f32>, inverse: vec3<f32>, limit: f32) -> Children {
    let start = (wide_nodes[node].origin - origin) * inverse;
    let step = wide_scale(wide_nodes[node].exponents) * inverse;
    let low = wide_nodes[node].low;
    let high = wide_nodes[node].high;
    let is_backward = inverse < vec3(0.0);
    let nearer = select(low, high, is_backward);
    let farther = select(high, low, is_backward);
    let near_x = unpacked(nearer.x) * step.x + start.x;
    let near_y = unpacked(nearer.y) * step.y + start.y;
    let near_z = unpacked(nearer.z) * step.z + start.z;
    let far_x = unpacked(farther.x) * step.x + start.x;
    let far_y = unpacked(farther.y) * step.y + start.y;
    let far_z = unpacked(farther.z) * step.z + start.z;
    let near = max(max(near_x, near_y), max(near_z, vec4(0.0)));
    let far = min(min(far_x, min(far_y, far_z)) * WIDEN, vec4(limit));
    let children = wide_nodes[node].children;
    let is_met = (near <= far) & (children != vec4(NO_PRIMITIVE));
    return Children(select(vec4(FAR), near, is_met), children);
}

// By where they are entered.
fn sorted(given: Children) -> Children {
    var enters = given.enters;
    var nodes = given.nodes;
    // The lesser of the first two and the last two pairs, then of the pairs' lesser and greater.
    var swaps = enters.xz > enters.yw;
    enters = vec4(
        min(enters.x, enters.y), max(enters.x, enters.y),
        min(enters.z, enters.w), max(enters.z, enters.w));
    nodes = vec4(select(nodes.xy, nodes.yx, swaps.x), select(nodes.zw, nodes.wz, swaps.y));
    swaps = enters.xy > enters.zw;
    enters = vec4(min(enters.xy, enters.zw), max(enters.xy, enters.zw));
    nodes = vec4(select(nodes.xy, nodes.zw, swaps), select(nodes.zw, nodes.xy, swaps));
    let swaps_middle = enters.y > enters.z;
    return Children(
        select(enters, enters.xzyw, swaps_middle), select(nodes, nodes.xzyw, swaps_middle));
}

fn traverse(ray: Ray, sheared_by: ShearedRay, inverse: vec3<f32>, left: ptr<function, Traversal>) -> u32 {
    var apart = NO_PRIMITIVE;
    while (*left).current != NO_PRIMITIVE && apart == NO_PRIMITIVE {
        while ((*left).current & LEAF_BIT) == 0u {
            let met = sorted(enter_children(
                (*left).current, ray.origin, inverse, (*left).closest.t * WIDEN));
            var next = select(NO_PRIMITIVE, met.nodes.x, met.enters.x < FAR);
            // The nearest last.
            if met.enters.w < FAR {
                let_wait(left, met.nodes.w);
            }
            if met.enters.z < FAR {
                let_wait(left, met.nodes.z);
            }
            if met.enters.y < FAR {
                let_wait(left, met.nodes.y);
            }
            if next == NO_PRIMITIVE {
                next = next_waiting(left);
            }
            (*left).current = next;
        }
        if (*left).current != NO_PRIMITIVE {
            let primitive = (*left).current ^ LEAF_BIT;
            let found = test_leaf(sheared_by, primitive);
            apart = select(NO_PRIMITIVE, primitive, found.t == DOUBTFUL);
            (*left).closest = closer_hit(found, (*left).closest);
            (*left).current = next_waiting(left);
        }
    }
    return apart;
}
