// Which sheet of light a photon is a part of. Twin: path_guide.rs in caustics-trace.

// Set in the hash of a path whose light landed turned over.
const TURNED: u32 = 0x80000000u;

// The area of the parallelogram of two axes in the plane with unit `normal`; below 0 where it is turned
// over. Twin: `signed_area` in path_guide.rs.
fn signed_area(u: vec3<f32>, v: vec3<f32>, normal: vec3<f32>) -> f32 {
    let across = rounded_vector(u.yzx * v.zxy) - rounded_vector(v.yzx * u.zxy);
    return rounded_dot(across, normal);
}
