use caustics_filter::Image;
use glam::{IVec2, Vec2, Vec3};

use crate::columns::{Columns, ColumnsMut};
use crate::gbuffer::Texel;
use crate::parallel;
use crate::prepared_splat::{Prepared, STRIDE};
use crate::screen::Screen;
use crate::splat_band::BandTask;
use crate::surroundings::Surroundings;
use crate::texel_level::{BAND, MARGIN, TexelLevel};

/// The light of a picture's texels at one resolution: irradiance, or radiance of glossy ones.
pub(crate) struct Level<'a> {
    view: &'a TexelLevel,
    light: Columns,
    extra_light: Vec<Vec3>,
}

impl<'a> Level<'a> {
    /// A dark one.
    pub(crate) fn new(view: &'a TexelLevel) -> Self {
        Self {
            view,
            light: Columns::zero(view.texels.len()),
            extra_light: vec![Vec3::ZERO; view.extras.len()],
        }
    }

    /// Adds the splats of this level.
    pub(crate) fn accumulate(
        &mut self,
        prepared: &[Prepared],
        screen: &Screen,
        surroundings: &Surroundings,
        level: usize,
    ) {
        let view = self.view;
        let bands = view.height.div_ceil(BAND);
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
        for (number, light) in self.light.chunks_mut(BAND * view.width).enumerate() {
            let extras = view.extra_starts[number]..view.extra_starts[number + 1];
            let (extra_light, rest) = extra_rest.split_at_mut(extras.len());
            extra_rest = rest;
            tasks.push(BandTask {
                first_row: number * BAND,
                width: view.width,
                depth: view.depth,
                surroundings,
                screen,
                reflection: &view.reflection,
                texels: &view.texels,
                light,
                first_extra: extras.start,
                extras: &view.extras[extras],
                extra_light,
                splats: &lists[number],
            });
        }
        parallel::each(tasks, |task| task.run(prepared));
    }

    /// Adds the light of the next coarser level, interpolated.
    pub(crate) fn add_coarser(&mut self, coarse: &Self) {
        if coarse.light.is_zero() {
            return;
        }
        let view = self.view;
        let bands = self.light.chunks_mut(BAND * view.width).enumerate();
        parallel::each(bands.collect(), |(number, mut light)| {
            let mut blend = Columns::zero(coarse.view.width);
            let rows = light.x.len() / view.width;
            for row in 0..rows {
                let mut light = light.part(row * view.width, view.width);
                coarse.add_to_row(view, number * BAND + row, &mut light, &mut blend);
            }
        });
        for ((pixel, texel), light) in view.extras.iter().zip(&mut self.extra_light) {
            let (x, y) = (*pixel as usize % view.width, *pixel as usize / view.width);
            *light += coarse.interpolate(place(view, x, y), texel);
        }
    }

    /// Adds this level's light to a row of the next finer one. `blend` has room for a row of this one.
    fn add_to_row(
        &self,
        fine: &TexelLevel,
        row: usize,
        light: &mut ColumnsMut<'_>,
        blend: &mut Columns,
    ) {
        // The pixel at `first` and the next one have between their middles those from `begin` on: two,
        // a quarter of the way from either, but one at the row's ends, which may lie outside.
        let width = self.view.width;
        let at = place(fine, 0, row).y;
        let (above, down) = (at as usize * width, at.fract());
        self.light.blend_rows(above, width, down, blend);
        if blend.is_zero() {
            return;
        }
        let is_even = &self.view.is_even[above..above + width];
        let begin = |first: usize| {
            (first * STRIDE as usize + fine.margin()).saturating_sub(STRIDE as usize * MARGIN - 1)
        };
        let mut first = 0;
        while first + 1 < width {
            let run = is_even[first..width - 1]
                .iter()
                .take_while(|&&it| it == is_even[first])
                .count();
            let columns = begin(first)..begin(first + run).min(fine.width);
            if is_even[first] {
                light.add_between(columns.start, blend, first..first + run);
            } else {
                for column in columns {
                    if let Some(texel) = &fine.texels[row * fine.width + column] {
                        let at = place(fine, column, row);
                        light.add(column, self.interpolate(at, texel));
                    }
                }
            }
            first += run;
        }
    }

    /// The light between the middles of pixels, from those that see the same surface. Both coordinates are at
    /// least 0.
    fn interpolate(&self, at: Vec2, texel: &Texel) -> Vec3 {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        let (view, base) = (self.view, at.as_ivec2());
        let within = IVec2::new(view.width as i32, view.height as i32);
        // The four around the point; where none sees the surface, the next ones out.
        for (first, last) in [(0, 1), (-1, 2)] {
            for dy in first..=last {
                for dx in first..=last {
                    let corner = base + IVec2::new(dx, dy);
                    if corner.cmplt(IVec2::ZERO).any() || corner.cmpge(within).any() {
                        continue;
                    }
                    let index = corner.y as usize * view.width + corner.x as usize;
                    let Some(other) = &view.texels[index] else {
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
    pub(crate) fn add_to(
        &self,
        reflectance: &Columns,
        extra_reflectance: &[Vec3],
        image: &mut Image,
    ) {
        let pixels = image.pixels_mut();
        let band = BAND * self.view.width;
        let bands = pixels.chunks_mut(band).enumerate();
        parallel::each(bands.collect(), |(number, pixels)| {
            let part = number * band..number * band + pixels.len();
            let (light, reflectance) = (self.light.part(part.clone()), reflectance.part(part));
            for (index, pixel) in pixels.iter_mut().enumerate() {
                for (channel, value) in pixel.iter_mut().enumerate() {
                    *value += reflectance[channel][index] * light[channel][index];
                }
            }
        });
        let extras = extra_reflectance.iter().zip(&self.extra_light);
        for ((pixel, _), (reflectance, light)) in self.view.extras.iter().zip(extras) {
            let pixel = &mut pixels[*pixel as usize];
            *pixel = (Vec3::from(*pixel) + *reflectance * *light).to_array();
        }
    }
}

/// Where the middle of a level's pixel lies among the middles of the next coarser one's.
fn place(fine: &TexelLevel, x: usize, y: usize) -> Vec2 {
    let at = Vec2::new(x as f32, y as f32) + 0.5 - fine.margin() as f32;
    at / STRIDE as f32 - 0.5 + MARGIN as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::floor_and_ball::floor_and_ball;

    #[test]
    fn rows_are_interpolated_as_their_pixels_are() {
        let buffer = floor_and_ball();
        let levels = &buffer.splat_view().passes[0].levels;
        let mut even = 0;
        for pair in levels.windows(2).take(4) {
            let (fine, mut coarse) = (&pair[0], Level::new(&pair[1]));
            for index in 0..coarse.view.texels.len() {
                let at = index as f32;
                coarse.light.x[index] = (at * 0.618_034).fract();
                coarse.light.y[index] = (at * 0.754_877_7).fract();
                coarse.light.z[index] = (at * 0.569_840_3).fract();
            }
            let mut light = Level::new(fine);
            light.add_coarser(&coarse);
            for (index, texel) in fine.texels.iter().enumerate() {
                let (x, y) = (index % fine.width, index / fine.width);
                let expected = texel.as_ref().map_or(Vec3::ZERO, |texel| {
                    coarse.interpolate(place(fine, x, y), texel)
                });
                let got = light.light.get(index);
                assert!(
                    got.abs_diff_eq(expected, 1e-5),
                    "level {} at {x}, {y}: {got} in place of {expected}",
                    fine.depth
                );
            }
            even += pair[1].is_even.iter().filter(|&&it| it).count();
        }
        // Both ways are taken: most squares are even, those at the ball's outline are not.
        let all: usize = levels[1..5].iter().map(|it| it.is_even.len()).sum();
        assert!(even * 3 > all && even < all, "{even} of {all} are even");
    }
}
