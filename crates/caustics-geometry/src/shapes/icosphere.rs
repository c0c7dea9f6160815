use std::collections::HashMap;

use glam::DVec3;

use super::ShapeError;
use super::error::{check_positive, check_vertices};
use crate::TriangleMesh;

/// A sphere of nearly equal triangles: an icosahedron, each triangle of which is cut into four
/// `subdivisions` times, with every vertex on the sphere and the sphere's own normals.
///
/// It has `20 * 4^subdivisions` triangles.
///
/// # Errors
///
/// [`ShapeError`] where the radius is not positive or the triangles are too many.
pub fn icosphere(radius: f32, subdivisions: u32) -> Result<TriangleMesh, ShapeError> {
    check_positive("radius", radius)?;
    let triangles = 4_u64
        .checked_pow(subdivisions)
        .and_then(|cuts| cuts.checked_mul(20));
    // Euler: half as many vertices as triangles, and two.
    check_vertices(triangles.map_or(u64::MAX, |count| count / 2 + 2))?;
    let mut directions = icosahedron_corners().to_vec();
    let mut faces = icosahedron_faces(&directions);
    for _ in 0..subdivisions {
        faces = subdivide(&mut directions, &faces);
    }
    let positions = directions
        .iter()
        .map(|d| (f64::from(radius) * *d).as_vec3())
        .collect();
    let normals = directions.iter().map(|d| d.as_vec3()).collect();
    Ok(TriangleMesh::new(positions, Some(normals), faces)?)
}

/// The corners of an icosahedron, of unit length: the cyclic permutations of `(0, ±1, ±phi)`.
fn icosahedron_corners() -> [DVec3; 12] {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = [DVec3::ZERO; 12];
    for (sign, corner) in corners.iter_mut().enumerate() {
        let near = if sign & 1 == 0 { 1.0 } else { -1.0 };
        let far = if sign & 2 == 0 { phi } else { -phi };
        *corner = match sign / 4 {
            0 => DVec3::new(0.0, near, far),
            1 => DVec3::new(near, far, 0.0),
            _ => DVec3::new(far, 0.0, near),
        }
        .normalize();
    }
    corners
}

/// The 20 triples of neighbouring corners, wound outwards.
fn icosahedron_faces(corners: &[DVec3]) -> Vec<[u32; 3]> {
    // Neighbours have the cosine 1/sqrt(5), 0.447; all other pairs a negative one.
    let adjacent = |p: usize, q: usize| corners[p].dot(corners[q]) > 0.4;
    let mut faces = Vec::with_capacity(20);
    for a in 0..corners.len() {
        for b in (a + 1..corners.len()).filter(|&b| adjacent(a, b)) {
            for c in (b + 1..corners.len()).filter(|&c| adjacent(a, c) && adjacent(b, c)) {
                let outwards = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                let [b, c] = if outwards { [b, c] } else { [c, b] };
                faces.push([a as u32, b as u32, c as u32]);
            }
        }
    }
    faces
}

/// Cuts each face into four, at the middles of its edges, and pushes these out to the sphere.
fn subdivide(directions: &mut Vec<DVec3>, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = HashMap::with_capacity(faces.len() * 3 / 2);
    let mut cut = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces {
        let mut middle = |p: u32, q: u32| {
            *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                let sum = directions[p as usize] + directions[q as usize];
                directions.push(sum.normalize());
                directions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        cut.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    cut
}
