// Snell, Fresnel, Schlick, Beer and Lambert. Twin: optics.rs in caustics-trace.

fn reflection_of(direction: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    return direction - 2.0 * dot(direction, normal) * normal;
}

// Not above 0 on total reflection.
fn transmitted_cosine_squared(cosine: f32, eta: f32) -> f32 {
    return min((1.0 - eta) * (1.0 + eta) + (eta * cosine) * (eta * cosine), 1.0);
}

// The zero vector on total reflection.
fn refraction_of(direction: vec3<f32>, normal: vec3<f32>, eta: f32) -> vec3<f32> {
    let cosine = -dot(direction, normal);
    let squared = transmitted_cosine_squared(cosine, eta);
    if squared <= 0.0 {
        return vec3(0.0);
    }
    return normalized_or_zero(eta * direction + (eta * cosine - sqrt(squared)) * normal);
}

fn fresnel_dielectric(cosine_given: f32, eta: f32) -> f32 {
    let cosine = clamp(cosine_given, 0.0, 1.0);
    let squared = transmitted_cosine_squared(cosine, eta);
    if squared <= 0.0 {
        return 1.0;
    }
    let transmitted = sqrt(squared);
    let perpendicular = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let parallel = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    return 0.5 * (perpendicular * perpendicular + parallel * parallel);
}

fn fresnel_schlick(cosine: f32, normal_reflectance: vec3<f32>) -> vec3<f32> {
    let grazing = 1.0 - clamp(cosine, 0.0, 1.0);
    let squared = grazing * grazing;
    return normal_reflectance + (vec3(1.0) - normal_reflectance) * (squared * squared * grazing);
}

fn beer_lambert(attenuation: vec3<f32>, distance: f32) -> vec3<f32> {
    return exp(-attenuation * distance);
}
