use std::ops::Range;

use bytemuck::Pod;
use caustics_scene::{Environment, World};

use crate::body_order::BodyOrder;
use crate::buffers::{filled_buffer, fits};
use crate::gpu_scene::{Body, Node, PackedScene, Triangle, Vertex, WideNode};
use crate::renderer_error::RendererError;
use crate::scene_hierarchy::SceneHierarchy;
use crate::sky_tables;

/// A [`World`] where the shaders can trace it: vertices, triangles, objects with their materials,
/// a hierarchy of boxes over all of it, and the environment.
///
/// Each kind is one buffer that is bound whole. Within WebGPU's default limits of 128 MiB a binding
/// that is room for two million triangles; more is refused. An environment shares the buffer of
/// triangles, 16 bytes a texel: two million triangles leave room for 3072 by 1536 texels.
#[derive(Clone, Debug)]
pub struct SceneBuffers {
    pub(crate) nodes: wgpu::Buffer,
    pub(crate) wide_nodes: wgpu::Buffer,
    /// For each wide node the binary nodes that are its children.
    pub(crate) wide_sources: wgpu::Buffer,
    pub(crate) wide_count: u32,
    pub(crate) vertices: wgpu::Buffer,
    /// With the environment's rows and texels behind them.
    pub(crate) triangles: wgpu::Buffer,
    pub(crate) bodies: wgpu::Buffer,
    pub(crate) root: u32,
    /// Nodes by row, the leaves first; and where the rows lie in it.
    pub(crate) refit_order: wgpu::Buffer,
    pub(crate) rows: Vec<Range<u32>>,
    /// By how much each leaf's box is wider than what it holds, in metres.
    pub(crate) margin: f32,
    pub(crate) counts: SceneCounts,
    /// What the tables behind the triangles were made from.
    pub(crate) environment: Option<Environment>,
    /// Whether any receiver is glossy.
    pub(crate) is_glossy: bool,
    bytes: u64,
}

/// How many elements the buffers were made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SceneCounts {
    pub(crate) vertices: usize,
    pub(crate) triangles: usize,
    pub(crate) bodies: usize,
}

impl SceneBuffers {
    /// Builds the hierarchy and fills the buffers. They travel to the device with the next submission
    /// that uses them.
    ///
    /// # Errors
    /// [`BufferTooLarge`](crate::GpuError::BufferTooLarge) and
    /// [`TooMany`](crate::GpuError::TooMany), as [`RendererError::Gpu`];
    /// [`RendererError::DeviceLost`] where the device gives no memory.
    pub fn new(device: &wgpu::Device, world: &World) -> Result<Self, RendererError> {
        let packed = PackedScene::new(world)?;
        let hierarchy = SceneHierarchy::new(world, &BodyOrder::new(world)?);
        let mut bytes = 0;
        let nodes = upload::<Node>(device, "nodes", &hierarchy.nodes, &mut bytes)?;
        let wide = &hierarchy.wide;
        let wide_nodes = upload::<WideNode>(device, "wide nodes", &wide.nodes, &mut bytes)?;
        let what = "children of wide nodes";
        let wide_sources = upload::<[u32; 4]>(device, what, &wide.sources, &mut bytes)?;
        let vertices = upload::<Vertex>(device, "vertices", &packed.vertices, &mut bytes)?;
        let triangles = upload_triangles(device, packed.triangles, world, &mut bytes)?;
        let bodies = upload::<Body>(device, "bodies", &packed.bodies, &mut bytes)?;
        let (order, rows) = hierarchy.refit_order();
        let refit_order = upload::<u32>(device, "refit order", &order, &mut bytes)?;
        Ok(Self {
            nodes,
            wide_nodes,
            wide_sources,
            wide_count: wide.nodes.len() as u32,
            vertices,
            triangles,
            bodies,
            root: hierarchy.root(),
            refit_order,
            rows,
            margin: hierarchy.margin,
            counts: SceneCounts {
                vertices: packed.vertices.len(),
                triangles: world.triangles().len(),
                bodies: packed.bodies.len(),
            },
            environment: world.environment().cloned(),
            is_glossy: is_glossy(world),
            bytes,
        })
    }

    /// The vertices, 32 bytes each: position and unit normal as six floats, then eight bytes that
    /// are not used. A host may write them, and then has to record
    /// [`SceneRefit::fit`](crate::SceneRefit::fit).
    #[must_use]
    pub fn vertices(&self) -> &wgpu::Buffer {
        &self.vertices
    }

    /// The nodes of the hierarchy, 32 bytes each: the lowest corner of the box as three floats; the
    /// index of the left child, which the right one follows, or for a leaf its primitive; the
    /// highest corner; and 1 for a leaf, else 0.
    #[must_use]
    pub fn nodes(&self) -> &wgpu::Buffer {
        &self.nodes
    }

    /// Memory of the device that they occupy, in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Whether any object of the world is glossy.
fn is_glossy(world: &World) -> bool {
    world.objects().iter().any(|object| {
        let surface = &world.materials()[object.material as usize].surface;
        surface.brdf().is_some_and(|brdf| !brdf.is_lambertian())
    })
}

/// The triangles, and behind them the world's environment.
fn upload_triangles(
    device: &wgpu::Device,
    mut triangles: Vec<Triangle>,
    world: &World,
    total: &mut u64,
) -> Result<wgpu::Buffer, RendererError> {
    let Some(sky) = world.environment() else {
        return upload::<Triangle>(device, "triangles", &triangles, total);
    };
    let what = "triangles with the texels of the environment";
    let count = triangles.len() + sky.rows().len() + sky.texels().len();
    fits(device, what, (count * size_of::<Triangle>()) as u64)?;
    triangles.extend(sky_tables::packed_sky(sky));
    upload::<Triangle>(device, what, &triangles, total)
}

/// A storage buffer of these elements, or of one that is never read where there are none.
fn upload<T: Pod>(
    device: &wgpu::Device,
    what: &'static str,
    elements: &[T],
    total: &mut u64,
) -> Result<wgpu::Buffer, RendererError> {
    let bytes = size_of_val(elements).max(size_of::<T>()) as u64;
    fits(device, what, bytes)?;
    *total += bytes;
    let nothing = [T::zeroed()];
    let contents = if elements.is_empty() {
        &nothing
    } else {
        elements
    };
    let copies = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let usage = wgpu::BufferUsages::STORAGE | copies;
    filled_buffer(device, what, usage, bytemuck::cast_slice(contents))
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_geometry::shapes::icosphere;
    use caustics_scene::{Instance, Material, Scene, Shape};

    #[test]
    fn half_a_million_triangles_fit_bindings_of_128_mib() {
        let mut scene = Scene::new();
        let mesh = scene.add_mesh(icosphere(1.0, 3).unwrap());
        let glass = scene
            .add_material(Material::dielectric("glass", 1.5))
            .unwrap();
        let ball = Instance::new("ball", Shape::Mesh(mesh), glass);
        scene.add_instance(ball).unwrap();
        let world = World::new(&scene).unwrap();
        let packed = PackedScene::new(&world).unwrap();
        let hierarchy = SceneHierarchy::new(&world, &BodyOrder::new(&world).unwrap());
        let triangles = world.triangles().len();
        assert_eq!(packed.triangles.len(), triangles);
        assert_eq!(hierarchy.nodes.len(), 2 * triangles - 1);
        assert!(packed.vertices.len() <= 3 * triangles);
        assert_eq!(hierarchy.refit_order().0.len(), hierarchy.nodes.len());

        let limit = wgpu::Limits::default().max_storage_buffer_binding_size;
        let bytes = |triangles: u64| {
            [
                (2 * triangles - 1) * size_of::<Node>() as u64,
                // Even if none is shared.
                3 * triangles * size_of::<Vertex>() as u64,
                triangles * size_of::<Triangle>() as u64,
                (2 * triangles - 1) * size_of::<u32>() as u64,
            ]
        };
        assert!(bytes(500_000).iter().all(|&it| it <= limit));
        assert!(bytes(2_000_000)[0] <= limit && bytes(2_200_000)[0] > limit);
    }
}
