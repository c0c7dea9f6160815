// The light of a cell at the edge of a sheet, in parts. Twin: edges.rs in caustics-trace, which says why.

// How often the stretch in which a row's end lies is halved.
const HALVINGS: u32 = 4u;

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

// Where an end is looked for: along a lattice axis, towards one side, so far beside the point, in the cell
// that begins there.
struct Search {
    axis: u32,
    side: f32,
    across: f32,
    from_reach: f32,
}

// A part of the light of a cell.
struct Stratum {
    position: vec3<f32>,
    // Along the row, as if for a whole cell.
    axis: vec3<f32>,
    object: u32,
    // Its middle, in cells from the point towards the edge.
    middle: f32,
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
    axis: u32,
    side: f32,
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
    var unit = side * own.axis;
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
    let ahead = side * fit.y * width * unit;
    let along = side * slant * unit;
    if axis == 0u {
        part.axis_u = ahead;
        part.axis_v = narrowing * part.axis_v + along;
    } else {
        part.axis_v = ahead;
        part.axis_u = narrowing * part.axis_u + along;
    }
    return part;
}

// The row whose axis crosses the edge the more steeply, with how far it goes.
fn steepest(rows: array<Row, 2>, ends: u32, reaches: array<f32, MOST_SEARCHES>) -> Row {
    let is_second = ends == 2u && reaches[1] < reaches[0];
    var row = rows[0];
    row.reach = reaches[0];
    if is_second {
        row = rows[1];
        row.reach = reaches[1];
    }
    return row;
}

// The ends of all rows, then how far the steepest goes half a row on.
fn edge_search(
    rows: array<Row, 2>,
    ends: u32,
    reaches: array<f32, MOST_SEARCHES>,
    number: u32,
) -> Search {
    if number < ends {
        let row = rows[min(number, 1u)];
        return Search(row.axis, row.side, 0.0, 0.0);
    }
    let row = steepest(rows, ends, reaches);
    return Search(row.axis, row.side, 0.5, row.reach - 0.5);
}

// The middle of a part, in cells from the row's last point.
fn edge_part_at(row: Row, part: u32) -> f32 {
    let stratum = STRATA[min(part, PARTS - 1u)];
    return 0.5 * (stratum.x + stratum.y) * (0.5 + row.reach) - 0.5;
}

// The parts as photons, `probed` where they landed, and what they give back.
fn edge_parts(
    row: Row,
    slant: f32,
    narrowing: f32,
    photon: FootprintRecord,
    probed: array<FootprintRecord, RECORDS_OF_DIVIDED>,
    strata: array<Stratum, RECORDS_OF_DIVIDED>,
) -> array<FootprintRecord, RECORDS_OF_DIVIDED> {
    let cells = 0.5 + row.reach;
    var parts = probed;
    var before = Stratum(row.inner.position, row.inner.axis, row.inner.object, -1.0);
    for (var part = 0u; part < PARTS; part++) {
        let stratum = STRATA[part];
        parts[part] = part_of(
            parts[part],
            row.axis,
            row.side,
            narrowing,
            0.5 * (stratum.x + stratum.y) * slant,
            (stratum.y - stratum.x) * cells,
            strata[part],
            before,
            strata[min(part + 1u, PARTS - 1u)],
            part + 1u < PARTS,
        );
        before = strata[part];
    }
    // The cell before them is as long as its neighbour lets it be.
    let step = -step_in_plane(photon, row.inner.position);
    var unit = row.side * row.inner.axis;
    if dot(unit, unit) > LIMIT * LIMIT * dot(step, step) {
        unit = step;
    }
    return give_back(parts, row.inner.position, unit, row.axis);
}
