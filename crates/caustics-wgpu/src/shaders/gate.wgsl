// Which points a footprint may light.
// CPU twin: `Gate` of caustics-render's `footprint.rs`.

const MIN_NORMAL_COSINE: f32 = 0.5;
const PLANE_DISTANCE: f32 = 0.3;
// Another object whose normal has at least this cosine with the footprint's is parallel to it.
const PARALLEL_COSINE: f32 = 0.9;
// How far off its plane a footprint lights other objects that are parallel to it.
const TOUCHING: f32 = 0.05;
// How far before its plane a surface still is in it. All three are relative to the reach.
const IN_PLANE: f32 = 1e-3;

struct Gate {
    // From where before the footprint's plane other surfaces catch its light, in metres.
    before: f32,
    // How far before the plane, in metres.
    reach: f32,
    // How far beyond the plane, in metres.
    plane_distance: f32,
}

fn gate_of(reach: f32) -> Gate {
    return Gate(0.0, reach, PLANE_DISTANCE * reach);
}

// The footprint's plane and what is beyond it.
fn gate_own(gate: Gate) -> Gate {
    return Gate(gate.before, IN_PLANE * gate.reach, gate.plane_distance);
}

// What catches its light before the plane.
fn gate_before(gate: Gate) -> Gate {
    let seam = IN_PLANE * gate.reach;
    return Gate(seam, gate.reach, -seam);
}

// Whether a point passes that lies `off` metres before the plane, and whose normal has this cosine
// with the footprint's; on the footprint's own receiver, or on another object.
fn gate_admits(gate: Gate, off: f32, normal_cosine: f32, is_own: bool) -> bool {
    if !is_own && normal_cosine >= PARALLEL_COSINE {
        let touching = TOUCHING * gate.reach;
        return off >= -min(touching, gate.plane_distance) && off <= touching;
    }
    let is_curving = is_own && normal_cosine >= MIN_NORMAL_COSINE;
    let lowest = select(gate.before, -gate.plane_distance, is_curving);
    return off >= lowest && off <= gate.reach;
}
