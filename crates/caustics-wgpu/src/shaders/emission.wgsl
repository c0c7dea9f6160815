// A photon as it leaves its light. Twin: `EmissionDomain::emit` in caustics-trace.

struct Emission {
    ray: Ray,
    flux: vec3<f32>,
    differential: Differential,
    // False for a sample that stands for no light.
    is_valid: bool,
}

fn emit(emitter: u32, sample: EmissionSample) -> Emission {
    let kind = trace.emitters[emitter].kind;
    if kind == EMITTER_AREA {
        return emit_from_area(emitter, sample);
    }
    if kind == EMITTER_SKY {
        return emit_from_sky(emitter, sample);
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
        warped = sample_from_frame(tangents, axis, local);
    }
    var emission: Emission;
    emission.ray = Ray(trace.emitters[emitter].origin, normalized(warped.value));
    // The spot light's falloff; 1 for a point light, whose cones are wider than all directions.
    let inner = trace.emitters[emitter].inner_cosine;
    let outer_cosine = trace.emitters[emitter].outer_cosine;
    let cosine = dot(trace.emitters[emitter].spot_axis, emission.ray.direction);
    let falloff = clamp((cosine - outer_cosine) / (inner - outer_cosine), 0.0, 1.0);
    let solid_angle = trace.emitters[emitter].solid_angle * share_of(emitter, sample);
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
    let area = trace.emitters[emitter].area * share_of(emitter, sample);
    emission.flux = trace.emitters[emitter].intensity * area;
    emission.is_valid = true;
    for (var i = 0u; i < 2u; i++) {
        let edge = sample.spacing[i];
        emission.differential.position[i] = edge.x * along + edge.y * across;
    }
    return emission;
}
