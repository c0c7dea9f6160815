// The light of a sheet that is narrower than a cell, in parts. Twin: narrow_sheets.rs in caustics-trace, which
// says why.

const NARROW_HALVINGS: u32 = 3u;

// Searches for its ends: of its column, of its row, and of the rows a quarter of the column on either side.
// Without neighbours in the column, either, the last four are left out.
const MOST_SEARCHES: u32 = 8u;
const SEARCHES_ALONE: u32 = 4u;

// Where the parts begin and end, in the sheet's width.
const STRIPS: u32 = RECORDS_OF_DIVIDED;
const STRIP_ENDS: array<f32, STRIPS + 1u> = array(0.0, 0.125, 0.375, 0.625, 0.875, 1.0);

// The most irradiance that a photon is given, in that of its sheet.
const BRIGHTEST: f32 = 2.0;

struct NarrowSheet {
    // Along which it is narrow.
    axis: u32,
    // Whether the photon has no neighbours across, either.
    is_alone: bool,
}

fn upper_or_lower(is_upper: bool) -> f32 {
    return select(-1.0, 1.0, is_upper);
}

// The middle of what is lit of the column, in rows from the point.
fn middle_row(reaches: array<f32, MOST_SEARCHES>) -> f32 {
    return 0.5 * (reaches[1] - reaches[0]);
}

fn narrow_search(sheet: NarrowSheet, reaches: array<f32, MOST_SEARCHES>, number: u32) -> Search {
    let is_odd = (number & 1u) == 1u;
    if number < 2u {
        return Search(1u - sheet.axis, upper_or_lower(is_odd), 0.0, 0.0);
    }
    let middle = middle_row(reaches);
    if number < 4u {
        return Search(sheet.axis, upper_or_lower(is_odd), middle, 0.0);
    }
    let quarter = 0.25 * (reaches[0] + reaches[1]);
    let across = middle + select(quarter, -quarter, is_odd);
    return Search(sheet.axis, upper_or_lower(number >= 6u), across, 0.0);
}

fn strip_middle(part: u32) -> f32 {
    return 0.5 * (STRIP_ENDS[part] + STRIP_ENDS[part + 1u]);
}

// The middle of a part, in cells from the point towards larger coordinates.
fn narrow_part_at(reaches: array<f32, MOST_SEARCHES>, part: u32) -> f32 {
    let cells = reaches[2] + reaches[3];
    return 0.5 * (reaches[3] - reaches[2]) + (strip_middle(part) - 0.5) * cells;
}

// A part seen from the middle towards the end on a side.
fn outwards(stratum: Stratum, side: f32) -> Stratum {
    var result = stratum;
    result.middle *= side;
    return result;
}

// The parts as photons, `probed` where they landed; `shortening` is by what those across let the footprint
// be as long as it is.
fn narrow_parts(
    sheet: NarrowSheet,
    reaches: array<f32, MOST_SEARCHES>,
    shortening: f32,
    probed: array<FootprintRecord, RECORDS_OF_DIVIDED>,
    strata: array<Stratum, RECORDS_OF_DIVIDED>,
) -> array<FootprintRecord, RECORDS_OF_DIVIDED> {
    let rows = reaches[0] + reaches[1];
    let cells = reaches[2] + reaches[3];
    let slants = select(
        2.0 * vec2(reaches[5] - reaches[4], reaches[6] - reaches[7]), vec2(0.0), sheet.is_alone);
    let lit = max(cells, 1.0) * select(rows, max(rows, 1.0), sheet.is_alone);
    let weight = min(lit, BRIGHTEST * cells * rows) / cells;
    var parts = probed;
    for (var part = 0u; part < STRIPS; part++) {
        // Outwards from the middle.
        let is_low = part < STRIPS / 2u;
        let side = upper_or_lower(!is_low);
        let below = outwards(strata[max(part, 1u) - 1u], side);
        let above = outwards(strata[min(part + 1u, STRIPS - 1u)], side);
        var before = below;
        var after = above;
        if is_low {
            before = above;
            after = below;
        }
        parts[part].flux_r *= weight;
        parts[part].flux_g *= weight;
        parts[part].flux_b *= weight;
        parts[part] = part_of(
            parts[part],
            sheet.axis,
            side,
            min(shortening, rows),
            slants.x + (slants.y - slants.x) * strip_middle(part),
            (STRIP_ENDS[part + 1u] - STRIP_ENDS[part]) * cells,
            outwards(strata[part], side),
            before,
            after,
            part > 0u && part + 1u < STRIPS,
        );
    }
    return parts;
}
