// Rows of a lattice that end, and narrow sheets. Twins: edges.rs and narrow_sheets.rs in
// caustics-trace.

const EDGE_WORKGROUP_SIZE: u32 = 64u;

// Whether the photon's path ends beside it and goes on behind it, along the axis of these neighbours.
fn is_end(photon: FootprintRecord, pair: array<Landed, 2>) -> bool {
    let behind = inner_of(pair);
    return pair[0].is_there != pair[1].is_there && behind.object == photon.object;
}

// Of two neighbours of which one is there, that one.
fn inner_of(pair: array<Landed, 2>) -> Landed {
    if pair[0].is_there {
        return pair[0];
    }
    return pair[1];
}

// Neither axis of the lattice.
const NO_AXIS: u32 = 2u;

// The axis of the lattice along which a photon's sheet of light is too narrow for the photons `beside` it to
// be part of it, though there are some on both sides. None if its footprint is the shorter along it.
fn narrow_axis(
    photon: FootprintRecord,
    beside: array<vec2<u32>, 2>,
    landings: array<array<Landed, 2>, 2>,
) -> u32 {
    // In the bits of other processors: of equal axes either may be the longer by a rounding.
    let squares = vec2(
        rounded_dot(photon.axis_u, photon.axis_u), rounded_dot(photon.axis_v, photon.axis_v));
    let is_u = all(beside[0] != vec2(NO_PHOTON))
        && !landings[0][0].is_there && !landings[0][1].is_there;
    if is_u && squares.x >= squares.y {
        return 0u;
    }
    let is_v = all(beside[1] != vec2(NO_PHOTON))
        && !landings[1][0].is_there && !landings[1][1].is_there;
    if is_v && squares.y >= squares.x {
        return 1u;
    }
    return NO_AXIS;
}
