// The points that an emitter's photons are made from. Twin: lattice.rs in caustics-trace.

// Lists of the emitters: for each emissive object the fractions of its area up to and including each
// primitive, as bits; runs of points; cells of projection maps.
@group(0) @binding(5) var<storage, read> emission_lists: array<u32>;

// The number of no photon.
const NO_PHOTON: u32 = 0xffffffffu;

// The emitter whose photon this is: the last that does not begin after it.
fn emitter_of(photon: u32) -> u32 {
    var emitter = 0u;
    while emitter + 1u < trace.emitter_count && trace.emitters[emitter + 1u].first <= photon {
        emitter += 1u;
    }
    return emitter;
}

// Where a photon's entry in `links` is: the photons of the batch in their order, then those after
// and before it that were traced as their neighbours.
fn slot_of(photon: u32) -> u32 {
    let slot = photon - trace.batch_first;
    return select(slot, slot + trace.slots, photon < trace.batch_first);
}

// The number, in the whole set, of the point of an emitter's photon.
fn point_number(emitter: u32, index: u32) -> u32 {
    let first = trace.emitters[emitter].first_span;
    var low = 0u;
    var high = trace.emitters[emitter].span_count;
    if high == 0u {
        return index;
    }
    // The last run that does not begin after it.
    while low + 1u < high {
        let middle = (low + high) / 2u;
        if emission_lists[first + 2u * middle + 1u] <= index {
            low = middle;
        } else {
            high = middle;
        }
    }
    return emission_lists[first + 2u * low] + (index - emission_lists[first + 2u * low + 1u]);
}

// Which of an emitter's photons is made from point `number` of the whole set.
fn index_of_point(emitter: u32, number: u32) -> u32 {
    let count = trace.emitters[emitter].count;
    let spans = trace.emitters[emitter].span_count;
    if spans == 0u {
        return select(NO_PHOTON, number, number < count);
    }
    let first = trace.emitters[emitter].first_span;
    // The first run that begins after it.
    var low = 0u;
    var high = spans;
    while low < high {
        let middle = (low + high) / 2u;
        if emission_lists[first + 2u * middle] <= number {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if low == 0u {
        return NO_PHOTON;
    }
    let span = first + 2u * (low - 1u);
    let index = emission_lists[span + 1u] + (number - emission_lists[span]);
    var end = count;
    if low < spans {
        end = emission_lists[span + 3u];
    }
    return select(NO_PHOTON, index, index < end);
}

// The photons before and after an emitter's photon on a grid, along each of its axes: numbers among
// all photons. Where rows differ in length, a neighbour across rows is the nearest.
fn neighbours_of(emitter: u32, photon: u32) -> array<vec2<u32>, 2> {
    let count = trace.emitters[emitter].points;
    let rows = trace.emitters[emitter].rows;
    let first = trace.emitters[emitter].first;
    let number = point_number(emitter, photon - first);
    let cell = grid_cell(count, rows, number);
    let columns = grid_columns(count, rows, cell.row);
    // The row's first point, and those before and after it.
    let start = number - cell.column;
    let below = grid_columns(count, rows, max(cell.row, 1u) - 1u);
    let above = grid_columns(count, rows, cell.row + 1u);
    var points = array<vec2<u32>, 2>(
        vec2(number - 1u, number + 1u),
        vec2(
            start - below + min(cell.column, below - 1u),
            start + columns + min(cell.column, above - 1u),
        ),
    );
    var exists = array<vec2<bool>, 2>(
        vec2(cell.column > 0u, cell.column + 1u < columns),
        vec2(cell.row > 0u, cell.row + 1u < rows),
    );
    for (var axis = 0u; axis < 2u; axis++) {
        for (var side = 0u; side < 2u; side++) {
            var index = NO_PHOTON;
            if exists[axis][side] {
                index = index_of_point(emitter, points[axis][side]);
            }
            points[axis][side] = select(first + index, NO_PHOTON, index == NO_PHOTON);
        }
    }
    return points;
}
