// Maps from the unit square with their derivatives. Twins: the modules of `warp` in
// caustics-sampling.

const PI: f32 = 3.14159265;
const HALF_PI: f32 = 1.57079633;
const QUARTER_PI: f32 = 0.785398163;
const POLE_DISTANCE: f32 = 2.98023224e-8;

struct DirectionSample {
    value: vec3<f32>,
    d_du: vec3<f32>,
    d_dv: vec3<f32>,
}

struct PlaneSample {
    value: vec2<f32>,
    d_du: vec2<f32>,
    d_dv: vec2<f32>,
}

// Sine and cosine of an angle from -8 to 8, to f32's accuracy, which WGSL's own do not promise. Twin:
// sine_cosine.rs.
fn sine_cosine(angle: f32) -> vec2<f32> {
    let quarters = round(angle * 0.636619772);
    // A quarter turn in two parts, the first of few digits.
    let x = (angle - quarters * 1.5703125) - quarters * 4.838268e-4;
    let y = x * x;
    let sine_tail = -1.984127e-4 + y * 2.755732e-6;
    let sine = x + x * y * (-1.6666667e-1 + y * (8.333334e-3 + y * sine_tail));
    let cosine_tail = -1.3888889e-3 + y * (2.4801587e-5 - y * 2.755732e-7);
    let cosine = 1.0 + y * (-0.5 + y * (4.1666668e-2 + y * cosine_tail));
    switch i32(quarters) & 3 {
        case 1: { return vec2(cosine, -sine); }
        case 2: { return vec2(-sine, -cosine); }
        case 3: { return vec2(-cosine, sine); }
        default: { return vec2(sine, cosine); }
    }
}

// Twin: disc_concentric.rs.
fn square_to_disc_concentric(uv: vec2<f32>) -> PlaneSample {
    let centred = 2.0 * uv - vec2(1.0);
    let horizontal = abs(centred.x) > abs(centred.y);
    let radius = select(centred.y, centred.x, horizontal);
    let other = select(centred.x, centred.y, horizontal);
    var ratio = 0.0;
    if radius != 0.0 {
        ratio = other / radius;
    }
    let angle = sine_cosine(QUARTER_PI * ratio);
    let value = radius * angle.yx;
    let d_radius = 2.0
        * vec2(angle.y + QUARTER_PI * ratio * angle.x, angle.x - QUARTER_PI * ratio * angle.y);
    let d_other = HALF_PI * vec2(-angle.x, angle.y);
    if horizontal {
        return PlaneSample(value, d_radius, d_other);
    }
    return PlaneSample(value.yx, d_other.yx, d_radius.yx);
}

fn cone_derivative(disc: vec2<f32>, d_disc: vec2<f32>, height: f32, stretch: f32, near: f32) -> vec3<f32> {
    let d_r = 2.0 * dot(disc, d_disc);
    let d_stretch = -0.5 * height * height * d_r / near;
    return vec3(d_disc * stretch + disc * d_stretch, -height * d_r);
}

// Twin: `Cone::sample_concentric` in cone.rs.
fn square_to_cone(uv: vec2<f32>, height: f32) -> DirectionSample {
    let disc = square_to_disc_concentric(uv);
    let r = dot(disc.value, disc.value);
    let stretch = sqrt(height * max(2.0 - r * height, 0.0));
    let near = sqrt(height * max(2.0 - r * height, 8.0 * POLE_DISTANCE));
    return DirectionSample(
        vec3(disc.value * stretch, 1.0 - r * height),
        cone_derivative(disc.value, disc.d_du, height, stretch, near),
        cone_derivative(disc.value, disc.d_dv, height, stretch, near),
    );
}

// Twin: sphere_octahedral.rs.
fn square_to_sphere_octahedral(uv: vec2<f32>) -> DirectionSample {
    let centred = 2.0 * uv - vec2(1.0);
    let side = select(vec2(1.0), vec2(-1.0), centred < vec2(0.0));
    let folded = abs(centred);
    let above = folded.x + folded.y <= 1.0;
    let pq = select(vec2(1.0 - folded.y, 1.0 - folded.x), folded, above);
    let up = select(-1.0, 1.0, above);
    let r = pq.x + pq.y;
    var parts = vec2(0.5);
    if r > 0.0 {
        parts = pq / r;
    }
    let angle = sine_cosine(QUARTER_PI * (parts.y - parts.x + 1.0));
    let stretch = sqrt(2.0 - r * r);
    let radius = r * stretch;
    let radial = angle.yx;
    let tangential = vec2(-angle.x, angle.y);
    let d_radius = up * (2.0 - 2.0 * r * r) / stretch;
    let turn = select(parts, parts.yx, above);
    let d_z = -2.0 * r;
    let across_u = side * (d_radius * radial + stretch * (-HALF_PI * turn.x) * tangential);
    let across_v = side * (d_radius * radial + stretch * (HALF_PI * turn.y) * tangential);
    return DirectionSample(
        vec3(side * radius * radial, up * (1.0 - r * r)),
        2.0 * side.x * vec3(across_u, d_z),
        2.0 * side.y * vec3(across_v, d_z),
    );
}

// Twin: cosine_hemisphere.rs.
fn square_to_cosine_hemisphere(uv: vec2<f32>) -> DirectionSample {
    let disc = square_to_disc_concentric(uv);
    let squared = max(1.0 - dot(disc.value, disc.value), 0.0);
    let near = sqrt(max(squared, 4.0 * POLE_DISTANCE));
    return DirectionSample(
        vec3(disc.value, sqrt(squared)),
        vec3(disc.d_du, -dot(disc.value, disc.d_du) / near),
        vec3(disc.d_dv, -dot(disc.value, disc.d_dv) / near),
    );
}

// Barycentric coordinates of the second and the third corner. Twin: triangle.rs.
fn square_to_barycentric(uv: vec2<f32>) -> PlaneSample {
    if uv.y > uv.x {
        let half = 0.5 * uv.x;
        return PlaneSample(vec2(half, uv.y - half), vec2(0.5, -0.5), vec2(0.0, 1.0));
    }
    let half = 0.5 * uv.y;
    return PlaneSample(vec2(uv.x - half, half), vec2(1.0, 0.0), vec2(-0.5, 0.5));
}

// A sample of directions in a frame, turned to the world's axes.
fn sample_from_frame(tangents: Tangents, normal: vec3<f32>, local: DirectionSample) -> DirectionSample {
    return DirectionSample(
        from_frame(tangents, normal, local.value),
        from_frame(tangents, normal, local.d_du),
        from_frame(tangents, normal, local.d_dv),
    );
}
