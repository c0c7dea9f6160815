// Directions that two emitters of one light cover, whose light counts once. Twins:
// `PathTracer::is_overlap` in tracer.rs, `EmissionBatch::covers` in plan.rs and
// `EmissionDomain::covers` in domain.rs of caustics-trace.

const FLOAT_EPSILON: f32 = 1.1920929e-7;

// Cells along each side of a projection map. Twin: `ProjectionMap::RESOLUTION`.
const MAP_RESOLUTION: u32 = 128u;

fn map_contains(first: u32, point: vec2<f32>) -> bool {
    let cell = min(vec2<u32>(max(point * f32(MAP_RESOLUTION), vec2(0.0))), vec2(MAP_RESOLUTION - 1u));
    let index = cell.y * MAP_RESOLUTION + cell.x;
    return ((emission_lists[first + index / 32u] >> (index % 32u)) & 1u) == 1u;
}

fn in_frame(tangents: Tangents, normal: vec3<f32>, world: vec3<f32>) -> vec3<f32> {
    return vec3(dot(world, tangents.first), dot(world, tangents.second), dot(world, normal));
}

fn in_cone(cosine_along: f32, height: f32) -> bool {
    return cosine_along >= (1.0 - height) - FLOAT_EPSILON;
}

// Whether a ray of the same light is one of the emitter's, within rounding.
fn emitter_covers(emitter: u32, ray: Ray) -> bool {
    let kind = trace.emitters[emitter].kind;
    let axis = trace.emitters[emitter].axis;
    let height = trace.emitters[emitter].height;
    let tangents = Tangents(trace.emitters[emitter].tangent, trace.emitters[emitter].bitangent);
    if kind == EMITTER_AREA {
        let surface = trace.emitters[emitter].surface;
        let outward = normalized_or_zero(ray.origin - trace.emitters[emitter].origin);
        if surface == SURFACE_CAP && !in_cone(dot(outward, axis), height) {
            return false;
        }
        let to_target = trace.emitters[emitter].target_center - ray.origin;
        let distance = length_of(to_target);
        let cone = target_height(emitter, distance);
        return cone == 0.0 || in_cone(dot(ray.direction, to_target / distance), cone);
    }
    if kind == EMITTER_SKY {
        let across = cross(trace.emitters[emitter].target_center - ray.origin, ray.direction);
        return length_of(across) <= trace.emitters[emitter].target_radius;
    }
    var point: vec2<f32>;
    if kind == EMITTER_RECTANGLE {
        let from_corner = ray.origin - trace.emitters[emitter].origin;
        point = vec2(
            dot(from_corner, tangents.first) / dot(tangents.first, tangents.first),
            dot(from_corner, tangents.second) / dot(tangents.second, tangents.second),
        );
        if any(point < vec2(0.0)) || any(point > vec2(1.0)) {
            return false;
        }
    } else if kind == EMITTER_CONE {
        let local = in_frame(tangents, axis, ray.direction);
        if !in_cone(local.z, height) {
            return false;
        }
        point = cone_to_square(local, height);
    } else {
        point = sphere_octahedral_to_square(ray.direction);
    }
    let map = trace.emitters[emitter].first_map;
    return map == NO_MAP || map_contains(map, point);
}

// Whether an earlier emitter of the same light covers an emitted ray too.
fn is_covered(emitter: u32, ray: Ray) -> bool {
    if trace.emitters[emitter].caster == NO_CASTER {
        return false;
    }
    for (var earlier = trace.emitters[emitter].first_of_light; earlier < emitter; earlier++) {
        if emitter_covers(earlier, ray) {
            return true;
        }
    }
    return false;
}

// Whether another emitter of the same light stands for an emitted ray that first meets this body, or
// `NO_BODY`; `covered` is what `is_covered` says of it.
fn is_overlap(emitter: u32, covered: bool, body: u32) -> bool {
    let caster = trace.emitters[emitter].caster;
    if caster == NO_CASTER {
        return false;
    }
    if body != NO_BODY && bodies[body].caster != NO_CASTER {
        return bodies[body].caster != caster;
    }
    return covered;
}
