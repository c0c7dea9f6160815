// The sample that a photon is made from. Twins: point_set.rs, rank1_lattice.rs and kronecker.rs in
// caustics-sampling; `EmissionSample` in caustics-trace.

struct EmissionSample {
    point: vec2<f32>,
    // The edges of the cell that the point stands for.
    spacing: array<vec2<f32>, 2>,
    // Chooses the place on an area light.
    place: vec2<f32>,
    // The size of its cell, relative to an equal share of the domain.
    weight: f32,
}

fn rotated(point: vec2<f32>, shift: vec2<f32>) -> vec2<f32> {
    let moved = point + shift;
    return moved - select(vec2(0.0), vec2(1.0), moved >= vec2(1.0));
}

// `index` times a step of 64 bits, plus a half, as a fraction of 2^64.
fn kronecker(index: u32, step_high: u32, step_low: u32) -> f32 {
    return unit_from_bits(index * step_high + multiply_high(index, step_low) + 0x80000000u);
}

// Two coordinates of a grid as a lattice of four dimensions: what they are in the first cell, and the steps
// from column to column and from row to row.
fn joint_pair(
    cell: GridCell,
    start: vec2<f32>,
    by_column: vec2<u32>,
    by_row: vec2<u32>,
) -> vec2<f32> {
    let bits = cell.column * by_column + cell.row * by_row;
    return rotated(vec2(unit_from_bits(bits.x), unit_from_bits(bits.y)), start);
}

fn joint_start(dimension: u32) -> f32 {
    let seed = vec2(trace.seed_low, trace.seed_high);
    return select(unit_from_bits(pcg4d(vec4(seed, dimension, 2u)).x), 0.5, all(seed == vec2(0u)));
}

fn lattice_place(multiple: u32, count: u32) -> f32 {
    return unit_nearest(f32(2u * multiple + 1u) / f32(2u * count));
}

fn emission_sample(index: u32, emitter: u32) -> EmissionSample {
    let count = trace.emitters[emitter].points;
    let place = trace.emitters[emitter].place;
    let edge = 1.0 / sqrt(f32(count));
    var result: EmissionSample;
    result.weight = 1.0;
    result.spacing = array(vec2(edge, 0.0), vec2(0.0, edge));
    if trace.sequence == SEQUENCE_GRID {
        let cell = grid_cell(count, trace.emitters[emitter].rows, index);
        var inside = place;
        if PARAMETERS > 2u {
            inside = joint_pair(cell, place, vec2(0u, 0x61c88647u), vec2(0x4498517bu, 0u));
            let start = vec2(joint_start(2u), joint_start(3u));
            result.place = joint_pair(
                cell, start, vec2(0x978fcfb9u, 0xf62124a1u), vec2(0xa0cd1370u, 0x6921ee11u));
        }
        let point = cell.corner + inside * cell.size;
        result.point = vec2(unit_nearest(point.x), unit_nearest(point.y));
        result.spacing = array(vec2(cell.size.x, 0.0), vec2(0.0, cell.size.y));
    } else if trace.sequence == SEQUENCE_HALTON {
        result.point = vec2(halton(index, 0u), halton(index, 1u));
        result.place = vec2(halton(index, 2u), halton(index, 3u));
    } else if trace.sequence == SEQUENCE_SOBOL {
        result.point = vec2(sobol(index, 0u), sobol(index, 1u));
        result.place = vec2(sobol(index, 2u), sobol(index, 3u));
    } else {
        if trace.sequence == SEQUENCE_FIBONACCI {
            let generator = trace.emitters[emitter].generator;
            let product = multiply_modulo(index, generator, count);
            result.point = vec2(lattice_place(index, count), lattice_place(product, count));
            let basis = trace.emitters[emitter].basis;
            result.spacing = array(basis.xy, basis.zw);
        } else {
            result.point = vec2(
                kronecker(index, 0xc13fa9a9u, 0x02a6328fu),
                kronecker(index, 0x91e10da5u, 0xc79e7b1du),
            );
        }
        result.point = rotated(result.point, place);
        result.place = vec2(sobol(index, 4u), sobol(index, 5u));
    }
    return result;
}
