use caustics_geometry::Aabb;
use caustics_trace::Coverage;
use glam::{Vec2, Vec3};

use crate::density::Density;
use crate::eye::Receiver;
use crate::gate::Gate;
use crate::truncated_kernel::TruncatedKernel;

/// The most pieces that a layer is cut into.
const MAX_PIECES: u32 = 256;

/// Twice as many pieces must have boxes with less than this part of the area together.
const WORTHWHILE: f32 = 0.9;

/// Height of the layer next to the plane, relative to the extent of a piece of it.
const LAYER_HEIGHT: f32 = 0.25;

/// How much higher the next layer reaches.
const LAYER_GROWTH: f32 = 4.0;

/// By how much boxes overlap, relative to their extent, so that no rounding leaves a gap.
const OVERLAP: f32 = 1e-3;

/// A footprint as a search for what lights a point needs it.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Footprint {
    center: Vec3,
    normal: Vec3,
    u_gradient: Vec3,
    v_gradient: Vec3,
    /// See [`Density::long_direction`].
    long: Vec2,
    /// See [`Gate`].
    reach: f32,
    /// Index of the receiver among the world's objects.
    object: u32,
}

/// The part of what a footprint may light that lies between two distances along its longest axis,
/// and between two heights above its plane.
///
/// A box around a long footprint that lies askew holds mostly points that it does not light, and
/// the more so when the light comes in at an angle: pieces have smaller boxes. Each point belongs
/// to exactly one piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Index of the footprint.
    pub(crate) footprint: u32,
    /// How the footprint lies among others, for which its own 64 bytes have no room.
    pub(crate) coverage: Coverage,
    /// In standard deviations: from, and up to but not at.
    pub(crate) along: [f32; 2],
    /// In metres, on the side of the light: from, and up to but not at.
    pub(crate) height: [f32; 2],
}

impl Piece {
    #[inline]
    fn holds(&self, along: f32, height: f32) -> bool {
        (along >= self.along[0])
            & (along < self.along[1])
            & (height >= self.height[0])
            & (height < self.height[1])
    }
}

impl Footprint {
    pub(crate) fn new(density: &Density) -> Self {
        let [u_gradient, v_gradient] = density.gradients();
        Self {
            center: density.center,
            normal: density.normal,
            u_gradient,
            v_gradient,
            long: density.long_direction(),
            reach: density.gate().reach,
            object: density.object,
        }
    }

    /// The kernel at a point of a surface with unit `normal` if the point belongs to the piece and
    /// passes the gates; else 0.
    #[inline]
    pub(crate) fn kernel_at(&self, piece: &Piece, target: &Target, kernel: TruncatedKernel) -> f32 {
        let Place {
            coordinates,
            height,
        } = self.place(target.position);
        let is_own = target.object.is_none_or(|object| object == self.object);
        let is_lit = piece.holds(coordinates.dot(self.long), height)
            && Gate::new(self.reach).admits_at(height, self.normal.dot(target.normal), is_own);
        if is_lit {
            kernel.density(coordinates.x, coordinates.y)
        } else {
            0.0
        }
    }

    /// Whether a point belongs to the piece.
    #[inline]
    pub(crate) fn is_in(&self, piece: &Piece, position: Vec3) -> bool {
        let Place {
            coordinates,
            height,
        } = self.place(position);
        piece.holds(coordinates.dot(self.long), height)
    }

    #[inline]
    fn place(&self, position: Vec3) -> Place {
        let relative = position - self.center;
        Place {
            coordinates: Vec2::new(relative.dot(self.u_gradient), relative.dot(self.v_gradient)),
            height: relative.dot(self.normal),
        }
    }
}

/// Where a point is in a footprint: in standard deviations, and in metres before its plane.
struct Place {
    coordinates: Vec2,
    height: f32,
}

/// A point of a surface with a unit normal, and the object that it belongs to if that is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) object: Option<u32>,
}

impl Target {
    /// What an eye path reached.
    pub(crate) fn of(receiver: &Receiver) -> Self {
        Self {
            position: receiver.point.spawn.position,
            normal: receiver.normal,
            object: Some(receiver.point.object),
        }
    }
}

/// How footprints are cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutting {
    /// Points of the scene are no farther than this from each other, in metres: what lies farther
    /// from a footprint's middle is not cut.
    pub(crate) scene: f32,
    /// The area of boxes that one more piece must save, in square metres.
    pub(crate) worth: f32,
}

impl Cutting {
    /// Cuts what the footprint number `index` may light into pieces, and calls `emit` with each and
    /// the box around it.
    pub(crate) fn cut(&self, index: u32, density: &Density, mut emit: impl FnMut(Piece, Aabb)) {
        let shape = Shape::of(density, self.scene);
        let gate = density.gate();
        let all = [-gate.plane_distance, gate.reach];
        let mut emit_layer = |pieces: u32, height: [f32; 2]| {
            let from = if height[0] == all[0] {
                f32::NEG_INFINITY
            } else {
                height[0]
            };
            let to = if height[1] == all[1] {
                f32::INFINITY
            } else {
                height[1]
            };
            shape.cut(pieces, |along, reached| {
                let piece = Piece {
                    footprint: index,
                    coverage: density.coverage,
                    along,
                    height: [from, to],
                };
                emit(piece, shape.bounds(reached, height));
            });
        };
        let pieces = self.count(&shape, [0.0; 2]);
        if pieces == 1 {
            emit_layer(1, all);
            return;
        }
        let side = (shape.cut_at / pieces as f32 * shape.long.length()).max(shape.short.length());
        let mut top = (LAYER_HEIGHT * side).min(all[1]);
        let bottom = if top < -all[0] { -top } else { all[0] };
        emit_layer(pieces, [bottom, top]);
        if bottom > all[0] {
            emit_layer(self.count(&shape, [all[0], bottom]), [all[0], bottom]);
        }
        while top < all[1] {
            let next = LAYER_GROWTH * top;
            // The last one takes what is left.
            let next = if LAYER_GROWTH * next > all[1] {
                all[1]
            } else {
                next
            };
            emit_layer(self.count(&shape, [top, next]), [top, next]);
            top = next;
        }
    }

    /// How many pieces a layer is best cut into.
    fn count(&self, shape: &Shape, height: [f32; 2]) -> u32 {
        let area = |pieces: u32| {
            let half = shape.cut_at / pieces as f32;
            pieces as f32 * shape.bounds([-half, half], height).surface_area()
        };
        let mut pieces = 1;
        while pieces < MAX_PIECES {
            let (before, after) = (area(pieces), area(2 * pieces));
            let is_worth = before - after > pieces as f32 * self.worth;
            if !(is_worth && after < WORTHWHILE * before) {
                break;
            }
            pieces *= 2;
        }
        pieces
    }
}

/// The slanted prism that holds all that a footprint may light.
struct Shape {
    center: Vec3,
    /// One standard deviation along the longest axis.
    long: Vec3,
    /// From the middle to the side, across the longest axis.
    short: Vec3,
    /// One metre up, along the light.
    up: Vec3,
    /// From the middle to the end, in standard deviations.
    end: f32,
    /// How far from the middle it is cut, in standard deviations.
    cut_at: f32,
}

impl Shape {
    fn of(density: &Density, scene: f32) -> Self {
        let direction = density.long_direction();
        let end = density.outer_reach();
        let long = density.displacement(direction);
        Self {
            center: density.center,
            long,
            short: end * density.displacement(direction.perp()),
            up: density.towards_light(),
            end,
            cut_at: end.min(scene / long.length()),
        }
    }

    fn bounds(&self, along: [f32; 2], height: [f32; 2]) -> Aabb {
        let middle = self.center + 0.5 * (along[0] + along[1]) * self.long;
        let half = 0.5 * (along[1] - along[0]) * self.long.abs() + self.short.abs();
        let rounding = 4.0 * f32::EPSILON * (self.center.abs() + middle.abs());
        let extent = (1.0 + OVERLAP) * half + rounding;
        let (low, high) = (height[0] * self.up, height[1] * self.up);
        let slack = OVERLAP * (high - low).abs();
        Aabb {
            min: middle + low.min(high) - extent - slack,
            max: middle + low.max(high) + extent + slack,
        }
    }

    /// Calls `emit` for each piece with the range that it answers for and the one that it reaches.
    fn cut(&self, pieces: u32, mut emit: impl FnMut([f32; 2], [f32; 2])) {
        let step = 2.0 * self.cut_at / pieces as f32;
        let is_cut_short = pieces > 1 && self.cut_at < self.end;
        let cut = |number: u32| number as f32 * step - self.cut_at;
        for number in 0..pieces {
            let mut range = [cut(number), cut(number + 1)];
            let mut reached = range;
            if !is_cut_short && number == 0 {
                (range[0], reached[0]) = (f32::NEG_INFINITY, -self.end);
            }
            if !is_cut_short && number + 1 == pieces {
                (range[1], reached[1]) = (f32::INFINITY, self.end);
            }
            emit(range, reached);
        }
        if is_cut_short {
            emit([f32::NEG_INFINITY, cut(0)], [-self.end, cut(0)]);
            emit([cut(pieces), f32::INFINITY], [cut(pieces), self.end]);
        }
    }
}
