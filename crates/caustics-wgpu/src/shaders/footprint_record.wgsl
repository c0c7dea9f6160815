// Light that landed on a receiver. Twin: `FootprintRecord` in footprint_record.rs.

// What is added to the object of a footprint that overlaps others, as those of area lights do.
const OVERLAP_BIT: u32 = 0x80000000u;

struct FootprintRecord {
    position: vec3<f32>,
    flux_r: f32,
    axis_u: vec3<f32>,
    flux_g: f32,
    axis_v: vec3<f32>,
    flux_b: f32,
    incoming: vec3<f32>,
    // Of the receiver, and `OVERLAP_BIT`.
    object: u32,
    normal: vec3<f32>,
    photon: u32,
}

fn flux_of(record: FootprintRecord) -> vec3<f32> {
    return vec3<f32>(record.flux_r, record.flux_g, record.flux_b);
}
