use bytemuck::{Pod, Zeroable};
use caustics_scene::{Environment, World};

use crate::GpuError;
use crate::buffers::filled_buffer;
use crate::gpu_scene::{PackedScene, Triangle};
use crate::pass_layout::{PassLayout, Slot};
use crate::photon_order::dispatch;
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::SceneBuffers;
use crate::scene_hierarchy::margin;
use crate::shader::{Shader, shader_piece};
use crate::sky_tables::{packed_sky, same_size, sky_size};

const SHADER: Shader = Shader {
    label: "refit",
    pieces: &[shader_piece!("scene"), shader_piece!("refit")],
};

const WIDEN: Shader = Shader {
    label: "widen",
    pieces: &[shader_piece!("scene"), shader_piece!("widen")],
};

const WIDEN_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Read, Slot::Read, Slot::Write];

/// What the shader binds, in the order of its bindings.
const SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Write,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
];

/// Nodes of one workgroup. Mirrors `REFIT_WORKGROUP_SIZE` in `shaders/refit.wgsl` and
/// `WIDEN_WORKGROUP_SIZE` in `shaders/widen.wgsl`.
const WORKGROUP_SIZE: u32 = 64;

/// Mirror of the struct of the same name in `shaders/refit.wgsl`, and of `WidenParams`.
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
    widen_layout: PassLayout,
    widen: wgpu::ComputePipeline,
}

impl SceneRefit {
    /// Compiles the shader. What the device has against it it tells its error scopes.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = PassLayout::new(device, "refit", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let pipeline = layout.compute(device, &SHADER, "refit", &[]);
        let stage = wgpu::ShaderStages::COMPUTE;
        let widen_layout = PassLayout::new(device, "widen", stage, &WIDEN_SLOTS);
        let widen = widen_layout.compute(device, &WIDEN, "widen_nodes", &[]);
        Self {
            layout,
            pipeline,
            widen_layout,
            widen,
        }
    }

    /// Records the upload of a world's vertices, objects and materials, and of its environment where
    /// that is another, and fits the hierarchy to them. The world must have the primitives that the
    /// buffers were made for, in the same order, and an environment of the same size.
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
        let before = scene.environment.as_ref();
        let sky = world.environment();
        same_size(sky_size(sky), sky_size(before))?;
        let is_other = |sky: &&Environment| !before.is_some_and(|it| it.shares_picture(sky));
        let tables: Vec<Triangle> = sky
            .filter(is_other)
            .into_iter()
            .flat_map(packed_sky)
            .collect();
        let triangles: &[u8] = bytemuck::cast_slice(&packed.triangles);
        let parts: [(&wgpu::Buffer, usize, &[u8]); 4] = [
            (&scene.vertices, 0, bytemuck::cast_slice(&packed.vertices)),
            (&scene.triangles, 0, triangles),
            (
                &scene.triangles,
                triangles.len(),
                bytemuck::cast_slice(&tables),
            ),
            (&scene.bodies, 0, bytemuck::cast_slice(&packed.bodies)),
        ];
        for (buffer, first, bytes) in parts {
            if !bytes.is_empty() {
                let usage = wgpu::BufferUsages::COPY_SRC;
                let staging = filled_buffer(device, "scene update", usage, bytes)?;
                let size = bytes.len() as u64;
                encoder.copy_buffer_to_buffer(&staging, 0, buffer, first as u64, size);
            }
        }
        scene.environment = sky.cloned();
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
        let all = RefitRow {
            first: 0,
            count: scene.wide_count,
            margin: scene.margin,
            unused: 0,
        };
        let uniform = filled_buffer(
            device,
            "widen",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&all),
        )?;
        let resources = [
            &uniform,
            &scene.nodes,
            &scene.wide_sources,
            &scene.wide_nodes,
        ]
        .map(wgpu::Buffer::as_entire_binding);
        let widen = self.widen_layout.bind(device, &resources);
        let mut recorder = Recorder::new(encoder, None);
        let mut pass = recorder.compute("refit", 1 + rows.len() as u32);
        pass.set_pipeline(&self.pipeline);
        for (group, count) in &rows {
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, *count, WORKGROUP_SIZE);
        }
        pass.set_pipeline(&self.widen);
        pass.set_bind_group(0, &widen, &[]);
        dispatch(&mut pass, scene.wide_count, WORKGROUP_SIZE);
        drop(pass);
        Ok(recorder.finish().1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};

    #[test]
    fn the_shaders_are_valid_and_agree_with_rust() {
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

        let (module, _) = reflection::validated(&WIDEN).unwrap_or_else(|it| panic!("{it}"));
        let slots: Vec<(u32, Slot)> = (0..).zip(WIDEN_SLOTS).collect();
        assert_eq!(reflection::buffers(&module), slots);
        let size = reflection::workgroup_size(&module, "widen_nodes");
        assert_eq!(size, [WORKGROUP_SIZE, 1, 1]);
        let (members, size) = reflection::layout(&module, "WidenParams");
        assert_eq!(size, size_of::<RefitRow>() as u32);
        assert_eq!(
            members[1],
            (
                "count".to_owned(),
                std::mem::offset_of!(RefitRow, count) as u32
            )
        );
    }
}
