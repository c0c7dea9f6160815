// Stored photons, appended as they land. Twins: photon.rs in caustics-trace; photon_order.rs reads
// the links.

@group(0) @binding(6) var<storage, read_write> records: array<FootprintRecord>;

// For each photon of the batch the place after its last record, 0 for none; then from
// `trace.first_link` on for each record the place after the photon's record before it, and a hash of
// its path.
@group(0) @binding(8) var<storage, read_write> links: array<u32>;

var<private> last_record: u32;

// Whether there was room.
fn store_photon(record: FootprintRecord, path: u32) -> bool {
    let place = atomicAdd(&counters[COUNTER_STORED], 1u);
    if place >= arrayLength(&records) {
        // No count below the room is ever seen, since every such step back follows one ahead.
        atomicSub(&counters[COUNTER_STORED], 1u);
        count_up(COUNTER_LOST, 1u);
        return false;
    }
    records[place] = record;
    links[trace.first_link + 2u * place] = last_record;
    links[trace.first_link + 2u * place + 1u] = path;
    last_record = place + 1u;
    return true;
}
