//! The engine and the caustics in one frame: what an engine has to do for them.

use caustics::prelude::{Light, Scene, TraceOptions, World};
use caustics::scene::{BvhOptions, SceneIntersector};
use caustics_wgpu::{
    CausticsRenderer, CompositeTarget, FrameLight, FrameParams, PreparedFrame, RendererOptions,
    SceneBuffers, SplatOptions, SurfaceInput, TracePlan, ViewParams,
};

use crate::Failure;
use crate::engine::{Engine, LIT_FORMAT, Look};

/// Where caustics are drawn: the engine's lighting pass.
const TARGET: CompositeTarget = CompositeTarget::new(LIT_FORMAT);

/// A scene, the engine that draws it, and the renderer of its caustics.
#[derive(Debug)]
pub struct Stage {
    /// The engine.
    pub engine: Engine,
    scene: Scene,
    rays: SceneIntersector,
    buffers: SceneBuffers,
    plan: TracePlan,
    caustics: CausticsRenderer,
}

impl Stage {
    /// Uploads the scene for both.
    ///
    /// # Errors
    /// A scene that cannot be traced, or a device that lacks something.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: Scene,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        trace: TraceOptions,
    ) -> Result<Self, Failure> {
        let world = World::new(&scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        Ok(Self {
            engine: Engine::new(device, queue, &world, size, format),
            buffers: SceneBuffers::new(device, &world)?,
            plan: TracePlan::new(&world, &rays, &trace)?,
            caustics: Self::renderer(device, SplatOptions::default())?,
            scene,
            rays,
        })
    }

    fn renderer(device: &wgpu::Device, splat: SplatOptions) -> Result<CausticsRenderer, Failure> {
        let options = RendererOptions {
            splat,
            targets: vec![TARGET],
            times_passes: true,
            ..RendererOptions::default()
        };
        Ok(CausticsRenderer::new(device, &options)?)
    }

    /// Splats in another way.
    ///
    /// # Errors
    /// Options out of range.
    pub fn set_splat(&mut self, device: &wgpu::Device, splat: SplatOptions) -> Result<(), Failure> {
        self.caustics = Self::renderer(device, splat)?;
        Ok(())
    }

    /// The renderer of caustics.
    #[must_use]
    pub fn caustics(&self) -> &CausticsRenderer {
        &self.caustics
    }

    /// Moves the first light, or changes how many photons there are.
    ///
    /// # Errors
    /// Options out of range.
    pub fn aim(&mut self, light: Light, trace: TraceOptions) -> Result<(), Failure> {
        let world = World::new(&relit(&self.scene, light)?)?;
        self.plan = TracePlan::new(&world, &self.rays, &trace)?;
        Ok(())
    }

    /// Records a frame: the engine's surfaces, the caustics on them, lighting with both, and the
    /// tone map into `into`.
    ///
    /// # Errors
    /// A device that is lost or out of memory.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        look: &Look,
        into: &wgpu::TextureView,
    ) -> Result<PreparedFrame, Failure> {
        self.engine.draw_surfaces(queue, encoder, look);
        let targets = self.engine.targets();
        let matrix = self.engine.view_projection(&look.camera);
        let surface = SurfaceInput::Depth(&targets.depth);
        let view = ViewParams {
            albedo: Some(&targets.albedo),
            objects: Some(&targets.objects),
            ..ViewParams::new(targets.size, matrix, surface, &targets.normals)
        };
        let frame = FrameParams {
            light: FrameLight::Traced {
                scene: &self.buffers,
                plan: &self.plan,
            },
            views: &[view],
        };
        let prepared = self.caustics.prepare(device, queue, encoder, &frame)?;
        self.engine.draw_lighting(device, encoder, |pass| {
            self.caustics.draw(pass, &prepared, 0, &TARGET)
        })?;
        self.engine.draw_tone_map(device, encoder, into);
        Ok(prepared)
    }
}

/// The scene with another first light.
fn relit(scene: &Scene, light: Light) -> Result<Scene, Failure> {
    let mut copy = Scene::new();
    for mesh in scene.meshes() {
        copy.add_mesh(mesh.clone());
    }
    for material in scene.materials() {
        copy.add_material(material.clone())?;
    }
    for instance in scene.instances() {
        copy.add_instance(instance.clone())?;
    }
    copy.add_light(light)?;
    for other in scene.lights().iter().skip(1) {
        copy.add_light(*other)?;
    }
    Ok(copy)
}
