use glam::{Vec2, Vec3};

use crate::density::Density;
use crate::screen::Screen;

/// The part of the screen that a footprint may overlap, in pixels.
pub(crate) struct Bounds {
    pub(crate) low: Vec2,
    pub(crate) high: Vec2,
    pub(crate) is_exact: bool,
}

impl Bounds {
    /// Of what a footprint lights between two heights before its plane.
    pub(crate) fn of(density: &Density, heights: [f32; 2], screen: &Screen) -> Self {
        let [a, b] = density.half_extents();
        let [below, above] = heights.map(|height| height * density.towards_light());
        // A perspective map takes the corners' hull to the corners' hull as long as all are in
        // front of the camera; close to it the map is too uneven to be followed linearly.
        let near = 0.3 * screen.depth(density.center).abs();
        let corners = [a + b, a - b, b - a, -a - b].map(|corner| density.center + corner);
        let hull = |shift: Vec3| {
            let corners = corners.map(|corner| corner + shift);
            if corners.iter().any(|&corner| screen.depth(corner) <= near) {
                return None;
            }
            let [p, q, r, s] = corners.map(|corner| screen.project(corner));
            let (p, q, r, s) = (p?, q?, r?, s?);
            Some((p.min(q).min(r).min(s), p.max(q).max(r).max(s)))
        };
        let hulls = hull(below).and_then(|lower| {
            let upper = if heights[0] == heights[1] {
                lower
            } else {
                hull(above)?
            };
            Some((lower.0.min(upper.0), lower.1.max(upper.1)))
        });
        if let Some((low, high)) = hulls {
            return Self {
                low,
                high,
                is_exact: true,
            };
        }
        let high = Vec2::new(screen.width as f32, screen.height as f32);
        Self {
            low: Vec2::ZERO,
            high,
            is_exact: false,
        }
    }

    pub(crate) fn clipped(self, screen: &Screen) -> Option<Self> {
        let size = Vec2::new(screen.width as f32, screen.height as f32);
        let overlaps = self.high.cmpge(Vec2::ZERO).all() && self.low.cmple(size).all();
        overlaps.then_some(self)
    }
}
