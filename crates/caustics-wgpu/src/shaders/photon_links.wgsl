// How records are linked until they are in order.
//
// `links` has for each photon the place after its last record, 0 for none; then from
// `trace.first_link` on two words for each record: the place after the photon's record before it
// with a flag, and a hash of its path.

const LINK_PLACE: u32 = 0x7fffffffu;
// Set where the footprint was widened for paths that ended where this one went on.
const LINK_THINNED: u32 = 0x80000000u;
