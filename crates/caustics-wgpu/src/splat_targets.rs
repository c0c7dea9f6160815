use glam::UVec2;

use crate::buffers::{bound_buffer, filled_buffer, storage_buffer};
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
    /// For each level, exponents that say how finely each pixel is rounded, where sums are blended.
    pub(crate) units: Option<Vec<wgpu::TextureView>>,
    /// For each level: its own and all coarser ones.
    pub(crate) totals: Vec<wgpu::TextureView>,
    pub(crate) irradiance: wgpu::Texture,
    /// What tiles of the view show.
    pub(crate) surroundings: wgpu::Buffer,
    pub(crate) counts: wgpu::Buffer,
    pub(crate) scale: wgpu::Buffer,
}

/// Sums of each level: of each layer, all its limbs one after the other.
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

impl SumFormat {
    /// What shaders write.
    pub(crate) const WRITTEN: Self = Self {
        format: wgpu::TextureFormat::Rgba32Float,
        layers: 1,
        is_blended: false,
    };

    /// Numbers that a sum is kept in, each in a texture's layer of its own.
    pub(crate) fn limbs(self) -> u32 {
        if self.is_half() { 2 } else { 1 }
    }

    /// The same as shaders know it.
    pub(crate) fn limbs_constant(self) -> (&'static str, f64) {
        ("SUM_LIMBS", f64::from(self.limbs()))
    }

    /// Whether these are half floats, and irradiance is scaled while it is blended.
    pub(crate) fn is_half(self) -> bool {
        self.format == wgpu::TextureFormat::Rgba16Float
    }
}

/// A texture that a view needs.
#[derive(Clone, Copy, Debug)]
struct ViewTexture {
    label: &'static str,
    size: UVec2,
    mips: u32,
    layers: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
}

impl ViewTexture {
    fn make(&self, device: &wgpu::Device) -> wgpu::Texture {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some(self.label),
            size: self.extent(),
            mip_level_count: self.mips,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: self.usage,
            view_formats: &[],
        })
    }

    fn extent(&self) -> wgpu::Extent3d {
        wgpu::Extent3d {
            width: self.size.x,
            height: self.size.y,
            depth_or_array_layers: self.layers,
        }
    }
}

/// All textures of a view.
#[derive(Clone, Copy, Debug)]
struct ViewTextures {
    texels: ViewTexture,
    objects: ViewTexture,
    sum: ViewTexture,
    units: Option<ViewTexture>,
    coarse: ViewTexture,
    irradiance: ViewTexture,
}

impl ViewTextures {
    fn of(size: UVec2, format: SumFormat) -> Self {
        let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let texels = ViewTexture {
            label: "caustics texels",
            size: padded(size),
            mips: LEVELS as u32,
            layers: 1,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: written,
        };
        let sum = ViewTexture {
            label: "caustics sums",
            layers: format.layers * format.limbs(),
            format: format.format,
            usage: if format.is_blended {
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING
            } else {
                written
            },
            ..texels
        };
        Self {
            texels,
            objects: ViewTexture {
                label: "caustics objects",
                format: wgpu::TextureFormat::R32Uint,
                ..texels
            },
            sum,
            units: format.is_blended.then_some(ViewTexture {
                label: "caustics units",
                format: wgpu::TextureFormat::Rgba8Uint,
                ..texels
            }),
            coarse: ViewTexture {
                label: "caustics totals",
                size: texels.size / 2,
                mips: texels.mips - 1,
                format: wgpu::TextureFormat::Rgba32Float,
                ..texels
            },
            irradiance: ViewTexture {
                label: "caustics irradiance",
                size,
                mips: 1,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: written | wgpu::TextureUsages::COPY_SRC,
                ..texels
            },
        }
    }
}

impl SplatTargets {
    pub(crate) fn new(
        device: &wgpu::Device,
        size: UVec2,
        format: SumFormat,
    ) -> Result<Self, RendererError> {
        let (levels, tiles) = levels(size, device.limits().max_texture_dimension_2d)?;
        let tiles_shown = SurroundingLevels::of(size).tiles;
        let bytes = u64::from(tiles_shown) * SURROUNDING_BYTES;
        let parts = ViewTextures::of(size, format);
        let single = |texture: &wgpu::Texture| -> Vec<_> {
            (0..texture.mip_level_count())
                .map(|mip| mip_view(texture, mip, Some(0)))
                .collect()
        };
        let texels = parts.texels.make(device);
        let objects = parts.objects.make(device);
        let sum = parts.sum.make(device);
        let coarse = parts.coarse.make(device);
        let irradiance = parts.irradiance.make(device);
        let mut totals = vec![irradiance.create_view(&wgpu::TextureViewDescriptor::default())];
        totals.extend(single(&coarse));
        Ok(Self {
            size,
            levels,
            tiles,
            texels: single(&texels),
            objects: single(&objects),
            sums: vec![SumTarget::of(&sum)],
            units: parts.units.map(|it| single(&it.make(device))),
            totals,
            irradiance,
            surroundings: bound_buffer(
                device,
                "what the tiles of a view show",
                bytes,
                wgpu::BufferUsages::empty(),
            )?,
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
            // The same once more: only what is not blended needs it, and that has one layer.
            let texture = ViewTextures::of(self.size, SumFormat::WRITTEN)
                .sum
                .make(device);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(texture: &ViewTexture) -> u64 {
        let texel = texture.format.block_copy_size(None).unwrap();
        let mips = (0..texture.mips).map(|mip| {
            let size = texture
                .extent()
                .mip_level_size(mip, wgpu::TextureDimension::D2);
            u64::from(size.width) * u64::from(size.height) * u64::from(texture.layers)
        });
        u64::from(texel) * mips.sum::<u64>()
    }

    /// Bytes a pixel of a view of 1920 by 1080, with one target of sums or two.
    fn bytes_a_pixel(format: SumFormat, sums: u64) -> f64 {
        let size = UVec2::new(1920, 1080);
        let parts = ViewTextures::of(size, format);
        let others = [parts.texels, parts.objects, parts.coarse, parts.irradiance];
        let textures = others.iter().chain(&parts.units).map(bytes).sum::<u64>();
        let tiles = u64::from(SurroundingLevels::of(size).tiles) * SURROUNDING_BYTES;
        let all = textures + sums * bytes(&parts.sum) + tiles;
        all as f64 / f64::from(size.x * size.y)
    }

    #[test]
    fn views_take_the_memory_that_the_documentation_says() {
        let half_floats = SumFormat {
            format: wgpu::TextureFormat::Rgba16Float,
            layers: 4,
            is_blended: true,
        };
        let blended = SumFormat {
            is_blended: true,
            ..SumFormat::WRITTEN
        };
        let found = [
            bytes_a_pixel(SumFormat::WRITTEN, 1),
            bytes_a_pixel(SumFormat::WRITTEN, 2),
            bytes_a_pixel(blended, 1),
            bytes_a_pixel(half_floats, 1),
        ];
        let words = found.map(|it| format!("{it:.0}"));
        let told = format!(
            "A view takes {} bytes a pixel, {} where tiles sum several batches, {} where quads are \
             blended in 32 bits, and {} in half floats and four layers",
            words[0], words[1], words[2], words[3]
        );
        let documentation = include_str!("lib.rs").replace("\n//!", "");
        assert!(documentation.contains(&told), "{told}");
    }
}
