use std::borrow::Cow;
use std::f32::consts::FRAC_1_PI;

use caustics_filter::Image;
use glam::{IVec2, Vec2, Vec3};

use crate::columns::{Columns, TexelColumns};
use crate::gbuffer::{GBuffer, Texel};
use crate::gloss::GlossyTexels;
use crate::parallel;
use crate::prepared_splat::{Prepared, STRIDE};
use crate::splat_band::BandTask;
use crate::surroundings::Surroundings;

/// Rows of one task.
const BAND: usize = 16;

/// Pixels that a coarser level has beyond the picture, on every side.
const MARGIN: usize = 1;

/// Pixels that a level has beyond the picture, on every side.
pub(crate) fn margin(depth: u32) -> usize {
    if depth == 0 { 0 } else { MARGIN }
}

/// What a level's texels are lit as.
pub(crate) enum Reflection {
    /// Lambertian ones take irradiance; the picture makes radiance of it in the end.
    Lambertian,
    /// Glossy ones take radiance towards the eye.
    Glossy(GlossyTexels),
}

/// The irradiance of a picture's texels at one resolution, or of glossy ones the radiance.
pub(crate) struct Level<'a> {
    buffer: &'a GBuffer,
    reflection: Reflection,
    /// With the margin.
    width: usize,
    height: usize,
    /// How often the picture was halved.
    depth: u32,
    texels: Cow<'a, [Option<Texel>]>,
    columns: TexelColumns,
    light: Columns,
    extras: Cow<'a, [(u32, Texel)]>,
    extra_light: Vec<Vec3>,
    /// For each band, where its extras start; one more than there are bands.
    extra_starts: Vec<usize>,
}

impl<'a> Level<'a> {
    fn new(
        buffer: &'a GBuffer,
        [width, height]: [usize; 2],
        depth: u32,
        texels: Cow<'a, [Option<Texel>]>,
        extras: Cow<'a, [(u32, Texel)]>,
        is_glossy: bool,
    ) -> Self {
        let (reflection, columns) = if is_glossy {
            let glossy = GlossyTexels::new(&texels, &extras, buffer);
            (Reflection::Glossy(glossy), TexelColumns::default())
        } else {
            (Reflection::Lambertian, TexelColumns::new(&texels))
        };
        let bands = height.div_ceil(BAND);
        let extra_starts = (0..=bands)
            .map(|band| {
                extras.partition_point(|&(pixel, _)| (pixel as usize) < band * BAND * width)
            })
            .collect();
        Self {
            buffer,
            reflection,
            width,
            height,
            depth,
            light: Columns::zero(texels.len()),
            columns,
            texels,
            extra_light: vec![Vec3::ZERO; extras.len()],
            extras,
            extra_starts,
        }
    }

    /// The pixels themselves, as far as their texels are Lambertian, or glossy.
    pub(crate) fn finest(buffer: &'a GBuffer, is_glossy: bool) -> Self {
        let (texels, extras) = if buffer.is_glossy() {
            let is_wanted = |texel: &Texel| buffer.brdf(texel).is_lambertian() != is_glossy;
            let (texels, extras) = (buffer.texels.iter(), buffer.extras.iter());
            (
                texels
                    .map(|texel| texel.filter(is_wanted))
                    .collect::<Vec<_>>()
                    .into(),
                extras
                    .filter(|(_, it)| is_wanted(it))
                    .copied()
                    .collect::<Vec<_>>()
                    .into(),
            )
        } else {
            (Cow::from(&buffer.texels), Cow::from(&buffer.extras))
        };
        let size = [buffer.width(), buffer.height()].map(|size| size as usize);
        Self::new(buffer, size, 0, texels, extras, is_glossy)
    }

    /// Up to which coarser level, at most `limit`, light may be drawn and interpolated from.
    pub(crate) fn coarsest(&self, limit: u8) -> u8 {
        match &self.reflection {
            Reflection::Lambertian => limit,
            Reflection::Glossy(texels) => texels.halvings(self.width, limit),
        }
    }

    /// The level whose pixels stand for blocks of this one's, each by the texel nearest its middle.
    ///
    /// Its texels lie where the block's middle sees their plane, also where only a part of the
    /// block sees it, or where the block ends outside the picture. A margin of one pixel around
    /// continues what is seen at the border, so that the picture's outermost pixels have something
    /// to be interpolated from on either side.
    pub(crate) fn coarser(&self) -> Self {
        let stride = STRIDE as usize;
        let size @ [width, height] = self.inner().map(|size| size.div_ceil(stride));
        let blocks = by_pixel([width, height], |x, y| self.block(x, y));
        let (depth, padded) = (self.depth + 1, size.map(|size| size + 2 * MARGIN));
        let texels = by_pixel(padded, |x, y| {
            let nearest = |at: usize, size: usize| at.clamp(MARGIN, size) - MARGIN;
            let inside = (nearest(x, width), nearest(y, height));
            let texel = blocks[inside.1 * width + inside.0]?;
            if (inside.0 + MARGIN, inside.1 + MARGIN) == (x, y) {
                return Some(texel);
            }
            let middle = Vec2::new(x as f32, y as f32) + 0.5 - MARGIN as f32;
            self.moved(texel, middle, depth)
        });
        let is_glossy = matches!(self.reflection, Reflection::Glossy(_));
        Self::new(
            self.buffer,
            padded,
            depth,
            texels.into(),
            Cow::default(),
            is_glossy,
        )
    }

    /// The texel of a block of the next level.
    fn block(&self, x: usize, y: usize) -> Option<Texel> {
        let stride = STRIDE as usize;
        let [width, height] = self.inner();
        let middle = (stride as f32 - 1.0) * 0.5;
        let inside = (0..stride * stride).filter_map(|it| {
            let (dx, dy) = (it % stride, it / stride);
            let (x, y) = (x * stride + dx, y * stride + dy);
            let index = (y + self.margin()) * self.width + x + self.margin();
            let texel = (x < width && y < height)
                .then(|| self.texels[index])
                .flatten()?;
            let off = Vec2::new(dx as f32 - middle, dy as f32 - middle).length_squared();
            Some((off, texel))
        });
        let (_, nearest) = inside.clone().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let alike = inside.filter(|(_, texel)| texel.is_like(&nearest));
        let (sum, count) = alike.fold((Vec3::ZERO, 0), |(sum, count), (_, texel)| {
            (sum + texel.position, count + 1)
        });
        let middle = Texel {
            position: sum / count as f32,
            ..nearest
        };
        if count == stride * stride {
            return Some(middle);
        }
        let at = Vec2::new(x as f32, y as f32) + 0.5;
        self.moved(middle, at, self.depth + 1).or(Some(middle))
    }

    /// A texel moved in its plane to where the pixel coordinates of a level see it.
    fn moved(&self, texel: Texel, at: Vec2, depth: u32) -> Option<Texel> {
        let pixel = at * STRIDE.pow(depth) as f32;
        let screen = &self.buffer.screen;
        let position = screen.on_plane(pixel, texel.position, texel.normal)?;
        Some(Texel { position, ..texel })
    }

    /// Pixels around those of the picture.
    fn margin(&self) -> usize {
        margin(self.depth)
    }

    /// Width and height without the margin.
    fn inner(&self) -> [usize; 2] {
        [self.width, self.height].map(|size| size - 2 * self.margin())
    }

    /// Adds the splats of this level.
    pub(crate) fn accumulate(
        &mut self,
        prepared: &[Prepared],
        surroundings: &Surroundings,
        level: usize,
    ) {
        let bands = self.height.div_ceil(BAND);
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for (index, item) in prepared.iter().enumerate() {
            if let Prepared::Splat(splat) = item
                && usize::from(splat.level) == level
                && splat.rows[0] < splat.rows[1]
            {
                let first = usize::from(splat.rows[0]) / BAND;
                let last = usize::from(splat.rows[1] - 1) / BAND;
                for list in &mut lists[first..=last] {
                    list.push(index as u32);
                }
            }
        }
        let mut extra_rest = self.extra_light.as_mut_slice();
        let mut tasks = Vec::with_capacity(bands);
        for (number, light) in self.light.chunks_mut(BAND * self.width).enumerate() {
            let extras = self.extra_starts[number]..self.extra_starts[number + 1];
            let (extra_light, rest) = extra_rest.split_at_mut(extras.len());
            extra_rest = rest;
            tasks.push(BandTask {
                first_row: number * BAND,
                width: self.width,
                depth: self.depth,
                surroundings,
                screen: &self.buffer.screen,
                reflection: &self.reflection,
                texels: &self.texels,
                columns: &self.columns,
                light,
                first_extra: extras.start,
                extras: &self.extras[extras],
                extra_light,
                splats: &lists[number],
            });
        }
        parallel::each(tasks, |task| task.run(prepared));
    }

    pub(crate) fn add_coarser(&mut self, coarse: &Self) {
        if coarse.is_dark() {
            return;
        }
        let stride = STRIDE as f32;
        let (width, margin) = (self.width, self.margin() as f32);
        let place = |pixel: usize| {
            let (x, y) = (pixel % width, pixel / width);
            (Vec2::new(x as f32, y as f32) + 0.5 - margin) / stride - 0.5 + MARGIN as f32
        };
        let pixels = BAND * width;
        let bands = self
            .light
            .chunks_mut(pixels)
            .zip(self.texels.chunks(pixels));
        let bands = bands.enumerate().collect();
        parallel::each(bands, |(number, (mut light, texels))| {
            for (offset, texel) in texels.iter().enumerate() {
                if let Some(texel) = texel {
                    let at = place(number * pixels + offset);
                    light.add(offset, coarse.interpolate(at, texel));
                }
            }
        });
        for ((pixel, texel), light) in self.extras.iter().zip(&mut self.extra_light) {
            *light += coarse.interpolate(place(*pixel as usize), texel);
        }
    }

    fn is_dark(&self) -> bool {
        self.light
            .x
            .iter()
            .chain(&self.light.y)
            .chain(&self.light.z)
            .all(|&it| it == 0.0)
    }

    /// The light between the middles of pixels, from those that see the same surface. Both coordinates are at
    /// least 0.
    fn interpolate(&self, at: Vec2, texel: &Texel) -> Vec3 {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        let base = at.as_ivec2();
        let within = IVec2::new(self.width as i32, self.height as i32);
        // The four around the point; where none sees the surface, the next ones out.
        for (first, last) in [(0, 1), (-1, 2)] {
            for dy in first..=last {
                for dx in first..=last {
                    let corner = base + IVec2::new(dx, dy);
                    if corner.cmplt(IVec2::ZERO).any() || corner.cmpge(within).any() {
                        continue;
                    }
                    let index = corner.y as usize * self.width + corner.x as usize;
                    let Some(other) = &self.texels[index] else {
                        continue;
                    };
                    if !texel.is_like(other) {
                        continue;
                    }
                    let off = (at - corner.as_vec2()).abs();
                    let tent = (1.0 - off / last as f32).max(Vec2::splat(1e-3));
                    let weight = tent.x * tent.y;
                    sum += weight * self.light.get(index);
                    weights += weight;
                }
            }
            if weights > 0.0 {
                return sum / weights;
            }
        }
        Vec3::ZERO
    }

    /// Adds the radiance of all texels to a picture.
    pub(crate) fn add_to(&self, image: &mut Image) {
        let pixels = image.pixels_mut();
        let add = |pixel: &mut [f32; 3], texel: &Texel, light: Vec3| {
            let reflected = match self.reflection {
                Reflection::Lambertian => {
                    FRAC_1_PI * (self.buffer.brdf(texel).base() * texel.coverage)
                }
                Reflection::Glossy(_) => Vec3::splat(texel.coverage),
            };
            *pixel = (Vec3::from(*pixel) + reflected * light).to_array();
        };
        let band = BAND * self.width;
        let bands = pixels.chunks_mut(band).zip(self.texels.chunks(band));
        parallel::each(bands.enumerate().collect(), |(number, (pixels, texels))| {
            for (index, (pixel, texel)) in (number * band..).zip(pixels.iter_mut().zip(texels)) {
                if let Some(texel) = texel {
                    add(pixel, texel, self.light.get(index));
                }
            }
        });
        for ((pixel, texel), light) in self.extras.iter().zip(&self.extra_light) {
            add(&mut pixels[*pixel as usize], texel, *light);
        }
    }
}

/// Something for each pixel of a picture, row by row.
fn by_pixel<T: Send>(
    [width, height]: [usize; 2],
    of: impl Fn(usize, usize) -> T + Sync + Send,
) -> Vec<T> {
    let rows = parallel::made(height as u32, |y| -> Vec<T> {
        (0..width).map(|x| of(x, y as usize)).collect()
    });
    rows.into_iter().flatten().collect()
}
