use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

use caustics_filter::Image;
use glam::{Vec2, Vec3};

use crate::columns::{Columns, ColumnsMut, TexelColumns};
use crate::error::RenderError;
use crate::gbuffer::{GBuffer, Texel};
use crate::splat::{PixelIntegral, Prepared, STRIDE, Splat};

/// Rows of one task.
const BAND: usize = 16;

/// The irradiance of a picture's texels at one resolution.
pub(crate) struct Level {
    width: usize,
    height: usize,
    texels: Vec<Option<Texel>>,
    columns: TexelColumns,
    irradiance: Columns,
    extras: Vec<(u32, Texel)>,
    extra_irradiance: Vec<Vec3>,
    /// For each band, where its extras start; one more than there are bands.
    extra_starts: Vec<usize>,
}

impl Level {
    pub(crate) fn new(
        width: usize,
        height: usize,
        texels: Vec<Option<Texel>>,
        extras: Vec<(u32, Texel)>,
    ) -> Self {
        let bands = height.div_ceil(BAND);
        let extra_starts = (0..=bands)
            .map(|band| {
                extras.partition_point(|&(pixel, _)| (pixel as usize) < band * BAND * width)
            })
            .collect();
        Self {
            width,
            height,
            irradiance: Columns::zero(texels.len()),
            columns: TexelColumns::new(&texels),
            texels,
            extra_irradiance: vec![Vec3::ZERO; extras.len()],
            extras,
            extra_starts,
        }
    }

    pub(crate) fn finest(buffer: &GBuffer) -> Self {
        Self::new(
            buffer.width() as usize,
            buffer.height() as usize,
            buffer.texels.clone(),
            buffer.extras.clone(),
        )
    }

    /// The level whose pixels stand for blocks of this one's, each by the texel nearest its middle,
    /// moved to the middle of those on the same surface: what is found there is taken to be the
    /// light in the block's middle.
    pub(crate) fn coarser(&self) -> Self {
        let stride = STRIDE as usize;
        let (width, height) = (self.width.div_ceil(stride), self.height.div_ceil(stride));
        let texels = (0..width * height)
            .map(|index| {
                let (x0, y0) = (index % width * stride, index / width * stride);
                let middle = (stride as f32 - 1.0) * 0.5;
                let inside = (0..stride * stride).filter_map(|it| {
                    let (dx, dy) = (it % stride, it / stride);
                    let (x, y) = (x0 + dx, y0 + dy);
                    let texel = (x < self.width && y < self.height)
                        .then(|| self.texels[y * self.width + x])
                        .flatten()?;
                    let off = Vec2::new(dx as f32 - middle, dy as f32 - middle).length_squared();
                    Some((off, texel))
                });
                let (_, nearest) = inside.clone().min_by(|a, b| a.0.total_cmp(&b.0))?;
                let alike = inside.filter(|(_, texel)| texel.is_like(&nearest));
                let (sum, count) = alike.fold((Vec3::ZERO, 0.0), |(sum, count), (_, texel)| {
                    (sum + texel.position, count + 1.0)
                });
                Some(Texel {
                    position: sum / count,
                    ..nearest
                })
            })
            .collect();
        Self::new(width, height, texels, Vec::new())
    }

    /// Adds the splats of this level.
    pub(crate) fn accumulate(&mut self, prepared: &[Prepared], level: usize) {
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
        let mut extra_rest = self.extra_irradiance.as_mut_slice();
        let mut tasks = Vec::with_capacity(bands);
        for (number, irradiance) in self.irradiance.chunks_mut(BAND * self.width).enumerate() {
            let extras = self.extra_starts[number]..self.extra_starts[number + 1];
            let (extra_irradiance, rest) = extra_rest.split_at_mut(extras.len());
            extra_rest = rest;
            tasks.push(BandTask {
                first_row: number * BAND,
                width: self.width,
                texels: &self.texels,
                columns: &self.columns,
                irradiance,
                extras: &self.extras[extras],
                extra_irradiance,
                splats: &lists[number],
            });
        }
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            tasks
                .into_par_iter()
                .with_max_len(1)
                .for_each(|task| task.run(prepared));
        }
        #[cfg(not(feature = "parallel"))]
        for task in tasks {
            task.run(prepared);
        }
    }

    pub(crate) fn add_coarser(&mut self, coarse: &Self) {
        let stride = STRIDE as f32;
        let width = self.width;
        let place = |pixel: usize| {
            let (x, y) = (pixel % width, pixel / width);
            (Vec2::new(x as f32, y as f32) + 0.5) / stride - 0.5
        };
        if coarse.is_dark() {
            return;
        }
        for (pixel, texel) in self.texels.iter().enumerate() {
            if let Some(texel) = texel {
                let sum = self.irradiance.get(pixel) + coarse.interpolate(place(pixel), texel);
                self.irradiance.set(pixel, sum);
            }
        }
        for ((pixel, texel), irradiance) in self.extras.iter().zip(&mut self.extra_irradiance) {
            *irradiance += coarse.interpolate(place(*pixel as usize), texel);
        }
    }

    fn is_dark(&self) -> bool {
        self.irradiance
            .x
            .iter()
            .chain(&self.irradiance.y)
            .chain(&self.irradiance.z)
            .all(|&it| it == 0.0)
    }

    /// The irradiance between the middles of pixels, from those that see the same surface.
    fn interpolate(&self, at: Vec2, texel: &Texel) -> Vec3 {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        // The four around the point; where none sees the surface, the next ones out.
        for (first, last) in [(0, 1), (-1, 2)] {
            let base = at.floor();
            for dy in first..=last {
                for dx in first..=last {
                    let corner = base + Vec2::new(dx as f32, dy as f32);
                    let (x, y) = (corner.x as isize, corner.y as isize);
                    if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                        continue;
                    }
                    let index = y as usize * self.width + x as usize;
                    let Some(other) = &self.texels[index] else {
                        continue;
                    };
                    if !texel.is_like(other) {
                        continue;
                    }
                    let tent = (1.0 - (at - corner).abs() / (last as f32)).max(Vec2::splat(1e-3));
                    let weight = tent.x * tent.y;
                    sum += weight * self.irradiance.get(index);
                    weights += weight;
                }
            }
            if weights > 0.0 {
                return sum / weights;
            }
        }
        Vec3::ZERO
    }

    pub(crate) fn radiance(&self) -> Result<Image, RenderError> {
        let mut image = Image::new(self.width as u32, self.height as u32)?;
        let pixels = image.pixels_mut();
        for (index, texel) in self.texels.iter().enumerate() {
            if let Some(texel) = texel {
                pixels[index] = (FRAC_1_PI * texel.albedo * self.irradiance.get(index)).to_array();
            }
        }
        for ((pixel, texel), irradiance) in self.extras.iter().zip(&self.extra_irradiance) {
            let pixel = &mut pixels[*pixel as usize];
            *pixel = (Vec3::from(*pixel) + FRAC_1_PI * texel.albedo * *irradiance).to_array();
        }
        Ok(image)
    }
}

/// A band of rows and the splats that overlap it.
struct BandTask<'a> {
    first_row: usize,
    width: usize,
    texels: &'a [Option<Texel>],
    columns: &'a TexelColumns,
    /// From the band's first row on.
    irradiance: ColumnsMut<'a>,
    extras: &'a [(u32, Texel)],
    extra_irradiance: &'a mut [Vec3],
    splats: &'a [u32],
}

impl BandTask<'_> {
    fn run(mut self, prepared: &[Prepared]) {
        let rows = self.irradiance.x.len() / self.width;
        let mut weights = Vec::new();
        for &index in self.splats {
            let Prepared::Splat(splat) = &prepared[index as usize] else {
                continue;
            };
            let first = usize::from(splat.rows[0]).max(self.first_row);
            let last = usize::from(splat.rows[1]).min(self.first_row + rows);
            if let Some(integral) = &splat.integral {
                self.light_integrated(splat, integral, first..last, &mut weights);
                continue;
            }
            for row in first..last {
                let span = splat.span(row);
                let start = (row - self.first_row) * self.width;
                self.columns.light(
                    &splat.density,
                    &splat.gate,
                    row * self.width + span.start,
                    span.len(),
                    &mut self.irradiance,
                    start + span.start,
                );
            }
            if !self.extras.is_empty() && first < last {
                let low = (first * self.width) as u32;
                let high = (last * self.width) as u32;
                let begin = self.extras.partition_point(|&(pixel, _)| pixel < low);
                let columns = splat.columns.map(u32::from);
                for (offset, (pixel, texel)) in self.extras[begin..].iter().enumerate() {
                    if *pixel >= high {
                        break;
                    }
                    let column = pixel % self.width as u32;
                    if (columns[0]..columns[1]).contains(&column) {
                        self.extra_irradiance[begin + offset] += splat.irradiance(texel, None);
                    }
                }
            }
        }
    }

    /// Lights the pixels of some rows by a footprint that is integrated over each.
    fn light_integrated(
        &mut self,
        splat: &Splat,
        integral: &PixelIntegral,
        rows: Range<usize>,
        weights: &mut Vec<f32>,
    ) {
        let columns = usize::from(splat.columns[0])..usize::from(splat.columns[1]);
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        weights.clear();
        weights.resize(rows.len() * columns.len(), 0.0);
        integral.gaussian.add_weights(&columns, &rows, weights);
        for (row, weights) in rows.clone().zip(weights.chunks(columns.len())) {
            let start = row * self.width;
            for (column, &weight) in columns.clone().zip(weights) {
                if weight > 0.0
                    && let Some(texel) = &self.texels[start + column]
                {
                    let target = (row - self.first_row) * self.width + column;
                    let added = splat.irradiance(texel, Some(weight));
                    self.irradiance.x[target] += added.x;
                    self.irradiance.y[target] += added.y;
                    self.irradiance.z[target] += added.z;
                }
            }
        }
        let begin = |row: usize| {
            self.extras
                .partition_point(|&(pixel, _)| (pixel as usize) < row * self.width)
        };
        for index in begin(rows.start)..begin(rows.end) {
            let (pixel, texel) = &self.extras[index];
            let (row, column) = (*pixel as usize / self.width, *pixel as usize % self.width);
            if columns.contains(&column) {
                let place = (row - rows.start) * columns.len() + column - columns.start;
                self.extra_irradiance[index] += splat.irradiance(texel, Some(weights[place]));
            }
        }
    }
}
