// Footprints checked against where the photons beside them landed. Twins: neighbours.rs
// and silhouette.rs in caustics-trace, which say why.

const LIMIT: f32 = 1.5;
const EDGE_SHIFT: f32 = 0.13;
const EDGE_EXTENT: f32 = 0.69;
const SILHOUETTE_EXTENT: f32 = 0.78;
const LEAST_SILHOUETTE: f32 = 1.02;
const AGREEMENT: f32 = 0.1;
const UNEVEN: f32 = 2.0;
const LONGER: f32 = 1.15;
const EVEN: f32 = 1.4;
const AGREEING: f32 = 0.2;
const BEND: f32 = 0.125;
const MAX_RATIO: f32 = 1e3;
const FAR_INSIDE: f32 = 1e30;

// A neighbour before or after a photon, if it took the same path.
struct Landed {
    position: vec3<f32>,
    // Its axis along which it is a neighbour.
    axis: vec3<f32>,
    // Of its footprint, in the photon's plane.
    area: f32,
    object: u32,
    is_there: bool,
}

// What the neighbours along an axis say.
struct Landing {
    // To the farthest of them, in the plane of the footprint.
    farthest: vec3<f32>,
    // How many times as long as that the axis is.
    ratio: f32,
    // How far inside a silhouette the photon is, in cells; FAR_INSIDE where none is told.
    inside: f32,
    // Whether the neighbour's differential says the same.
    is_sure: bool,
    is_there: bool,
    is_edge: bool,
    between: Between,
}

// What two neighbours on opposite sides of a photon say of its light along their axis.
struct Between {
    is_there: bool,
    // From the photon to the middle of the light.
    shift: vec3<f32>,
    axis: vec3<f32>,
    // Whether the differential has no part in it.
    is_replaced: bool,
}

struct CheckedAxis {
    axis: vec3<f32>,
    // What the footprint's middle is moved by.
    shift: vec3<f32>,
    // Whether a neighbour stood in for the differential.
    is_replaced: bool,
}

// Where the light of a cell at a silhouette lands: how far inwards, and how wide, in the distance to
// the one neighbour. Twin: `Silhouette::fit`.
fn silhouette_fit(ratio: f32, x: f32) -> vec2<f32> {
    let low = max(x - 0.5, 0.0);
    let high = x + 0.5;
    let sum = sqrt(low) + sqrt(high);
    let difference = (high - low) / sum;
    let mean = 0.5 * sum + difference * difference / (6.0 * sum);
    let skew = difference / sum;
    let width = difference * sqrt(1.0 - skew * skew / 3.0);
    let scale = 2.0 * ratio * sqrt(x);
    return vec2(scale * (mean - sqrt(x)), SILHOUETTE_EXTENT * scale * width);
}

// Where light at a displacement from a photon, from the same side, meets its receiver's plane.
fn along_light(photon: FootprintRecord, displacement: vec3<f32>) -> vec3<f32> {
    let height = dot(displacement, photon.normal) / dot(photon.incoming, photon.normal);
    return displacement - photon.incoming * height;
}

// By the steps to the neighbours before and after a photon, its axis and that axis' length.
fn between_of(before: vec3<f32>, after: vec3<f32>, axis: vec3<f32>, length: f32) -> Between {
    var between: Between;
    if dot(before, after) >= 0.0 {
        return between;
    }
    let a = length_of(before);
    let b = length_of(after);
    let near = min(a, b);
    let far = max(a, b);
    let half = 0.5 * (after - before);
    if far > UNEVEN * near && length > LONGER * 0.5 * (a + b) {
        return Between(true, 0.25 * (before + after), half, true);
    }
    // The axis may point either way.
    let along = select(half, -half, dot(half, axis) < 0.0);
    if far <= EVEN * near && length_of(axis - along) <= AGREEING * length_of(along) {
        return Between(true, BEND * (before + after), 0.5 * (axis + along), false);
    }
    return between;
}

fn landing_of(
    photon: FootprintRecord,
    axis: vec3<f32>,
    before: Landed,
    after: Landed,
) -> Landing {
    var landing: Landing;
    landing.inside = FAR_INSIDE;
    let to_before = before.position - photon.position;
    let to_after = after.position - photon.position;
    let before_in_plane = to_before - photon.normal * dot(to_before, photon.normal);
    let after_in_plane = to_after - photon.normal * dot(to_after, photon.normal);
    let has_before = before.is_there && before.object == photon.object;
    let has_after = after.is_there && after.object == photon.object;
    landing.is_there = has_before || has_after;
    if !landing.is_there {
        return landing;
    }
    // Of equal distances the latter.
    let is_before_farther = dot(before_in_plane, before_in_plane) > dot(after_in_plane, after_in_plane);
    let takes_before = has_before && (!has_after || is_before_farther);
    landing.farthest = select(after_in_plane, before_in_plane, takes_before);
    let distance = length_of(landing.farthest);
    // By its largest coordinate where the square of a long axis overflows.
    let size = largest(abs(axis));
    let length = select(length_of(axis), size, size > LIMIT * distance);
    landing.ratio = MAX_RATIO;
    if distance > 0.0 {
        landing.ratio = min(length / distance, MAX_RATIO);
    }
    if has_before && has_after {
        landing.between = between_of(
            along_light(photon, to_before), along_light(photon, to_after), axis, length);
    }
    landing.is_edge = before.is_there != after.is_there;
    if landing.is_edge && landing.ratio > LEAST_SILHOUETTE {
        landing.inside = 1.0 / (4.0 * landing.ratio * (landing.ratio - 1.0));
        let slope = length / length_of(select(after.axis, before.axis, takes_before));
        let by_slope = 1.0 / (slope * slope - 1.0);
        landing.is_sure = slope > 1.0 && abs(landing.inside - by_slope) < AGREEMENT;
    }
    return landing;
}

fn checked_axis(axis: vec3<f32>, landing: Landing) -> CheckedAxis {
    if !landing.is_there {
        return CheckedAxis(axis, vec3(0.0), false);
    }
    if landing.between.is_there {
        return CheckedAxis(
            landing.between.axis, landing.between.shift, landing.between.is_replaced);
    }
    // Inwards, and how wide.
    var fit = vec2(0.0, 1.0);
    let is_fitted = landing.inside < FAR_INSIDE;
    if is_fitted {
        fit = silhouette_fit(landing.ratio, landing.inside);
    } else if landing.is_edge {
        fit = vec2(EDGE_SHIFT, EDGE_EXTENT);
    }
    let is_replaced = landing.ratio > LIMIT || is_fitted;
    let unit = select(axis, landing.farthest, is_replaced);
    // The axis may point either way.
    let side = sign_of(dot(landing.farthest, unit));
    return CheckedAxis(fit.y * unit, fit.x * side * unit, is_replaced);
}

struct CheckedRecord {
    record: FootprintRecord,
    is_replaced: bool,
}

// `along` and `across` are the neighbours before and after it in its row and in its column.
fn checked(
    photon: FootprintRecord,
    along: array<Landed, 2>,
    across: array<Landed, 2>,
) -> CheckedRecord {
    let u = landing_of(photon, photon.axis_u, along[0], along[1]);
    let v = landing_of(photon, photon.axis_v, across[0], across[1]);
    let inside = min(
        select(FAR_INSIDE, u.inside, u.is_sure), select(FAR_INSIDE, v.inside, v.is_sure));
    let by_u = checked_axis(photon.axis_u, u);
    let by_v = checked_axis(photon.axis_v, v);
    var result = CheckedRecord(photon, by_u.is_replaced || by_v.is_replaced);
    result.record.position = result.record.position + by_u.shift;
    result.record.position = result.record.position + by_v.shift;
    result.record.axis_u = by_u.axis;
    result.record.axis_v = by_v.axis;
    // The last photon of a row has all its light from the silhouette on.
    let cells = select(1.0, inside + 0.5, inside < 1.0);
    result.record.flux_r *= cells;
    result.record.flux_g *= cells;
    result.record.flux_b *= cells;
    return result;
}
