// Photons at the edges of sheets of light, divided. Twins: `EdgeTracer::divide` and `divide_narrow` in
// caustics-trace. Rays are sent from one place of the shader alone, which is nearly all of it.

// What is `along` cells from the point towards the end, and `across` cells beside the row.
fn offset_of(search: Search, along: f32) -> vec2<f32> {
    let ahead = search.side * along;
    return select(vec2(search.across, ahead), vec2(ahead, search.across), search.axis == 0u);
}

fn is_finite_record(record: FootprintRecord) -> bool {
    return all_finite(record.position) && all_finite(record.axis_u) && all_finite(record.axis_v);
}

// Stores what a photon is divided into, if there is room for it.
fn store_parts(link: u32, parts: array<FootprintRecord, RECORDS_OF_DIVIDED>) {
    for (var part = 0u; part < RECORDS_OF_DIVIDED; part++) {
        if !is_finite_record(parts[part]) {
            return;
        }
    }
    let first = atomicAdd(&counters[COUNTER_STORED], RECORDS_OF_DIVIDED);
    if first + RECORDS_OF_DIVIDED > arrayLength(&appended) {
        // It stays whole.
        atomicSub(&counters[COUNTER_STORED], RECORDS_OF_DIVIDED);
        return;
    }
    for (var part = 0u; part < RECORDS_OF_DIVIDED; part++) {
        appended[first + part] = parts[part];
    }
    links[link + 2u] = LINK_DIVIDED | (first + 1u);
    atomicAdd(&group_divided, 1u);
}

fn divide_record(place: u32) {
    let photon = appended[place - 1u];
    // Another dispatch is told of its emitter.
    if photon.photon < trace.first || photon.photon - trace.first >= trace.count {
        return;
    }
    let link = link_of(trace.first_link, place);
    sought_path = links[link + 1u];
    sought_turns = links[link + 2u];
    photon_number = photon.photon;
    let emitter = emitter_of(photon.photon);
    let point = point_number(emitter, photon.photon - trace.emitters[emitter].first);
    let beside = neighbours_of(emitter, photon.photon);
    let landings = landed_beside(photon, beside, sought_path);

    let narrow = narrow_axis(photon, beside, landings);
    let is_narrow = narrow != NO_AXIS;
    let column = landings[1u - min(narrow, 1u)];
    let sheet = NarrowSheet(narrow, !column[0].is_there && !column[1].is_there);
    var rows: array<Row, 2>;
    var ends = 0u;
    for (var axis = 0u; axis < 2u; axis++) {
        if is_end(photon, landings[axis]) {
            let side = select(-1.0, 1.0, landings[axis][0].is_there);
            rows[ends] = Row(axis, side, 0.0, inner_of(landings[axis]));
            ends += 1u;
        }
    }

    // Searches for ends by halving, then the parts.
    let halvings = select(HALVINGS, NARROW_HALVINGS, is_narrow);
    let searches = select(
        ends + 1u, select(MOST_SEARCHES, SEARCHES_ALONE, sheet.is_alone), is_narrow);
    let searched = halvings * searches;
    let wanted = select(PARTS, STRIPS, is_narrow);
    var reaches: array<f32, MOST_SEARCHES>;
    var search: Search;
    var width = 0.5;
    var row: Row;
    var probes: array<FootprintRecord, RECORDS_OF_DIVIDED>;
    var strata: array<Stratum, RECORDS_OF_DIVIDED>;
    var parts_found = 0u;
    for (var step = 0u; step < searched + wanted; step++) {
        let number = step / halvings;
        let part = step - searched;
        if step < searched && step % halvings == 0u {
            if is_narrow {
                search = narrow_search(sheet, reaches, number);
            } else {
                search = edge_search(rows, ends, reaches, number);
            }
            reaches[number] = search.from_reach;
            width = 0.5;
        }
        if is_narrow && number < 2u && column[number].is_there {
            // It goes on.
            reaches[number] = 0.5;
            continue;
        }
        if step == searched {
            row = steepest(rows, ends, reaches);
            search = Search(row.axis, row.side, 0.0, 0.0);
            if is_narrow {
                search = Search(narrow, 1.0, middle_row(reaches), 0.0);
            }
        }
        var along = 0.0;
        if step < searched {
            along = reaches[number] + width;
        } else if is_narrow {
            along = narrow_part_at(reaches, part);
        } else {
            along = edge_part_at(row, part);
        }
        probe(emitter, point, offset_of(search, along));
        if step < searched {
            let gain = select(0.0, width, is_probed);
            width *= 0.5;
            let is_last = step % halvings == halvings - 1u;
            reaches[number] += gain + select(0.0, width, is_last);
        } else if is_probed {
            probes[part] = probed;
            strata[part] = Stratum(
                probed.position, axis_of(probed, search.axis), probed.object, along);
            parts_found += 1u;
        }
    }
    if parts_found < wanted {
        return;
    }
    if is_narrow {
        let shortening = checked_ratio(photon, axis_of(photon, 1u - narrow), column);
        store_parts(link, narrow_parts(sheet, reaches, shortening, probes, strata));
        return;
    }
    let slant = 2.0 * row.side * (reaches[ends] - row.reach);
    // Along the edge the photon's neighbours may have landed nearer than its differential says.
    var narrowing = 1.0;
    if ends == 1u {
        let along_edge = 1u - row.axis;
        narrowing = checked_ratio(photon, axis_of(photon, along_edge), landings[along_edge]);
    }
    store_parts(link, edge_parts(row, slant, narrowing, photon, probes, strata));
}

@compute @workgroup_size(EDGE_WORKGROUP_SIZE)
fn divide_photons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let edges = atomicLoad(&counters[COUNTER_EDGES]);
    let stride = EDGE_WORKGROUP_SIZE * groups.x;
    for (var index = group.x * EDGE_WORKGROUP_SIZE + invocation; index < edges; index += stride) {
        divide_record(links[trace.first_edge + index]);
    }
    workgroupBarrier();
    if invocation == 0u {
        publish_probes();
    }
}
