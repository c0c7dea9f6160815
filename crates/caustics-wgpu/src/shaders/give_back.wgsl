// Light that there is too much of on the parts of a divided photon, which goes back to the cell before
// them. Twin: give_back.rs in caustics-trace, which says why.

const GIVE_BACK_PEAK: f32 = 0.72534;
const GIVE_BACK_CUT: f32 = 0.012913223;
const LEAST_KEPT: f32 = 0.3;
const GIVE_BACK_SHIFT: f32 = 0.1;
const GIVE_BACK_WIDTH: f32 = 0.6;

// How much of even light a footprint with this middle and `axis` has along it at a place.
fn even_part(middle: vec3<f32>, axis: vec3<f32>, place: vec3<f32>) -> f32 {
    let squared = rounded_dot(axis, axis);
    if squared == 0.0 {
        return 0.0;
    }
    // Constants stay where they are in a product, or what is rounded is another number.
    let distance = rounded(rounded_dot(place - middle, axis) * (1.0 / squared));
    var power = max(1.0 - rounded(rounded(GIVE_BACK_CUT * distance) * distance), 0.0);
    for (var i = 0u; i < 7u; i++) {
        power *= power;
    }
    return rounded(GIVE_BACK_PEAK * rounded(power));
}

// The parts with what they keep, and what they give back as the last; `unit` spans the cell before them, with
// its middle `inner`, along lattice axis `axis`.
fn give_back(
    whole: array<FootprintRecord, RECORDS_OF_DIVIDED>,
    inner: vec3<f32>,
    unit: vec3<f32>,
    axis: u32,
) -> array<FootprintRecord, RECORDS_OF_DIVIDED> {
    var parts = whole;
    var kept: array<f32, PARTS>;
    for (var part = 0u; part < PARTS; part++) {
        let place = parts[part].position;
        var sum = even_part(inner, unit, place);
        for (var other = 0u; other < PARTS; other++) {
            sum += even_part(parts[other].position, axis_of(parts[other], axis), place);
        }
        kept[part] = clamp(1.0 / (sum * sum), LEAST_KEPT, 1.0);
    }
    var back = parts[0];
    var flux_back = vec3(0.0);
    for (var part = 0u; part < PARTS; part++) {
        let flux = flux_of(parts[part]);
        let flux_kept = rounded_vector(kept[part] * flux);
        flux_back += flux - flux_kept;
        parts[part].flux_r = flux_kept.x;
        parts[part].flux_g = flux_kept.y;
        parts[part].flux_b = flux_kept.z;
    }
    back.flux_r = flux_back.x;
    back.flux_g = flux_back.y;
    back.flux_b = flux_back.z;
    back.position = inner + GIVE_BACK_SHIFT * unit;
    if axis == 0u {
        back.axis_u = GIVE_BACK_WIDTH * unit;
    } else {
        back.axis_v = GIVE_BACK_WIDTH * unit;
    }
    parts[PARTS] = back;
    return parts;
}
