//! The engine: a rasteriser with a G-buffer, as a host of caustics has one.

mod overlay;
mod pipelines;
mod scene_mesh;

use bytemuck::{Pod, Zeroable};
use caustics::glam::Mat4;
use caustics::glam::camera::rh::proj::directx;
use caustics::glam::camera::rh::view::look_at_mat4;
use caustics::glam::{Vec3, Vec4};
use caustics::prelude::{Camera, Light, World};
use caustics_wgpu::camera_matrix;

use overlay::Overlay;
pub use pipelines::LIT_FORMAT;
use pipelines::Pipelines;
use scene_mesh::SceneMesh;

/// Pixels a side of the shadow map.
const SHADOW_SIZE: u32 = 2048;

const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const NORMAL_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const ALBEDO_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const OBJECT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// A rasteriser for one scene and one size.
#[derive(Debug)]
pub struct Engine {
    pipelines: Pipelines,
    overlay: Overlay,
    opaque: (wgpu::Buffer, u32),
    shining: (wgpu::Buffer, u32),
    globals: wgpu::Buffer,
    globals_group: wgpu::BindGroup,
    shadow: wgpu::TextureView,
    targets: Targets,
    center: Vec3,
    radius: f32,
}

/// What the engine draws into, and what others may read.
#[derive(Debug)]
pub struct Targets {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Depth, 1 far away.
    pub depth: wgpu::TextureView,
    /// Normals in world space.
    pub normals: wgpu::TextureView,
    /// Linear reflectance.
    pub albedo: wgpu::TextureView,
    /// Index of the object.
    pub objects: wgpu::TextureView,
    /// Linear radiance.
    pub lit: wgpu::TextureView,
}

/// What a frame shows.
#[derive(Clone, Debug)]
pub struct Look {
    /// From where.
    pub camera: Camera,
    /// The light that the engine shades with.
    pub light: Light,
    /// Stops.
    pub exposure_ev: f32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Globals {
    view_projection: [[f32; 4]; 4],
    inverse_view_projection: [[f32; 4]; 4],
    light_projection: [[f32; 4]; 4],
    eye: [f32; 4],
    light: [f32; 4],
    light_axis: [f32; 4],
    light_color: [f32; 4],
    settings: [f32; 4],
}

impl Engine {
    /// Uploads the world and makes all targets. `format` is what the tone map writes.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        world: &World,
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Self {
        let mesh = SceneMesh::new(world);
        let upload = |vertices: &[scene_mesh::Vertex]| {
            let bytes: &[u8] = bytemuck::cast_slice(vertices);
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("vertices"),
                size: bytes.len().max(4) as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            queue.write_buffer(&buffer, 0, bytes);
            (buffer, vertices.len() as u32)
        };
        let pipelines = Pipelines::new(device, format);
        let globals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let (center, radius) = world.bounds().bounding_sphere();
        Self {
            opaque: upload(&mesh.opaque),
            shining: upload(&mesh.shining),
            globals_group: pipelines.bind_globals(device, &globals),
            globals,
            shadow: target(device, [SHADOW_SIZE; 2], DEPTH_FORMAT),
            targets: Targets::new(device, size),
            pipelines,
            overlay: Overlay::new(device, format),
            center,
            radius,
        }
    }

    /// Follows the window.
    pub fn resize(&mut self, device: &wgpu::Device, size: [u32; 2]) {
        if size != self.targets.size && size[0] > 0 && size[1] > 0 {
            self.targets = Targets::new(device, size);
        }
    }

    /// What it draws into.
    #[must_use]
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// The view-projection that it draws with.
    #[must_use]
    pub fn view_projection(&self, camera: &Camera) -> [[f32; 4]; 4] {
        let distance = (camera.position() - self.center).length();
        let near = (0.2 * (distance - self.radius)).max(0.01 * self.radius);
        camera_matrix(
            camera,
            self.targets.size,
            near,
            distance + 2.0 * self.radius,
        )
    }

    /// Draws the shadow map and the G-buffer.
    pub fn draw_surfaces(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        look: &Look,
    ) {
        queue.write_buffer(&self.globals, 0, bytemuck::bytes_of(&self.globals(look)));
        {
            let mut pass = begin(encoder, "shadow", &[], Some((&self.shadow, true)));
            pass.set_pipeline(&self.pipelines.shadow);
            pass.set_bind_group(0, &self.globals_group, &[]);
            draw(&mut pass, &self.opaque);
            draw(&mut pass, &self.shining);
        }
        let targets = [
            &self.targets.normals,
            &self.targets.albedo,
            &self.targets.objects,
        ];
        let depth = Some((&self.targets.depth, true));
        let mut pass = begin(encoder, "gbuffer", &targets, depth);
        pass.set_pipeline(&self.pipelines.gbuffer);
        pass.set_bind_group(0, &self.globals_group, &[]);
        draw(&mut pass, &self.opaque);
    }

    /// Shades the G-buffer, lets `add` draw into the same pass, and draws glass and metal on top.
    ///
    /// # Errors
    /// Whatever `add` returns.
    pub fn draw_lighting<E>(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        add: impl FnOnce(&mut wgpu::RenderPass<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let group = self
            .pipelines
            .bind_gbuffer(device, &self.targets, &self.shadow);
        {
            let mut pass = begin(encoder, "lighting", &[&self.targets.lit], None);
            pass.set_pipeline(&self.pipelines.lighting);
            pass.set_bind_group(0, &self.globals_group, &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.draw(0..3, 0..1);
            add(&mut pass)?;
        }
        let depth = Some((&self.targets.depth, false));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shining"),
            color_attachments: &[Some(color(&self.targets.lit, wgpu::LoadOp::Load))],
            depth_stencil_attachment: depth.map(depth_attachment),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipelines.shining);
        pass.set_bind_group(0, &self.globals_group, &[]);
        draw(&mut pass, &self.shining);
        Ok(())
    }

    /// Brings the lit picture to a target of the format that was given.
    pub fn draw_tone_map(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        into: &wgpu::TextureView,
    ) {
        let group = self.pipelines.bind_lit(device, &self.targets.lit);
        let mut pass = begin(encoder, "tone map", &[into], None);
        pass.set_pipeline(&self.pipelines.tone_map);
        pass.set_bind_group(0, &self.globals_group, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Draws lines of text onto what the tone map has written.
    pub fn draw_text(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        into: &wgpu::TextureView,
        lines: &[String],
    ) {
        self.overlay.draw(queue, encoder, into, lines);
    }

    fn globals(&self, look: &Look) -> Globals {
        let view_projection = self.view_projection(&look.camera);
        let (light, axis, color, cosines) = match look.light {
            Light::Spot {
                position,
                direction,
                intensity,
                inner_cos,
                outer_cos,
            } => (
                Vec4::from((position, 1.0)),
                direction,
                intensity,
                [inner_cos, outer_cos],
            ),
            Light::Directional {
                direction,
                irradiance,
            } => (
                Vec4::from((direction, 0.0)),
                direction,
                irradiance,
                [2.0, -2.0],
            ),
            Light::Point {
                position,
                intensity,
            } => {
                let axis = (self.center - position).normalize_or(Vec3::NEG_Y);
                (Vec4::from((position, 1.0)), axis, intensity, [-1.0, -2.0])
            }
            _ => (Vec4::ZERO, Vec3::NEG_Y, Vec3::ZERO, [1.0, 0.0]),
        };
        let inverse = Mat4::from_cols_array_2d(&view_projection).inverse();
        Globals {
            view_projection,
            inverse_view_projection: inverse.to_cols_array_2d(),
            light_projection: self.light_projection(light).to_cols_array_2d(),
            eye: Vec4::from((look.camera.position(), 1.0)).to_array(),
            light: light.to_array(),
            light_axis: Vec4::from((axis, 0.0)).to_array(),
            light_color: Vec4::from((color, 0.0)).to_array(),
            settings: [cosines[0], cosines[1], look.exposure_ev.exp2(), 0.0],
        }
    }

    /// The whole scene as the light sees it.
    fn light_projection(&self, light: Vec4) -> Mat4 {
        let radius = self.radius;
        let (eye, projection) = if light.w > 0.5 {
            let eye = light.truncate();
            let distance = (self.center - eye).length().max(1e-3 * radius);
            let half = (radius / distance).clamp(0.05, 0.97).asin().min(1.3);
            let near = (distance - radius).max(0.02 * distance);
            let far = distance + radius;
            (eye, directx::perspective(2.0 * half, 1.0, near, far))
        } else {
            let eye = self.center - 2.0 * radius * light.truncate();
            let box_ =
                directx::orthographic(-radius, radius, -radius, radius, radius, 3.0 * radius);
            (eye, box_)
        };
        let along = (self.center - eye).normalize_or(Vec3::NEG_Y);
        projection * look_at_mat4(eye, self.center, along.any_orthogonal_vector())
    }
}

impl Targets {
    fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        Self {
            size,
            depth: target(device, size, DEPTH_FORMAT),
            normals: target(device, size, NORMAL_FORMAT),
            albedo: target(device, size, ALBEDO_FORMAT),
            objects: target(device, size, OBJECT_FORMAT),
            lit: target(device, size, LIT_FORMAT),
        }
    }
}

fn target(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("target"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn color(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load,
            store: wgpu::StoreOp::Store,
        },
    }
}

fn depth_attachment(
    (view, is_cleared): (&wgpu::TextureView, bool),
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let load = if is_cleared {
        wgpu::LoadOp::Clear(1.0)
    } else {
        wgpu::LoadOp::Load
    };
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load,
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    }
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
    colors: &[&wgpu::TextureView],
    depth: Option<(&wgpu::TextureView, bool)>,
) -> wgpu::RenderPass<'a> {
    let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
    let colors: Vec<_> = colors.iter().map(|view| Some(color(view, clear))).collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &colors,
        depth_stencil_attachment: depth.map(depth_attachment),
        ..wgpu::RenderPassDescriptor::default()
    })
}

fn draw(pass: &mut wgpu::RenderPass<'_>, (vertices, count): &(wgpu::Buffer, u32)) {
    if *count > 0 {
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.draw(0..*count, 0..1);
    }
}
