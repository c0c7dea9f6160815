// Photons where more of them are wanted. Twins: `DensityTable::sample` in caustics-sampling,
// `EmissionSample::guided` in caustics-trace.

// Values along one axis of a table, between two rows of its nodes.
struct DensityRow {
    // Where in `emission_lists` the first row's densities begin, and their integrals.
    densities: u32,
    integrals: u32,
    // From there to the second row's.
    next: u32,
    // How far it is from the first row, of the way to the second.
    up: f32,
}

fn listed(place: u32) -> f32 {
    return bitcast<f32>(emission_lists[place]);
}

fn between(first: f32, second: f32, along: f32) -> f32 {
    return first + rounded(along * (second - first));
}

fn row_value(place: u32, row: DensityRow) -> f32 {
    return between(listed(place), listed(place + row.next), row.up);
}

// Where in a cell of width 1 the integral of a density that runs from `first` to `second` is `area`.
fn inverse_integral(first: f32, second: f32, area: f32) -> f32 {
    let squared = rounded(first * first) + 2.0 * rounded((second - first) * area);
    let root = sqrt(max(squared, 0.0));
    return clamp(rounded(2.0 * area) * (1.0 / (first + root)), 0.0, 1.0);
}

// The sample where points are as dense as the emitter's table says. The table: for each row of nodes its
// integral, and that of all below it; for each node its density, and the integral of its row up to it.
fn guided(emitter: u32, sample: EmissionSample) -> EmissionSample {
    let cells = trace.emitters[emitter].density_cells;
    if cells == 0u {
        return sample;
    }
    let width = cells + 1u;
    let marginals = trace.emitters[emitter].first_density;
    let densities = marginals + 2u * width;
    let integrals = densities + width * width;
    let scale = f32(cells);
    let step = 1.0 / scale;

    // First which row, then where in it. In one loop, since software adapters take minutes longer for two.
    var row = DensityRow(marginals, marginals + width, 0u, 0.0);
    var sought = sample.point.y;
    var cell: vec2<u32>;
    var along: vec2<f32>;
    var ends: vec2<f32>;
    var density: vec2<f32>;
    for (var axis = 0u; axis < 2u; axis++) {
        var low = 0u;
        var high = cells;
        while high - low > 1u {
            let middle = (low + high) / 2u;
            if row_value(row.integrals + middle, row) <= sought {
                low = middle;
            } else {
                high = middle;
            }
        }
        let first = row_value(row.densities + low, row);
        let second = row_value(row.densities + low + 1u, row);
        let beyond = rounded((sought - row_value(row.integrals + low, row)) * scale);
        let part = rounded(inverse_integral(first, second, beyond));
        // The last are those of the row.
        cell = vec2(low, cell.x);
        along = vec2(part, along.x);
        density = vec2(between(first, second, part), density.x);
        ends = vec2(second - first, ends.x);
        row = DensityRow(densities + low * width, integrals + low * width, width, part);
        sought = rounded(sample.point.x * density.x);
    }

    // How the integral up to the image changes from row to row.
    let left = cell.y * width + cell.x;
    let after = vec2(listed(densities + left + width), listed(densities + left + width + 1u));
    let steepening = after - vec2(listed(densities + left), listed(densities + left + 1u));
    let turn = rounded(along.x * (steepening.y - steepening.x));
    let on_the_way = rounded(along.x * (steepening.x + rounded(0.5 * turn)));
    let raised = listed(integrals + left + width) - listed(integrals + left);
    let change = raised + rounded(on_the_way * step);
    let turning = rounded((change - rounded(sample.point.x * ends.y)) * scale);

    let weight = rounded(1.0 / density.x);
    let d_dv = rounded(1.0 / density.y);
    let across = vec2(-rounded(rounded(turning * weight) * d_dv), d_dv);
    let in_row = vec2(rounded(density.y * weight), 0.0);

    var result = sample;
    result.point = vec2(
        unit_nearest(rounded((f32(cell.x) + along.x) * step)),
        unit_nearest(rounded((f32(cell.y) + along.y) * step)),
    );
    for (var i = 0u; i < 2u; i++) {
        let edge = sample.spacing[i];
        result.spacing[i] = edge.x * in_row + edge.y * across;
    }
    result.weight = sample.weight * weight;
    return result;
}

// The part of its domain's flux that a sample stands for.
fn share_of(emitter: u32, sample: EmissionSample) -> f32 {
    return rounded(trace.emitters[emitter].share * sample.weight);
}
