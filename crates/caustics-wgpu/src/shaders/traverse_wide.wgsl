// The closest hit of a ray in the hierarchy of four children a node, whose boxes are quantised after
// Ylitie, Karras and Laine 2017. Twins: as of traverse.wgsl. `Hierarchy` in tracer_shaders.rs says what
// other forms cost.

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
            while (current & LEAF_BIT) == 0u {
                var next = NO_PRIMITIVE;
                let met = sorted(
                    enter_children(current, ray.origin, inverse, closest.t * WIDEN));
                next = select(NO_PRIMITIVE, met.nodes.x, met.enters.x < FAR);
                // The nearest last.
                if met.enters.w < FAR {
                    waiting[waiting_count] = met.nodes.w;
                    waiting_count += 1u;
                }
                if met.enters.z < FAR {
                    waiting[waiting_count] = met.nodes.z;
                    waiting_count += 1u;
                }
                if met.enters.y < FAR {
                    waiting[waiting_count] = met.nodes.y;
                    waiting_count += 1u;
                }
                if next == NO_PRIMITIVE && waiting_count > 0u {
                    waiting_count -= 1u;
                    next = waiting[waiting_count];
                }
                current = next;
            }
            if current != NO_PRIMITIVE {
                let primitive = current ^ LEAF_BIT;
                let found = test_leaf(sheared_by, primitive);
                apart = select(NO_PRIMITIVE, primitive, found.t == DOUBTFUL);
                closest = closer_hit(found, closest);
                current = NO_PRIMITIVE;
                if waiting_count > 0u {
                    waiting_count -= 1u;
                    current = waiting[waiting_count];
                }
            }
        }
        if apart != NO_PRIMITIVE {
            closest = closer_hit(test_apart(ray, sheared_by, apart), closest);
        }
    }
    return closest;
}
