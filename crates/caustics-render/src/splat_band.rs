use std::ops::Range;

use glam::Vec3;

use crate::columns::ColumnsMut;
use crate::footprint_integral::FootprintIntegral;
use crate::gbuffer::Texel;
use crate::pixel_samples::PixelSamples;
use crate::prepared_splat::{Prepared, Splat};
use crate::screen::Screen;

use crate::surroundings::{Relation, Surroundings, TILE};
use crate::texel_level::{Reflection, margin};

/// A band of rows and the splats that overlap it.
pub(crate) struct BandTask<'a> {
    pub(crate) first_row: usize,
    pub(crate) width: usize,
    pub(crate) depth: u32,
    pub(crate) surroundings: &'a Surroundings,
    pub(crate) screen: &'a Screen,
    pub(crate) reflection: &'a Reflection,
    pub(crate) texels: &'a [Option<Texel>],
    /// From the band's first row on.
    pub(crate) light: ColumnsMut<'a>,
    pub(crate) first_extra: usize,
    pub(crate) extras: &'a [(u32, Texel)],
    pub(crate) extra_light: &'a mut [Vec3],
    pub(crate) splats: &'a [u32],
}

impl BandTask<'_> {
    pub(crate) fn run(mut self, prepared: &[Prepared]) {
        let rows = self.light.x.len() / self.width;
        let mut weights = [Vec::new(), Vec::new()];
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
            if splat.is_plain {
                for row in first..last {
                    self.light(splat, row, splat.span(row), Relation::Flat);
                }
            } else {
                self.light_by_tiles(splat, first..last);
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
                        self.extra_light[begin + offset] +=
                            self.extra(splat, begin + offset, texel);
                    }
                }
            }
        }
    }

    /// Lights the pixels of some rows by a footprint that is integrated over each.
    fn light_integrated(
        &mut self,
        splat: &Splat,
        integral: &FootprintIntegral,
        rows: Range<usize>,
        [weights, part_weights]: &mut [Vec<f32>; 2],
    ) {
        let columns = usize::from(splat.columns[0])..usize::from(splat.columns[1]);
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        let (texels, light) = (self.texels, &mut self.light);
        let (width, first) = (self.width, self.first_row);
        let (density, gate) = (&splat.density, &splat.gate);
        let gaussian = integral.gaussian();
        gaussian.light_pixels(&columns, &rows, weights, |column, row, weight| {
            if let Some(texel) = &texels[row * width + column]
                && integral.is_in_plane(density, gate, texel)
            {
                let target = (row - first) * width + column;
                let weight = if texel.samples == PixelSamples::ALL {
                    weight
                } else {
                    gaussian.part(column, row, texel.samples, part_weights) / texel.coverage
                };
                let irradiance = integral.irradiance_in_plane(density, gate, texel, weight);
                light.add(target, irradiance);
            }
        });
        let mut at = |texel: &Texel, pixel: [usize; 2]| {
            integral.irradiance(density, gate, texel, pixel, self.screen, weights)
        };
        // Off the plane each pixel lies elsewhere in the distribution.
        let off_plane = if integral.is_flat() {
            0..0
        } else {
            rows.clone()
        };
        for row in off_plane {
            for column in columns.clone() {
                if let Some(texel) = &texels[row * width + column]
                    && !integral.is_in_plane(density, gate, texel)
                {
                    let target = (row - first) * width + column;
                    light.add(target, at(texel, [column, row]));
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
                self.extra_light[index] += at(texel, [column, row]);
            }
        }
    }

    /// Lights rows of the band tile by tile, each by what it is to the splat.
    fn light_by_tiles(&mut self, splat: &Splat, rows: Range<usize>) {
        let margin = margin(self.depth);
        let tile_of = |pixel: usize| pixel.saturating_sub(margin) / TILE;
        let [first, last] = splat.columns.map(usize::from);
        if first >= last {
            return;
        }
        // Columns where something of the same kind begins and ends.
        let mut runs: Vec<(Range<usize>, Relation)> = Vec::new();
        let mut tile_row = usize::MAX;
        for row in rows {
            if tile_of(row) != tile_row {
                tile_row = tile_of(row);
                runs.clear();
                for column in tile_of(first)..=tile_of(last - 1) {
                    let place = [column, tile_row];
                    let relation = self.surroundings.relation(
                        self.depth,
                        place,
                        &splat.density,
                        &splat.gate,
                        splat.flat,
                    );
                    let end = ((column + 1) * TILE + margin).min(last);
                    match runs.last_mut() {
                        Some((run, known)) if *known == relation => run.end = end,
                        Some((run, _)) => {
                            let begin = run.end;
                            runs.push((begin..end, relation));
                        }
                        None => runs.push((first..end, relation)),
                    }
                }
                // The margin belongs to the last tile.
                if let Some((run, _)) = runs.last_mut() {
                    run.end = last;
                }
            }
            for (run, relation) in &runs {
                let columns = match relation {
                    Relation::Dark => continue,
                    Relation::Flat => {
                        let span = splat.span(row);
                        span.start.max(run.start)..span.end.min(run.end)
                    }
                    Relation::Own | Relation::Mixed => run.clone(),
                };
                self.light(splat, row, columns, *relation);
            }
        }
    }

    /// Lights some columns of a row.
    fn light(&mut self, splat: &Splat, row: usize, columns: Range<usize>, relation: Relation) {
        if columns.is_empty() {
            return;
        }
        let count = columns.len();
        let from = row * self.width + columns.start;
        let to = (row - self.first_row) * self.width + columns.start;
        let (density, gate, light) = (&splat.density, &splat.gate, &mut self.light);
        match self.reflection {
            Reflection::Lambertian(texels) => {
                let is_mixed = relation == Relation::Mixed;
                texels.light(density, gate, is_mixed, from, count, light, to);
            }
            Reflection::Glossy(texels) => texels.light(density, gate, from, count, light, to),
        }
    }

    /// What a splat adds to an extra texel of the band.
    fn extra(&self, splat: &Splat, extra: usize, texel: &Texel) -> Vec3 {
        match self.reflection {
            Reflection::Lambertian(_) => splat.irradiance(texel),
            Reflection::Glossy(texels) => {
                texels.extra_radiance(self.first_extra + extra, &splat.density, &splat.gate)
            }
        }
    }
}
