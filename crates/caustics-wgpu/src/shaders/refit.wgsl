// The hierarchy's boxes after its primitives have moved, a row of nodes to a dispatch: first the
// leaves, then those whose children are done. Twin: `SceneHierarchy::fit` in scene_hierarchy.rs.

struct RefitRow {
    // The row's nodes in `order`.
    first: u32,
    count: u32,
    // By how much each leaf's box is wider than what it holds.
    margin: f32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> row: RefitRow;
@group(0) @binding(1) var<storage, read_write> nodes: array<Node>;
@group(0) @binding(2) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(3) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(4) var<storage, read> bodies: array<Body>;
@group(0) @binding(5) var<storage, read> order: array<u32>;

const REFIT_WORKGROUP_SIZE: u32 = 64u;

@compute @workgroup_size(REFIT_WORKGROUP_SIZE)
fn refit(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let index = (group.y * groups.x + group.x) * REFIT_WORKGROUP_SIZE + invocation;
    if index >= row.count {
        return;
    }
    let node = order[row.first + index];
    let first = nodes[node].first;
    if nodes[node].is_leaf == 0u {
        nodes[node].low = min(nodes[first].low, nodes[first + 1u].low);
        nodes[node].high = max(nodes[first].high, nodes[first + 1u].high);
        return;
    }
    var low: vec3<f32>;
    var high: vec3<f32>;
    if (first & SPHERE_BIT) != 0u {
        let body = first ^ SPHERE_BIT;
        // Rounding is well within the margin.
        low = bodies[body].center - bodies[body].radius;
        high = bodies[body].center + bodies[body].radius;
    } else {
        let triangle = triangles[first];
        let a = vertices[triangle.a].position;
        let b = vertices[triangle.b].position;
        let c = vertices[triangle.c].position;
        low = min(min(a, b), c);
        high = max(max(a, b), c);
    }
    nodes[node].low = low - row.margin;
    nodes[node].high = high + row.margin;
}
