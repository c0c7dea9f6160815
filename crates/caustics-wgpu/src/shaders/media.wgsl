// The closed dielectrics that a point lies in (Schmidt and Budge 2002). Twin: media.rs in
// caustics-trace.

const MEDIA_CAPACITY: u32 = 8u;
const AIR: f32 = 1.0;
const NO_BODY: u32 = 0xffffffffu;

struct MediumStack {
    // Two bodies to a word, the first in its lower half.
    bodies: vec4<u32>,
    count: u32,
}

fn medium_at(stack: MediumStack, place: u32) -> u32 {
    return (stack.bodies[place >> 1u] >> ((place & 1u) * 16u)) & 0xffffu;
}

// The stack without the body at `place`, which is one of its.
fn media_without(stack: MediumStack, place: u32) -> MediumStack {
    var result = MediumStack(vec4(0u), stack.count - 1u);
    for (var i = 0u; i < result.count; i++) {
        let body = medium_at(stack, select(i, i + 1u, i >= place));
        result.bodies[i >> 1u] |= body << ((i & 1u) * 16u);
    }
    return result;
}

fn media_entered(stack: MediumStack, body: u32) -> MediumStack {
    var result = stack;
    if stack.count == MEDIA_CAPACITY {
        result = media_without(stack, 0u);
    }
    result.bodies[result.count >> 1u] |= body << ((result.count & 1u) * 16u);
    result.count += 1u;
    return result;
}

fn media_left(stack: MediumStack, body: u32) -> MediumStack {
    for (var place = stack.count; place > 0u; place--) {
        if medium_at(stack, place - 1u) == body {
            return media_without(stack, place - 1u);
        }
    }
    return stack;
}

// Whether body `a` is there where both are.
fn displaces(a: u32, b: u32) -> bool {
    if bodies[a].priority != bodies[b].priority {
        return bodies[a].priority > bodies[b].priority;
    }
    return bodies[a].ior > bodies[b].ior;
}

// The body that is here; `NO_BODY` in air.
fn current_medium(stack: MediumStack) -> u32 {
    var best = NO_BODY;
    for (var i = 0u; i < stack.count; i++) {
        let body = medium_at(stack, i);
        if best == NO_BODY || displaces(body, best) {
            best = body;
        }
    }
    return best;
}

// The refractive index of a body in a channel, 3 for all channels.
fn medium_index(body: u32, channel: u32) -> f32 {
    if channel < 3u {
        return bodies[body].channel_ior[channel];
    }
    return bodies[body].ior;
}

// What a path finds at the boundary of a dielectric.
struct Crossing {
    is_interface: bool,
    index_from: f32,
    index_to: f32,
    beyond: MediumStack,
}

fn cross_boundary(stack: MediumStack, body: u32, from_outside: bool, channel: u32) -> Crossing {
    var beyond: MediumStack;
    var around: MediumStack;
    if from_outside {
        beyond = media_entered(stack, body);
        around = stack;
    } else {
        beyond = media_left(stack, body);
        around = beyond;
    }
    let surrounding = current_medium(around);
    var outside = AIR;
    if surrounding != NO_BODY {
        if displaces(surrounding, body) {
            return Crossing(false, 1.0, 1.0, beyond);
        }
        outside = medium_index(surrounding, channel);
    }
    let inside = medium_index(body, channel);
    return Crossing(
        true,
        select(inside, outside, from_outside),
        select(outside, inside, from_outside),
        beyond,
    );
}
