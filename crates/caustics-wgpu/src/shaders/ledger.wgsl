// Where the energy went. Twin: ledger.rs in caustics-trace. A workgroup sums by itself and adds its
// sums to the buffer at the end.

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
