// Rows of a lattice that end. Twin: edges.rs in caustics-trace.

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
