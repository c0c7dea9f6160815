// Finds the last photons of a lattice's rows, which are then divided. Twin: `EdgeTracer::check` in
// edges.rs of caustics-trace, which says why.

// Workgroups of one dispatch at most; further records are theirs in turn.
const MAX_EDGE_GROUPS: u32 = 32768u;

// Photons with less than this part of the flux of their point's brightest are not divided.
const SIGNIFICANT: f32 = 0.1;

fn mark_photon(photon: u32) {
    let last = links[slot_of(photon)];
    if last == 0u {
        return;
    }
    var brightest = 0.0;
    var place = last;
    while place != 0u {
        brightest = max(brightest, largest(flux_of(appended[place - 1u])));
        place = links[link_of(trace.first_link, place)] & LINK_PLACE;
    }
    let beside = neighbours_of(emitter_of(photon), photon);
    place = last;
    while place != 0u {
        let link = link_of(trace.first_link, place);
        let before = links[link];
        let record = appended[place - 1u];
        if (before & LINK_THINNED) == 0u
            && (links[link + 2u] & TURN_TOO_MANY) == 0u
            && largest(flux_of(record)) >= SIGNIFICANT * brightest {
            let landings = landed_beside(record, beside, links[link + 1u]);
            if is_end(record, landings[0]) || is_end(record, landings[1])
                || narrow_axis(record, beside, landings) != NO_AXIS {
                let index = atomicAdd(&counters[COUNTER_EDGES], 1u);
                links[trace.first_edge + index] = place;
                if index % EDGE_WORKGROUP_SIZE == 0u
                    && index / EDGE_WORKGROUP_SIZE < MAX_EDGE_GROUPS {
                    atomicAdd(&counters[COUNTER_EDGE_GROUPS], 1u);
                }
            }
        }
        place = before & LINK_PLACE;
    }
}

@compute @workgroup_size(EDGE_WORKGROUP_SIZE)
fn mark_edges(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let index = (group.y * groups.x + group.x) * EDGE_WORKGROUP_SIZE + invocation;
    if index < trace.count {
        mark_photon(trace.first + index);
    }
}
