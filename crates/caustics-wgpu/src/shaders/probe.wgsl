// Rays beside a photon, of which only one way is followed. Twin: `EdgeTracer::photon_at` in edges.rs
// of caustics-trace, with path_guide.rs.

// One way has one branch at a time.
const MAX_PENDING: u32 = 8u;
const RESERVED_PENDING: u32 = 4u;

// The way that is followed.
var<private> sought_path: u32;
var<private> sought_turns: u32;

// What landed there.
var<private> probed: FootprintRecord;
var<private> is_probed: bool;

fn store_photon(record: FootprintRecord, branch: Branch, path: u32) -> bool {
    if path == sought_path && !is_probed {
        probed = record;
        is_probed = true;
    }
    return true;
}

fn is_followed(turns: u32, depth: u32) -> bool {
    return is_same_way(turns, sought_turns, depth);
}

fn is_followed_channel(channel: u32) -> bool {
    return channel == (sought_turns & TURN_CHANNEL);
}

// Sends what leaves the light beside a point, in cells from it.
fn probe(emitter: u32, point: u32, offset: vec2<f32>) {
    is_probed = false;
    var sample = emission_sample(point, emitter);
    sample.point += offset.x * sample.spacing[0] + offset.y * sample.spacing[1];
    if all(sample.point >= vec2(0.0)) && all(sample.point < vec2(1.0)) {
        send(emitter, point, guided(emitter, sample));
    }
}
