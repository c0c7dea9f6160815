//! Flux shared out over square pixels by the exact part of a shape that lies in each.

use std::f64::consts::TAU;

use glam::DVec2;

/// A triangle of less area than this, in pixels, is a point for all that its pixels can tell.
const LEAST_AREA: f64 = 1e-14;

/// The flux of square pixels, `size` by `size`. Points are given in pixels; what lies outside is
/// lost.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelSum {
    size: usize,
    flux: Vec<f64>,
    /// Memory to clip in.
    polygons: [Vec<DVec2>; 2],
    /// Memory for the angles at which a circle enters pixels.
    angles: Vec<f64>,
}

impl PixelSum {
    /// Dark pixels.
    #[must_use]
    pub fn new(size: usize) -> Self {
        Self {
            size,
            flux: vec![0.0; size * size],
            polygons: [Vec::new(), Vec::new()],
            angles: Vec::new(),
        }
    }

    /// The flux of each pixel, row by row.
    #[must_use]
    pub fn into_flux(self) -> Vec<f64> {
        self.flux
    }

    /// Spreads flux evenly over a triangle, of either orientation.
    pub fn add_triangle(&mut self, corners: [DVec2; 3], flux: f64) {
        let [a, b, c] = corners;
        let low = a.min(b).min(c).floor();
        let high = a.max(b).max(c).floor();
        let area = polygon_area(&corners);
        if low == high || area < LEAST_AREA {
            self.add_point((a + b + c) / 3.0, flux);
            return;
        }
        let last = DVec2::splat(self.size as f64 - 1.0);
        let (low, high) = (low.max(DVec2::ZERO), high.min(last));
        let [mut one, mut other] = std::mem::take(&mut self.polygons);
        let mut pixel = low;
        while pixel.y <= high.y {
            pixel.x = low.x;
            while pixel.x <= high.x {
                clip(&corners, DVec2::X, pixel.x, &mut one);
                clip(&one, DVec2::NEG_X, -pixel.x - 1.0, &mut other);
                clip(&other, DVec2::Y, pixel.y, &mut one);
                clip(&one, DVec2::NEG_Y, -pixel.y - 1.0, &mut other);
                self.add_point(pixel, flux * polygon_area(&other) / area);
                pixel.x += 1.0;
            }
            pixel.y += 1.0;
        }
        self.polygons = [one, other];
    }

    /// Spreads flux evenly along a circle.
    pub fn add_circle(&mut self, center: DVec2, radius: f64, flux: f64) {
        let mut angles = std::mem::take(&mut self.angles);
        angles.clear();
        angles.extend([0.0, TAU]);
        // Where it crosses the lines between columns, and those between rows.
        let lines = |middle: f64| {
            let first = (middle - radius).ceil().max(0.0) as usize;
            let last = (middle + radius).floor().min(self.size as f64);
            (first..=last.max(0.0) as usize).map(move |line| (line as f64 - middle) / radius)
        };
        for cosine in lines(center.x).filter(|it| it.abs() < 1.0) {
            let angle = cosine.acos();
            angles.extend([angle, TAU - angle]);
        }
        for sine in lines(center.y).filter(|it| it.abs() < 1.0) {
            let angle = sine.asin();
            angles.extend([angle.rem_euclid(TAU), TAU / 2.0 - angle]);
        }
        angles.sort_by(f64::total_cmp);
        for ends in angles.windows(2) {
            let middle = DVec2::from_angle(0.5 * (ends[0] + ends[1]));
            self.add_point(center + radius * middle, flux * (ends[1] - ends[0]) / TAU);
        }
        self.angles = angles;
    }

    fn add_point(&mut self, at: DVec2, flux: f64) {
        if at.min_element() >= 0.0 && at.max_element() < self.size as f64 {
            self.flux[at.y as usize * self.size + at.x as usize] += flux;
        }
    }
}

/// Area of a convex polygon.
fn polygon_area(corners: &[DVec2]) -> f64 {
    let Some((first, rest)) = corners.split_first() else {
        return 0.0;
    };
    let twice: f64 = rest
        .windows(2)
        .map(|side| (side[0] - first).perp_dot(side[1] - first))
        .sum();
    0.5 * twice.abs()
}

/// The part of a convex polygon whose points have at least `least` as their product with `axis`
/// (Sutherland and Hodgman 1974).
fn clip(corners: &[DVec2], axis: DVec2, least: f64, clipped: &mut Vec<DVec2>) {
    clipped.clear();
    for (index, &from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % corners.len()];
        let (before, after) = (from.dot(axis) - least, to.dot(axis) - least);
        if before >= 0.0 {
            clipped.push(from);
        }
        if (before >= 0.0) != (after >= 0.0) {
            clipped.push(from.lerp(to, before / (before - after)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_gives_pixels_its_parts() {
        // Twice as high as wide, over two pixels: the upper one has a quarter.
        let corners = [DVec2::ZERO, DVec2::new(1.0, 0.0), DVec2::new(0.0, 2.0)];
        for turned in [corners, [corners[0], corners[2], corners[1]]] {
            let mut sum = PixelSum::new(3);
            sum.add_triangle(turned, 8.0);
            let flux = sum.into_flux();
            for (pixel, expected) in [(0, 6.0), (3, 2.0), (1, 0.0), (6, 0.0)] {
                assert!((flux[pixel] - expected).abs() < 1e-14, "{flux:?}");
            }
        }
    }

    #[test]
    fn what_lies_outside_is_lost_and_what_is_flat_is_kept() {
        let mut sum = PixelSum::new(2);
        let corners = [
            DVec2::new(-2.0, 0.0),
            DVec2::new(2.0, 0.0),
            DVec2::new(2.0, 1.0),
        ];
        sum.add_triangle(corners, 4.0);
        // The part left of 0 is a similar triangle of half the size.
        assert!((sum.flux.iter().sum::<f64>() - 3.0).abs() < 1e-14);
        sum.add_triangle([DVec2::ONE; 3], 1.0);
        assert_eq!(sum.flux[3], 1.0);
    }

    #[test]
    fn a_circle_gives_pixels_its_arcs() {
        // Around a corner of four pixels, and one that leaves the pixel below on a third.
        let mut sum = PixelSum::new(2);
        sum.add_circle(DVec2::ONE, 0.5, 4.0);
        assert!(sum.flux.iter().all(|flux| (flux - 1.0).abs() < 1e-14));
        let mut sum = PixelSum::new(2);
        sum.add_circle(DVec2::new(0.5, 0.8), 0.4, 3.0);
        // Above y = 1 it spans 2 acos(0.2 / 0.4): a third of it.
        assert!((sum.flux[2] - 1.0).abs() < 1e-14 && (sum.flux[0] - 2.0).abs() < 1e-14);
    }

    #[test]
    fn many_points_of_a_circle_agree_with_its_arcs() {
        let (center, radius, places) = (DVec2::new(3.1, 2.7), 4.4, 1_000_000);
        let (mut exact, mut points) = (PixelSum::new(6), PixelSum::new(6));
        exact.add_circle(center, radius, 1.0);
        for place in 0..places {
            let at = DVec2::from_angle(TAU * f64::from(place) / f64::from(places));
            points.add_point(center + radius * at, 1.0 / f64::from(places));
        }
        for (exact, counted) in exact.flux.iter().zip(&points.flux) {
            assert!((exact - counted).abs() < 3e-6, "{exact} and {counted}");
        }
    }
}
