// The lines of the ledger, and the words of the buffer that has it. Twin: `TraceCounters`.
//
// Counts are words; sums of flux are integers of 64 bits in two words, in units of
// 1 / `trace.flux_scale` watts, so that they do not depend on the order of the sum.

const FATE_STORED: u32 = 0u;
const FATE_ABSORBED: u32 = 1u;
const FATE_ESCAPED: u32 = 2u;
const FATE_MISSED: u32 = 3u;
const FATE_UNAIMED: u32 = 4u;
const FATE_OVERLAP: u32 = 5u;
const FATE_DIRECT: u32 = 6u;
const FATE_TOO_DEEP: u32 = 7u;
const FATE_ROULETTE: u32 = 8u;
const FATE_INVALID: u32 = 9u;
// For want of room, in the buffer of records or for a photon's branches.
const FATE_CROWDED: u32 = 10u;
// Not ends, but lines of the same form.
const LINE_EMITTED: u32 = 11u;
const LINE_ROULETTE_GAIN: u32 = 12u;
// What photons at silhouettes got, and what was taken from them.
const LINE_SILHOUETTE_GAIN: u32 = 13u;
const LINE_SILHOUETTE_LOSS: u32 = 14u;
const LINES: u32 = 15u;

// The words of the buffer: records stored, and parts lost because there was no room; then a count
// for each line, then other counts, then sums by line, channel and word, the lower first.
const COUNTER_STORED: u32 = 0u;
const COUNTER_LOST: u32 = 1u;
const COUNTER_LINES: u32 = 2u;
const COUNTER_RAYS: u32 = 17u;
const COUNTER_FALLBACKS: u32 = 18u;
const COUNTER_BOUNDED: u32 = 19u;
const COUNTER_REPLACED: u32 = 20u;
const COUNTER_DIVIDED: u32 = 21u;
// Records of the batch that stand at the edge of a sheet of light.
const COUNTER_EDGES: u32 = 22u;
// Workgroups that divide them.
const COUNTER_EDGE_GROUPS: u32 = 23u;
const COUNTER_SUMS: u32 = 24u;
const COUNTERS: u32 = 114u;

@group(0) @binding(7) var<storage, read_write> counters: array<atomic<u32>>;
