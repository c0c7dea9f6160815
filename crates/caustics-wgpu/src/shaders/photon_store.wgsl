// Stored photons, appended as they land. Twin: photon.rs in caustics-trace; photon_order.wgsl reads
// the links.

@group(0) @binding(6) var<storage, read_write> appended: array<FootprintRecord>;

@group(0) @binding(8) var<storage, read_write> links: array<u32>;

var<private> last_record: u32;

// Whether there was room.
fn store_photon(record: FootprintRecord, path: u32, is_thinned: bool) -> bool {
    let place = atomicAdd(&counters[COUNTER_STORED], 1u);
    if place >= arrayLength(&appended) {
        // No count below the room is ever seen, since every such step back follows one ahead.
        atomicSub(&counters[COUNTER_STORED], 1u);
        count_up(COUNTER_LOST, 1u);
        return false;
    }
    appended[place] = record;
    links[trace.first_link + 2u * place] = last_record | select(0u, LINK_THINNED, is_thinned);
    links[trace.first_link + 2u * place + 1u] = path;
    last_record = place + 1u;
    return true;
}
