//! Meshes to trace rays against, from a drinking glass to a finely tessellated sphere.

use std::f32::consts::{PI, TAU};

use caustics_geometry::shapes;
use glam::Vec3;

/// A named list of triangles.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Short name, with the approximate number of triangles.
    pub name: &'static str,
    /// Vertices, in metres.
    pub positions: Vec<Vec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn patch(name: &'static str, columns: u32, rows: u32, at: impl Fn(f32, f32) -> Vec3) -> Self {
        let mut positions = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                positions.push(at(column as f32 / columns as f32, row as f32 / rows as f32));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let (b, c) = (a + 1, a + columns + 1);
                triangles.extend([[a, b, c], [b, c + 1, c]]);
            }
        }
        Self {
            name,
            positions,
            triangles,
        }
    }

    /// The smallest box around the mesh: its centre and half its diagonal.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        caustics_geometry::Aabb::from_points(self.positions.iter().copied()).bounding_sphere()
    }
}

/// A stemmed glass with walls, 6016 triangles.
#[must_use]
pub fn glass() -> Mesh {
    Mesh::patch("glass6k", 94, 32, |u, v| {
        // Up the outside, over the rim and down the inside.
        let up = 1.0 - (2.0 * v - 1.0).abs();
        let inside = f32::from(u8::from(v > 0.5));
        let radius = 0.35 + 0.25 * (PI * up).sin() + 0.3 * (0.1 - up).max(0.0) * 10.0;
        let (sin, cos) = (TAU * u).sin_cos();
        let radius = radius - 0.03 * inside;
        Vec3::new(
            radius * cos,
            0.05 * inside * (1.0 - up) + up * 1.5,
            radius * sin,
        )
    })
}

/// A ball of 20 times 4 to the power of `subdivisions` triangles.
///
/// # Panics
/// If the triangles are too many.
#[must_use]
pub fn icosphere(name: &'static str, subdivisions: u32) -> Mesh {
    let mesh = shapes::icosphere(1.0, subdivisions).expect("a valid sphere");
    Mesh {
        name,
        positions: mesh.positions().to_vec(),
        triangles: mesh.triangles().to_vec(),
    }
}

/// A dented ball of 2 `cells`^2 triangles.
#[must_use]
pub fn blob(name: &'static str, cells: u32) -> Mesh {
    Mesh::patch(name, cells, cells, |u, v| {
        let (sin_theta, cos_theta) = (PI * v).sin_cos();
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        let d = Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi);
        let dent = (5.0 * d.x).sin() * (4.0 * d.y + 1.0).sin() + (7.0 * d.z + 2.0 * d.x).sin();
        d * (1.0 + 0.15 * dent + 0.03 * (23.0 * d.x + 17.0 * d.z).sin() * (19.0 * d.y).sin())
    })
}

/// A wavy square of water of 2 `cells`^2 triangles.
#[must_use]
pub fn water(name: &'static str, cells: u32) -> Mesh {
    Mesh::patch(name, cells, cells, |u, v| {
        let (x, z) = (4.0 * u - 2.0, 4.0 * v - 2.0);
        let mut y = 0.0;
        for (kx, kz, size) in [(5.0, 1.0, 0.05), (-3.0, 6.0, 0.03), (11.0, -9.0, 0.01)] {
            y += size * (kx * x + kz * z + size * 100.0).sin();
        }
        Vec3::new(x, y, z)
    })
}

/// From a drinking glass to half a million triangles: those that the tables are about.
#[must_use]
pub fn tabled() -> Vec<Mesh> {
    vec![
        glass(),
        icosphere("ico20k", 5),
        water("water200k", 316),
        blob("blob500k", 500),
    ]
}

/// The five meshes that the benchmarks are about.
#[must_use]
pub fn all() -> Vec<Mesh> {
    vec![
        glass(),
        icosphere("ico20k", 5),
        blob("blob100k", 223),
        water("water200k", 316),
        icosphere("ico320k", 7),
    ]
}
