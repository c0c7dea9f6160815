// How a ray changes with the parameters of its emission (Igehy 1999). Twin: differential.rs in
// caustics-trace.

// Twins: those of differential.rs.
const BLUR_EDGE: f32 = 0.125;
const OVERLAP: f32 = 4.0;
const LEAST_AREA: f32 = 0.01;

struct Differential {
    position: array<vec3<f32>, PARAMETERS>,
    direction: array<vec3<f32>, PARAMETERS>,
}

// On a plane at `distance` along `direction`.
fn transferred(
    before: Differential,
    direction: vec3<f32>,
    distance: f32,
    plane_normal: vec3<f32>,
) -> Differential {
    var result = before;
    let along = dot(direction, plane_normal);
    for (var i = 0u; i < PARAMETERS; i++) {
        let moved = before.position[i] + distance * before.direction[i];
        let corrected = moved - dot(moved, plane_normal) / along * direction;
        if along != 0.0 && all_finite(corrected) {
            result.position[i] = corrected;
        } else {
            result.position[i] = moved;
        }
    }
    return result;
}

// The matrix times the vector, summed in the twin's order.
fn turned(matrix: mat3x3<f32>, v: vec3<f32>) -> vec3<f32> {
    return matrix[0] * v.x + matrix[1] * v.y + matrix[2] * v.z;
}

// After mirror reflection; `turn` takes a displacement to the change of the normal.
fn reflected(
    before: Differential,
    direction: vec3<f32>,
    normal: vec3<f32>,
    turn: mat3x3<f32>,
) -> Differential {
    var result = before;
    let along = dot(direction, normal);
    for (var i = 0u; i < PARAMETERS; i++) {
        let change = before.direction[i];
        let bend = turned(turn, before.position[i]);
        let along_change = dot(change, normal) + dot(direction, bend);
        result.direction[i] = change - 2.0 * (along * bend + along_change * normal);
    }
    return result;
}

// After refraction; `eta` is the index left over the index entered.
fn refracted(
    before: Differential,
    direction: vec3<f32>,
    refracted_direction: vec3<f32>,
    normal: vec3<f32>,
    eta: f32,
    turn: mat3x3<f32>,
) -> Differential {
    var result = before;
    let along = dot(direction, normal);
    let along_refracted = min(dot(refracted_direction, normal), -SMALLEST_NORMAL);
    let mu = eta * along - along_refracted;
    let mu_slope = eta - eta * eta * along / along_refracted;
    for (var i = 0u; i < PARAMETERS; i++) {
        let change = before.direction[i];
        let bend = turned(turn, before.position[i]);
        let along_change = dot(change, normal) + dot(direction, bend);
        result.direction[i] = eta * change - (mu * bend + mu_slope * along_change * normal);
    }
    return result;
}

struct Bounded {
    differential: Differential,
    shortened: bool,
}

// How near a silhouette differentials still grow, in steps and parts of the blur. Twin: grazing.rs.
const NEAREST: f32 = 0.3;
const LARGEST: f32 = 3.4028234e38;

// What leaves, no wider towards the silhouette than light that near to it; `before` comes along
// `direction`, and `eta` is that of a refraction, 0 of a reflection.
fn bounded_at_silhouette(
    after: Differential,
    before: Differential,
    direction: vec3<f32>,
    scattered_direction: vec3<f32>,
    normal: vec3<f32>,
    eta: f32,
    turn: mat3x3<f32>,
) -> Bounded {
    var result = Bounded(after, false);
    var cosine = abs(dot(direction, normal));
    let scattered_cosine = abs(dot(scattered_direction, normal));
    // By Snell's law: the one sine is eta times the other.
    var factor = 1.0;
    if eta > 0.0 && scattered_cosine < cosine {
        factor = eta * eta * cosine / scattered_cosine;
        cosine = scattered_cosine;
    }
    var changes: array<f32, PARAMETERS>;
    var squares = 0.0;
    for (var i = 0u; i < PARAMETERS; i++) {
        let bend = turned(turn, before.position[i]);
        let change = factor * (dot(before.direction[i], normal) + dot(direction, bend));
        changes[i] = change;
        squares += change * change;
    }
    let slope = sqrt(squares);
    let distance = cosine / (2.0 * slope);
    if !(slope > 0.0 && slope < LARGEST && distance < NEAREST) {
        return result;
    }
    let lost = 1.0 - sqrt(distance / NEAREST);
    var position = vec3(0.0);
    var turning = vec3(0.0);
    for (var i = 0u; i < PARAMETERS; i++) {
        let part = changes[i] / slope;
        position += part * after.position[i];
        turning += part * after.direction[i];
    }
    for (var i = 0u; i < PARAMETERS; i++) {
        let part = lost * (changes[i] / slope);
        result.differential.position[i] -= part * position;
        result.differential.direction[i] -= part * turning;
    }
    result.shortened = true;
    return result;
}

fn bounded(before: Differential, limit: f32) -> Bounded {
    var result = Bounded(before, false);
    for (var i = 0u; i < PARAMETERS; i++) {
        let change = before.direction[i];
        let size = largest(abs(change));
        if !all_finite(change) {
            result.differential.direction[i] = vec3(0.0);
            result.shortened = true;
        } else if size > limit || length_of(change) > limit {
            // Scaled first: the square of a large derivative overflows.
            let scaled = change / size;
            result.differential.direction[i] = scaled * (limit / length_of(scaled));
            result.shortened = true;
        }
        if !all_finite(before.position[i]) {
            result.differential.position[i] = vec3(0.0);
            result.shortened = true;
        }
    }
    return result;
}

fn scaled_by(before: Differential, factor: f32) -> Differential {
    var result = before;
    for (var i = 0u; i < PARAMETERS; i++) {
        result.position[i] *= factor;
        result.direction[i] *= factor;
    }
    return result;
}

struct Footprint {
    axes: array<vec3<f32>, 2>,
    // Whether it covers four steps or more.
    is_overlap: bool,
}

// The footprint in the plane of `normal`.
fn footprint(at_end: Differential, normal: vec3<f32>) -> Footprint {
    if PARAMETERS == 2u {
        return Footprint(array(at_end.position[0], at_end.position[1]), false);
    }
    var scale = 0.0;
    for (var i = 0u; i < PARAMETERS; i++) {
        scale = max(scale, largest(abs(at_end.position[i])));
    }
    if scale == 0.0 {
        return Footprint(array(vec3(0.0), vec3(0.0)), false);
    }
    let tangents = tangents_of(normal);
    var steps = array(at_end.position[0] / scale, at_end.position[1] / scale);
    let step = area_of(steps[0], steps[1]);
    let blur = area_of(
        at_end.position[PARAMETERS - 2u] / scale, at_end.position[PARAMETERS - 1u] / scale);
    let overlap = OVERLAP * sqrt(step * blur);
    // How much of the steps' own shape is left.
    let covered = step + overlap;
    var own = 1.0;
    if covered > 0.0 {
        own = step / covered;
    }
    let disc = covered - own * step;
    var xx = disc;
    var xy = 0.0;
    var yy = disc;
    for (var i = 0u; i < 2u; i++) {
        let moved = sqrt(own) * steps[i];
        let x = dot(moved, tangents.first);
        let y = dot(moved, tangents.second);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    // The columns of the covariance's Cholesky factor.
    let x = sqrt(xx);
    var shear = 0.0;
    if x > 0.0 {
        shear = xy / x;
    }
    let y = sqrt(max(yy - shear * shear, 0.0));
    let axes = array(
        scale * (x * tangents.first + shear * tangents.second),
        scale * y * tangents.second,
    );
    return Footprint(axes, blur >= step && step > 0.0);
}

fn area_of(one: vec3<f32>, other: vec3<f32>) -> f32 {
    let squares = dot(one, one) + dot(other, other);
    return max(length_of(cross(one, other)), LEAST_AREA * squares);
}
