use caustics_trace::{Coverage, Photon};
use glam::{Mat2, Vec2, Vec3};
use std::ops::Range;

use crate::covariance::Covariance;
use crate::footprint::{Density, FootprintOptions, Gate, incident_cosine};
use crate::footprint_kernel::FootprintKernel;
use crate::gbuffer::Texel;
use crate::pixel_integral::PixelGaussian;
use crate::screen::Screen;
use crate::splat_bounds::Bounds;
use crate::splat_level::margin;
use crate::surroundings::Surroundings;
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

/// The least standard deviation of a footprint, in pixels, that is read at the pixels' middles;
/// narrower ones are integrated over the pixels.
const INTEGRATED_SIGMA: f32 = 0.9;

/// As [`INTEGRATED_SIGMA`], for footprints that overlap: those that are narrower still are lines of
/// light that would leak into the pixels beside them.
const OVERLAP_INTEGRATED_SIGMA: f32 = 0.35;

/// Half a pixel's diagonal and a little, in pixels: no farther is the nearest pixel's middle.
const LEAST_REACH: f32 = 0.75;

/// Half the widest rectangle of pixels that a footprint is integrated over, beyond which the
/// perspective bends it.
const INTEGRATED_EXTENT: f32 = 48.0;

/// The farthest, in pixels, that light may slide on its way to a footprint's plane for a pixel to be in
/// the plane.
const NEGLIGIBLE_SHIFT: f32 = 1e-3;

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
    pub(crate) integral: Option<PixelIntegral>,
}

/// A footprint that is integrated over pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelIntegral {
    pub(crate) gaussian: PixelGaussian,
    /// What a pixel with all of the flux would have for irradiance, over the incident cosine.
    pub(crate) strength: Vec3,
    /// How far, in pixels, what lies a metre before the plane is seen from where its light meets the
    /// plane.
    shift: Vec2,
    /// Whether what it lights lies in its plane, as far as pixels can tell.
    pub(crate) is_flat: bool,
    /// In its plane, in square metres, without the pixel's blur.
    covariance: Covariance,
    /// Its flux over the incident cosine.
    flux: Vec3,
}

impl PixelIntegral {
    /// `None` for a footprint that can be read at the pixels' middles.
    fn of(
        photon: &Photon,
        pixel: &[Vec3; 2],
        center: Vec2,
        shift: Vec2,
        options: &FootprintOptions,
        kernel: TruncatedKernel,
    ) -> Option<Self> {
        if kernel.shape != FootprintKernel::Gaussian || !options.integrate_pixels {
            return None;
        }
        let (tangent, bitangent) = photon.normal.any_orthonormal_pair();
        let on_plane = |axis: Vec3| Vec2::new(axis.dot(tangent), axis.dot(bitangent));
        let to_pixels = Mat2::from_cols(on_plane(pixel[0]), on_plane(pixel[1])).inverse();
        let covariance = Covariance::of_axes(&photon.axes, photon.normal, options);
        let on_screen = covariance.mapped(&to_pixels);
        let (short, _) = on_screen.eigenvalues();
        let gaussian = PixelGaussian::new(center, &on_screen);
        let flux = photon.flux / incident_cosine(photon);
        let strength = flux * to_pixels.determinant().abs();
        let limit = integrated_sigma(photon.coverage, kernel);
        let is_small = short < limit * limit && gaussian.extent().max_element() < INTEGRATED_EXTENT;
        (is_small && strength.is_finite()).then_some(Self {
            gaussian,
            strength,
            shift,
            is_flat: true,
            covariance,
            flux,
        })
    }

    /// The pixels that may see what it lights of a curved receiver between two heights before its plane,
    /// in metres.
    fn bounds(&mut self, heights: [f32; 2]) -> Bounds {
        let center = self.gaussian.middle();
        let extent = self.gaussian.extent();
        let [one, other] = heights.map(|height| height * self.shift);
        self.is_flat = one.length().max(other.length()) <= NEGLIGIBLE_SHIFT;
        let (mut low, mut high) = (center - extent, center + extent);
        if !self.is_flat {
            low += one.min(other).min(Vec2::ZERO);
            high += one.max(other).max(Vec2::ZERO);
        }
        Bounds {
            low,
            high,
            is_exact: true,
        }
    }
}

/// The least standard deviation of a footprint, in pixels, that is read at the pixels' middles. It
/// reaches one of them from wherever it stands.
fn integrated_sigma(coverage: Coverage, kernel: TruncatedKernel) -> f32 {
    let reaching = LEAST_REACH / kernel.reach();
    let least = reaching * reaching - kernel.shape.pixel_variance();
    match coverage {
        Coverage::Overlap => OVERLAP_INTEGRATED_SIGMA.max(least.max(0.0).sqrt()),
        _ => INTEGRATED_SIGMA,
    }
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
            && photon.coverage == Coverage::Overlap
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
                PixelIntegral::of(photon, &pixel, center, shift, options, kernel)
            });
        }
        if let Some(integral) = &mut splat.integral {
            let is_curved = surroundings.is_curved(photon.object) || !in_reach.is_flat(half_pixel);
            let bounds = integral.bounds(if is_curved {
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

    /// What the photon adds to the irradiance of a texel whose pixel gets `weight` of its flux.
    #[inline]
    pub(crate) fn integrated(&self, integral: &PixelIntegral, texel: &Texel, weight: f32) -> Vec3 {
        if self.admits(texel) {
            let cosine = (-texel.normal.dot(self.density.incoming)).max(0.0);
            integral.strength * (cosine * weight)
        } else {
            Vec3::ZERO
        }
    }

    /// How far, in pixels, what a pixel sees is from where its light meets the footprint's plane, where
    /// the receiver curves; zero in the plane, and on what catches the light before it.
    #[inline]
    pub(crate) fn shift(&self, integral: &PixelIntegral, texel: &Texel) -> Vec2 {
        let density = &self.density;
        let normal_cosine = texel.normal.dot(density.normal);
        let curves = texel.object == density.object && normal_cosine >= self.gate.normal_cosine;
        if integral.is_flat || !curves {
            return Vec2::ZERO;
        }
        let shift = (texel.position - density.center).dot(density.normal) * integral.shift;
        if shift.length_squared() <= NEGLIGIBLE_SHIFT * NEGLIGIBLE_SHIFT {
            Vec2::ZERO
        } else {
            shift
        }
    }

    /// Whether a texel catches the light of an integrated footprint on its way to the plane.
    #[inline]
    pub(crate) fn is_caught(&self, integral: &PixelIntegral, texel: &Texel) -> bool {
        let density = &self.density;
        let normal_cosine = texel.normal.dot(density.normal);
        !integral.is_flat
            && (texel.object != density.object && normal_cosine < 0.999
                || normal_cosine < self.gate.normal_cosine)
    }

    pub(crate) fn caught(
        &self,
        integral: &PixelIntegral,
        texel: &Texel,
        pixel: [usize; 2],
        screen: &Screen,
        weights: &mut Vec<f32>,
    ) -> Vec3 {
        if !self.admits(texel) {
            return Vec3::ZERO;
        }
        let density = &self.density;
        let Some(edges) = screen.pixel_axes(texel.position, texel.normal) else {
            return Vec3::ZERO;
        };
        let Some(at) = screen.project(texel.position) else {
            return Vec3::ZERO;
        };
        let (tangent, bitangent) = density.normal.any_orthonormal_pair();
        let up = density.towards_light();
        let slid = |way: Vec3| {
            let way = way - way.dot(density.normal) * up;
            Vec2::new(way.dot(tangent), way.dot(bitangent))
        };
        let [x, y] = edges.map(slid);
        let to_pixels = Mat2::from_cols(x, y).inverse();
        let center = at + to_pixels * slid(density.center - texel.position);
        if !center.is_finite() {
            return Vec3::ZERO;
        }
        let gaussian = PixelGaussian::new(center, &integral.covariance.mapped(&to_pixels));
        let weight = gaussian.part(pixel[0], pixel[1], texel.samples, weights);
        let cosine = (-texel.normal.dot(density.incoming)).max(0.0);
        integral.flux * (to_pixels.determinant().abs() * cosine * weight / texel.coverage)
    }

    fn admits(&self, texel: &Texel) -> bool {
        self.gate.admits(
            &self.density,
            texel.position,
            texel.normal,
            Some(texel.object),
        )
    }

    /// What the photon adds to the irradiance of a texel.
    #[inline]
    pub(crate) fn irradiance(&self, texel: &Texel) -> Vec3 {
        if self.admits(texel) {
            self.density.irradiance(texel.position, texel.normal)
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
