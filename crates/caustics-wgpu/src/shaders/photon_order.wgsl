// Puts the records of a batch into the order of their photons, with their footprints checked. Twin:
// traced.rs in caustics-trace.

const ORDER_WORKGROUP_SIZE: u32 = 64u;

// As the tracer appended them, with its links.
@group(0) @binding(1) var<storage, read> appended: array<FootprintRecord>;
@group(0) @binding(2) var<storage, read> links: array<u32>;
// For each photon of the batch how many records come before its own.
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read_write> paths: array<u32>;
@group(0) @binding(6) var<storage, read_write> records: array<FootprintRecord>;

// The first record of a photon that took this path, if there is one.
fn landed(photon: u32, path: u32, is_along: bool) -> Landed {
    var found = 0u;
    if photon != NO_PHOTON {
        // From the last to the first.
        var place = links[slot_of(photon)];
        while place != 0u {
            let link = trace.first_link + 2u * (place - 1u);
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

fn book_silhouette(before: vec3<f32>, after: vec3<f32>) {
    if any(after > before) {
        book(LINE_SILHOUETTE_GAIN, after - before);
    } else if any(after < before) {
        book(LINE_SILHOUETTE_LOSS, before - after);
    }
}

fn order_photon(photon: u32) {
    let slot = slot_of(photon);
    var place = links[slot];
    if place == 0u {
        return;
    }
    let checks = (trace.flags & FLAG_CHECKS) != 0u;
    var beside: array<vec2<u32>, 2>;
    if checks {
        beside = neighbours_of(emitter_of(photon), photon);
    }
    var ordered = starts[slot + 1u];
    while place != 0u {
        ordered -= 1u;
        var record = appended[place - 1u];
        let link = trace.first_link + 2u * (place - 1u);
        let before = links[link];
        let path = links[link + 1u];
        if checks && (before & LINK_THINNED) == 0u {
            let after = checked(
                record,
                array(landed(beside[0].x, path, true), landed(beside[0].y, path, true)),
                array(landed(beside[1].x, path, false), landed(beside[1].y, path, false)),
            );
            count_up(COUNTER_REPLACED, select(0u, 1u, after.is_replaced));
            book_silhouette(flux_of(record), flux_of(after.record));
            record = after.record;
        }
        records[ordered] = record;
        paths[ordered] = path;
        place = before & LINK_PLACE;
    }
}

@compute @workgroup_size(ORDER_WORKGROUP_SIZE)
fn order_photons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let index = (group.y * groups.x + group.x) * ORDER_WORKGROUP_SIZE + invocation;
    if index < trace.count {
        order_photon(trace.first + index);
    }
    workgroupBarrier();
    publish_ledger(invocation, ORDER_WORKGROUP_SIZE);
}
