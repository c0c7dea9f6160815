//! What a search in double precision says about rays and triangles, and triangles to try it on.

use caustics_accel::Intersect;
use caustics_geometry::glam::Vec3;
use caustics_geometry::{Aabb, Ray};
use proptest::prelude::*;

/// Relative error that single precision is granted in each step; a few times its unit.
const STEP: f64 = 1e-6;

/// What double precision says about a ray and a triangle.
struct Verdict {
    /// The ray passes well inside the triangle's edges.
    certain: bool,
    /// It passes inside, or so close to an edge that single precision cannot tell.
    possible: bool,
    t: f64,
    t_error: f64,
}

/// Woop's test in double precision, with bounds for what single precision may make of it.
fn judge(ray: &Ray, triangle: [Vec3; 3]) -> Verdict {
    let origin = ray.origin.as_dvec3();
    let direction = ray.direction.as_dvec3().to_array();
    let z = ray.direction.abs().max_position();
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    // Sheared coordinates, and the magnitudes of the terms that they are the difference of.
    let mut place = [[0.0; 3]; 3];
    let mut size = [[0.0; 3]; 3];
    for (i, vertex) in triangle.iter().enumerate() {
        let p: [f64; 3] = (vertex.as_dvec3() - origin).to_array();
        for (out, axis) in [x, y].into_iter().enumerate() {
            let shear = direction[axis] / direction[z] * p[z];
            place[i][out] = p[axis] - shear;
            size[i][out] = p[axis].abs() + shear.abs();
        }
        place[i][2] = p[z];
    }
    let mut weights = [0.0; 3];
    let mut errors = [0.0; 3];
    for i in 0..3 {
        let (b, c) = ((i + 1) % 3, (i + 2) % 3);
        weights[i] = place[c][0] * place[b][1] - place[c][1] * place[b][0];
        errors[i] = STEP * (size[c][0] * size[b][1] + size[c][1] * size[b][0]);
    }
    let sum: f64 = weights.iter().sum();
    let sign = sum.signum();
    let certain = (0..3).all(|i| weights[i] * sign > errors[i]);
    let possible =
        (0..3).all(|i| weights[i] >= -errors[i]) || (0..3).all(|i| weights[i] <= errors[i]);
    let depth: f64 = (0..3).map(|i| weights[i] * place[i][2]).sum();
    let lowest = (0..3).map(|i| place[i][2]).fold(f64::INFINITY, f64::min);
    let highest = (0..3)
        .map(|i| place[i][2])
        .fold(f64::NEG_INFINITY, f64::max);
    let spread = (errors.iter().sum::<f64>() / sum.abs()).min(1.0) * (highest - lowest);
    let farthest = lowest.abs().max(highest.abs());
    // Inside the triangle the depth lies between the vertices' in any precision.
    let depth = if certain {
        depth / sum
    } else {
        (depth / sum).clamp(lowest, highest)
    };
    let depth = if depth.is_nan() { lowest } else { depth };
    let spread = if possible && !certain {
        highest - lowest
    } else {
        spread
    };
    Verdict {
        certain,
        possible,
        t: depth / direction[z],
        t_error: (spread + 4.0 * STEP * farthest) / direction[z].abs(),
    }
}

/// Whether a structure says of a ray what double precision says.
pub(crate) fn agrees(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    tree: &impl Intersect,
    ray: &Ray,
) -> Result<(), TestCaseError> {
    let corners = |i: usize| triangles[i].map(|vertex| positions[vertex as usize]);
    let hit = tree.closest_hit(ray);
    let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
    let farthest = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t));
    for i in 0..triangles.len() {
        let verdict = judge(ray, corners(i));
        let (from, to) = (verdict.t - verdict.t_error, verdict.t + verdict.t_error);
        if verdict.certain && from > t_min && to < t_max {
            prop_assert!(
                farthest <= to,
                "{ray:?} hits triangle {i} at {} +- {} and not {hit:?}",
                verdict.t,
                verdict.t_error
            );
            prop_assert!(tree.is_occluded(ray), "{ray:?} is stopped by triangle {i}");
        }
    }
    if let Some(hit) = hit {
        let verdict = judge(ray, corners(hit.primitive as usize));
        prop_assert!(verdict.possible, "{ray:?} passes by triangle {hit:?}");
        let off = (f64::from(hit.t) - verdict.t).abs();
        prop_assert!(
            off <= verdict.t_error,
            "{ray:?} hits at {} instead of {}",
            hit.t,
            verdict.t
        );
        prop_assert!(
            hit.t > ray.t_min && hit.t < ray.t_max,
            "{hit:?} is outside the range of {ray:?}"
        );
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        prop_assert!(
            weights.iter().all(|w| (-1e-5..=1.00001).contains(w)),
            "{hit:?}"
        );
        prop_assert!(tree.is_occluded(ray));
    }
    Ok(())
}

pub(crate) fn unit_coordinates() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(
        prop_oneof![3 => -1.0_f32..1.0, 1 => (-2_i8..3).prop_map(|i| f32::from(i) / 2.0)],
    )
}

/// A soup of triangles: fat ones, slivers down to an aspect of 10^6, needles of no area, copies.
pub(crate) fn soup() -> impl Strategy<Value = (Vec<Vec3>, Vec<[u32; 3]>)> {
    let triangle = (
        unit_coordinates(),
        unit_coordinates(),
        unit_coordinates(),
        prop_oneof![Just(1.0_f32), Just(0.1), Just(1e-3), Just(1e-6), Just(0.0)],
        prop_oneof![Just(1.0_f32), Just(0.1)],
    );
    let scale = prop_oneof![Just(1.0_f32), Just(1e-4), Just(1e4)];
    let centre = prop_oneof![Just([0.0_f32; 3]), Just([1e4, -3e3, 50.0])];
    let copies = 1_usize..4;
    (
        prop::collection::vec(triangle, 0..150),
        scale,
        centre,
        copies,
    )
        .prop_map(|(triangles, scale, centre, copies)| {
            let mut positions = Vec::new();
            let mut indices = Vec::new();
            for (a, b, c, thickness, length) in triangles {
                let [a, b, c] = [a, b, c].map(Vec3::from_array);
                let first = positions.len() as u32;
                let along = (b - a) * length;
                for p in [a, a + along, a + along * 0.5 + (c - a) * thickness * length] {
                    positions.push(p * scale + Vec3::from_array(centre));
                }
                for _ in 0..copies {
                    indices.push([first, first + 1, first + 2]);
                }
            }
            (positions, indices)
        })
}

/// A ray for each aim: about half of them go through a point of a triangle, some along an axis.
pub(crate) fn rays_at(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    aims: Vec<([f32; 3], [f32; 3], [u8; 4])>,
) -> Vec<Ray> {
    let corners = triangles.iter().flatten();
    let bounds = Aabb::from_points(corners.map(|&vertex| positions[vertex as usize]));
    let size = bounds.diagonal().length().max(1e-3);
    let middle = bounds.center();
    let mut rays = Vec::new();
    for (from, to, [kind, choice, a, b]) in aims {
        let [from, to] = [from, to].map(Vec3::from_array);
        let origin = middle + from * size;
        let mut target = middle + to * size * 0.5;
        if !triangles.is_empty() && kind & 1 == 0 {
            let corners = triangles[choice as usize % triangles.len()];
            let [p, q, r] = corners.map(|vertex| positions[vertex as usize]);
            let (u, v) = (f32::from(a) / 512.0, f32::from(b) / 512.0);
            target = p + (q - p) * u + (r - p) * v;
        }
        let mut direction = target - origin;
        if kind & 6 == 2 {
            let axis = direction.abs().max_position();
            let mut along = Vec3::ZERO;
            along[axis] = direction[axis];
            direction = along;
        }
        if direction.length() >= 1e-9 {
            rays.push(Ray::new(origin, direction));
        }
    }
    rays
}
