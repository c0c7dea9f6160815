// Turns counts into the places where lists start: an exclusive prefix sum in three dispatches.
// Each workgroup sums a block of 2048; one workgroup sums the blocks; each adds what came before.

const BLOCK: u32 = 2048u;
const EACH: u32 = 8u;

// Rust mirror: `GpuPrefixSum`.
struct PrefixSum {
    count: u32,
    blocks: u32,
    pad_a: u32,
    pad_b: u32,
}

@group(0) @binding(0) var<uniform> size: PrefixSum;
// Counts; afterwards zero, to serve as cursors.
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
// The starts, and the total in one more.
@group(0) @binding(2) var<storage, read_write> starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> block_sums: array<u32>;

var<workgroup> partial: array<u32, 256>;

// The sum of what the threads before this one in the workgroup gave.
fn sum_before(local: u32, value: u32) -> u32 {
    partial[local] = value;
    workgroupBarrier();
    for (var reach = 1u; reach < 256u; reach *= 2u) {
        var other = 0u;
        if local >= reach {
            other = partial[local - reach];
        }
        workgroupBarrier();
        partial[local] += other;
        workgroupBarrier();
    }
    return partial[local] - value;
}

@compute @workgroup_size(256)
fn prefix_sum_blocks(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let first = group.x * BLOCK + local * EACH;
    var sum = 0u;
    for (var i = first; i < min(first + EACH, size.count); i++) {
        sum += values[i];
    }
    let before = sum_before(local, sum);
    if local == 255u {
        block_sums[group.x] = before + sum;
    }
}

@compute @workgroup_size(256)
fn prefix_sum_of_blocks(@builtin(local_invocation_index) local: u32) {
    let each = (size.blocks + 255u) / 256u;
    let first = local * each;
    let last = min(first + each, size.blocks);
    var sum = 0u;
    for (var i = first; i < last; i++) {
        sum += block_sums[i];
    }
    var before = sum_before(local, sum);
    if local == 255u {
        starts[size.count] = before + sum;
    }
    for (var i = first; i < last; i++) {
        let value = block_sums[i];
        block_sums[i] = before;
        before += value;
    }
}

@compute @workgroup_size(256)
fn prefix_sum_add(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let first = group.x * BLOCK + local * EACH;
    var sum = 0u;
    for (var i = first; i < min(first + EACH, size.count); i++) {
        sum += values[i];
    }
    var before = sum_before(local, sum) + block_sums[group.x];
    for (var i = first; i < min(first + EACH, size.count); i++) {
        starts[i] = before;
        before += values[i];
        values[i] = 0u;
    }
}
