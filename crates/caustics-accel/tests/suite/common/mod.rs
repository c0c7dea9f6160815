//! A closed mesh and rays aimed at its weakest places.

pub(crate) mod brute_force;

use std::collections::HashMap;

use caustics_geometry::Ray;
use caustics_geometry::glam::{DVec3, Vec3};

/// A sphere of radius 1 as 20 * 4^`subdivisions` triangles.
pub(crate) fn icosphere(subdivisions: u32, centre: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (x, y) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.push(DVec3::new(x, y, 0.0).normalize());
    }
    for (y, z) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.push(DVec3::new(0.0, y, z).normalize());
    }
    for (z, x) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.push(DVec3::new(x, 0.0, z).normalize());
    }
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let positions = points
        .iter()
        .map(|p| (*p + centre.as_dvec3()).as_vec3())
        .collect();
    (positions, triangles)
}

/// A square lattice's cells in Morton order, by column and row: 4 to the power of `log2_side`.
pub(crate) fn morton_cells(log2_side: u32) -> impl Iterator<Item = (u32, u32)> {
    let every_other = move |code: u32| {
        (0..log2_side)
            .map(|bit| (code >> (2 * bit) & 1) << bit)
            .sum()
    };
    (0..1_u32 << (2 * log2_side)).map(move |code| (every_other(code), every_other(code >> 1)))
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// At a random point of a random edge.
    Edge,
    /// At a random vertex.
    Vertex,
}

/// Rays from random points inside a sphere of radius 1/2, aimed in double precision.
pub(crate) struct AimedRays<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    centre: Vec3,
    state: u64,
}

impl<'a> AimedRays<'a> {
    pub(crate) fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]], centre: Vec3) -> Self {
        Self {
            positions,
            triangles,
            centre,
            state: 0,
        }
    }

    /// `SplitMix64` (Steele, Lea, Flood 2014).
    fn random(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Between 0 and 1.
    fn uniform(&mut self) -> f64 {
        (self.random() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn next(&mut self, aim: Aim) -> Ray {
        let offset = loop {
            let p = DVec3::new(self.uniform(), self.uniform(), self.uniform()) - 0.5;
            if p.length() < 0.5 {
                break p;
            }
        };
        let origin = self.centre + offset.as_vec3();
        let corners = self.triangles[(self.random() % self.triangles.len() as u64) as usize];
        let first = (self.random() % 3) as usize;
        let a = self.positions[corners[first] as usize].as_dvec3();
        let b = self.positions[corners[(first + 1) % 3] as usize].as_dvec3();
        let target = match aim {
            Aim::Edge => a.lerp(b, self.uniform()),
            Aim::Vertex => a,
        };
        Ray::new(origin, (target - origin.as_dvec3()).as_vec3())
    }
}
