// How records are linked until they are in order.
//
// `links` has for each photon the place after its last record, 0 for none. Then, for each record, from
// `first_link` on three words: the place after the photon's record before it, with a flag; a hash of
// its path; and the turns that it took or, once it is divided, the place after the first of its parts,
// with a flag. Last, from `first_edge` on, the places after the records that are to be divided.

const LINK_WORDS: u32 = 3u;
const LINK_PLACE: u32 = 0x7fffffffu;
// Set in the first word where the footprint was widened for paths that ended where this one went on.
const LINK_THINNED: u32 = 0x80000000u;
// Set in the third word where the record's light is divided among further records.
const LINK_DIVIDED: u32 = 0x80000000u;

// The parts of a photon that is divided. Twin: the length of `STRATA` in edges.rs of caustics-trace.
const PARTS: u32 = 4u;

// Its records: the parts, and what they give back.
const RECORDS_OF_DIVIDED: u32 = PARTS + 1u;

// Where the words of the record before a place are.
fn link_of(first_link: u32, place: u32) -> u32 {
    return first_link + LINK_WORDS * (place - 1u);
}
