use std::sync::OnceLock;

use caustics_geometry::{Frame, Sphere};
use caustics_sampling::warp::{Cone, sphere_octahedral_to_square, square_to_sphere_octahedral};
use caustics_scene::World;
use glam::{Vec2, Vec3};

use crate::domain::EmissionDomain;

/// Cells along each side of a map, a power of two. A caster's outline is known to about one of
/// them: at 128, a round one that fills its cone is seen 3 % wider than it is.
const RESOLUTION: u32 = 128;

/// Levels of the tree of cells above the finest.
const LEVELS: u32 = RESOLUTION.ilog2();

/// By how much the circle around a cell of directions is wider than the one through its corners:
/// its sides are curved.
const CELL_MARGIN: f32 = 1.15;

/// The largest radius of a piece of a surface, as the light sees it, that is looked at as a whole, in
/// radii of a cell: wider ones are halved until they fit.
const PIECE_RADIUS: f32 = 0.7;

/// How often a triangle is halved at most, before everything that its pieces might cover is marked.
const HALVINGS: u32 = 18;

/// Which cells of an emitter's unit square could send photons to its caster.
///
/// Maps that a caster's triangles are drawn into side by side.
const DRAWINGS: usize = 32;

/// The least triangles for which such a map is made.
const LEAST_OF_DRAWING: usize = 512;

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
                for (corners, _) in triangles(world, objects) {
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
            .map(|(corners, _)| corners.map(|it| it - origin))
            .collect();
        let size = all.len().div_ceil(DRAWINGS).max(LEAST_OF_DRAWING);
        let draw = |part: &[[Vec3; 3]]| {
            let mut map = Self::empty();
            map.draw_far_triangles(part, cells);
            map
        };
        #[cfg(feature = "parallel")]
        let parts: Vec<Self> = {
            use rayon::prelude::*;
            all.par_chunks(size).map(draw).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let parts: Vec<Self> = all.chunks(size).map(draw).collect();
        for part in parts {
            for (word, more) in self.words.iter_mut().zip(part.words) {
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

    /// Marks what triangles cover of the directions from the origin.
    fn draw_far_triangles(&mut self, triangles: &[[Vec3; 3]], cells: &Cells) {
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

fn triangles<'a>(
    world: &'a World,
    objects: &'a [u32],
) -> impl Iterator<Item = ([Vec3; 3], u32)> + 'a {
    objects.iter().flat_map(move |&object| {
        let range = &world.objects()[object as usize].triangles;
        let triangles = &world.triangles()[range.start as usize..range.end as usize];
        triangles
            .iter()
            .map(move |it| (it.map(|vertex| world.positions()[vertex as usize]), object))
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

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
struct Cap {
    axis: Vec3,
    /// In radians.
    radius: f32,
}

impl Cap {
    fn new(axis: Vec3, radius: f32) -> Self {
        Self { axis, radius }
    }

    /// A cap around the directions to a triangle; `None` where it is as wide as a hemisphere.
    fn around(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(Vec3::normalize_or_zero);
        let axis = (a + b + c).try_normalize()?;
        let radius = [a, b, c]
            .map(|it| (it - axis).length())
            .into_iter()
            .fold(0.0, f32::max);
        // The chord of an angle below a right one; a cap that wide is convex.
        (radius < 1.2).then(|| Self::new(axis, 2.0 * (0.5 * radius).asin()))
    }

    fn meets(&self, other: &Self) -> bool {
        // The chord's length is 2 sin(angle / 2), which loses no digits to a cosine near one.
        let reach = 0.5 * (self.radius + other.radius);
        if reach >= std::f32::consts::FRAC_PI_2 {
            return true;
        }
        let chord = 2.0 * reach.sin();
        (self.axis - other.axis).length_squared() <= chord * chord
    }
}

/// The caps around the cells of a square of directions, for each level of their tree.
struct Cells {
    finest: Vec<Cap>,
    /// The levels above, from the coarsest; made when first asked for, by a wide cap.
    coarser: OnceLock<Vec<Vec<Cap>>>,
    /// The point of the square for a direction.
    inverse: Box<dyn Fn(Vec3) -> Vec2 + Sync>,
    /// The least angle, in radians, between the directions of two points of the square, relative to
    /// the points' distance.
    least_stretch: f32,
    /// Whether the map goes on from one side of the square to another.
    wraps: bool,
}

impl Cells {
    fn of_cone(frame: &Frame, cone: Cone) -> Self {
        let frame = *frame;
        // Where the square becomes a disc, 2 by 0.568 (the smaller singular value of the concentric
        // map, at its diagonals); from there to the cap, across the radius at its edge.
        let chord = (cone.solid_angle() / std::f32::consts::PI).sqrt();
        let across = (0.5 + 0.5 * cone.cosine()).max(0.0).sqrt();
        Self {
            finest: finest(&|at| frame.to_world(cone.sample_concentric(at).value)),
            coarser: OnceLock::new(),
            inverse: Box::new(move |direction| cone.invert_concentric(frame.to_local(direction))),
            least_stretch: 2.0 * 0.568 * chord * across,
            wraps: false,
        }
    }

    fn of_sphere() -> Self {
        Self {
            finest: finest(&|at| square_to_sphere_octahedral(at).value),
            coarser: OnceLock::new(),
            inverse: Box::new(sphere_octahedral_to_square),
            // The whole sphere over the largest singular value, 2 sqrt(3.82) by 2 at the equator.
            least_stretch: 1.6,
            wraps: true,
        }
    }

    /// The radius of the cell in the middle, in radians.
    fn radius(&self) -> f32 {
        let middle = RESOLUTION / 2;
        self.cap(LEVELS, middle, middle).radius
    }

    fn cap(&self, level: u32, column: u32, row: u32) -> &Cap {
        let cell = ((row << level) + column) as usize;
        if level == LEVELS {
            return &self.finest[cell];
        }
        let levels = self.coarser.get_or_init(|| {
            let mut levels = vec![coarser(&self.finest, RESOLUTION as usize)];
            while let Some(last) = levels.last().filter(|it| it.len() > 1) {
                levels.push(coarser(last, last.len().isqrt()));
            }
            levels.reverse();
            levels
        });
        &levels[level as usize][cell]
    }
}

/// The caps around the finest cells, row by row.
fn finest(direction: &dyn Fn(Vec2) -> Vec3) -> Vec<Cap> {
    let at = |x: f32, y: f32| {
        let point = Vec2::new(x, y) / RESOLUTION as f32;
        direction(point.min(Vec2::splat(1.0f32.next_down()))).normalize()
    };
    let side = RESOLUTION as usize;
    let row_of_corners = |row: usize| -> Vec<Vec3> {
        (0..=side)
            .map(|column| at(column as f32, row as f32))
            .collect()
    };
    let mut caps = Vec::with_capacity(side * side);
    let mut above = row_of_corners(0);
    for row in 0..side {
        let below = row_of_corners(row + 1);
        for column in 0..side {
            let axis = at(column as f32 + 0.5, row as f32 + 0.5);
            let corners = [
                above[column],
                above[column + 1],
                below[column],
                below[column + 1],
            ];
            let chord = corners
                .map(|it| (it - axis).length())
                .into_iter()
                .fold(0.0, f32::max);
            caps.push(Cap::new(
                axis,
                CELL_MARGIN * 2.0 * (0.5 * chord).min(1.0).asin(),
            ));
        }
        above = below;
    }
    caps
}

/// The caps of the next coarser level, each around those of the four cells in it.
fn coarser(caps: &[Cap], side: usize) -> Vec<Cap> {
    let half = side / 2;
    let mut merged = Vec::with_capacity(half * half);
    for row in 0..half {
        for column in 0..half {
            let first = 2 * row * side + 2 * column;
            let four = [first, first + 1, first + side, first + side + 1].map(|it| caps[it]);
            let sum: Vec3 = four.iter().map(|it| it.axis).sum();
            let axis = sum.normalize_or(four[0].axis);
            let radius = four
                .map(|it| 2.0 * (0.5 * it.axis.distance(axis)).min(1.0).asin() + it.radius)
                .into_iter()
                .fold(0.0, f32::max);
            merged.push(Cap::new(axis, radius));
        }
    }
    merged
}
