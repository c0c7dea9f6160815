use caustics_geometry::Sphere;
use caustics_scene::World;
use glam::{Vec2, Vec3};

use crate::direction_cells::{Cap, Cells, LEVELS, RESOLUTION};
use crate::domain::EmissionDomain;
use crate::parallel;

/// The largest radius of a piece of a surface, as the light sees it, that is looked at as a whole, in
/// radii of a cell: wider ones are halved until they fit.
const PIECE_RADIUS: f32 = 0.7;

/// How often a triangle is halved at most, before everything that its pieces might cover is marked.
const HALVINGS: u32 = 18;

/// Maps that a caster's triangles are drawn into side by side.
const DRAWINGS: usize = 32;

/// The least triangles for which such a map is made.
const LEAST_OF_DRAWING: usize = 512;

/// Which cells of an emitter's unit square could send photons to its caster.
///
/// A conservative projection map (Jensen, *Global Illumination using Photon Maps*, 1996, section
/// 2.1): the caster's triangles and spheres are drawn into the square that directions (by the
/// [`EmissionDomain`]'s own area-preserving map) or places on a sun's rectangle are made from, and
/// every cell that they touch is marked. Photons of the others would miss, and are not traced. As
/// all cells have the same share of the light, nothing else changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProjectionMap {
    /// For each cell, row by row, whether it is marked; 32 to a word, the lowest bit first.
    words: Vec<u32>,
    marked: u32,
}

impl ProjectionMap {
    /// Cells along each side.
    pub const RESOLUTION: u32 = RESOLUTION;

    /// The map of some objects in an emitter's square; `None` for a light with an area, whose rays
    /// have four parameters.
    pub(crate) fn of(world: &World, objects: &[u32], domain: &EmissionDomain) -> Option<Self> {
        let mut map = Self::empty();
        match domain {
            EmissionDomain::Rectangle { corner, edges, .. } => {
                for corners in triangles(world, objects) {
                    map.draw_triangle(corners.map(|it| on_rectangle(it, *corner, edges)));
                }
                for sphere in spheres(world, objects) {
                    let center = on_rectangle(sphere.center, *corner, edges);
                    let radius = edges.map(|edge| sphere.radius / edge.length());
                    map.draw_ellipse(center, radius.into());
                }
            }
            EmissionDomain::Cone {
                origin,
                frame,
                cone,
                ..
            } => map.draw_directions(world, objects, *origin, &Cells::of_cone(frame, *cone)),
            EmissionDomain::Sphere { origin, .. } => {
                map.draw_directions(world, objects, *origin, &Cells::of_sphere());
            }
            EmissionDomain::Area { .. } | EmissionDomain::Sky { .. } | EmissionDomain::Nothing => {
                return None;
            }
        }
        map.marked = map.words.iter().map(|word| word.count_ones()).sum();
        Some(map)
    }

    fn empty() -> Self {
        Self {
            words: vec![0; (RESOLUTION * RESOLUTION / 32) as usize],
            marked: 0,
        }
    }

    /// The marked part of all cells, in 0..=1.
    #[must_use]
    pub fn coverage(&self) -> f32 {
        self.marked as f32 / (RESOLUTION * RESOLUTION) as f32
    }

    /// The integral of a density over the marked cells, by its values in their middles.
    pub(crate) fn integral(&self, density: impl Fn(Vec2) -> f32) -> f64 {
        let middle = |cell: u32| {
            let cell = glam::UVec2::new(cell % RESOLUTION, cell / RESOLUTION).as_vec2();
            (cell + 0.5) / RESOLUTION as f32
        };
        let marked = (0..RESOLUTION * RESOLUTION).filter(|&cell| self.is_marked(cell));
        let sum: f64 = marked.map(|cell| f64::from(density(middle(cell)))).sum();
        sum / f64::from(RESOLUTION * RESOLUTION)
    }

    /// The cells, row by row, 32 to a word with the lowest bit first: 1 for a marked one.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Whether a point of the unit square lies in a marked cell.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        let cell = (point * RESOLUTION as f32)
            .max(Vec2::ZERO)
            .as_uvec2()
            .min(glam::UVec2::splat(RESOLUTION - 1));
        self.is_marked(cell.y * RESOLUTION + cell.x)
    }

    /// The marked cells of a row, as ranges of columns from left to right.
    pub(crate) fn runs(&self, row: u32) -> impl Iterator<Item = std::ops::Range<u32>> {
        let first = row.min(RESOLUTION - 1) * RESOLUTION;
        let mut column = 0;
        std::iter::from_fn(move || {
            while column < RESOLUTION && !self.is_marked(first + column) {
                column += 1;
            }
            let start = column;
            while column < RESOLUTION && self.is_marked(first + column) {
                column += 1;
            }
            (start < column).then_some(start..column)
        })
    }

    fn is_marked(&self, cell: u32) -> bool {
        self.words[(cell / 32) as usize] >> (cell % 32) & 1 == 1
    }

    fn mark(&mut self, column: u32, row: u32) {
        let cell = row * RESOLUTION + column;
        self.words[(cell / 32) as usize] |= 1 << (cell % 32);
    }

    /// Marks what lies between `from` and `to`, in cells, of a row.
    fn mark_row(&mut self, row: i32, from: f32, to: f32) {
        let last = RESOLUTION as i32 - 1;
        if (0..=last).contains(&row) && from <= to {
            // A little wider, for the rounding of coordinates up to the map's size.
            let (from, to) = (
                (from - ROUNDING).floor() as i32,
                (to + ROUNDING).floor() as i32,
            );
            for column in from.max(0)..=to.min(last) {
                self.mark(column as u32, row as u32);
            }
        }
    }

    /// Marks every cell that a triangle of the square touches.
    fn draw_triangle(&mut self, corners: [Vec2; 3]) {
        let corners = corners.map(|it| it * RESOLUTION as f32);
        if !corners.iter().all(|it| it.is_finite()) {
            return self.words.fill(u32::MAX);
        }
        let [a, b, c] = corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let last = RESOLUTION as i32 - 1;
        let rows = ((low.y - ROUNDING).floor() as i32).max(0)
            ..=((high.y + ROUNDING).floor() as i32).min(last);
        for row in rows {
            // What of the triangle lies in the row: its corners there, and where its edges cross.
            let (bottom, top) = (row as f32 - ROUNDING, row as f32 + 1.0 + ROUNDING);
            let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
            let mut include = |x: f32| {
                from = from.min(x);
                to = to.max(x);
            };
            for (start, end) in [(a, b), (b, c), (c, a)] {
                if (bottom..=top).contains(&start.y) {
                    include(start.x);
                }
                for line in [bottom, top] {
                    if (start.y - line) * (end.y - line) < 0.0 {
                        include(start.x + (end.x - start.x) * (line - start.y) / (end.y - start.y));
                    }
                }
            }
            self.mark_row(row, from, to);
        }
    }

    fn draw_ellipse(&mut self, center: Vec2, radius: Vec2) {
        let (center, radius) = (center * RESOLUTION as f32, radius * RESOLUTION as f32);
        let last = RESOLUTION as i32 - 1;
        let rows = ((center.y - radius.y - ROUNDING).floor() as i32).max(0)
            ..=((center.y + radius.y + ROUNDING).floor() as i32).min(last);
        for row in rows {
            let (bottom, top) = (row as f32 - ROUNDING, row as f32 + 1.0 + ROUNDING);
            // The height in the row at which the ellipse is widest.
            let off = (center.y.clamp(bottom, top) - center.y) / radius.y;
            let half = radius.x * (1.0 - off * off).max(0.0).sqrt();
            self.mark_row(row, center.x - half, center.x + half);
        }
    }

    fn draw_directions(&mut self, world: &World, objects: &[u32], origin: Vec3, cells: &Cells) {
        let all: Vec<[Vec3; 3]> = triangles(world, objects)
            .map(|corners| corners.map(|it| it - origin))
            .collect();
        let size = all.len().div_ceil(DRAWINGS).max(LEAST_OF_DRAWING);
        let parts: Vec<_> = all.chunks(size).collect();
        let maps = parallel::made(parts.len() as u32, |number| {
            let mut map = Self::empty();
            map.draw_directions_to(parts[number as usize], cells);
            map
        });
        for map in maps {
            for (word, more) in self.words.iter_mut().zip(map.words) {
                *word |= more;
            }
        }
        for sphere in spheres(world, objects) {
            let to_center = sphere.center - origin;
            let distance = to_center.length();
            if distance <= sphere.radius {
                return self.words.fill(u32::MAX);
            }
            let radius = (sphere.radius / distance).asin();
            self.draw_cap(&Cap::new(to_center / distance, radius), cells);
        }
    }

    /// Marks the directions from the light to triangles, whose corners are given from there.
    fn draw_directions_to(&mut self, triangles: &[[Vec3; 3]], cells: &Cells) {
        let mut pieces = Vec::new();
        let widest = PIECE_RADIUS * cells.radius();
        for &corners in triangles {
            pieces.push((corners, HALVINGS));
            while let Some((corners, halvings)) = pieces.pop() {
                match Cap::around(corners) {
                    Some(cap) if cap.radius <= widest => self.draw_small_cap(&cap, cells),
                    Some(cap) if halvings == 0 => self.draw_cap(&cap, cells),
                    None if halvings == 0 => return self.words.fill(u32::MAX),
                    _ => {
                        let halves = halved(corners);
                        pieces.extend(halves.map(|half| (half, halvings - 1)));
                    }
                }
            }
        }
    }

    /// As [`draw_cap`](Self::draw_cap), for one that is not much larger than a cell: only the cells
    /// around its middle are looked at.
    fn draw_small_cap(&mut self, cap: &Cap, cells: &Cells) {
        let middle = (cells.inverse)(cap.axis) * RESOLUTION as f32;
        let reach = Vec2::splat(1.02 * cap.radius / cells.least_stretch * RESOLUTION as f32 + 0.01);
        let (low, high) = ((middle - reach).floor(), (middle + reach).floor());
        let last = Vec2::splat(RESOLUTION as f32 - 1.0);
        let is_inside = low.cmpge(Vec2::ZERO).all() && high.cmple(last).all();
        if !middle.is_finite() || (cells.wraps && !is_inside) {
            return self.draw_cap(cap, cells);
        }
        let (low, high) = (low.clamp(Vec2::ZERO, last), high.clamp(Vec2::ZERO, last));
        for row in low.y as u32..=high.y as u32 {
            for column in low.x as u32..=high.x as u32 {
                if !self.is_marked(row * RESOLUTION + column)
                    && cap.meets(cells.cap(LEVELS, column, row))
                {
                    self.mark(column, row);
                }
            }
        }
    }

    /// Marks every cell that a cap on the sphere of directions may touch.
    fn draw_cap(&mut self, cap: &Cap, cells: &Cells) {
        // Level, column and row.
        let mut pending = vec![(0u32, 0u32, 0u32)];
        while let Some((level, column, row)) = pending.pop() {
            if !cap.meets(cells.cap(level, column, row)) {
                continue;
            }
            if level == LEVELS {
                self.mark(column, row);
                continue;
            }
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                pending.push((level + 1, 2 * column + x, 2 * row + y));
            }
        }
    }
}

/// By how many cells coordinates may be wrong from rounding.
const ROUNDING: f32 = 1e-3;

fn on_rectangle(point: Vec3, corner: Vec3, edges: &[Vec3; 2]) -> Vec2 {
    let from_corner = point - corner;
    let along = |edge: Vec3| from_corner.dot(edge) / edge.length_squared();
    Vec2::new(along(edges[0]), along(edges[1]))
}

fn triangles<'a>(world: &'a World, objects: &'a [u32]) -> impl Iterator<Item = [Vec3; 3]> + 'a {
    objects.iter().flat_map(move |&object| {
        let range = &world.objects()[object as usize].triangles;
        let triangles = &world.triangles()[range.start as usize..range.end as usize];
        triangles
            .iter()
            .map(|it| it.map(|vertex| world.positions()[vertex as usize]))
    })
}

fn spheres<'a>(world: &'a World, objects: &'a [u32]) -> impl Iterator<Item = &'a Sphere> {
    objects.iter().flat_map(move |&object| {
        let range = &world.objects()[object as usize].spheres;
        &world.spheres()[range.start as usize..range.end as usize]
    })
}

/// The two halves of a triangle, cut through its longest edge.
fn halved([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 2] {
    let lengths = [(a - b), (b - c), (c - a)].map(Vec3::length_squared);
    let [p, q, r] = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
        [a, b, c]
    } else if lengths[1] >= lengths[2] {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let middle = 0.5 * (p + q);
    [[p, middle, r], [middle, q, r]]
}
