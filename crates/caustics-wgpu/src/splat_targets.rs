use glam::UVec2;

use crate::GpuError;
use crate::error_scope::{filled_buffer, storage_buffer};
use crate::renderer_error::RendererError;
use crate::splat_stats::SplatStats;
use crate::splat_view::{LEVELS, SURROUNDING_BYTES, SurroundingLevels, levels, padded};

/// The textures of one view, for as long as its size stays.
#[derive(Clone, Debug)]
pub(crate) struct SplatTargets {
    pub(crate) size: UVec2,
    pub(crate) levels: [[u32; 4]; 8],
    pub(crate) tiles: u32,
    /// For each level: receivers, and their objects.
    pub(crate) texels: Vec<wgpu::TextureView>,
    pub(crate) objects: Vec<wgpu::TextureView>,
    /// What is summed at each level alone, before and after a batch: one of two, or one that is
    /// blended into.
    pub(crate) sums: Vec<SumTarget>,
    /// An estimate of the sums, where they are blended in half floats.
    pub(crate) estimate: Option<SumTarget>,
    /// For each level: its own and all coarser ones.
    pub(crate) totals: Vec<wgpu::TextureView>,
    pub(crate) irradiance: wgpu::Texture,
    /// What tiles of the view show.
    pub(crate) surroundings: wgpu::Buffer,
    pub(crate) counts: wgpu::Buffer,
    pub(crate) scale: wgpu::Buffer,
}

/// Sums of each level.
#[derive(Clone, Debug)]
pub(crate) struct SumTarget {
    /// For each level, all layers.
    pub(crate) layers: Vec<wgpu::TextureView>,
    /// For each level, one for each layer.
    pub(crate) single: Vec<Vec<wgpu::TextureView>>,
}

/// How a view's light is summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SumFormat {
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) layers: u32,
    /// Whether it is blended into; else it is written by shaders.
    pub(crate) is_blended: bool,
}

impl SplatTargets {
    pub(crate) fn new(
        device: &wgpu::Device,
        size: UVec2,
        format: SumFormat,
    ) -> Result<Self, RendererError> {
        let (levels, tiles) = levels(size, device.limits().max_texture_dimension_2d)?;
        let padded = padded(size);
        let tiles_shown = SurroundingLevels::of(size).tiles;
        let bytes = u64::from(tiles_shown) * SURROUNDING_BYTES;
        let limit = device.limits().max_storage_buffer_binding_size;
        if bytes > limit {
            let what = "what the tiles of a view show";
            return Err(GpuError::BufferTooLarge { what, bytes, limit }.into());
        }
        let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let make = |label, size: UVec2, mips, layers, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size.x,
                    height: size.y,
                    depth_or_array_layers: layers,
                },
                mip_level_count: mips,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let mips = LEVELS as u32;
        let single = |texture: &wgpu::Texture| -> Vec<_> {
            (0..texture.mip_level_count())
                .map(|mip| mip_view(texture, mip, Some(0)))
                .collect()
        };
        let texels = make(
            "caustics texels",
            padded,
            mips,
            1,
            wgpu::TextureFormat::Rgba32Uint,
            written,
        );
        let objects = make(
            "caustics objects",
            padded,
            mips,
            1,
            wgpu::TextureFormat::R32Uint,
            written,
        );
        let usage = if format.is_blended {
            wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING
        } else {
            written
        };
        let sum = make(
            "caustics sums",
            padded,
            mips,
            format.layers,
            format.format,
            usage,
        );
        let coarse = make(
            "caustics totals",
            padded / 2,
            mips - 1,
            1,
            wgpu::TextureFormat::Rgba32Float,
            written,
        );
        let irradiance = make(
            "caustics irradiance",
            size,
            1,
            1,
            wgpu::TextureFormat::Rgba32Float,
            written | wgpu::TextureUsages::COPY_SRC,
        );
        let mut totals = vec![irradiance.create_view(&wgpu::TextureViewDescriptor::default())];
        totals.extend(single(&coarse));
        Ok(Self {
            size,
            levels,
            tiles,
            texels: single(&texels),
            objects: single(&objects),
            sums: vec![SumTarget::of(&sum)],
            estimate: (format.format == wgpu::TextureFormat::Rgba16Float).then(|| {
                let label = "caustics estimate";
                SumTarget::of(&make(label, padded, mips, 1, format.format, usage))
            }),
            totals,
            irradiance,
            surroundings: storage_buffer(
                device,
                "caustics surroundings",
                bytes,
                wgpu::BufferUsages::empty(),
            ),
            counts: storage_buffer(
                device,
                "caustics counts",
                SplatStats::BYTES,
                wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            ),
            scale: filled_buffer(
                device,
                "caustics scale",
                wgpu::BufferUsages::STORAGE,
                bytemuck::cast_slice(&[1.0f32, 0.0]),
            )?,
        })
    }

    /// Makes a second target for sums, which more than one batch needs where they are not blended.
    pub(crate) fn second_sum(&mut self, device: &wgpu::Device) {
        if self.sums.len() == 1 {
            let padded = padded(self.size);
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("caustics sums"),
                size: wgpu::Extent3d {
                    width: padded.x,
                    height: padded.y,
                    depth_or_array_layers: 1,
                },
                mip_level_count: LEVELS as u32,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            self.sums.push(SumTarget::of(&texture));
        }
    }
}

impl SumTarget {
    pub(crate) fn of(texture: &wgpu::Texture) -> Self {
        let mips = 0..texture.mip_level_count();
        let layers = texture.depth_or_array_layers();
        Self {
            layers: mips
                .clone()
                .map(|mip| mip_view(texture, mip, None))
                .collect(),
            single: mips
                .map(|mip| {
                    (0..layers)
                        .map(|layer| mip_view(texture, mip, Some(layer)))
                        .collect()
                })
                .collect(),
        }
    }
}

/// One level of a texture: one layer, or all.
fn mip_view(texture: &wgpu::Texture, mip: u32, layer: Option<u32>) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(if layer.is_some() {
            wgpu::TextureViewDimension::D2
        } else {
            wgpu::TextureViewDimension::D2Array
        }),
        base_mip_level: mip,
        mip_level_count: Some(1),
        base_array_layer: layer.unwrap_or(0),
        array_layer_count: layer.map(|_| 1),
        ..wgpu::TextureViewDescriptor::default()
    })
}
