// Photons, one to an invocation. Twin: `Batch::trace_range` in trace.rs of caustics-trace.

// Branches of one photon that wait. Where no more than a few have room left, photons go one way, as
// with `BRANCHING_ROULETTE`; what finds no room even so is booked as crowded.
const MAX_PENDING: u32 = 28u;
const RESERVED_PENDING: u32 = 4u;

const WORKGROUP_SIZE: u32 = 64u;

var<private> last_record: u32;

// Whether there was room.
fn store_photon(record: FootprintRecord, branch: Branch, path: u32) -> bool {
    let place = atomicAdd(&counters[COUNTER_STORED], 1u);
    if place >= arrayLength(&appended) {
        // No count below the room is ever seen, since every such step back follows one ahead.
        atomicSub(&counters[COUNTER_STORED], 1u);
        count_up(COUNTER_LOST, 1u);
        return false;
    }
    appended[place] = record;
    let link = link_of(trace.first_link, place + 1u);
    links[link] = last_record | select(0u, LINK_THINNED, branch.is_thinned);
    links[link + 1u] = path;
    links[link + 2u] = with_channel(branch.turns, branch.channel);
    last_record = place + 1u;
    return true;
}

// All branches are followed.
fn is_followed(turns: u32, depth: u32) -> bool {
    return true;
}

fn is_followed_channel(channel: u32) -> bool {
    return true;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn trace_photons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let index = (group.y * groups.x + group.x) * WORKGROUP_SIZE + invocation;
    if index < trace.count {
        let number = trace.first + index;
        let emitter = emitter_of(number);
        let point = point_number(emitter, number - trace.emitters[emitter].first);
        photon_number = number;
        last_record = 0u;
        send(emitter, point, guided(emitter, emission_sample(point, emitter)));
        links[slot_of(number)] = last_record;
    }
    workgroupBarrier();
    publish_ledger(invocation, WORKGROUP_SIZE);
}
