use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::columns::Columns;
use crate::gbuffer::{GBuffer, Texel};
use crate::parallel;
use crate::prepared_splat::LEVELS;
use crate::surroundings::Surroundings;
use crate::texel_level::{BAND, Reflection, TexelLevel};

/// What a camera sees, as splats ask for it. It has nothing to do with any photon.
#[derive(Clone, Debug)]
pub(crate) struct SplatView {
    /// Lambertian texels, and glossy ones if there are any.
    pub(crate) passes: Vec<PassView>,
    pub(crate) surroundings: Surroundings,
}

/// The texels that reflect in one way, at all levels that serve.
#[derive(Clone, Debug)]
pub(crate) struct PassView {
    /// The finest first; at least one.
    pub(crate) levels: Vec<TexelLevel>,
    /// By what the light of each pixel is multiplied.
    pub(crate) reflectance: Columns,
    /// The same for the extra texels.
    pub(crate) extra_reflectance: Vec<Vec3>,
}

impl SplatView {
    pub(crate) fn of(buffer: &GBuffer) -> Self {
        let passes = || {
            let mut passes = vec![PassView::new(buffer, false)];
            if buffer.is_glossy() {
                passes.push(PassView::new(buffer, true));
            }
            passes
        };
        let (passes, surroundings) = parallel::both(passes, || Surroundings::of(buffer));
        Self {
            passes,
            surroundings,
        }
    }
}

impl PassView {
    fn new(buffer: &GBuffer, is_glossy: bool) -> Self {
        let finest = TexelLevel::finest(buffer, is_glossy);
        let reflectance = |texel: &Texel| match finest.reflection {
            Reflection::Lambertian(_) => FRAC_1_PI * (buffer.brdf(texel).base() * texel.coverage),
            Reflection::Glossy(_) => Vec3::splat(texel.coverage),
        };
        let of_pixels = Columns::of(&finest.texels, BAND * finest.width, |texel| {
            texel.as_ref().map_or(Vec3::ZERO, reflectance)
        });
        let of_extras = finest.extras.iter().map(|(_, texel)| reflectance(texel));
        let extra_reflectance = of_extras.collect();
        let coarser = finest.coarsest(LEVELS as u8 - 1);
        let mut levels = vec![finest];
        for level in 0..usize::from(coarser) {
            levels.push(levels[level].coarser(buffer));
        }
        Self {
            levels,
            reflectance: of_pixels,
            extra_reflectance,
        }
    }
}
