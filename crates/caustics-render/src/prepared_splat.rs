use caustics_trace::Photon;
use glam::{Vec2, Vec3};
use std::ops::Range;

use crate::density::Density;
use crate::footprint::FootprintOptions;
use crate::footprint_integral::{FootprintIntegral, integrated_sigma};
use crate::footprint_kernel::FootprintKernel;
use crate::gate::Gate;
use crate::gbuffer::Texel;
use crate::screen::Screen;
use crate::splat_bounds::Bounds;
use crate::surroundings::Surroundings;
use crate::texel_level::margin;
use crate::truncated_kernel::{Kernels, TruncatedKernel};

/// Pixels a side of a level's pixel on the level below.
pub(crate) const STRIDE: u32 = 2;

/// Levels of resolution.
pub(crate) const LEVELS: usize = 7;

/// The least standard deviation of a footprint, in pixels of a level, that may be splatted there:
/// linear interpolation between the level's pixels then errs by 3 % of the footprint's peak.
const LEVEL_SIGMA: f32 = 2.0;

/// As [`LEVEL_SIGMA`], for Gaussians that overlap and light only their receiver's plane: made narrower
/// by what interpolation adds to their variance, dozens of them sum to what they would else.
const OVERLAP_LEVEL_SIGMA: f32 = 0.8;

/// Footprints with a standard deviation below this many pixels are normalised by their own sum.
const SMALL_SIGMA: f32 = 0.9;

/// The least cosine between the view and the normal of a footprint at which its blur serves for what
/// stands before its plane, too. A plane that is seen edge-on blurs its footprints by a pixel that is
/// long on the plane, but not on what stands before it.
const LEAST_FACING: f32 = 0.3;

/// A photon made ready for one level of the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) density: Density,
    pub(crate) gate: Gate,
    pub(crate) level: u8,
    /// Whether a pixel's coordinates tell where in the footprint it sees the plane; if not, every
    /// pixel of the rows and columns is asked.
    is_linear: bool,
    /// How far off the plane, in metres, is still in it: the pixels that see it are those that see
    /// where its light meets the plane, to half a pixel.
    pub(crate) flat: f32,
    /// Whether it lights nothing but its receiver in its plane.
    pub(crate) is_plain: bool,
    /// Middle, in pixels of the level.
    center: Vec2,
    /// What a step of one pixel of the level along x and y adds to the footprint's coordinates.
    step_x: Vec2,
    step_y: Vec2,
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// Instead of all this, where it is as small as pixels.
    pub(crate) integral: Option<FootprintIntegral>,
}

#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "most are splats, and a loop over them should not chase pointers"
)]
pub(crate) enum Prepared {
    Splat(Splat),
    Outside,
    Hidden,
    TurnedAway,
    Invalid,
}

impl Prepared {
    /// The same, on no coarser level than `coarsest`.
    pub(crate) fn refined(&self, coarsest: u8, screen: &Screen) -> Self {
        match self {
            Self::Splat(splat) => Self::Splat(splat.refined(coarsest, screen)),
            other => *other,
        }
    }
}

impl Splat {
    /// What other surfaces catch, if the footprint's own splat does not tell.
    pub(crate) fn before_plane(
        photon: &Photon,
        screen: &Screen,
        surroundings: &Surroundings,
        options: &FootprintOptions,
        kernels: Kernels,
    ) -> Option<Self> {
        if screen.facing_cosine(photon.position, photon.normal) >= LEAST_FACING {
            return None;
        }
        let pixel = screen.facing_axes(photon.position);
        let kernel = kernels.get(photon.coverage);
        let density = Density::before_plane(photon, pixel, options, kernel)?;
        let [_, gate] = density.gate().divided();
        let bounds = Bounds::of(&density, [gate.before, gate.reach], screen).clipped(screen)?;
        let in_reach = surroundings.in_reach(&density, &gate, bounds.low, bounds.high)?;
        let bounds = Bounds::of(&density, in_reach.heights, screen).clipped(screen)?;
        let [step_x, step_y] = pixel.map(|edge| Vec2::from(density.along(edge)));
        let mut splat = Self {
            gate,
            density,
            level: 0,
            is_linear: false,
            flat: 0.0,
            is_plain: false,
            center: Vec2::ZERO,
            step_x,
            step_y,
            columns: [0; 2],
            rows: [0; 2],
            integral: None,
        };
        splat.choose_level(least_sigma(step_x, step_y), LEVEL_SIGMA);
        splat.place(&bounds, screen);
        Some(splat)
    }

    pub(crate) fn prepare(
        photon: &Photon,
        screen: &Screen,
        surroundings: &Surroundings,
        options: &FootprintOptions,
        kernels: Kernels,
    ) -> Prepared {
        let facing = screen.facing_cosine(photon.position, photon.normal);
        if facing <= 0.0 {
            return Prepared::TurnedAway;
        }
        let pixel = screen.pixel_axes(photon.position, photon.normal);
        let kernel = kernels.get(photon.coverage);
        let Some(density) = Density::new(photon, pixel, options, kernel) else {
            return Prepared::Invalid;
        };
        let mut gate = density.gate();
        if facing < LEAST_FACING {
            [gate, _] = gate.divided();
        }
        let reach = [-gate.plane_distance, gate.reach];
        let Some(bounds) = Bounds::of(&density, reach, screen).clipped(screen) else {
            return Prepared::Outside;
        };
        let Some(in_reach) = surroundings.in_reach(&density, &gate, bounds.low, bounds.high) else {
            return Prepared::Hidden;
        };
        let steps = pixel.map(|[x, y]| [density.along(x), density.along(y)].map(Vec2::from));
        let center = screen.project(photon.position);
        let plane = Bounds::of(&density, [0.0; 2], screen);
        let is_linear = plane.is_exact && steps.is_some() && center.is_some();
        let ([step_x, step_y], center) = (steps.unwrap_or_default(), center.unwrap_or_default());
        let sigma = if is_linear {
            least_sigma(step_x, step_y)
        } else {
            f32::INFINITY
        };
        let mut splat = Self {
            gate,
            density,
            level: 0,
            is_linear,
            flat: 0.0,
            is_plain: false,
            center,
            step_x,
            step_y,
            columns: [0; 2],
            rows: [0; 2],
            integral: None,
        };
        let shift = pixels_per_height(&splat.density, screen);
        let half_pixel = shift.map_or(0.0, |shift| 0.5 / shift.length());
        let is_coarse = splat.is_linear
            && photon.coverage.overlaps()
            && kernel.shape == FootprintKernel::Gaussian
            && in_reach.is_own
            && in_reach.is_flat(half_pixel)
            && !surroundings.is_glossy;
        if is_coarse {
            splat.choose_level(sigma, OVERLAP_LEVEL_SIGMA);
            splat.undo_interpolation(photon, pixel, options, kernel);
        } else {
            splat.choose_level(sigma, LEVEL_SIGMA);
        }
        splat.flat = splat.stride() * half_pixel;
        let is_flat = in_reach.is_flat(splat.flat);
        splat.is_plain = is_flat && in_reach.is_own;
        // Sigma has the pixel's own blur in it, and rounding.
        let limit = integrated_sigma(photon.coverage, kernel);
        let blurred = 1.01 * (limit * limit + kernel.shape.pixel_variance());
        if splat.is_linear && sigma * sigma < blurred && !surroundings.is_glossy {
            let shift = shift.unwrap_or_default();
            splat.integral = pixel.and_then(|pixel| {
                FootprintIntegral::of(photon, &pixel, center, shift, options, kernel)
            });
        }
        if let Some(integral) = &mut splat.integral {
            // A receiver that curves, or what stands before one that does not.
            let is_beside = surroundings.is_curved(photon.object) || !in_reach.is_flat(half_pixel);
            let bounds = integral.bounds(if is_beside {
                in_reach.heights
            } else {
                [0.0; 2]
            });
            splat.place(&bounds, screen);
            return Prepared::Splat(splat);
        }
        if sigma < SMALL_SIGMA {
            let factor = normalisation(&splat.density, center, step_x, step_y);
            splat.density.scale_by(factor);
        }
        let bounds = if is_flat {
            plane
        } else {
            Bounds::of(&splat.density, in_reach.heights, screen)
        };
        let Some(bounds) = bounds.clipped(screen) else {
            return Prepared::Outside;
        };
        splat.place(&bounds, screen);
        Prepared::Splat(splat)
    }

    /// Pixels of the picture along the sides of one of the level.
    fn stride(&self) -> f32 {
        STRIDE.pow(u32::from(self.level)) as f32
    }

    /// Makes the footprint narrower by as much as interpolation from its level will blur it.
    fn undo_interpolation(
        &mut self,
        photon: &Photon,
        pixel: Option<[Vec3; 2]>,
        options: &FootprintOptions,
        kernel: TruncatedKernel,
    ) {
        let (Some(pixel), 1..) = (pixel, self.level) else {
            return;
        };
        // Each step to the next finer level takes a pixel's light from the coarser one's three
        // quarters and one quarter of its side away: a variance of 3 / 16 of its square.
        let pixels = self.stride() * self.stride();
        let blur = 0.25 * (pixels - 1.0);
        let variance = kernel.shape.pixel_variance() - blur;
        let narrower = Density::with_variance(photon, Some((pixel, variance)), options, kernel);
        if let Some(density) = narrower {
            self.density = density;
            [self.step_x, self.step_y] =
                pixel.map(|edge| self.stride() * Vec2::from(density.along(edge)));
        }
    }

    fn choose_level(&mut self, mut sigma: f32, least: f32) {
        let stride = STRIDE as f32;
        while sigma >= least * stride && usize::from(self.level) + 1 < LEVELS {
            self.level += 1;
            sigma /= stride;
            self.center /= stride;
            self.step_x *= stride;
            self.step_y *= stride;
        }
    }

    fn refined(&self, coarsest: u8, screen: &Screen) -> Self {
        let mut finer = *self;
        let halvings = self.level.saturating_sub(coarsest);
        if halvings == 0 {
            return finer;
        }
        let factor = STRIDE.pow(u32::from(halvings));
        finer.level -= halvings;
        let depth = u32::from(finer.level);
        let (before, after) = (margin(u32::from(self.level)), margin(depth));
        finer.center = (self.center - before as f32) * factor as f32 + after as f32;
        finer.step_x /= factor as f32;
        finer.step_y /= factor as f32;
        finer.flat /= factor as f32;
        // What is flat to half a pixel there need not be here.
        finer.is_plain = false;
        let widen = |[first, last]: [u16; 2], size: u32| {
            let size = size.div_ceil(STRIDE.pow(depth)) as usize + 2 * after;
            // What lies in the margin there may lie in that of any level.
            let first = usize::from(first).saturating_sub(before) * factor as usize;
            let last = usize::from(last) * factor as usize + after;
            [first.min(size) as u16, last.min(size) as u16]
        };
        finer.columns = widen(self.columns, screen.width);
        finer.rows = widen(self.rows, screen.height);
        finer
    }

    /// The pixels of the level whose middles may lie in the footprint.
    fn place(&mut self, bounds: &Bounds, screen: &Screen) {
        let depth = u32::from(self.level);
        let (stride, margin) = (STRIDE.pow(depth), margin(depth) as f32);
        let range = |low: f32, high: f32, size: u32| {
            let size = size.div_ceil(stride) as f32 + 2.0 * margin;
            let first = (low / stride as f32 - 1.0).floor() + margin;
            let last = (high / stride as f32 + 1.0).ceil() + margin;
            [first, last].map(|end| end.clamp(0.0, size) as u16)
        };
        self.columns = range(bounds.low.x, bounds.high.x, screen.width);
        self.rows = range(bounds.low.y, bounds.high.y, screen.height);
        self.center += margin;
    }

    /// The pixels of a row whose middles lie in the footprint.
    pub(crate) fn span(&self, row: usize) -> Range<usize> {
        let [first, last] = self.columns.map(usize::from);
        if !self.is_linear {
            return first..last;
        }
        // |x step_x + y step_y|² = cut, for the x of the ends.
        let y = row as f32 + 0.5 - self.center.y;
        let across = y * self.step_y;
        let a = self.step_x.length_squared();
        let b = self.step_x.dot(across);
        let c = across.length_squared() - self.density.cut();
        let discriminant = b * b - a * c;
        if discriminant <= 0.0 || a <= 0.0 {
            return 0..0;
        }
        let half = discriminant.sqrt() / a;
        let middle = self.center.x - b / a - 0.5;
        // A texel's point need not be the pixel's middle: one more on either side.
        // Conversion rounds down: nothing is negative.
        let low = (middle - half).clamp(first as f32, last as f32) as usize;
        let high = (middle + half + 2.0).clamp(low as f32, last as f32) as usize;
        low..high
    }

    /// What the photon adds to the irradiance of a texel.
    #[inline]
    pub(crate) fn irradiance(&self, texel: &Texel) -> Vec3 {
        let object = Some(texel.object);
        let (density, normal) = (&self.density, texel.normal);
        if self.gate.admits(density, texel.position, normal, object) {
            density.irradiance(texel.position, normal)
        } else {
            Vec3::ZERO
        }
    }
}

/// How far, in pixels, what lies a metre before a footprint's plane is seen from where its light
/// meets the plane; `None` where that cannot be seen.
fn pixels_per_height(density: &Density, screen: &Screen) -> Option<Vec2> {
    let height = 0.1 * density.radius();
    let shifted = screen.project(density.center + height * density.towards_light());
    Some((shifted? - screen.project(density.center)?) / height)
}

/// The smallest standard deviation across the screen, in pixels.
fn least_sigma(step_x: Vec2, step_y: Vec2) -> f32 {
    // The largest singular value of the steps is one over it.
    let (xx, yy, xy) = (
        step_x.length_squared(),
        step_y.length_squared(),
        step_x.dot(step_y),
    );
    let mean = 0.5 * (xx + yy);
    let half = 0.5 * (xx - yy);
    (mean + (half * half + xy * xy).sqrt()).sqrt().recip()
}

/// By how much a small footprint must be brighter so that its values at the pixels' middles sum to
/// its flux, whether or not those pixels see its receiver.
fn normalisation(density: &Density, center: Vec2, step_x: Vec2, step_y: Vec2) -> f32 {
    let area = step_x.perp_dot(step_y).abs();
    // Extents of the ellipse along the pixel axes.
    let reach = density.cut().sqrt() / area;
    let extent = Vec2::new(step_y.length(), step_x.length()) * reach;
    if extent.max_element() > 64.0 {
        return 1.0;
    }
    let low = (center - extent - 0.5).floor();
    let high = (center + extent - 0.5).ceil();
    let mut sum = 0.0;
    let mut y = low.y;
    while y <= high.y {
        let mut x = low.x;
        while x <= high.x {
            let offset = Vec2::new(x + 0.5, y + 0.5) - center;
            let at = offset.x * step_x + offset.y * step_y;
            sum += density.kernel_at(at);
            x += 1.0;
        }
        y += 1.0;
    }
    let sum = sum * area;
    if sum > 0.05 { sum.recip() } else { 1.0 }
}
