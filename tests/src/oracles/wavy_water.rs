use caustics_geometry::shapes::heightfield_with_slope;
use caustics_scene::{Material, Scene};
use glam::{DMat2, DVec2, DVec3, Vec2};

use crate::TestError;
use crate::numerics::integrate_rectangle;
use crate::optics::{refract, transmittance};
use crate::pixel_sum::PixelSum;
use crate::stage::{add_mesh, add_receiver, add_sun};

/// One sine wave of a [`WavyWater`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Height of its crests, in metres.
    pub amplitude: f64,
    /// Its direction along x and z, times `2 pi` over its length, per metre.
    pub wave_vector: DVec2,
    /// Its phase at the origin, in radians.
    pub phase: f64,
}

/// Water with waves over a receiver at height 0, with the sun straight above.
///
/// Light that enters at (x, z) is bent at the slope of the surface there and lands at a point that
/// this gives exactly; the caustic is the inverse of the map's determinant.
#[derive(Clone, Debug, PartialEq)]
pub struct WavyWater {
    /// Refractive index.
    pub ior: f64,
    /// Half the width of the surface, in metres.
    pub half_width: f64,
    /// Mean height of the surface, in metres.
    pub depth: f64,
    /// The waves, which add up.
    pub waves: Vec<Wave>,
    /// Irradiance of the beam, in W/m².
    pub sun: f64,
}

impl WavyWater {
    /// Three waves that do not repeat within the surface, their heights in proportion to
    /// `strength`: at 1 the caustic has no folds, and the first appear at about 1.8.
    #[must_use]
    pub fn with_strength(strength: f64) -> Self {
        let wave = |amplitude: f64, x, z, phase| Wave {
            amplitude: strength * amplitude,
            wave_vector: DVec2::new(x, z),
            phase,
        };
        Self {
            ior: 1.33,
            half_width: 1.0,
            depth: 0.5,
            waves: vec![
                wave(0.016, 11.0, 3.0, 0.4),
                wave(0.012, -5.0, 13.0, 1.9),
                wave(0.006, 16.0, -9.0, 4.1),
            ],
            sun: 1.0,
        }
    }

    /// Height of the surface, in metres.
    #[must_use]
    pub fn height(&self, at: DVec2) -> f64 {
        let waves = self.waves.iter();
        self.depth
            + waves
                .map(|it| it.amplitude * (it.wave_vector.dot(at) + it.phase).sin())
                .sum::<f64>()
    }

    /// Slope of the surface along x and along z.
    #[must_use]
    pub fn slope(&self, at: DVec2) -> DVec2 {
        let waves = self.waves.iter();
        waves
            .map(|it| it.wave_vector * (it.amplitude * (it.wave_vector.dot(at) + it.phase).cos()))
            .sum()
    }

    /// Where light lands that enters at a point, and the part of it that enters.
    #[must_use]
    pub fn land(&self, at: DVec2) -> (DVec2, f64) {
        let slope = self.slope(at);
        let normal = DVec3::new(-slope.x, 1.0, -slope.y).normalize();
        // From air into water, light is never totally reflected.
        let inside = refract(DVec3::NEG_Y, normal, 1.0, self.ior).unwrap_or(DVec3::NEG_Y);
        let shift = DVec2::new(inside.x, inside.z) * (self.height(at) / -inside.y);
        (at + shift, transmittance(normal.y.acos(), 1.0, self.ior))
    }

    /// The derivative of where light lands by where it enters.
    #[must_use]
    pub fn stretch(&self, at: DVec2) -> DMat2 {
        let step = 1e-5;
        let along = |axis: DVec2| {
            (self.land(at + step * axis).0 - self.land(at - step * axis).0) / (2.0 * step)
        };
        DMat2::from_cols(along(DVec2::X), along(DVec2::Y))
    }

    /// Irradiance at a point of the receiver, in W/m², by Newton's inversion of the map: only for
    /// waves so low that it has no folds. `None` where Newton's method finds nothing.
    #[must_use]
    pub fn irradiance_at(&self, point: DVec2) -> Option<f64> {
        let mut at = point;
        for _ in 0..50 {
            let (landed, entered) = self.land(at);
            let stretch = self.stretch(at);
            let miss = landed - point;
            if miss.length() < 1e-13 {
                return Some(self.sun * entered / stretch.determinant().abs());
            }
            at -= stretch.inverse() * miss;
        }
        None
    }

    /// Flux that lands in a rectangle of the receiver, in watts, by [`irradiance_at`](Self::irradiance_at):
    /// not a number where that finds nothing.
    #[must_use]
    pub fn flux(&self, min: DVec2, max: DVec2) -> f64 {
        let at = |x, z| self.irradiance_at(DVec2::new(x, z)).unwrap_or(f64::NAN);
        integrate_rectangle(at, (min.x, max.x), (min.y, max.y), 1)
    }

    /// Flux that lands in each of `cells` by `cells` equal squares of the receiver between -`half`
    /// and `half`, in watts, row by row along z, folds and all: the surface in `samples` by
    /// `samples` squares of two triangles, the flux of each spread evenly over the triangle that
    /// its corners land at.
    ///
    /// Counted by the points at which single rays land, the flux of a square is off by those that
    /// fall on either side of its border: by a third of a percent with a thousand of them in it.
    /// Triangles are off by how much the map bends within one, which falls with the fourth power of
    /// their size in the mean square.
    #[must_use]
    pub fn binned_flux(&self, half: f64, cells: usize, samples: u32) -> Vec<f64> {
        let spacing = 2.0 * self.half_width / f64::from(samples);
        let share = 0.5 * self.sun * spacing * spacing;
        let place = |index: u32| f64::from(index) * spacing - self.half_width;
        let land = |column: u32, row: u32| {
            let (landed, entered) = self.land(DVec2::new(place(column), place(row)));
            ((landed + half) * (cells as f64 / (2.0 * half)), entered)
        };
        let line = |row: u32| (0..=samples).map(|column| land(column, row)).collect();
        let mut sum = PixelSum::new(cells);
        let mut before: Vec<(DVec2, f64)> = line(0);
        for row in 1..=samples {
            let after: Vec<(DVec2, f64)> = line(row);
            for (low, high) in before.windows(2).zip(after.windows(2)) {
                for corners in [[low[0], low[1], high[1]], [low[0], high[1], high[0]]] {
                    let entered = corners.map(|(_, entered)| entered).iter().sum::<f64>() / 3.0;
                    sum.add_triangle(corners.map(|(landed, _)| landed), share * entered);
                }
            }
            before = after;
        }
        sum.into_flux()
    }

    /// The arrangement, for the tracer, with the surface cut into `cells` squares each way.
    ///
    /// Vertices and their normals are exact. Between them the facets are off in height by at most
    /// `a k² d² / 8` and the interpolated normals by `a k³ d² / 8`, for a wave of amplitude `a` and
    /// number `k` on squares of width `d`: on 512 squares, 1e-6 m and 2e-5, which moves light by
    /// 3e-6 m on the receiver.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, cells: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        let point = |x: f32, z: f32| DVec2::new(f64::from(x), f64::from(z));
        let surface = heightfield_with_slope(
            Vec2::splat(2.0 * self.half_width as f32),
            [cells, cells],
            |x, z| self.height(point(x, z)) as f32,
            |x, z| self.slope(point(x, z)).as_vec2(),
        )?;
        let water = Material::dielectric("water", self.ior as f32);
        add_mesh(&mut scene, "water", surface, water)?;
        add_receiver(&mut scene, 2.0 * self.half_width, 0.0)?;
        add_sun(&mut scene, 0.0, self.sun)?;
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_is_the_derivative_of_the_height() {
        let water = WavyWater::with_strength(1.0);
        let (at, step) = (DVec2::new(0.3, -0.2), 1e-5);
        for (axis, slope) in [(DVec2::X, water.slope(at).x), (DVec2::Y, water.slope(at).y)] {
            let rise = water.height(at + step * axis) - water.height(at - step * axis);
            assert!((rise / (2.0 * step) - slope).abs() < 1e-9);
        }
    }

    #[test]
    fn inversion_and_binning_agree_where_nothing_folds() {
        let water = WavyWater::with_strength(1.0);
        let (half, cells) = (0.5, 16);
        let bins = water.binned_flux(half, cells, 1000);
        for (index, binned) in bins.iter().enumerate() {
            let cell = DVec2::new((index % cells) as f64, (index / cells) as f64);
            let min = cell / 16.0 - half;
            let exact = water.flux(min, min + 1.0 / 16.0);
            assert!((binned / exact - 1.0).abs() < 1e-4, "{binned} and {exact}");
        }
    }

    #[test]
    fn strong_waves_fold_and_weak_ones_do_not() {
        let least = |strength| {
            let water = WavyWater::with_strength(strength);
            let place = |index: u32| f64::from(index) / 100.0 - 1.0;
            let points = (0..40_000).map(|it| DVec2::new(place(it % 200), place(it / 200)));
            points
                .map(|at| water.stretch(at).determinant())
                .fold(f64::INFINITY, f64::min)
        };
        let (weak, strong) = (least(1.0), least(3.0));
        assert!(weak > 0.2 && strong < -0.2, "{weak} and {strong}");
    }
}
