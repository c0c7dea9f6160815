// Where the energy went. Twin: ledger.rs in caustics-trace; `TraceCounters` reads the buffer.
//
// Counts are words; sums of flux are integers of 64 bits in two words, in units of
// 1 / `trace.flux_scale` watts, so that they do not depend on the order of the sum. A workgroup sums
// by itself and adds its sums to the buffer at the end.

const FATE_STORED: u32 = 0u;
const FATE_ABSORBED: u32 = 1u;
const FATE_ESCAPED: u32 = 2u;
const FATE_MISSED: u32 = 3u;
const FATE_UNAIMED: u32 = 4u;
const FATE_OVERLAP: u32 = 5u;
const FATE_DIRECT: u32 = 6u;
const FATE_TOO_DEEP: u32 = 7u;
const FATE_ROULETTE: u32 = 8u;
const FATE_INVALID: u32 = 9u;
// For want of room, in the buffer of records or for a photon's branches.
const FATE_CROWDED: u32 = 10u;
// Not ends, but lines of the same form.
const LINE_EMITTED: u32 = 11u;
const LINE_ROULETTE_GAIN: u32 = 12u;
// What photons at silhouettes got, and what was taken from them.
const LINE_SILHOUETTE_GAIN: u32 = 13u;
const LINE_SILHOUETTE_LOSS: u32 = 14u;
const LINES: u32 = 15u;

// The words of the buffer: records stored, and parts lost because there was no room; then a count
// for each line, then other counts, then sums by line, channel and word, the lower first.
const COUNTER_STORED: u32 = 0u;
const COUNTER_LOST: u32 = 1u;
const COUNTER_LINES: u32 = 2u;
const COUNTER_RAYS: u32 = 17u;
const COUNTER_FALLBACKS: u32 = 18u;
const COUNTER_BOUNDED: u32 = 19u;
const COUNTER_REPLACED: u32 = 20u;
const COUNTER_SUMS: u32 = 22u;
const COUNTERS: u32 = 112u;

@group(0) @binding(7) var<storage, read_write> counters: array<atomic<u32>>;

var<workgroup> group_counters: array<atomic<u32>, COUNTERS>;

fn count_up(counter: u32, by: u32) {
    if by > 0u {
        atomicAdd(&group_counters[counter], by);
    }
}

// Books `flux` on a line. Its largest value is 2^30 units.
fn book(line: u32, flux: vec3<f32>) {
    atomicAdd(&group_counters[COUNTER_LINES + line], 1u);
    for (var channel = 0u; channel < 3u; channel++) {
        let units = u32(clamp(flux[channel] * trace.flux_scale + 0.5, 0.0, 4.0e9));
        if units > 0u {
            let place = COUNTER_SUMS + 2u * (3u * line + channel);
            let before = atomicAdd(&group_counters[place], units);
            if before + units < before {
                atomicAdd(&group_counters[place + 1u], 1u);
            }
        }
    }
}

// Adds the workgroup's sums to the buffer's. After a barrier, by all of its invocations. Photons that
// are traced as neighbours only are booked with the batch that they are of.
fn publish_ledger(invocation: u32, invocations: u32) {
    if (trace.flags & FLAG_NEIGHBOURS_ONLY) != 0u {
        return;
    }
    for (var i = COUNTER_LOST + invocation; i < COUNTER_SUMS; i += invocations) {
        let counted = atomicLoad(&group_counters[i]);
        if counted > 0u {
            atomicAdd(&counters[i], counted);
        }
    }
    for (var i = COUNTER_SUMS + 2u * invocation; i < COUNTERS; i += 2u * invocations) {
        let low = atomicLoad(&group_counters[i]);
        var high = atomicLoad(&group_counters[i + 1u]);
        if low > 0u {
            let before = atomicAdd(&counters[i], low);
            high += select(0u, 1u, before + low < before);
        }
        if high > 0u {
            atomicAdd(&counters[i + 1u], high);
        }
    }
}
