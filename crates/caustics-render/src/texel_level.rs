use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::columns::TexelColumns;
use crate::gbuffer::{GBuffer, SMOOTH_COSINE, Texel};
use crate::gloss::GlossyTexels;
use crate::parallel;
use crate::prepared_splat::STRIDE;

/// Rows of one task.
pub(crate) const BAND: usize = 16;

/// Pixels that a coarser level has beyond the picture, on every side.
pub(crate) const MARGIN: usize = 1;

/// The least cosine between one normal and others that are alike each with each: two such turns stay
/// within what [`Texel::is_like`] allows.
const EVEN_COSINE: f32 = 0.9951;
const _: () = assert!(2.0 * EVEN_COSINE * EVEN_COSINE - 1.0 > SMOOTH_COSINE);

/// Pixels that a level has beyond the picture, on every side.
pub(crate) fn margin(depth: u32) -> usize {
    if depth == 0 { 0 } else { MARGIN }
}

/// What a level's texels are lit as.
#[derive(Clone, Debug)]
pub(crate) enum Reflection {
    /// Lambertian ones take irradiance; the picture makes radiance of it in the end.
    Lambertian(TexelColumns),
    /// Glossy ones take radiance towards the eye.
    Glossy(GlossyTexels),
}

/// What a picture shows at one resolution, of what reflects in one way.
#[derive(Clone, Debug)]
pub(crate) struct TexelLevel {
    pub(crate) reflection: Reflection,
    /// With the margin.
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// How often the picture was halved.
    pub(crate) depth: u32,
    pub(crate) texels: Arc<Vec<Option<Texel>>>,
    pub(crate) extras: Arc<Vec<(u32, Texel)>>,
    /// For each band, where its extras start; one more than there are bands.
    pub(crate) extra_starts: Vec<usize>,
    /// For each pixel, whether all between its middle and that of the one below and to the right is
    /// one smooth surface, here and on the next finer level: light is interpolated to that without a
    /// further look. Empty for the finest level.
    pub(crate) is_even: Vec<bool>,
}

impl TexelLevel {
    fn new(
        buffer: &GBuffer,
        [width, height]: [usize; 2],
        depth: u32,
        texels: Arc<Vec<Option<Texel>>>,
        extras: Arc<Vec<(u32, Texel)>>,
        is_glossy: bool,
    ) -> Self {
        let reflection = if is_glossy {
            Reflection::Glossy(GlossyTexels::new(&texels, &extras, buffer))
        } else {
            Reflection::Lambertian(TexelColumns::new(&texels, BAND * width))
        };
        let bands = height.div_ceil(BAND);
        let extra_starts = (0..=bands)
            .map(|band| {
                extras.partition_point(|&(pixel, _)| (pixel as usize) < band * BAND * width)
            })
            .collect();
        Self {
            reflection,
            width,
            height,
            depth,
            texels,
            extras,
            extra_starts,
            is_even: Vec::new(),
        }
    }

    /// The pixels themselves, as far as their texels are Lambertian, or glossy.
    pub(crate) fn finest(buffer: &GBuffer, is_glossy: bool) -> Self {
        let (texels, extras) = if buffer.is_glossy() {
            let is_wanted = |texel: &Texel| buffer.brdf(texel).is_lambertian() != is_glossy;
            let (texels, extras) = (buffer.texels.iter(), buffer.extras.iter());
            (
                Arc::new(texels.map(|texel| texel.filter(is_wanted)).collect()),
                Arc::new(extras.filter(|(_, it)| is_wanted(it)).copied().collect()),
            )
        } else {
            (Arc::clone(&buffer.texels), Arc::clone(&buffer.extras))
        };
        let size = [buffer.width(), buffer.height()].map(|size| size as usize);
        Self::new(buffer, size, 0, texels, extras, is_glossy)
    }

    /// Up to which coarser level, at most `limit`, light may be drawn and interpolated from.
    pub(crate) fn coarsest(&self, limit: u8) -> u8 {
        match &self.reflection {
            Reflection::Lambertian(_) => limit,
            Reflection::Glossy(texels) => texels.halvings(self.width, limit),
        }
    }

    /// The level whose pixels stand for blocks of this one's, each by the texel nearest its middle.
    ///
    /// Its texels lie where the block's middle sees their plane, also where only a part of the
    /// block sees it, or where the block ends outside the picture. A margin of one pixel around
    /// continues what is seen at the border, so that the picture's outermost pixels have something
    /// to be interpolated from on either side.
    pub(crate) fn coarser(&self, buffer: &GBuffer) -> Self {
        let size = self.inner().map(|size| size.div_ceil(STRIDE as usize));
        let (depth, padded) = (self.depth + 1, size.map(|size| size + 2 * MARGIN));
        let [width, height] = padded;
        let texels = parallel::made((width * height) as u32, BAND * width, |pixel| {
            let (x, y) = (pixel as usize % width, pixel as usize / width);
            let nearest = |at: usize, size: usize| at.clamp(MARGIN, size) - MARGIN;
            let inside = (nearest(x, size[0]), nearest(y, size[1]));
            let texel = self.block(buffer, inside.0, inside.1)?;
            if (inside.0 + MARGIN, inside.1 + MARGIN) == (x, y) {
                return Some(texel);
            }
            let middle = Vec2::new(x as f32, y as f32) + 0.5 - MARGIN as f32;
            moved(buffer, texel, middle, depth)
        });
        let is_even = parallel::made((width * height) as u32, BAND * width, |pixel| {
            self.is_even_at(&texels, padded, pixel as usize)
        });
        let is_glossy = matches!(self.reflection, Reflection::Glossy(_));
        Self {
            is_even,
            ..Self::new(
                buffer,
                padded,
                depth,
                Arc::new(texels),
                Arc::default(),
                is_glossy,
            )
        }
    }

    /// Whether four pixels of the next coarser level and the four of this one between their middles
    /// are of one surface, each with each.
    fn is_even_at(
        &self,
        coarser: &[Option<Texel>],
        [width, height]: [usize; 2],
        first: usize,
    ) -> bool {
        let (x, y) = (first % width, first / width);
        if !(MARGIN..width - MARGIN - 1).contains(&x) || !(MARGIN..height - MARGIN - 1).contains(&y)
        {
            return false;
        }
        let Some(one) = &coarser[first] else {
            return false;
        };
        let is_even = |texels: &[Option<Texel>]| {
            texels.iter().all(|other| {
                other.as_ref().is_some_and(|other| {
                    one.object == other.object && one.normal.dot(other.normal) > EVEN_COSINE
                })
            })
        };
        // The last column and row of the first one's block.
        let [column, row] =
            [x, y].map(|at| (at - MARGIN + 1) * STRIDE as usize - 1 + self.margin());
        let fine = row * self.width + column;
        is_even(&coarser[first + 1..][..1])
            && is_even(&coarser[first + width..][..2])
            && is_even(&self.texels[fine..][..2])
            && is_even(&self.texels[fine + self.width..][..2])
    }

    /// The texel of a block of the next level.
    fn block(&self, buffer: &GBuffer, x: usize, y: usize) -> Option<Texel> {
        const SIDE: usize = STRIDE as usize;
        let [width, height] = self.inner();
        let at = |it: usize| {
            let (x, y) = (x * SIDE + it % SIDE, y * SIDE + it / SIDE);
            let index = (y + self.margin()) * self.width + x + self.margin();
            let is_inside = x < width && y < height;
            is_inside.then(|| self.texels[index].as_ref()).flatten()
        };
        // All pixels of a block of four are as near its middle.
        let inside: [Option<&Texel>; SIDE * SIDE] = std::array::from_fn(at);
        let nearest = *inside.iter().flatten().next()?;
        let (mut sum, mut count) = (Vec3::ZERO, 0);
        for texel in inside.into_iter().flatten() {
            if texel.is_like(nearest) {
                sum += texel.position;
                count += 1;
            }
        }
        let middle = Texel {
            position: sum / count as f32,
            ..*nearest
        };
        if count == SIDE * SIDE {
            return Some(middle);
        }
        let at = Vec2::new(x as f32, y as f32) + 0.5;
        moved(buffer, middle, at, self.depth + 1).or(Some(middle))
    }

    /// Pixels around those of the picture.
    pub(crate) fn margin(&self) -> usize {
        margin(self.depth)
    }

    /// Width and height without the margin.
    fn inner(&self) -> [usize; 2] {
        [self.width, self.height].map(|size| size - 2 * self.margin())
    }
}

/// A texel moved in its plane to where the pixel coordinates of a level see it.
fn moved(buffer: &GBuffer, texel: Texel, at: Vec2, depth: u32) -> Option<Texel> {
    let pixel = at * STRIDE.pow(depth) as f32;
    let screen = &buffer.screen;
    let position = screen.on_plane(pixel, texel.position, texel.normal)?;
    Some(Texel { position, ..texel })
}
