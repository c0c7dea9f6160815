// How many records each photon of a batch has.

const COUNT_WORKGROUP_SIZE: u32 = 256u;

// Rust mirror: `PhotonCounts` in photon_order.rs.
struct PhotonCounts {
    photons: u32,
    // Where in `links` the records' entries begin.
    first_link: u32,
    unused_a: u32,
    unused_b: u32,
}

@group(0) @binding(0) var<uniform> batch: PhotonCounts;
@group(0) @binding(1) var<storage, read> links: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(COUNT_WORKGROUP_SIZE)
fn count_photons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let photon = (group.y * groups.x + group.x) * COUNT_WORKGROUP_SIZE + invocation;
    if photon >= batch.photons {
        return;
    }
    var count = 0u;
    var place = links[photon];
    while place != 0u {
        let link = link_of(batch.first_link, place);
        count += select(1u, RECORDS_OF_DIVIDED, (links[link + 2u] & LINK_DIVIDED) != 0u);
        place = links[link] & LINK_PLACE;
    }
    counts[photon] = count;
}
