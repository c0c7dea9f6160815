// What probes cost. They are no photons: of all that they meet only the rays are counted, as
// `EdgeTracer` does in edges.rs of caustics-trace.

var<workgroup> group_rays: atomic<u32>;
var<workgroup> group_divided: atomic<u32>;

fn count_up(counter: u32, by: u32) {
    if counter == COUNTER_RAYS {
        atomicAdd(&group_rays, by);
    }
}

fn book(line: u32, flux: vec3<f32>) {}

// After a barrier, by one invocation.
fn publish_probes() {
    atomicAdd(&counters[COUNTER_RAYS], atomicLoad(&group_rays));
    atomicAdd(&counters[COUNTER_DIVIDED], atomicLoad(&group_divided));
}
