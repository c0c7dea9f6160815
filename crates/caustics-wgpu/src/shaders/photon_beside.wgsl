// Photons beside a photon, as they landed. Twin: `LatticePhotons::photon_of` in neighbours.rs of
// caustics-trace.

// The first record of a photon that took this path, if there is one.
fn landed(photon: u32, path: u32, is_along: bool) -> Landed {
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
    }
    return result;
}

// Those of a path before and after a photon in its row and in its column.
fn landed_beside(beside: array<vec2<u32>, 2>, path: u32) -> array<array<Landed, 2>, 2> {
    return array(
        array(landed(beside[0].x, path, true), landed(beside[0].y, path, true)),
        array(landed(beside[1].x, path, false), landed(beside[1].y, path, false)),
    );
}
