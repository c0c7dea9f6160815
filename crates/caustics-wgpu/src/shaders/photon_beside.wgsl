// Photons beside a photon, as they landed. Twin: `LatticePhotons::landed` in neighbours.rs of
// caustics-trace.

// The largest part of the footprint of the photon before it that the footprint of the last photon before
// a smooth fold covers.
const SLOWING: f32 = 0.6;

// The first record of a photon that took this path, if there is one; its area is that in the plane with
// unit `normal`.
fn landed(photon: u32, path: u32, is_along: bool, normal: vec3<f32>) -> Landed {
    var found = 0u;
    if photon != NO_PHOTON {
        // From the last to the first.
        var place = links[slot_of(photon)];
        while place != 0u {
            let link = link_of(trace.first_link, place);
            found = select(found, place, links[link + 1u] == path);
            place = links[link] & LINK_PLACE;
        }
    }
    var result: Landed;
    result.is_there = found != 0u;
    if result.is_there {
        result.position = appended[found - 1u].position;
        if is_along {
            result.axis = appended[found - 1u].axis_u;
        } else {
            result.axis = appended[found - 1u].axis_v;
        }
        result.object = appended[found - 1u].object;
        result.area = abs(signed_area(
            appended[found - 1u].axis_u, appended[found - 1u].axis_v, normal));
    }
    return result;
}

// Those before and after a record in its row or its column that are parts of its sheet of light. Beyond a
// smooth fold that is what landed turned over.
fn landed_in_line(
    record: FootprintRecord,
    beside: vec2<u32>,
    path: u32,
    is_along: bool,
) -> array<Landed, 2> {
    let normal = record.normal;
    var pair = array(
        landed(beside.x, path, is_along, normal), landed(beside.y, path, is_along, normal));
    if pair[0].is_there == pair[1].is_there {
        return pair;
    }
    var before = pair[1];
    if pair[0].is_there {
        before = pair[0];
    }
    let area = abs(signed_area(record.axis_u, record.axis_v, normal));
    if before.object == record.object && area < SLOWING * before.area {
        let is_after = pair[0].is_there;
        let beyond = landed(
            select(beside.x, beside.y, is_after), path ^ TURNED, is_along, normal);
        if is_after {
            pair[1] = beyond;
        } else {
            pair[0] = beyond;
        }
    }
    return pair;
}

// In its row and in its column.
fn landed_beside(
    record: FootprintRecord,
    beside: array<vec2<u32>, 2>,
    path: u32,
) -> array<array<Landed, 2>, 2> {
    return array(
        landed_in_line(record, beside[0], path, true),
        landed_in_line(record, beside[1], path, false),
    );
}
