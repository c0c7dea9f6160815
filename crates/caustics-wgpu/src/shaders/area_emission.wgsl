// Photons from surfaces that shine. Twin: area_emission.rs in caustics-trace.

// Below it a cone's height is too small for f32. Twin: `LEAST_HEIGHT` in cone.rs.
const LEAST_HEIGHT: f32 = 1e-30;

// A place on a surface.
struct AreaPlace {
    spawn: SpawnPoint,
    // The unit normal of the side that shines.
    normal: vec3<f32>,
    // How it moves with the sample, where that is known.
    d_du: vec3<f32>,
    d_dv: vec3<f32>,
    has_derivatives: bool,
    is_valid: bool,
}

// A place, or a step, along two edges.
fn on_edges(edges: Tangents, along: vec2<f32>) -> vec3<f32> {
    return along.x * edges.first + along.y * edges.second;
}

// The place of a sample. Twins: `AreaSurface::place`, `AreaLight::choose`.
fn area_place(emitter: u32, sample: vec2<f32>) -> AreaPlace {
    var place: AreaPlace;
    place.is_valid = true;
    place.has_derivatives = true;
    place.normal = trace.emitters[emitter].axis;
    let origin = trace.emitters[emitter].origin;
    let tangents = Tangents(trace.emitters[emitter].tangent, trace.emitters[emitter].bitangent);
    let radius = trace.emitters[emitter].radius;
    let surface = trace.emitters[emitter].surface;
    if surface == SURFACE_RECTANGLE {
        place.spawn.position = origin + sample.x * tangents.first + sample.y * tangents.second;
        place.d_du = tangents.first;
        place.d_dv = tangents.second;
    } else if surface == SURFACE_TRIANGLE {
        let local = square_to_barycentric(sample);
        place.spawn.position = origin + rounded_vector(on_edges(tangents, local.value));
        place.d_du = on_edges(tangents, local.d_du);
        place.d_dv = on_edges(tangents, local.d_dv);
    } else if surface == SURFACE_DISC {
        let local = square_to_disc_concentric(sample);
        let normal = place.normal;
        // Rounded, or compilers sum and multiply in another order.
        let across = vec3(rounded(radius * local.value.x), rounded(radius * local.value.y), 0.0);
        place.spawn.position = origin + rounded_vector(from_frame(tangents, normal, across));
        place.d_du = from_frame(tangents, normal, vec3(radius * local.d_du, 0.0));
        place.d_dv = from_frame(tangents, normal, vec3(radius * local.d_dv, 0.0));
    } else if surface == SURFACE_CAP {
        let local = square_to_cone(sample, trace.emitters[emitter].height);
        let warped = sample_from_frame(tangents, place.normal, local);
        place.spawn.position = origin + radius * warped.value;
        place.normal = normalized(warped.value);
        place.d_du = radius * warped.d_du;
        place.d_dv = radius * warped.d_dv;
    } else {
        // The primitive that a number falls on when they lie side by side.
        let first = trace.emitters[emitter].first_cumulative;
        var low = 0u;
        var high = trace.emitters[emitter].primitive_count - 1u;
        while low < high {
            let middle = (low + high) / 2u;
            if bitcast<f32>(emission_lists[first + middle]) <= sample.x {
                low = middle + 1u;
            } else {
                high = middle;
            }
        }
        var start = 0.0;
        if low > 0u {
            start = bitcast<f32>(emission_lists[first + low - 1u]);
        }
        let end = bitcast<f32>(emission_lists[first + low]);
        let along = min((sample.x - start) / (end - start), BELOW_ONE);
        let primitive = trace.emitters[emitter].first_primitive + low;
        let point = point_on(primitive, along, sample.y);
        place.spawn = point.spawn;
        place.normal = trace.emitters[emitter].side * point.normal;
        place.has_derivatives = false;
        place.is_valid = point.is_valid;
    }
    return place;
}

// The height of the cone of directions from a point that just holds the target; 0 from inside, and
// without a target.
fn target_height(emitter: u32, distance: f32) -> f32 {
    let radius = trace.emitters[emitter].target_radius;
    if radius > 0.0 && distance > radius {
        let sine = radius / distance;
        let height = sine * sine / (1.0 + sqrt(max(1.0 - sine * sine, 0.0)));
        return select(0.0, height, height >= LEAST_HEIGHT);
    }
    return 0.0;
}

fn emit_from_area(emitter: u32, sample: EmissionSample) -> Emission {
    var emission: Emission;
    let place = area_place(emitter, sample.place);
    if !place.is_valid {
        return emission;
    }
    let normal = place.normal;

    // A direction, and the reciprocal of its density.
    var warped: DirectionSample;
    var solid_angle: f32;
    let to_target = trace.emitters[emitter].target_center - place.spawn.position;
    let distance = length_of(to_target);
    let height = target_height(emitter, distance);
    if height > 0.0 {
        let axis = to_target / distance;
        warped = sample_from_frame(tangents_of(axis), axis, square_to_cone(sample.point, height));
        solid_angle = 2.0 * PI * height;
    } else {
        let local = square_to_cosine_hemisphere(sample.point);
        if local.value.z == 0.0 {
            return emission;
        }
        warped = sample_from_frame(tangents_of(normal), normal, local);
        solid_angle = PI / local.value.z;
    }
    let direction = normalized(warped.value);
    let cosine = dot(direction, normal);
    if cosine <= 0.0 {
        return emission;
    }

    let area = trace.emitters[emitter].area;
    let share = share_of(emitter, sample);
    let step = sqrt(share);

    emission.ray = Ray(origin_towards(place.spawn, normal, direction), direction);
    emission.flux = trace.emitters[emitter].intensity * (cosine * solid_angle * area * share);
    emission.is_valid = true;
    if PARAMETERS == 4u {
        if place.has_derivatives {
            emission.differential.direction[0] = step * warped.d_du;
            emission.differential.direction[1] = step * warped.d_dv;
            emission.differential.position[PARAMETERS - 2u] = BLUR_EDGE * place.d_du;
            emission.differential.position[PARAMETERS - 1u] = BLUR_EDGE * place.d_dv;
        } else {
            // The places of an object jump from triangle to triangle: as wide a square instead.
            let turns = tangents_of(direction);
            let moves = tangents_of(normal);
            let length = BLUR_EDGE * sqrt(area);
            let angle = step * sqrt(solid_angle);
            emission.differential.direction[0] = angle * turns.first;
            emission.differential.direction[1] = angle * turns.second;
            emission.differential.position[PARAMETERS - 2u] = length * moves.first;
            emission.differential.position[PARAMETERS - 1u] = length * moves.second;
        }
    }
    return emission;
}
