use bytemuck::{Pod, Zeroable};
use caustics_scene::World;

use crate::GpuError;
use crate::error_scope::filled_buffer;
use crate::gpu_scene::PackedScene;
use crate::pass_layout::{PassLayout, Slot};
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::SceneBuffers;
use crate::scene_hierarchy::margin;
use crate::shader::{Shader, shader_piece};

const SHADER: Shader = Shader {
    label: "refit",
    pieces: &[shader_piece!("scene"), shader_piece!("refit")],
};

/// What the shader binds, in the order of its bindings.
const SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Write,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
];

/// Nodes of one workgroup. Mirrors `REFIT_WORKGROUP_SIZE` in `shaders/refit.wgsl`.
const WORKGROUP_SIZE: u32 = 64;

/// Workgroups of a dispatch along its first axis.
const MAX_GROUPS: u32 = 32_768;

/// Mirror of the struct of the same name in `shaders/refit.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct RefitRow {
    first: u32,
    count: u32,
    margin: f32,
    unused: u32,
}

/// Lets a scene's buffers follow what moves, without building the hierarchy anew.
///
/// A box over primitives that have parted is large, and rays that pass through it are slow: after
/// large motions, make new [`SceneBuffers`].
#[derive(Clone, Debug)]
pub struct SceneRefit {
    layout: PassLayout,
    pipeline: wgpu::ComputePipeline,
}

impl SceneRefit {
    /// Compiles the shader. What the device has against it it tells its error scopes.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = PassLayout::new(device, "refit", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let pipeline = layout.compute(device, &SHADER, "refit", &[]);
        Self { layout, pipeline }
    }

    /// Records the upload of a world's vertices, objects and materials, and fits the hierarchy to
    /// them. The world must have the primitives that the buffers were made for, in the same order.
    ///
    /// # Errors
    /// [`GpuError::SceneChanged`], as [`RendererError::Gpu`]; [`RendererError::DeviceLost`].
    pub fn update(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        scene: &mut SceneBuffers,
        world: &World,
    ) -> Result<RecordedWork, RendererError> {
        let packed = PackedScene::new(world)?;
        let sizes = [
            ("vertices", packed.vertices.len(), scene.counts.vertices),
            ("triangles", packed.triangles.len(), scene.counts.triangles),
            ("objects", packed.bodies.len(), scene.counts.bodies),
        ];
        for (what, given, expected) in sizes {
            if given != expected {
                let (given, expected) = (given as u64, expected as u64);
                return Err(RendererError::Gpu(GpuError::SceneChanged {
                    what,
                    given,
                    expected,
                }));
            }
        }
        let parts: [(&wgpu::Buffer, &[u8]); 3] = [
            (&scene.vertices, bytemuck::cast_slice(&packed.vertices)),
            (&scene.triangles, bytemuck::cast_slice(&packed.triangles)),
            (&scene.bodies, bytemuck::cast_slice(&packed.bodies)),
        ];
        for (buffer, bytes) in parts {
            if !bytes.is_empty() {
                let usage = wgpu::BufferUsages::COPY_SRC;
                let staging = filled_buffer(device, "scene update", usage, bytes)?;
                encoder.copy_buffer_to_buffer(&staging, 0, buffer, 0, bytes.len() as u64);
            }
        }
        scene.margin = margin(&world.bounds());
        self.fit(device, encoder, scene)
    }

    /// Records the fitting of the hierarchy alone, to vertices that the host has written into
    /// [`SceneBuffers::vertices`] itself.
    ///
    /// # Errors
    /// [`RendererError::DeviceLost`].
    pub fn fit(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        scene: &SceneBuffers,
    ) -> Result<RecordedWork, RendererError> {
        let mut rows = Vec::with_capacity(scene.rows.len());
        for range in &scene.rows {
            let row = RefitRow {
                first: range.start,
                count: range.len() as u32,
                margin: scene.margin,
                unused: 0,
            };
            let uniform = filled_buffer(
                device,
                "refit row",
                wgpu::BufferUsages::UNIFORM,
                bytemuck::bytes_of(&row),
            )?;
            let resources = [
                &uniform,
                &scene.nodes,
                &scene.vertices,
                &scene.triangles,
                &scene.bodies,
                &scene.refit_order,
            ]
            .map(wgpu::Buffer::as_entire_binding);
            rows.push((self.layout.bind(device, &resources), row.count));
        }
        let mut recorder = Recorder::new(encoder, None);
        let mut pass = recorder.compute("refit", rows.len() as u32);
        pass.set_pipeline(&self.pipeline);
        for (group, count) in &rows {
            pass.set_bind_group(0, group, &[]);
            let groups = count.div_ceil(WORKGROUP_SIZE);
            pass.dispatch_workgroups(groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS), 1);
        }
        drop(pass);
        Ok(recorder.finish().1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};

    #[test]
    fn the_shader_is_valid_and_agrees_with_rust() {
        let (module, _) = reflection::validated(&SHADER).unwrap_or_else(|it| panic!("{it}"));
        let slots: Vec<(u32, Slot)> = (0..).zip(SLOTS).collect();
        assert_eq!(reflection::buffers(&module), slots);
        assert_eq!(
            reflection::workgroup_size(&module, "refit"),
            [WORKGROUP_SIZE, 1, 1]
        );
        assert_layout!(
            &module,
            RefitRow {
                first,
                count,
                margin,
                unused
            }
        );
    }
}
