use glam::{Vec2, Vec3};

use crate::density::Density;
use crate::flat_objects::curved_objects;
use crate::gate::Gate;
use crate::gbuffer::{GBuffer, Texel};
use crate::parallel;

/// Pixels along the sides of the smallest tiles.
pub(crate) const TILE: usize = 8;

/// What tiles of a picture show, in a pyramid: so that a footprint knows whether there is anything
/// but its own receiver to light, without a look at every pixel.
#[derive(Clone, Debug)]
pub(crate) struct Surroundings {
    /// The smallest tiles first, each further level with tiles of twice the side.
    levels: Vec<Tiles>,
    /// Whether any texel is glossy.
    pub(crate) is_glossy: bool,
    /// For each object up to the last that curves, whether it does.
    curved: Vec<bool>,
}

#[derive(Clone, Debug)]
struct Tiles {
    width: usize,
    height: usize,
    tiles: Vec<Tile>,
}

/// A box around the texels of a tile, and the least and the greatest of their objects.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tile {
    min: Vec3,
    max: Vec3,
    objects: [u32; 2],
}

impl Tile {
    const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
        objects: [u32::MAX, 0],
    };

    fn add(&mut self, texel: &Texel) {
        self.join(&Self {
            min: texel.position,
            max: texel.position,
            objects: [texel.object; 2],
        });
    }

    fn join(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.objects[0] = self.objects[0].min(other.objects[0]);
        self.objects[1] = self.objects[1].max(other.objects[1]);
    }

    fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// Between which heights before a footprint's plane it lies, in metres.
    fn heights(&self, density: &Density) -> [f32; 2] {
        let (middle, half) = self.extent_along(density.normal, density.center);
        [middle - half, middle + half]
    }

    /// The middle and half of the extent of its coordinates along an axis from a point.
    fn extent_along(&self, axis: Vec3, from: Vec3) -> (f32, f32) {
        let middle = 0.5 * (self.min + self.max) - from;
        let half = 0.5 * (self.max - self.min);
        (middle.dot(axis), half.dot(axis.abs()))
    }

    /// Whether the light of a footprint may reach it.
    fn is_near(&self, density: &Density) -> bool {
        let [u, v] = density.gradients().map(|gradient| {
            let (middle, half) = self.extent_along(gradient, density.center);
            (middle.abs() - half).max(0.0)
        });
        u * u + v * v <= density.outer_reach() * density.outer_reach()
    }
}

/// What a tile is to a footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Relation {
    /// Nothing that it may light.
    Dark,
    /// Its receiver, in its plane.
    Flat,
    /// Its receiver.
    Own,
    /// Other objects, too.
    Mixed,
}

/// What of a part of the picture a footprint may light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InReach {
    /// Where it lies, in metres before the footprint's plane: from and to.
    pub(crate) heights: [f32; 2],
    /// Whether it all belongs to the footprint's own receiver.
    pub(crate) is_own: bool,
}

impl InReach {
    /// Whether it all lies in the footprint's plane, to `flat` metres.
    pub(crate) fn is_flat(&self, flat: f32) -> bool {
        self.heights.iter().all(|it| it.abs() <= flat)
    }
}

impl Surroundings {
    pub(crate) fn of(buffer: &GBuffer) -> Self {
        let [width, height] = [buffer.width(), buffer.height()].map(|size| size as usize);
        let mut finest = Tiles::empty(width.div_ceil(TILE), height.div_ceil(TILE));
        let columns = finest.width;
        let rows = finest.tiles.chunks_mut(columns);
        let rows = rows.zip(buffer.texels.chunks(TILE * width));
        parallel::each(rows.collect(), |(tiles, texels)| {
            for (pixel, texel) in texels.iter().enumerate() {
                if let Some(texel) = texel {
                    tiles[pixel % width / TILE].add(texel);
                }
            }
        });
        for (pixel, texel) in buffer.extras.iter() {
            let (x, y) = (
                *pixel as usize % width / TILE,
                *pixel as usize / width / TILE,
            );
            finest.tiles[y * columns + x].add(texel);
        }
        let mut levels = vec![finest];
        while let Some(coarser) = levels[levels.len() - 1].coarser() {
            levels.push(coarser);
        }
        Self {
            levels,
            is_glossy: buffer.is_glossy(),
            curved: curved_objects(buffer),
        }
    }

    /// Whether an object is seen beside the plane of one of its footprints, where light that follows
    /// the surface must be followed to that plane.
    pub(crate) fn is_curved(&self, object: u32) -> bool {
        self.curved.get(object as usize).copied().unwrap_or(false)
    }

    /// What a footprint may light in a tile, of the level whose tiles have `TILE` pixels of a
    /// picture that was halved `depth` times. `flat` is how far off the plane is still in it, in
    /// metres. Tiles at the border also stand for what lies beyond it.
    pub(crate) fn relation(
        &self,
        depth: u32,
        [column, row]: [usize; 2],
        density: &Density,
        gate: &Gate,
        flat: f32,
    ) -> Relation {
        let tiles = &self.levels[(depth as usize).min(self.levels.len() - 1)];
        let [column, row] = [column.min(tiles.width - 1), row.min(tiles.height - 1)];
        let tile = &tiles.tiles[row * tiles.width + column];
        if tile.is_empty() {
            return Relation::Dark;
        }
        let [lowest, highest] = tile.heights(density);
        let is_out_of_reach = highest < -gate.plane_distance || lowest > gate.reach;
        let is_at_border =
            column == 0 || row == 0 || column + 1 == tiles.width || row + 1 == tiles.height;
        if is_out_of_reach || !(is_at_border || tile.is_near(density)) {
            return Relation::Dark;
        }
        match tile.objects == [density.object; 2] {
            true if lowest >= -flat && highest <= flat => Relation::Flat,
            true => Relation::Own,
            false => Relation::Mixed,
        }
    }

    /// What a footprint may light of the pixels between `low` and `high`; `None` if nothing.
    pub(crate) fn in_reach(
        &self,
        density: &Density,
        gate: &Gate,
        low: Vec2,
        high: Vec2,
    ) -> Option<InReach> {
        // The level at which it takes two or three tiles along each side at most.
        let extent = (high - low).max_element() / (2 * TILE) as f32;
        let level = extent
            .log2()
            .ceil()
            .clamp(0.0, (self.levels.len() - 1) as f32) as usize;
        let tiles = &self.levels[level];
        let side = (TILE << level) as f32;
        let from = (low / side).floor().max(Vec2::ZERO);
        let to = (high / side).floor();
        let columns = from.x as usize..=(to.x.max(0.0) as usize).min(tiles.width - 1);
        let rows = from.y as usize..=(to.y.max(0.0) as usize).min(tiles.height - 1);

        let bottom = -gate.plane_distance;
        let mut found = InReach {
            heights: [f32::INFINITY, f32::NEG_INFINITY],
            is_own: true,
        };
        for row in rows {
            for column in columns.clone() {
                let tile = &tiles.tiles[row * tiles.width + column];
                if tile.is_empty() {
                    continue;
                }
                let [lowest, highest] = tile.heights(density);
                if highest < bottom || lowest > gate.reach {
                    continue;
                }
                found.heights[0] = found.heights[0].min(lowest.max(bottom));
                found.heights[1] = found.heights[1].max(highest.min(gate.reach));
                found.is_own &= tile.objects == [density.object; 2];
            }
        }
        (found.heights[0] <= found.heights[1]).then_some(found)
    }
}

impl Tiles {
    fn empty(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            tiles: vec![Tile::EMPTY; width * height],
        }
    }

    /// Tiles of twice the side; `None` for a single one.
    fn coarser(&self) -> Option<Self> {
        if self.tiles.len() <= 1 {
            return None;
        }
        let mut coarser = Self::empty(self.width.div_ceil(2), self.height.div_ceil(2));
        for (index, tile) in self.tiles.iter().enumerate() {
            let (x, y) = (index % self.width / 2, index / self.width / 2);
            coarser.tiles[y * coarser.width + x].join(tile);
        }
        Some(coarser)
    }
}
