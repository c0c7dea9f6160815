use glam::{Mat4, UVec2};

use crate::renderer_error::RendererError;
use crate::splat_options::SplatOptions;
use crate::splat_view::{SplatView, SurroundingLevels, inverse_and_eye, levels};
use crate::truncation;

/// What tells where the surface lies that a pixel sees.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum SurfaceInput<'a> {
    /// Depth as the view-projection gives it: the depth aspect of a depth texture, or a texture of
    /// one float.
    Depth(&'a wgpu::TextureView),
    /// World-space positions in metres, in the first three channels. A pixel without a receiver has
    /// a normal of length 0.
    Position(&'a wgpu::TextureView),
}

/// How a texture holds unit normals in world space, in its first three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum NormalEncoding {
    /// As they are: floats or signed normalised integers.
    #[default]
    Signed,
    /// Half of them plus a half: unsigned normalised integers.
    Unsigned,
}

/// One view of a frame: what the host's G-buffer shows of it.
///
/// All textures are without multisampling and at least as large as the view, which is in their
/// upper left corner. A pixel whose normal is far from unit length has no receiver and gets no
/// light; so do pixels of the background depth.
#[derive(Clone, Copy, Debug)]
pub struct ViewParams<'a> {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// From world space to clip space, y up, depth 0 to 1 in either direction: columns, as
    /// `to_cols_array_2d` of [`glam::Mat4`] has them. Jitter belongs in it.
    pub view_projection: [[f32; 4]; 4],
    /// Where surfaces are.
    pub surface: SurfaceInput<'a>,
    /// The depth that pixels are cleared to: 1, or 0 where depth is reversed.
    pub background_depth: f32,
    /// Normals on the side that is seen, in world space.
    pub normals: &'a wgpu::TextureView,
    /// How the normals are held.
    pub normal_encoding: NormalEncoding,
    /// Reflectance for each channel, linear; without it all is 1.
    pub albedo: Option<&'a wgpu::TextureView>,
    /// The object that each pixel sees, unsigned: its index among
    /// [`World::objects`](caustics_scene::World::objects), or whatever
    /// [`FootprintRecord::object`](crate::FootprintRecord::object) of the light says. It keeps light
    /// off what stands close to its receiver. Without it, all is one object.
    pub objects: Option<&'a wgpu::TextureView>,
    /// What radiance is multiplied by as it is drawn.
    pub exposure: f32,
    /// Where the view's upper left corner lies in the target that it is drawn into, in pixels.
    pub origin: [i32; 2],
}

impl<'a> ViewParams<'a> {
    /// A view with signed normals, a background depth of 1, and nothing optional.
    #[must_use]
    pub fn new(
        size: [u32; 2],
        view_projection: [[f32; 4]; 4],
        surface: SurfaceInput<'a>,
        normals: &'a wgpu::TextureView,
    ) -> Self {
        Self {
            size,
            view_projection,
            surface,
            background_depth: 1.0,
            normals,
            normal_encoding: NormalEncoding::Signed,
            albedo: None,
            objects: None,
            exposure: 1.0,
            origin: [0, 0],
        }
    }

    pub(crate) fn uniform(
        &self,
        index: usize,
        options: &SplatOptions,
        max_texture: u32,
    ) -> Result<SplatView, RendererError> {
        let (levels, _) = levels(UVec2::from(self.size), max_texture)?;
        let surroundings = SurroundingLevels::of(UVec2::from(self.size));
        let matrix = Mat4::from_cols_array_2d(&self.view_projection);
        let Some((inverse, eye)) = inverse_and_eye(&matrix, self.background_depth) else {
            return Err(RendererError::SingularProjection { view: index });
        };
        Ok(SplatView {
            view_projection: self.view_projection,
            inverse_view_projection: inverse.to_cols_array_2d(),
            eye: eye.to_array(),
            size: self.size,
            normal_encoding: u32::from(self.normal_encoding == NormalEncoding::Unsigned),
            has_positions: u32::from(matches!(self.surface, SurfaceInput::Position(_))),
            background_depth: self.background_depth,
            scale: options.scale,
            max_anisotropy: options.anisotropy_or_zero(),
            has_objects: u32::from(self.objects.is_some()),
            integrate_pixels: u32::from(options.integrates_pixels()),
            surrounding_levels: surroundings.count,
            pad: [0; 2],
            truncation: truncation::uniform(options.truncation, options.overlap_truncation),
            levels,
            surroundings: surroundings.levels,
        })
    }
}
