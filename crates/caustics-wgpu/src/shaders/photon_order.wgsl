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
        var record = appended[place - 1u];
        let flux = flux_of(record);
        let link = link_of(trace.first_link, place);
        let before = links[link];
        let path = links[link + 1u];
        let parts = links[link + 2u];
        var flux_after = flux;
        if (parts & LINK_DIVIDED) != 0u {
            flux_after = vec3(0.0);
            for (var part = RECORDS_OF_DIVIDED; part > 0u; part--) {
                ordered -= 1u;
                record = appended[(parts & LINK_PLACE) + part - 2u];
                flux_after += flux_of(record);
                records[ordered] = record;
                paths[ordered] = path;
            }
        } else {
            if checks && (before & LINK_THINNED) == 0u {
                let landings = landed_beside(record, beside, path);
                let after = checked(record, landings[0], landings[1]);
                count_up(COUNTER_REPLACED, select(0u, 1u, after.is_replaced));
                record = after.record;
                flux_after = flux_of(record);
            }
            ordered -= 1u;
            records[ordered] = record;
            paths[ordered] = path;
        }
        book_silhouette(flux, flux_after);
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
