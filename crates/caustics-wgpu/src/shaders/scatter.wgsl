// What leaves a specular surface. Twin: scatter.rs in caustics-trace.

const EVENT_REFLECTION: u32 = 0u;
const EVENT_REFRACTION: u32 = 1u;
const EVENT_PASSAGE: u32 = 2u;

struct Outgoing {
    event: u32,
    direction: vec3<f32>,
    // The part of the light that goes this way.
    weight: vec3<f32>,
    // The unit normal that served, on the side from which the light came.
    normal: vec3<f32>,
    eta: f32,
    media: MediumStack,
}

struct Scattering {
    outgoing: array<Outgoing, 2>,
    // How many of them there are, the reflected one first.
    count: u32,
    absorbed: vec3<f32>,
    fallbacks: u32,
}

// The two normals on the side from which the light comes.
struct Normals {
    geometric: vec3<f32>,
    serving: vec3<f32>,
    interpolated: bool,
}

struct Served {
    direction: vec3<f32>,
    normal: vec3<f32>,
    interpolated: bool,
}

fn serve_reflection(normals: Normals, direction: vec3<f32>) -> Served {
    let by_serving = reflection_of(direction, normals.serving);
    if !normals.interpolated || dot(by_serving, normals.geometric) > 0.0 {
        return Served(normalized_or_zero(by_serving), normals.serving, normals.interpolated);
    }
    let by_geometric = reflection_of(direction, normals.geometric);
    return Served(normalized_or_zero(by_geometric), normals.geometric, false);
}

// The zero vector on total reflection.
fn serve_refraction(normals: Normals, direction: vec3<f32>, eta: f32) -> Served {
    let by_serving = refraction_of(direction, normals.serving, eta);
    let is_total = all(by_serving == vec3(0.0));
    if !is_total && normals.interpolated && dot(by_serving, normals.geometric) >= 0.0 {
        let by_geometric = refraction_of(direction, normals.geometric, eta);
        return Served(by_geometric, normals.geometric, false);
    }
    return Served(by_serving, normals.serving, normals.interpolated);
}

// `channel` is 3 for all channels together. Not for receivers.
fn scatter(point: SurfacePoint, direction: vec3<f32>, media: MediumStack, channel: u32) -> Scattering {
    var result: Scattering;
    let side = select(-1.0, 1.0, point.from_outside);
    let shading = side * point.shading_normal;
    let interpolated = dot(shading, direction) < 0.0;
    let geometric = side * point.geometric_normal;
    let normals = Normals(geometric, select(geometric, shading, interpolated), interpolated);
    let cosine = -dot(direction, normals.serving);

    var reflectance = vec3(0.0);
    if bodies[point.body].kind == BODY_METAL {
        reflectance = fresnel_schlick(cosine, bodies[point.body].color);
        result.absorbed = vec3(1.0) - reflectance;
    } else {
        let crossing = cross_boundary(media, point.body, point.from_outside, channel);
        if !crossing.is_interface {
            result.outgoing[0] = Outgoing(
                EVENT_PASSAGE, direction, vec3(1.0), geometric, 1.0, crossing.beyond);
            result.count = 1u;
            return result;
        }
        let eta = crossing.index_from / crossing.index_to;
        let through = serve_refraction(normals, direction, eta);
        if all(through.direction == vec3(0.0)) {
            // Where the serving normal is the geometric one, the reflection below counts it.
            result.fallbacks += select(0u, 1u, normals.interpolated && !through.interpolated);
            reflectance = vec3(1.0);
        } else {
            result.fallbacks += select(1u, 0u, through.interpolated);
            reflectance = vec3(fresnel_dielectric(cosine, eta));
            // Second, after the reflected one if there is that.
            result.count = select(0u, 1u, reflectance.x > 0.0);
            result.outgoing[result.count] = Outgoing(
                EVENT_REFRACTION,
                through.direction,
                vec3(1.0) - reflectance,
                through.normal,
                eta,
                crossing.beyond,
            );
            result.count += 1u;
            if reflectance.x <= 0.0 {
                return result;
            }
        }
    }
    let mirrored = serve_reflection(normals, direction);
    result.fallbacks += select(1u, 0u, mirrored.interpolated);
    result.outgoing[0] = Outgoing(
        EVENT_REFLECTION, mirrored.direction, reflectance, mirrored.normal, 1.0, media);
    result.count = max(result.count, 1u);
    return result;
}
