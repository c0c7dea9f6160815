// The last photons of a lattice's rows, divided. Twin: edges.rs in caustics-trace, which says why.

// How often the stretch in which a row's end lies is halved, and that in which a narrow sheet's does.
const HALVINGS: u32 = 4u;
const NARROW_HALVINGS: u32 = 3u;

// Searches for the ends of a narrow sheet: of its column, of its row, and of the rows a quarter of the
// column on either side.
const NARROW_SEARCHES: u32 = 8u;
const SEARCHES_ALONE: u32 = 4u;

// Where the parts of a narrow sheet's light begin and end, in its width. Twin: narrow_sheets.rs.
const STRIPS: u32 = RECORDS_OF_DIVIDED;
const STRIP_ENDS: array<f32, STRIPS + 1u> = array(0.0, 0.125, 0.375, 0.625, 0.875, 1.0);
const BRIGHTEST: f32 = 2.0;

// Where in a row's last cell each part begins and ends, from the inside to the edge.
const STRATA: array<vec2<f32>, PARTS> = array(
    vec2(0.0, 0.5), vec2(0.5, 0.75), vec2(0.75, 0.875), vec2(0.875, 1.0));

// A row, and how far it goes from its last point, in cells.
struct Row {
    axis: u32,
    // Whether it ends towards larger or smaller coordinates.
    side: f32,
    reach: f32,
    inner: Landed,
}

// A part of the light of a row's last photon.
struct Stratum {
    position: vec3<f32>,
    // Along the row, as if for a whole cell.
    axis: vec3<f32>,
    object: u32,
    // Its middle, in cells from the point towards the edge.
    middle: f32,
}

// What is `along` cells from the point towards the row's end, and `across` cells beside the row.
fn row_offset(row: Row, along: f32, across: f32) -> vec2<f32> {
    let ahead = row.side * along;
    return select(vec2(across, ahead), vec2(ahead, across), row.axis == 0u);
}

fn axis_of(record: FootprintRecord, axis: u32) -> vec3<f32> {
    return select(record.axis_v, record.axis_u, axis == 0u);
}

fn step_in_plane(photon: FootprintRecord, position: vec3<f32>) -> vec3<f32> {
    let displacement = position - photon.position;
    return displacement - photon.normal * dot(displacement, photon.normal);
}

// How many times as long as its axis a photon's neighbours let its footprint be, at most once.
fn checked_ratio(photon: FootprintRecord, axis: vec3<f32>, pair: array<Landed, 2>) -> f32 {
    var farthest = -1.0;
    for (var i = 0u; i < 2u; i++) {
        if pair[i].is_there && pair[i].object == photon.object {
            farthest = max(farthest, length_of(step_in_plane(photon, pair[i].position)));
        }
    }
    let length = length_of(axis);
    return select(1.0, farthest / length, farthest >= 0.0 && length > LIMIT * farthest);
}

// A part as a photon: `own` by those before and after it.
fn part_of(
    photon: FootprintRecord,
    row: Row,
    narrowing: f32,
    slant: f32,
    width: f32,
    own: Stratum,
    before: Stratum,
    after: Stratum,
    has_after: bool,
) -> FootprintRecord {
    var part = photon;
    part.flux_r *= width;
    part.flux_g *= width;
    part.flux_b *= width;
    // For one cell towards the edge.
    var unit = row.side * own.axis;
    var fit = vec2(0.0, 1.0);
    let has_before = before.object == own.object;
    let goes_on = has_after && after.object == own.object;
    if has_before || goes_on {
        let to_before = step_in_plane(photon, before.position) / (before.middle - own.middle);
        let to_after = step_in_plane(photon, after.position) / (after.middle - own.middle);
        // Of equal distances the latter.
        let is_before_farther = dot(to_before, to_before) > dot(to_after, to_after);
        let takes_before = has_before && (!goes_on || is_before_farther);
        let step = select(to_after, to_before, takes_before);
        let length = length_of(unit);
        let distance = length_of(step);
        var ratio = MAX_RATIO;
        if distance > 0.0 {
            ratio = min(length / distance, MAX_RATIO);
        }
        let is_fitted = !has_after && ratio > LEAST_SILHOUETTE;
        if is_fitted {
            fit = silhouette_fit(ratio, 1.0 / (4.0 * ratio * (ratio - 1.0)));
        } else if !has_after {
            fit = vec2(EDGE_SHIFT, EDGE_EXTENT);
        }
        unit = select(unit, step, is_fitted || ratio > LIMIT);
    }
    part.position = part.position - fit.x * width * unit;
    let ahead = row.side * fit.y * width * unit;
    let along = row.side * slant * unit;
    if row.axis == 0u {
        part.axis_u = ahead;
        part.axis_v = narrowing * part.axis_v + along;
    } else {
        part.axis_v = ahead;
        part.axis_u = narrowing * part.axis_u + along;
    }
    return part;
}

// Twins: give_back.rs.
const GIVE_BACK_PEAK: f32 = 0.72534;
const GIVE_BACK_CUT: f32 = 0.012913223;
const LEAST_KEPT: f32 = 0.3;
const GIVE_BACK_SHIFT: f32 = 0.1;
const GIVE_BACK_WIDTH: f32 = 0.6;

// How much of even light a footprint with this middle and `axis` has along it at a place.
fn even_part(middle: vec3<f32>, axis: vec3<f32>, place: vec3<f32>) -> f32 {
    let squared = rounded_dot(axis, axis);
    if squared == 0.0 {
        return 0.0;
    }
    // Constants stay where they are in a product, or what is rounded is another number.
    let distance = rounded(rounded_dot(place - middle, axis) * (1.0 / squared));
    var power = max(1.0 - rounded(rounded(GIVE_BACK_CUT * distance) * distance), 0.0);
    for (var i = 0u; i < 7u; i++) {
        power *= power;
    }
    return rounded(GIVE_BACK_PEAK * rounded(power));
}

fn is_finite_record(record: FootprintRecord) -> bool {
    return all_finite(record.position) && all_finite(record.axis_u) && all_finite(record.axis_v);
}

// A part seen from the middle of a narrow sheet towards its end on a side.
fn outwards(stratum: Stratum, side: f32) -> Stratum {
    var result = stratum;
    result.middle *= side;
    return result;
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
    let across_axis = 1u - min(narrow, 1u);
    let is_alone = is_narrow && !landings[across_axis][0].is_there && !landings[across_axis][1].is_there;
    var rows: array<Row, 2>;
    var ends = 0u;
    if !is_narrow {
        for (var axis = 0u; axis < 2u; axis++) {
            if is_end(photon, landings[axis]) {
                let side = select(-1.0, 1.0, landings[axis][0].is_there);
                rows[ends] = Row(axis, side, 0.0, inner_of(landings[axis]));
                ends += 1u;
            }
        }
    }
    // The ends of all rows; how far the row goes half a row on; the parts. Of a narrow sheet the searches
    // that are said above, and its parts.
    let halvings = select(HALVINGS, NARROW_HALVINGS, is_narrow);
    let searches = select(
        ends + 1u, select(NARROW_SEARCHES, SEARCHES_ALONE, is_alone), is_narrow);
    let searched = halvings * searches;
    let wanted = select(PARTS, STRIPS, is_narrow);
    var row = rows[0];
    var reaches: array<f32, NARROW_SEARCHES>;
    var across = 0.0;
    var width = 0.5;
    var lit_rows = 0.0;
    var middle_row = 0.0;
    var cells = 0.0;
    var middle = 0.0;
    var parts: array<FootprintRecord, STRIPS>;
    var strata: array<Stratum, STRIPS>;
    var parts_found = 0u;
    for (var step = 0u; step < searched + wanted; step++) {
        let search = step / halvings;
        if step < searched && step % halvings == 0u {
            width = 0.5;
            across = 0.0;
            reaches[search] = 0.0;
            if is_narrow {
                if search == 2u {
                    lit_rows = reaches[0] + reaches[1];
                    middle_row = 0.5 * (reaches[1] - reaches[0]);
                }
                row.axis = select(narrow, across_axis, search < 2u);
                let is_upper = select((search & 1u) == 1u, search >= 6u, search >= 4u);
                row.side = select(-1.0, 1.0, is_upper);
                if search >= 2u {
                    across = middle_row;
                }
                if search >= 4u {
                    across += select(-0.25, 0.25, (search & 1u) == 0u) * lit_rows;
                }
            } else if search < ends {
                row = rows[search];
            } else {
                row = rows[0];
                // The axis that crosses the edge the more steeply.
                if ends == 2u && reaches[1] < reaches[0] {
                    row = rows[1];
                }
                across = 0.5;
                row.reach = select(reaches[0], reaches[1], ends == 2u && reaches[1] < reaches[0]);
                reaches[search] = row.reach - 0.5;
            }
        }
        if is_narrow && search < 2u && landings[across_axis][search].is_there {
            // The column goes on.
            reaches[search] = 0.5;
            continue;
        }
        if step == searched {
            if is_narrow {
                cells = reaches[2] + reaches[3];
                middle = 0.5 * (reaches[3] - reaches[2]);
                row = Row(narrow, 1.0, 0.0, row.inner);
                across = middle_row;
            } else {
                cells = 0.5 + row.reach;
                across = 0.0;
            }
        }
        var along = 0.0;
        let part = step - searched;
        if step < searched {
            along = reaches[search] + width;
        } else if is_narrow {
            along = middle + (0.5 * (STRIP_ENDS[part] + STRIP_ENDS[part + 1u]) - 0.5) * cells;
        } else {
            along = 0.5 * (STRATA[part].x + STRATA[part].y) * cells - 0.5;
        }
        probe(emitter, point, row_offset(row, along, across));
        if step < searched {
            let gain = select(0.0, width, is_probed);
            width *= 0.5;
            let is_last = step % halvings == halvings - 1u;
            reaches[search] += gain + select(0.0, width, is_last);
        } else if is_probed {
            parts[part] = probed;
            strata[part] = Stratum(
                probed.position, axis_of(probed, row.axis), probed.object, along);
            parts_found += 1u;
        }
    }
    if parts_found < wanted {
        return;
    }
    if is_narrow {
        let slants = select(
            2.0 * vec2(reaches[5] - reaches[4], reaches[6] - reaches[7]), vec2(0.0), is_alone);
        let whole = max(cells, 1.0) * select(lit_rows, max(lit_rows, 1.0), is_alone);
        let weight = min(whole, BRIGHTEST * cells * lit_rows) / cells;
        let shortening = checked_ratio(photon, axis_of(photon, across_axis), landings[across_axis]);
        let narrowing = min(shortening, lit_rows);
        for (var part = 0u; part < STRIPS; part++) {
            // Outwards from the middle.
            let is_low = part < STRIPS / 2u;
            row.side = select(1.0, -1.0, is_low);
            let below = outwards(strata[max(part, 1u) - 1u], row.side);
            let above = outwards(strata[min(part + 1u, STRIPS - 1u)], row.side);
            let is_last = part == 0u || part == STRIPS - 1u;
            var before = below;
            var after = above;
            if is_low {
                before = above;
                after = below;
            }
            let at = 0.5 * (STRIP_ENDS[part] + STRIP_ENDS[part + 1u]);
            let strip_width = (STRIP_ENDS[part + 1u] - STRIP_ENDS[part]) * cells;
            parts[part].flux_r *= weight;
            parts[part].flux_g *= weight;
            parts[part].flux_b *= weight;
            parts[part] = part_of(
                parts[part],
                row,
                narrowing,
                slants.x + (slants.y - slants.x) * at,
                strip_width,
                outwards(strata[part], row.side),
                before,
                after,
                !is_last,
            );
        }
        store_parts(link, parts);
        return;
    }
    let slant = 2.0 * row.side * (reaches[ends] - row.reach);
    // Along the edge the photon's neighbours may have landed nearer than its differential says.
    var narrowing = 1.0;
    if ends == 1u {
        let beside = 1u - row.axis;
        narrowing = checked_ratio(photon, axis_of(photon, beside), landings[beside]);
    }
    var before = Stratum(row.inner.position, row.inner.axis, row.inner.object, -1.0);
    for (var part = 0u; part < PARTS; part++) {
        let stratum = STRATA[part];
        let has_after = part + 1u < PARTS;
        parts[part] = part_of(
            parts[part],
            row,
            narrowing,
            0.5 * (stratum.x + stratum.y) * slant,
            (stratum.y - stratum.x) * cells,
            strata[part],
            before,
            strata[min(part + 1u, PARTS - 1u)],
            has_after,
        );
        before = strata[part];
    }
    // What there is too much of on the parts goes back to the cell before them, which is as long as its
    // neighbour lets it be.
    let inner_step = -step_in_plane(photon, row.inner.position);
    var inner_unit = row.side * row.inner.axis;
    if dot(inner_unit, inner_unit) > LIMIT * LIMIT * dot(inner_step, inner_step) {
        inner_unit = inner_step;
    }
    var kept: array<f32, PARTS>;
    for (var part = 0u; part < PARTS; part++) {
        let place = parts[part].position;
        var sum = even_part(row.inner.position, inner_unit, place);
        for (var other = 0u; other < PARTS; other++) {
            sum += even_part(parts[other].position, axis_of(parts[other], row.axis), place);
        }
        kept[part] = clamp(1.0 / (sum * sum), LEAST_KEPT, 1.0);
    }
    var back = parts[0];
    var flux_back = vec3(0.0);
    for (var part = 0u; part < PARTS; part++) {
        let flux = flux_of(parts[part]);
        let flux_kept = rounded_vector(kept[part] * flux);
        flux_back += flux - flux_kept;
        parts[part].flux_r = flux_kept.x;
        parts[part].flux_g = flux_kept.y;
        parts[part].flux_b = flux_kept.z;
    }
    back.flux_r = flux_back.x;
    back.flux_g = flux_back.y;
    back.flux_b = flux_back.z;
    back.position = row.inner.position + GIVE_BACK_SHIFT * inner_unit;
    if row.axis == 0u {
        back.axis_u = GIVE_BACK_WIDTH * inner_unit;
    } else {
        back.axis_v = GIVE_BACK_WIDTH * inner_unit;
    }
    parts[PARTS] = back;
    store_parts(link, parts);
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
