// Puts the boxes of the binary hierarchy into the wide one. Twin: `WideNode::set_boxes` in
// wide_hierarchy.rs.

const WIDEN_WORKGROUP_SIZE: u32 = 64u;

// Rust mirror: `RefitRow` in scene_refit.rs; of it only `count` is used.
struct WidenParams {
    first: u32,
    count: u32,
    margin: f32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> widen: WidenParams;
@group(0) @binding(1) var<storage, read> nodes: array<Node>;
// For each wide node the binary nodes that are its children; all bits set where there is none.
@group(0) @binding(2) var<storage, read> sources: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> wide_nodes: array<WideNode>;

@compute @workgroup_size(WIDEN_WORKGROUP_SIZE)
fn widen_nodes(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let node = (group.y * groups.x + group.x) * WIDEN_WORKGROUP_SIZE + invocation;
    if node >= widen.count {
        return;
    }
    var low = vec3(3.4e38);
    var high = vec3(-3.4e38);
    for (var child = 0u; child < 4u; child++) {
        let source = sources[node][child];
        if source != 0xffffffffu {
            low = min(low, nodes[source].low);
            high = max(high, nodes[source].high);
        }
    }
    // The least power of two of which 254 are as long; one more is for rounding.
    let bits = bitcast<vec3<u32>>((high - low) / 254.0);
    let exponents = max((bits + vec3(0x7fffffu)) >> vec3(23u), vec3(1u));
    // The power's reciprocal.
    let steps = bitcast<vec3<f32>>((vec3(254u) - exponents) << vec3(23u));
    var low_bytes = vec3(0u);
    var high_bytes = vec3(0u);
    for (var child = 0u; child < 4u; child++) {
        let source = sources[node][child];
        if source != 0xffffffffu {
            let first = floor((nodes[source].low - low) * steps);
            let last = ceil((nodes[source].high - low) * steps);
            low_bytes |= vec3<u32>(clamp(first, vec3(0.0), vec3(255.0))) << vec3(8u * child);
            high_bytes |= vec3<u32>(clamp(last, vec3(0.0), vec3(255.0))) << vec3(8u * child);
        }
    }
    wide_nodes[node].origin = low;
    wide_nodes[node].exponents = exponents.x | (exponents.y << 8u) | (exponents.z << 16u);
    wide_nodes[node].low = low_bytes;
    wide_nodes[node].high = high_bytes;
}
