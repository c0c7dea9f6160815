use caustics_trace::{Coverage, Photon};
use glam::{Mat2, Vec2, Vec3};

use crate::covariance::Covariance;
use crate::density::{Density, incident_cosine};
use crate::footprint::FootprintOptions;
use crate::footprint_kernel::FootprintKernel;
use crate::gate::Gate;
use crate::gbuffer::Texel;
use crate::pixel_integral::PixelGaussian;
use crate::screen::Screen;
use crate::splat_bounds::Bounds;
use crate::truncated_kernel::TruncatedKernel;

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

/// Another object whose normal has at least this cosine with the footprint's lies in its plane, as one
/// of the tiles of a floor does: of what is parallel to the plane, the gate admits no other. What
/// rounding makes of such normals must not have the tiles followed one by one.
const COPLANAR_COSINE: f32 = 0.999;

/// A footprint that is integrated over pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FootprintIntegral {
    /// In its plane, in pixels.
    gaussian: PixelGaussian,
    /// What a pixel of the plane with all of the flux would have for irradiance, over the incident
    /// cosine.
    strength: Vec3,
    /// In its plane, in square metres, without the pixel's blur.
    covariance: Covariance,
    /// Its flux over the incident cosine.
    flux: Vec3,
    /// How far, in pixels, what lies a metre before the plane is seen from where its light meets the
    /// plane.
    shift: Vec2,
    /// Whether what it lights lies in its plane, as far as pixels can tell.
    is_flat: bool,
}

/// How the pixel that sees a texel lies to a footprint's distribution over pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Where it is on the screen.
    InPlane,
    /// The receiver curves there, and the pixel's square is so far, in pixels, from where its light
    /// meets the plane.
    Curved(Vec2),
    /// Another surface catches the light before it gets to the plane: the pixel's edges on it are not
    /// those in the plane.
    Caught,
}

impl FootprintIntegral {
    /// `None` for a footprint that can be read at the pixels' middles.
    pub(crate) fn of(
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
            covariance,
            flux,
            shift,
            is_flat: true,
        })
    }

    /// The pixels that may see what it lights between two heights before its plane, in metres.
    pub(crate) fn bounds(&mut self, heights: [f32; 2]) -> Bounds {
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

    /// The parts of the flux that pixels of its plane get.
    pub(crate) fn gaussian(&self) -> &PixelGaussian {
        &self.gaussian
    }

    /// Whether what it lights lies in its plane, as far as pixels can tell: every texel is.
    pub(crate) fn is_flat(&self) -> bool {
        self.is_flat
    }

    /// Whether a texel gets the part of the flux that its pixel has where it is on the screen.
    #[inline]
    pub(crate) fn is_in_plane(&self, density: &Density, gate: &Gate, texel: &Texel) -> bool {
        self.is_flat || self.place(density, gate, texel) == Place::InPlane
    }

    /// The irradiance of a texel in the plane that gets a part of the flux, as part of a whole pixel.
    #[inline]
    pub(crate) fn irradiance_in_plane(
        &self,
        density: &Density,
        gate: &Gate,
        texel: &Texel,
        part: f32,
    ) -> Vec3 {
        if admits(gate, density, texel) {
            self.strength * (cosine_on(density, texel) * part)
        } else {
            Vec3::ZERO
        }
    }

    /// The irradiance of a texel that `pixel`, its column and its row, sees wherever it lies.
    /// `weights` is memory to work in, as of [`PixelGaussian::light_pixels`].
    pub(crate) fn irradiance(
        &self,
        density: &Density,
        gate: &Gate,
        texel: &Texel,
        [column, row]: [usize; 2],
        screen: &Screen,
        weights: &mut Vec<f32>,
    ) -> Vec3 {
        if !admits(gate, density, texel) {
            return Vec3::ZERO;
        }
        let seen = match self.place(density, gate, texel) {
            Place::InPlane => Some((self.gaussian, self.strength)),
            Place::Curved(shift) => Some((self.gaussian.moved(shift), self.strength)),
            Place::Caught => self.caught(density, texel, screen),
        };
        let Some((gaussian, strength)) = seen else {
            return Vec3::ZERO;
        };
        // Most that are asked are out of its reach.
        let away = Vec2::new(column as f32, row as f32) + 0.5 - gaussian.middle();
        if away.abs().cmpgt(gaussian.extent() + 0.5).any() {
            return Vec3::ZERO;
        }
        let part = gaussian.part(column, row, texel.samples, weights) / texel.coverage;
        strength * (cosine_on(density, texel) * part)
    }

    #[inline]
    fn place(&self, density: &Density, gate: &Gate, texel: &Texel) -> Place {
        if self.is_flat {
            return Place::InPlane;
        }
        let normal_cosine = texel.normal.dot(density.normal);
        let is_own = texel.object == density.object;
        let least = if is_own {
            gate.normal_cosine
        } else {
            COPLANAR_COSINE
        };
        if normal_cosine < least {
            return Place::Caught;
        }
        let height = (texel.position - density.center).dot(density.normal);
        let shift = height * self.shift;
        if is_own && shift.length_squared() > NEGLIGIBLE_SHIFT * NEGLIGIBLE_SHIFT {
            Place::Curved(shift)
        } else {
            Place::InPlane
        }
    }

    /// The distribution in the pixels of a surface that catches the light on its way to the plane, and
    /// what a pixel there with all of the flux would have for irradiance, over the incident cosine;
    /// `None` where the light goes along the surface, or the surface is seen edge-on.
    ///
    /// Slid along the light, a pixel's square on that surface is a parallelogram in the footprint's
    /// plane, and what it holds of the footprint there is what falls on it. The inverse of the map from
    /// the pixel's edges to the parallelogram's takes the footprint to pixels.
    fn caught(
        &self,
        density: &Density,
        texel: &Texel,
        screen: &Screen,
    ) -> Option<(PixelGaussian, Vec3)> {
        let edges = screen.pixel_axes(texel.position, texel.normal)?;
        // What is farther away than a pixel that the footprint reaches is spared the rest.
        let [across, down] = edges.map(|edge| Vec2::from(density.along(edge)).length());
        let away = Vec2::from(density.coordinates(texel.position)).length();
        if away > density.outer_reach() + across + down {
            return None;
        }
        let (tangent, bitangent) = density.normal.any_orthonormal_pair();
        let up = density.towards_light();
        let slid = |way: Vec3| {
            let way = way - way.dot(density.normal) * up;
            Vec2::new(way.dot(tangent), way.dot(bitangent))
        };
        let [x, y] = edges.map(slid);
        let to_pixels = Mat2::from_cols(x, y).inverse();
        let from_texel = to_pixels * slid(density.center - texel.position);
        let center = screen.project(texel.position)? + from_texel;
        let gaussian = PixelGaussian::new(center, &self.covariance.mapped(&to_pixels));
        let strength = self.flux * to_pixels.determinant().abs();
        (center.is_finite() && strength.is_finite()).then_some((gaussian, strength))
    }
}

/// The least standard deviation of a footprint, in pixels, that is read at the pixels' middles. It
/// reaches one of them from wherever it stands.
pub(crate) fn integrated_sigma(coverage: Coverage, kernel: TruncatedKernel) -> f32 {
    let reaching = LEAST_REACH / kernel.reach();
    let least = reaching * reaching - kernel.shape.pixel_variance();
    if coverage.overlaps() {
        OVERLAP_INTEGRATED_SIGMA.max(least.max(0.0).sqrt())
    } else {
        INTEGRATED_SIGMA
    }
}

#[inline]
fn admits(gate: &Gate, density: &Density, texel: &Texel) -> bool {
    let object = Some(texel.object);
    gate.admits(density, texel.position, texel.normal, object)
}

#[inline]
fn cosine_on(density: &Density, texel: &Texel) -> f32 {
    (-texel.normal.dot(density.incoming)).max(0.0)
}
