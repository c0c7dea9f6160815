//! What a scene's camera sees, for the GPU and to compare with.

use caustics::accel::Intersect;
use caustics::prelude::Surface;
use caustics_benches::gpu::Gpu;
use caustics_benches::stage::Stage;
use caustics_gpu_readback::uploaded_texture;
use caustics_wgpu::{SurfaceInput, ViewParams, camera_matrix};

/// Receivers at the middles of the pixels.
pub(crate) struct Receivers {
    pub(crate) size: [u32; 2],
    /// Positions and normals; a normal of 0 where no receiver is seen.
    pub(crate) points: Vec<[[f32; 3]; 2]>,
    pub(crate) albedo: Vec<[f32; 3]>,
    objects: Vec<u32>,
    textures: [wgpu::TextureView; 3],
}

impl Receivers {
    pub(crate) fn new(gpu: &Gpu, stage: &Stage) -> Self {
        let size @ [width, height] = [stage.reference.width(), stage.reference.height()];
        let count = (width * height) as usize;
        let mut points = vec![[[0.0; 3]; 2]; count];
        let mut albedo = vec![[0.0; 3]; count];
        let mut objects = vec![0; count];
        for (pixel, number) in (0..count).zip(0u32..) {
            let (x, y) = ((number % width) as f32, (number / width) as f32);
            let ray = stage.camera.ray(x + 0.5, y + 0.5, width, height);
            let hit = stage.intersector.closest_hit(&ray);
            let Some(point) = hit.and_then(|hit| stage.world.surface(&ray, &hit)) else {
                continue;
            };
            let surface = stage.world.materials()[point.material as usize].surface;
            if let Surface::Diffuse { albedo: reflected } = surface {
                let side = if point.from_outside { 1.0 } else { -1.0 };
                let normal = side * point.geometric_normal;
                points[pixel] = [point.spawn.position, normal].map(|it| it.to_array());
                objects[pixel] = point.object;
                albedo[pixel] = reflected.to_array();
            }
        }
        let wide = wgpu::TextureFormat::Rgba32Float;
        let part = |index: usize| -> Vec<[f32; 4]> {
            let four = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
            points.iter().map(|it: &[_; 2]| four(it[index])).collect()
        };
        let texture =
            |format, bytes: &[u8]| uploaded_texture(&gpu.device, &gpu.queue, size, format, bytes);
        let textures = [
            texture(wide, bytemuck::cast_slice(&part(0))),
            texture(wide, bytemuck::cast_slice(&part(1))),
            texture(wgpu::TextureFormat::R32Uint, bytemuck::cast_slice(&objects)),
        ];
        Self {
            size,
            points,
            albedo,
            objects,
            textures,
        }
    }

    pub(crate) fn view(&self, stage: &Stage) -> ViewParams<'_> {
        let matrix = camera_matrix(&stage.camera, self.size, 0.01, 100.0);
        let [positions, normals, objects] = &self.textures;
        let surface = SurfaceInput::Position(positions);
        ViewParams {
            objects: Some(objects),
            ..ViewParams::new(self.size, matrix, surface, normals)
        }
    }

    /// Whether the four pixels beside a pixel see the same object as it does.
    pub(crate) fn is_inside(&self, pixel: usize) -> bool {
        let width = self.size[0] as usize;
        let kind = |at: usize| (self.points[at][1] == [0.0; 3], self.objects[at]);
        let around = [
            pixel.checked_sub(1),
            Some(pixel + 1),
            pixel.checked_sub(width),
            Some(pixel + width),
        ];
        around
            .into_iter()
            .all(|it| it.is_some_and(|it| it < self.points.len() && kind(it) == kind(pixel)))
    }
}
