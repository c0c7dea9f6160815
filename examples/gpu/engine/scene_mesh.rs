use bytemuck::{Pod, Zeroable};
use caustics::geometry::shapes;
use caustics::glam::Vec3;
use caustics::prelude::{Surface, World};

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) albedo: [f32; 3],
    pub(crate) object: u32,
}

/// A world as lists of triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneMesh {
    /// Matt surfaces, with their geometric normals: receivers.
    pub(crate) opaque: Vec<Vertex>,
    /// Glass, with albedo 0, and metal; with interpolated normals.
    pub(crate) shining: Vec<Vertex>,
}

impl SceneMesh {
    pub(crate) fn new(world: &World) -> Self {
        let mut mesh = Self::default();
        for (number, object) in (0..).zip(world.objects()) {
            let surface = world.materials()[object.material as usize].surface;
            let (albedo, list, is_flat) = match surface {
                Surface::Diffuse { albedo } => (albedo, &mut mesh.opaque, true),
                Surface::Metal { f0 } => (f0, &mut mesh.shining, false),
                _ => (Vec3::ZERO, &mut mesh.shining, false),
            };
            let mut add = |corners: [Vec3; 3], normals: [Vec3; 3]| {
                let [a, b, c] = corners;
                let flat = (b - a).cross(c - a).normalize_or_zero();
                for (position, normal) in corners.into_iter().zip(normals) {
                    let normal = if is_flat { flat } else { normal };
                    list.push(Vertex {
                        position: position.to_array(),
                        normal: normal.to_array(),
                        albedo: albedo.to_array(),
                        object: number,
                    });
                }
            };
            for triangle in object.triangles.clone() {
                let corners = world.triangles()[triangle as usize].map(|it| it as usize);
                add(
                    corners.map(|it| world.positions()[it]),
                    corners.map(|it| world.normals()[it]),
                );
            }
            for sphere in object.spheres.clone() {
                let sphere = world.spheres()[sphere as usize];
                let Ok(ball) = shapes::icosphere(sphere.radius, 4) else {
                    continue;
                };
                for corners in ball.triangles() {
                    let corners = corners.map(|it| it as usize);
                    add(
                        corners.map(|it| sphere.center + ball.positions()[it]),
                        corners.map(|it| ball.normals()[it]),
                    );
                }
            }
        }
        mesh
    }
}
