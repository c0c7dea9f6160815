// Which footprints are in which layer, and which of them stand for all where sums are estimated.
//
// A row of a level's order are neighbours in the lattice: they may all land on one pixel.

// One of so many in a row of a level's order.
const SAMPLE_STRIDE: u32 = 16u;
// About so many of these are added up a second time for themselves: if all are on one pixel, half
// floats still add up.
const SPARSE_SAMPLE: u32 = 1024u;

fn sample_count(count: u32) -> u32 {
    return (count + SAMPLE_STRIDE - 1u) / SAMPLE_STRIDE;
}

fn sample_hash(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Where in the order of so many footprints a sample stands: anywhere in its row, since every
// sixteenth point of a lattice may be in one part of it.
fn sample_place(sample: u32, count: u32) -> u32 {
    let first = SAMPLE_STRIDE * sample;
    return first + sample_hash(sample) % min(SAMPLE_STRIDE, max(count, first + 1u) - first);
}

// For how many samples a sample stands among the few: 0 if it is none of them.
fn sparse_weight(sample: u32, count: u32) -> f32 {
    let stride = (sample_count(count) + SPARSE_SAMPLE - 1u) / SPARSE_SAMPLE;
    let chosen = sample_hash(~(sample / stride)) % stride;
    return select(0.0, f32(stride), sample % stride == chosen);
}

// Where in the order a layer's footprint stands: each row of as many as there are layers has one in
// each. The last row may lack some.
fn layer_place(instance: u32, layer: u32, layers: u32) -> u32 {
    return layers * instance + (layer + sample_hash(instance)) % layers;
}
