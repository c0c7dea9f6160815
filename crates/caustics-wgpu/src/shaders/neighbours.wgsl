// Footprints checked against where the photons beside them landed. Twins: neighbours.rs
// and silhouette.rs in caustics-trace, which say why.

const LIMIT: f32 = 1.5;
const EDGE_SHIFT: f32 = 0.13;
const EDGE_EXTENT: f32 = 0.69;
const SILHOUETTE_EXTENT: f32 = 0.78;
const LEAST_SILHOUETTE: f32 = 1.02;
const AGREEMENT: f32 = 0.1;
const MAX_RATIO: f32 = 1e3;
const FAR_INSIDE: f32 = 1e30;

// A neighbour before or after a photon, if it took the same path.
struct Landed {
    position: vec3<f32>,
    // Its axis along which it is a neighbour.
    axis: vec3<f32>,
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
}

struct CheckedAxis {
    axis: vec3<f32>,
    // What the footprint's middle is moved by.
    shift: vec3<f32>,
    // Of how many cells the flux is.
    cells: f32,
    // Whether a neighbour stood in for the differential.
    is_replaced: bool,
}

// The part of the light at a silhouette that a photon stands for. Twin: `Share` in silhouette.rs.
struct Share {
    cells: f32,
    inwards: f32,
    extent: f32,
}

fn silhouette_share(ratio: f32, x: f32, is_last: bool) -> Share {
    let low = select(max(x - 0.5, 0.0), 0.0, is_last);
    let high = x + 0.5;
    let sum = sqrt(low) + sqrt(high);
    let difference = (high - low) / sum;
    let mean = 0.5 * sum + difference * difference / (6.0 * sum);
    let skew = difference / sum;
    let width = difference * sqrt(1.0 - skew * skew / 3.0);
    let scale = 2.0 * ratio * sqrt(x);
    return Share(
        select(1.0, high, is_last),
        scale * (mean - sqrt(x)),
        SILHOUETTE_EXTENT * scale * width,
    );
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
    landing.is_edge = before.is_there != after.is_there;
    if landing.is_edge && landing.ratio > LEAST_SILHOUETTE {
        landing.inside = 1.0 / (4.0 * landing.ratio * (landing.ratio - 1.0));
        let slope = length / length_of(select(after.axis, before.axis, takes_before));
        let by_slope = 1.0 / (slope * slope - 1.0);
        landing.is_sure = slope > 1.0 && abs(landing.inside - by_slope) < AGREEMENT;
    }
    return landing;
}

// `is_last` where a silhouette is within a cell, along the axis that is `steepest` or along the other.
fn checked_axis(
    axis: vec3<f32>,
    landing: Landing,
    is_last: bool,
    is_steepest: bool,
) -> CheckedAxis {
    if !landing.is_there {
        return CheckedAxis(axis, vec3(0.0), 1.0, false);
    }
    var share = Share(1.0, 0.0, 1.0);
    var is_fitted = false;
    if landing.inside < FAR_INSIDE {
        if !is_last || is_steepest {
            is_fitted = true;
            share = silhouette_share(landing.ratio, landing.inside, is_last);
        }
    } else if landing.is_edge {
        share.inwards = EDGE_SHIFT;
        share.extent = EDGE_EXTENT;
    }
    let is_replaced = landing.ratio > LIMIT || is_fitted;
    let unit = select(axis, landing.farthest, is_replaced);
    // The axis may point either way.
    let side = sign_of(dot(landing.farthest, unit));
    return CheckedAxis(share.extent * unit, share.inwards * side * unit, share.cells, is_replaced);
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
    let u_inside = select(FAR_INSIDE, u.inside, u.is_sure);
    let v_inside = select(FAR_INSIDE, v.inside, v.is_sure);
    let is_v_steepest = v_inside < u_inside;
    let is_last = select(u_inside, v_inside, is_v_steepest) < 1.0;
    let by_u = checked_axis(photon.axis_u, u, is_last, !is_v_steepest);
    let by_v = checked_axis(photon.axis_v, v, is_last, is_v_steepest);
    var result = CheckedRecord(photon, by_u.is_replaced || by_v.is_replaced);
    result.record.position = result.record.position + by_u.shift;
    result.record.position = result.record.position + by_v.shift;
    result.record.axis_u = by_u.axis;
    result.record.axis_v = by_v.axis;
    let cells = by_u.cells * by_v.cells;
    result.record.flux_r *= cells;
    result.record.flux_g *= cells;
    result.record.flux_b *= cells;
    return result;
}
