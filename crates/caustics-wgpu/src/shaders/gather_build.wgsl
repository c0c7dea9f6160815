// Sorts footprints into the lists of a hash grid by counting.
// CPU twin: `FootprintGather::new` of caustics-render.

const_assert DENSITY_OVERLAP_BIT == OVERLAP_BIT;

@group(0) @binding(0) var<uniform> grid: GatherGrid;
@group(0) @binding(1) var<storage, read> footprints: array<FootprintRecord>;
@group(0) @binding(2) var<storage, read> footprint_count: array<u32>;
@group(0) @binding(3) var<storage, read_write> densities: array<StoredDensity>;
@group(0) @binding(4) var<storage, read_write> list_counts: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read> list_starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> entries: array<u32>;
// Stored, widened, shortened, invalid, entries, entries without room, and the sizes in use.
@group(0) @binding(7) var<storage, read_write> counts: array<atomic<u32>, 8>;

struct Cells {
    size: u32,
    first: vec3<i32>,
    last: vec3<i32>,
}

// The cells that the box around what a footprint may light touches.
fn cells_of(d: Density) -> Cells {
    let half = kernel_outer_reach(d.truncation) * sqrt(d.axis_u * d.axis_u + d.axis_v * d.axis_v);
    let up = towards_light(d.incoming, d.normal);
    let reach = density_reach(d);
    let low = -PLANE_DISTANCE * reach * up;
    let high = reach * up;
    // A little more than all, so that no rounding leaves a gap.
    let slack = 1e-3 * half + 1e-6 * abs(d.center);
    let corner_low = d.center + min(low, high) - half - slack;
    let corner_high = d.center + max(low, high) + half + slack;
    let extent = max(max(corner_high.x - corner_low.x, corner_high.y - corner_low.y), corner_high.z - corner_low.z);
    var size = 0u;
    var edge = grid.cell;
    while edge < extent && size < 31u {
        edge *= 2.0;
        size += 1u;
    }
    return Cells(size, gather_cell(corner_low, edge), gather_cell(corner_high, edge));
}

fn bounded(axis: vec3<f32>) -> vec3<f32> {
    let longest = grid.most_extent / grid.scale;
    let largest = max(max(abs(axis.x), abs(axis.y)), abs(axis.z));
    if largest > longest {
        return axis / largest * longest;
    }
    return axis;
}

fn is_shortened(record: FootprintRecord) -> bool {
    return any(bounded(record.axis_u) != record.axis_u) || any(bounded(record.axis_v) != record.axis_v);
}

fn covariance_of(record: FootprintRecord) -> Covariance {
    let u = bounded(record.axis_u);
    let v = bounded(record.axis_v);
    return covariance_of_axes(u, v, record.normal, grid.scale, grid.max_anisotropy);
}

// What the shortest direction lacks to the least variance.
fn lacking(c: Covariance) -> f32 {
    return grid.least_extent * grid.least_extent - covariance_eigenvalues(c).x;
}

fn density_of(record: FootprintRecord) -> Density {
    let c = covariance_of(record);
    let lack = max(lacking(c), 0.0);
    let widened = c + vec3<f32>(lack, 0.0, lack);
    let truncation = truncation_of(grid.truncation, record.object);
    return density_spread(
        record.position, record.normal, record.incoming, flux_of(record), widened, truncation,
    );
}

// The list of one of the eight corners of the box, unless an earlier one has the same.
fn list_of(cells: Cells, corner: u32) -> u32 {
    let mine = corner_list(cells, corner);
    for (var other = 0u; other < corner; other++) {
        if corner_list(cells, other) == mine {
            return NO_FOOTPRINT;
        }
    }
    return mine;
}

fn corner_list(cells: Cells, corner: u32) -> u32 {
    let upper = (vec3<u32>(corner) >> vec3<u32>(0u, 1u, 2u) & vec3<u32>(1u)) != vec3<u32>(0u);
    return gather_list(select(cells.first, cells.last, upper), cells.size, grid.lists);
}

@compute @workgroup_size(256)
fn gather_count(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= min(footprint_count[0], arrayLength(&footprints)) {
        return;
    }
    let record = footprints[id.x];
    let d = density_of(record);
    if !(d.is_valid && is_finite_vector(record.position)) {
        atomicAdd(&counts[3], 1u);
        // Marks it as left out.
        densities[id.x].reach = -1.0;
        return;
    }
    atomicAdd(&counts[0], 1u);
    atomicAdd(&counts[1], u32(lacking(covariance_of(record)) > 0.0));
    atomicAdd(&counts[2], u32(is_shortened(record)));
    let cells = cells_of(d);
    atomicOr(&counts[6], 1u << cells.size);
    densities[id.x] = density_store(d, gate_of(density_reach(d)), record.object);
    for (var corner = 0u; corner < 8u; corner++) {
        let list = list_of(cells, corner);
        if list != NO_FOOTPRINT {
            atomicAdd(&list_counts[list], 1u);
        }
    }
}

@compute @workgroup_size(256)
fn gather_scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= min(footprint_count[0], arrayLength(&footprints)) {
        return;
    }
    if densities[id.x].reach < 0.0 {
        return;
    }
    // Anew from the record: what is stored is rounded and might touch other cells.
    let cells = cells_of(density_of(footprints[id.x]));
    for (var corner = 0u; corner < 8u; corner++) {
        let list = list_of(cells, corner);
        if list == NO_FOOTPRINT {
            continue;
        }
        let at = list_starts[list] + atomicAdd(&list_counts[list], 1u);
        atomicAdd(&counts[4], 1u);
        if at < arrayLength(&entries) {
            entries[at] = id.x | (cells.size << GATHER_SIZE_SHIFT);
        } else {
            atomicAdd(&counts[5], 1u);
        }
    }
}
