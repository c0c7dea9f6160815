// Footprints reflected where their receivers end. Twin: boundary.rs in caustics-trace.

const BOUNDARY_REACH: f32 = 1.65;
const BOUNDARY_IN_PLANE: f32 = 0.05;
const BOUNDARY_PROBE: f32 = 0.02;
const BOUNDARY_LEAST_PROBE: f32 = 1e-5;
const BOUNDARY_APART_COSINE: f32 = 0.5;
const MOST_BOUNDARIES: u32 = 4u;

// Where `emission_lists` have no boundaries.
const NO_BOUNDARIES: u32 = 0xffffffffu;

// Words of the start and the end of an edge.
const BOUNDARY_WORDS: u32 = 6u;

// Where a footprint is reflected: a point, and the unit direction outwards in the footprint's plane.
struct Mirror {
    foot: vec3<f32>,
    outwards: vec3<f32>,
    is_valid: bool,
}

fn listed_point(place: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(vec3(
        emission_lists[place], emission_lists[place + 1u], emission_lists[place + 2u]));
}

// How far a footprint reaches in a direction of its plane.
fn reach_along(record: FootprintRecord, direction: vec3<f32>) -> f32 {
    let a = dot(record.axis_u, direction);
    let b = dot(record.axis_v, direction);
    return BOUNDARY_REACH * sqrt(a * a + b * b);
}

fn mirror_of(record: FootprintRecord, start: vec3<f32>, end: vec3<f32>) -> Mirror {
    let none = Mirror(vec3(0.0), vec3(0.0), false);
    let edge = end - start;
    let length = length_of(edge);
    let along = (1.0 / length) * edge;
    let normal = record.normal;
    let way = dot(along, record.position - start);
    if !(way >= 0.0 && way < length) || abs(dot(along, normal)) > BOUNDARY_IN_PLANE {
        return none;
    }
    let to_edge = start + way * along - record.position;
    let height = dot(to_edge, normal);
    let across = to_edge - height * normal;
    let distance = length_of(across);
    let outwards = (1.0 / distance) * across;
    let reach = reach_along(record, outwards);
    if !(distance < reach && abs(height) < BOUNDARY_IN_PLANE * reach) {
        return none;
    }
    return Mirror(record.position + across, outwards, true);
}

// Whether nothing goes on behind it.
fn is_open(record: FootprintRecord, mirror: Mirror) -> bool {
    let step = BOUNDARY_PROBE * reach_along(record, mirror.outwards);
    if step < BOUNDARY_LEAST_PROBE * largest(abs(mirror.foot)) {
        return false;
    }
    var is_free = true;
    for (var probe = 0u; probe < 2u && is_free; probe++) {
        let side = select(1.0, -1.0, probe == 0u);
        let direction = select(-record.normal, mirror.outwards, probe == 0u);
        let origin = mirror.foot + step * (record.normal + side * mirror.outwards);
        let hit = closest_hit(Ray(origin, direction));
        is_free = hit.primitive == NO_PRIMITIVE || hit.t >= 2.0 * step;
    }
    return is_free;
}

fn mirrored(way: vec3<f32>, mirror: Mirror) -> vec3<f32> {
    return way - 2.0 * dot(way, mirror.outwards) * mirror.outwards;
}

fn image(record: FootprintRecord, mirror: Mirror) -> FootprintRecord {
    var its = record;
    its.position = mirror.foot + mirrored(record.position - mirror.foot, mirror);
    its.axis_u = mirrored(record.axis_u, mirror);
    its.axis_v = mirrored(record.axis_v, mirror);
    return its;
}

// Stores the images of a footprint behind the boundaries that it reaches.
fn reflect_at_boundaries(record: FootprintRecord, branch: Branch, path: u32, object: u32) {
    if trace.first_boundary == NO_BOUNDARIES {
        return;
    }
    let first = emission_lists[trace.first_boundary + object];
    let end = emission_lists[trace.first_boundary + object + 1u];
    var mirrors: array<Mirror, MOST_BOUNDARIES>;
    var count = 0u;
    for (var place = first; place < end && count < MOST_BOUNDARIES; place += BOUNDARY_WORDS) {
        let mirror = mirror_of(record, listed_point(place), listed_point(place + 3u));
        var is_apart = mirror.is_valid;
        for (var other = 0u; other < count; other++) {
            is_apart = is_apart
                && dot(mirrors[other].outwards, mirror.outwards) < BOUNDARY_APART_COSINE;
        }
        if is_apart && is_open(record, mirror) {
            mirrors[count] = mirror;
            count += 1u;
        }
    }
    // In a corner each image of one side has one of the other.
    for (var number = 1u; number < (1u << count); number++) {
        var its = record;
        for (var side = 0u; side < count; side++) {
            if (number & (1u << side)) != 0u {
                its = image(its, mirrors[side]);
            }
        }
        store_photon(its, branch, path);
    }
}
