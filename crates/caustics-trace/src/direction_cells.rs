use std::sync::OnceLock;

use caustics_geometry::Frame;
use caustics_sampling::warp::{Cone, sphere_octahedral_to_square, square_to_sphere_octahedral};
use glam::{Vec2, Vec3};

/// Cells along each side of a map, a power of two. A caster's outline is known to about one of
/// them: at 128, a round one that fills its cone is seen 3 % wider than it is.
pub(crate) const RESOLUTION: u32 = 128;

/// Levels of the tree of cells above the finest.
pub(crate) const LEVELS: u32 = RESOLUTION.ilog2();

/// By how much the circle around a cell of directions is wider than the one through its corners:
/// its sides are curved.
const CELL_MARGIN: f32 = 1.15;

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cap {
    pub(crate) axis: Vec3,
    /// In radians.
    pub(crate) radius: f32,
}

impl Cap {
    pub(crate) fn new(axis: Vec3, radius: f32) -> Self {
        Self { axis, radius }
    }

    /// A cap around the directions to a triangle; `None` where it is as wide as a hemisphere.
    pub(crate) fn around(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(Vec3::normalize_or_zero);
        let axis = (a + b + c).try_normalize()?;
        let radius = [a, b, c]
            .map(|it| (it - axis).length())
            .into_iter()
            .fold(0.0, f32::max);
        // The chord of an angle below a right one; a cap that wide is convex.
        (radius < 1.2).then(|| Self::new(axis, 2.0 * (0.5 * radius).asin()))
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
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
pub(crate) struct Cells {
    finest: Vec<Cap>,
    /// The levels above, from the coarsest; made when first asked for, by a wide cap.
    coarser: OnceLock<Vec<Vec<Cap>>>,
    /// The point of the square for a direction.
    pub(crate) inverse: Box<dyn Fn(Vec3) -> Vec2 + Sync>,
    /// The least angle, in radians, between the directions of two points of the square, relative to
    /// the points' distance.
    pub(crate) least_stretch: f32,
    /// Whether the map goes on from one side of the square to another.
    pub(crate) wraps: bool,
}

impl Cells {
    pub(crate) fn of_cone(frame: &Frame, cone: Cone) -> Self {
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

    pub(crate) fn of_sphere() -> Self {
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
    pub(crate) fn radius(&self) -> f32 {
        let middle = RESOLUTION / 2;
        self.cap(LEVELS, middle, middle).radius
    }

    pub(crate) fn cap(&self, level: u32, column: u32, row: u32) -> &Cap {
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
