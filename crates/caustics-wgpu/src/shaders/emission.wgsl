// A photon as it leaves its light. Twins: emission.rs and area_emission.rs in caustics-trace.

// How wide a photon's share is taken of a four-dimensional cell. Twin: `NARROWING`.
const NARROWING: f32 = 0.2;

// Below it a cone's height is too small for f32. Twin: `LEAST_HEIGHT` in cone.rs.
const LEAST_HEIGHT: f32 = 1e-30;

struct Emission {
    ray: Ray,
    flux: vec3<f32>,
    differential: Differential,
    // False for a sample that stands for no light.
    is_valid: bool,
}

fn emit(emitter: u32, index: u32) -> Emission {
    let sample = emission_sample(index, emitter);
    let kind = trace.emitters[emitter].kind;
    if kind == EMITTER_AREA {
        return emit_from_area(emitter, sample);
    }
    if kind == EMITTER_RECTANGLE {
        return emit_from_rectangle(emitter, sample);
    }
    return emit_from_point(emitter, sample);
}

fn emit_from_point(emitter: u32, sample: EmissionSample) -> Emission {
    var warped: DirectionSample;
    if trace.emitters[emitter].kind == EMITTER_SPHERE {
        warped = square_to_sphere_octahedral(sample.point);
    } else {
        let local = square_to_cone(sample.point, trace.emitters[emitter].height);
        let tangents = Tangents(trace.emitters[emitter].tangent, trace.emitters[emitter].bitangent);
        let axis = trace.emitters[emitter].axis;
        warped.value = from_frame(tangents, axis, local.value);
        warped.d_du = from_frame(tangents, axis, local.d_du);
        warped.d_dv = from_frame(tangents, axis, local.d_dv);
    }
    var emission: Emission;
    emission.ray = Ray(trace.emitters[emitter].origin, normalized(warped.value));
    // The spot light's falloff; 1 for a point light, whose cones are wider than all directions.
    let inner = trace.emitters[emitter].inner_cosine;
    let outer_cosine = trace.emitters[emitter].outer_cosine;
    let cosine = dot(trace.emitters[emitter].spot_axis, emission.ray.direction);
    let falloff = clamp((cosine - outer_cosine) / (inner - outer_cosine), 0.0, 1.0);
    let solid_angle = trace.emitters[emitter].solid_angle * trace.emitters[emitter].share;
    emission.flux = trace.emitters[emitter].intensity * (falloff * falloff) * solid_angle;
    emission.is_valid = any(emission.flux != vec3(0.0));
    for (var i = 0u; i < 2u; i++) {
        let edge = sample.spacing[i];
        emission.differential.direction[i] = edge.x * warped.d_du + edge.y * warped.d_dv;
    }
    return emission;
}

fn emit_from_rectangle(emitter: u32, sample: EmissionSample) -> Emission {
    let along = trace.emitters[emitter].tangent;
    let across = trace.emitters[emitter].bitangent;
    let corner = trace.emitters[emitter].origin;
    var emission: Emission;
    emission.ray = Ray(
        corner + sample.point.x * along + sample.point.y * across,
        trace.emitters[emitter].axis,
    );
    let area = trace.emitters[emitter].area * trace.emitters[emitter].share;
    emission.flux = trace.emitters[emitter].intensity * area;
    emission.is_valid = true;
    for (var i = 0u; i < 2u; i++) {
        let edge = sample.spacing[i];
        emission.differential.position[i] = edge.x * along + edge.y * across;
    }
    return emission;
}

struct AreaPlace {
    primitive: u32,
    along: f32,
}

// The primitive that a number falls on when they lie side by side. Twin: `AreaLight::choose`.
fn choose_primitive(emitter: u32, number: f32) -> AreaPlace {
    let first = trace.emitters[emitter].first_cumulative;
    var low = 0u;
    var high = trace.emitters[emitter].primitive_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if cumulative_areas[first + middle] <= number {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var start = 0.0;
    if low > 0u {
        start = cumulative_areas[first + low - 1u];
    }
    let along = (number - start) / (cumulative_areas[first + low] - start);
    return AreaPlace(trace.emitters[emitter].first_primitive + low, min(along, BELOW_ONE));
}

fn emit_from_area(emitter: u32, sample: EmissionSample) -> Emission {
    var emission: Emission;
    let place = choose_primitive(emitter, sample.place.x);
    let point = point_on(place.primitive, place.along, sample.place.y);
    if !point.is_valid {
        return emission;
    }
    let origin = point.spawn.position;
    let normal = trace.emitters[emitter].side * point.normal;

    // A direction, and the reciprocal of its density.
    var direction: vec3<f32>;
    var solid_angle: f32;
    let radius = trace.emitters[emitter].target_radius;
    let to_target = trace.emitters[emitter].target_center - origin;
    let distance = length_of(to_target);
    var height = 0.0;
    if radius > 0.0 && distance > radius {
        let sine = radius / distance;
        height = sine * sine / (1.0 + sqrt(max(1.0 - sine * sine, 0.0)));
    }
    if height >= LEAST_HEIGHT {
        let axis = to_target / distance;
        let local = square_to_cone(sample.point, height).value;
        direction = normalized(from_frame(tangents_of(axis), axis, local));
        solid_angle = 2.0 * PI * height;
    } else {
        let disc = square_to_disc_concentric(sample.point).value;
        let cosine = sqrt(max(1.0 - dot(disc, disc), 0.0));
        if cosine == 0.0 {
            return emission;
        }
        direction = normalized(from_frame(tangents_of(normal), normal, vec3(disc, cosine)));
        solid_angle = PI / cosine;
    }
    let cosine = dot(direction, normal);
    if cosine <= 0.0 {
        return emission;
    }

    // Of the four-dimensional domain each photon has one share: as if from so many places on the
    // light, each with so many directions.
    let area = trace.emitters[emitter].area;
    let share = trace.emitters[emitter].share;
    let reach = select(0.0, distance, radius > 0.0);
    let across_target = solid_angle * reach * reach * share;
    var places = 1.0 / sqrt(share);
    if across_target > 0.0 {
        places = sqrt(area / across_target);
    }
    places = clamp(places, 1.0, 1.0 / share);
    let length = NARROWING * sqrt(area / places);
    let angle = NARROWING * sqrt(solid_angle * places * share);

    emission.ray = Ray(origin_towards(point.spawn, normal, direction), direction);
    emission.flux = trace.emitters[emitter].intensity * (cosine * solid_angle * area * share);
    emission.is_valid = true;
    if PARAMETERS == 4u {
        let turns = tangents_of(direction);
        let moves = tangents_of(normal);
        emission.differential.direction[0] = angle * turns.first;
        emission.differential.direction[1] = angle * turns.second;
        emission.differential.position[PARAMETERS - 2u] = length * moves.first;
        emission.differential.position[PARAMETERS - 1u] = length * moves.second;
    }
    return emission;
}
