// Footprints checked against where the photons beside them landed. Twin: neighbours.rs in
// caustics-trace, which says why.

const LIMIT: f32 = 1.5;
const EDGE_SHIFT: f32 = 0.13;
const EDGE_EXTENT: f32 = 0.69;
const SILHOUETTE_EXTENT: f32 = 0.78;
const LEAST_SILHOUETTE: f32 = 1.02;
const MAX_RATIO: f32 = 1e3;

// A neighbour before or after a photon, if it took the same path.
struct Landed {
    position: vec3<f32>,
    object: u32,
    is_there: bool,
}

struct CheckedAxis {
    axis: vec3<f32>,
    // What the footprint's middle is moved by.
    shift: vec3<f32>,
    // Whether a neighbour stood in for the differential.
    is_replaced: bool,
}

// How far inwards, and how wide, in the distance to the one neighbour.
fn silhouette(ratio: f32) -> vec2<f32> {
    let x = 1.0 / (4.0 * ratio * (ratio - 1.0));
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

fn checked_axis(
    photon: FootprintRecord,
    axis: vec3<f32>,
    before: Landed,
    after: Landed,
) -> CheckedAxis {
    let unchanged = CheckedAxis(axis, vec3(0.0), false);
    let to_before = before.position - photon.position;
    let to_after = after.position - photon.position;
    let before_in_plane = to_before - photon.normal * dot(to_before, photon.normal);
    let after_in_plane = to_after - photon.normal * dot(to_after, photon.normal);
    let has_before = before.is_there && before.object == photon.object;
    let has_after = after.is_there && after.object == photon.object;
    if !(has_before || has_after) {
        return unchanged;
    }
    // Of equal distances the latter.
    let is_before_farther = dot(before_in_plane, before_in_plane) > dot(after_in_plane, after_in_plane);
    let takes_before = has_before && (!has_after || is_before_farther);
    let farthest = select(after_in_plane, before_in_plane, takes_before);
    let distance = length_of(farthest);
    // By its largest coordinate where the square of a long axis overflows.
    let size = largest(abs(axis));
    let length = select(length_of(axis), size, size > LIMIT * distance);
    var ratio = MAX_RATIO;
    if distance > 0.0 {
        ratio = min(length / distance, MAX_RATIO);
    }
    let is_edge = before.is_there != after.is_there;
    var inwards = 0.0;
    var extent = 1.0;
    if is_edge {
        inwards = EDGE_SHIFT;
        extent = EDGE_EXTENT;
        if ratio > LEAST_SILHOUETTE {
            let fitted = silhouette(ratio);
            inwards = fitted.x;
            extent = fitted.y;
        }
    }
    let is_replaced = ratio > LIMIT || (is_edge && ratio > LEAST_SILHOUETTE);
    let unit = select(axis, farthest, is_replaced);
    // The axis may point either way.
    let side = sign_of(dot(farthest, unit));
    return CheckedAxis(extent * unit, inwards * side * unit, is_replaced);
}
