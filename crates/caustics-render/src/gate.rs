use glam::Vec3;

use crate::density::Density;

/// The least cosine between the normals of a footprint and of a point that it may light.
pub(crate) const MIN_NORMAL_COSINE: f32 = 0.5;

/// How far off its plane a footprint lights, relative to its reach.
const PLANE_DISTANCE: f32 = 0.3;

/// Another object whose normal has at least this cosine with the footprint's is parallel to it.
const PARALLEL_COSINE: f32 = 0.9;

/// How far off its plane a footprint lights other objects that are parallel to it, relative to its
/// reach: tiles of one floor, but not a sheet that lies above or below it.
const TOUCHING: f32 = 0.05;

/// How far before its plane a surface still is in it, relative to a footprint's reach.
const IN_PLANE: f32 = 1e-3;

/// Which points a footprint may light.
///
/// What stands before the footprint's plane, as a wall does that its receiver ends at, catches the
/// light on its way to the plane. What lies beyond the plane is lit only if it is the receiver
/// itself, curving away: not what is to be seen past its edge. Another object that is parallel to
/// the receiver is lit only where it continues it: not a sheet above or below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gate {
    /// From where before the footprint's plane other surfaces catch its light, in metres.
    pub(crate) before: f32,
    /// How far before the footprint's plane, in metres.
    pub(crate) reach: f32,
    /// How far beyond the footprint's plane, in metres.
    pub(crate) plane_distance: f32,
    /// The least cosine between the normals beyond the plane.
    pub(crate) normal_cosine: f32,
}

impl Gate {
    /// The gate of a footprint that lights what is up to `reach` before its plane, in metres.
    pub(crate) fn new(reach: f32) -> Self {
        Self {
            before: 0.0,
            reach,
            plane_distance: PLANE_DISTANCE * reach,
            normal_cosine: MIN_NORMAL_COSINE,
        }
    }

    /// In two: the footprint's plane and what is beyond it, and what catches its light before.
    pub(crate) fn divided(self) -> [Self; 2] {
        let seam = IN_PLANE * self.reach;
        let own = Self {
            reach: seam,
            ..self
        };
        let before = Self {
            before: seam,
            plane_distance: -seam,
            ..self
        };
        [own, before]
    }

    /// Whether a point with a normal, on an object if that is known, passes.
    pub(crate) fn admits(
        &self,
        density: &Density,
        point: Vec3,
        normal: Vec3,
        object: Option<u32>,
    ) -> bool {
        let off = (point - density.center).dot(density.normal);
        let is_own = object.is_none_or(|object| object == density.object);
        self.admits_at(off, normal.dot(density.normal), is_own)
    }

    /// Whether a point passes that lies `off` metres before the plane, and whose normal has this
    /// cosine with the footprint's; on the footprint's own receiver, or on another object.
    #[inline]
    pub(crate) fn admits_at(&self, off: f32, normal_cosine: f32, is_own: bool) -> bool {
        // Without branches, so that loops over many points use vector instructions.
        let is_parallel = !is_own & (normal_cosine >= PARALLEL_COSINE);
        let touching = TOUCHING * self.reach;
        let is_touching = (off >= -touching.min(self.plane_distance)) & (off <= touching);
        let is_before = (off >= self.before) & (off <= self.reach);
        let curves_away = is_own & (normal_cosine >= self.normal_cosine);
        let is_beyond = curves_away & (off >= -self.plane_distance) & (off <= self.reach);
        (is_parallel & is_touching) | (!is_parallel & (is_before | is_beyond))
    }
}
