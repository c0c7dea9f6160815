// Orders the footprints by their level of resolution and says how many quads to draw at each.

@group(0) @binding(0) var<uniform> step: SplatStep;
@group(0) @binding(1) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(2) var<storage, read_write> counts: SplatCounts;
@group(0) @binding(3) var<storage, read_write> order: array<u32>;
// Vertices, instances, first vertex, first instance: for each level and layer.
@group(0) @binding(4) var<storage, read_write> draws: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> peak_sums: array<f32>;
@group(0) @binding(6) var<storage, read_write> splat_scale: SplatScale;

// The largest half float, with room for the rounding of sums.
const HALF_FLOAT_BOUND: f32 = 32768.0;

@compute @workgroup_size(256)
fn splat_order(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= atomicLoad(&counts.footprints) + atomicLoad(&counts.caught) {
        return;
    }
    let place = places[id.x];
    if place.rows == 0u {
        return;
    }
    var first = 0u;
    for (var level = 0u; level < place.level; level++) {
        first += atomicLoad(&counts.by_level[level]);
    }
    order[first + atomicAdd(&counts.level_cursor[place.level], 1u)] = id.x;
}

@compute @workgroup_size(128)
fn splat_draws(@builtin(local_invocation_index) local: u32) {
    if local >= LEVELS * step.layers {
        return;
    }
    if local < LEVELS {
        // The sample that the estimate is made from.
        let all = atomicLoad(&counts.by_level[local]);
        draws[LEVELS * step.layers + local] = vec4<u32>(4u, sample_count(all), 0u, 0u);
    }
    let count = atomicLoad(&counts.by_level[local / step.layers]);
    draws[local] = vec4<u32>(4u, (count + step.layers - 1u) / step.layers, 0u, 0u);
}

var<workgroup> partial: array<f32, 256>;

// Adds this batch's peaks to those of the batches before.
@compute @workgroup_size(256)
fn splat_peaks(@builtin(local_invocation_index) local: u32) {
    let groups = (atomicLoad(&counts.footprints) + 255u) / 256u;
    var sum = 0.0;
    for (var i = local; i < groups; i += 256u) {
        sum += peak_sums[i];
    }
    partial[local] = sum;
    workgroupBarrier();
    if local == 0u {
        var all = select(splat_scale.peak_sum, 0.0, step.is_first != 0u);
        for (var i = 0u; i < 256u; i++) {
            all += partial[i];
        }
        splat_scale.peak_sum = all;
        let is_usable = all > 0.0 && is_finite_number(all);
        splat_scale.scale = select(1.0, HALF_FLOAT_BOUND / all, is_usable);
    }
}
