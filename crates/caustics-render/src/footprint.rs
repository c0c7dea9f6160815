use std::f32::consts::{PI, SQRT_2};

use caustics_trace::Photon;
use glam::{Vec2, Vec3};

use crate::error::RenderError;

/// Squared radius, in standard deviations, at which the Gaussian is cut off.
const GAUSSIAN_CUT: f32 = 9.0;

/// The least cosine between a photon's direction and its receiver at which other points of the
/// receiver are still followed along that direction; below it they are followed along the normal.
const MIN_INCIDENCE: f32 = 0.05;

/// The least cosine between the normals of a footprint and of a point that it may light.
pub(crate) const MIN_NORMAL_COSINE: f32 = 0.5;

/// How far off its plane a footprint lights, relative to its radius.
const PLANE_DISTANCE: f32 = 0.3;

/// How far along its light a point is followed to the footprint's plane, relative to the distance
/// allowed off that plane: at grazing incidence, points that the light passes far above are not
/// the footprint's.
const MAX_SLIDE: f32 = 2.0;

/// The shape in which a footprint spreads its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FootprintKernel {
    /// A Gaussian with the footprint's axes for its standard deviations, cut off at three of them.
    #[default]
    Gaussian,
    /// Epanechnikov's parabola over the footprint's ellipse, as in adaptive anisotropic photon
    /// scattering (Yang and Ouyang 2021).
    Ellipse,
    /// Constant over a disc of the footprint's area (Larsen 2006).
    Disc,
    /// The product of two tents along the footprint's axes: on a lattice they sum to one.
    Tent,
}

impl FootprintKernel {
    /// All kernels.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::Ellipse, Self::Disc, Self::Tent];

    /// The name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Ellipse => "ellipse",
            Self::Disc => "disc",
            Self::Tent => "tent",
        }
    }

    /// Squared radius, in standard deviations, beyond which the kernel is zero.
    pub(crate) fn cut(self) -> f32 {
        match self {
            Self::Gaussian => GAUSSIAN_CUT,
            Self::Ellipse => 6.0,
            Self::Disc => 4.0,
            Self::Tent => 12.0,
        }
    }

    /// The variance that a pixel adds along each of its edges, in squared pixels.
    ///
    /// For the Gaussian it is that of the box as wide as the pixel. The others end sooner, and need
    /// more to reach a pixel's middle from wherever they stand.
    pub(crate) fn pixel_variance(self) -> f32 {
        if self == Self::Gaussian {
            1.0 / 12.0
        } else {
            0.25
        }
    }

    /// The extent of the kernel along each of its axes, for axes of one standard deviation.
    pub(crate) fn reach(self) -> f32 {
        match self {
            Self::Gaussian => GAUSSIAN_CUT.sqrt(),
            // Radii at which each kernel has the variance 1 along each axis.
            Self::Ellipse | Self::Tent => 6.0f32.sqrt(),
            Self::Disc => 2.0,
        }
    }

    /// How far a blur of one standard deviation carries light from where it would be, in any
    /// direction, along the receiver or off its plane.
    pub(crate) fn search_reach(self) -> f32 {
        self.outer_reach() + self.reach() * MAX_SLIDE
    }

    /// The farthest that light gets along any direction, in standard deviations along that
    /// direction.
    fn outer_reach(self) -> f32 {
        // The tent's corners lie beyond the ellipse.
        if self == Self::Tent {
            SQRT_2 * self.reach()
        } else {
            self.reach()
        }
    }

    /// The kernel at coordinates along its axes in standard deviations; its integral is 1.
    #[inline]
    pub(crate) fn density(self, u: f32, v: f32) -> f32 {
        let squared = u * u + v * v;
        match self {
            Self::Gaussian => gaussian(squared),
            Self::Ellipse => (1.0 - squared / 6.0).max(0.0) / (3.0 * PI),
            Self::Disc => {
                if squared < 4.0 {
                    0.25 / PI
                } else {
                    0.0
                }
            }
            Self::Tent => {
                let width = 6.0f32.sqrt();
                let tent = |x: f32| (1.0 - x.abs() / width).max(0.0);
                tent(u) * tent(v) / 6.0
            }
        }
    }
}

/// The normal density at a squared radius, cut off and divided by what is left of its integral.
///
/// The exponential is `exp(-squared / 32)` by its series, to the 16th power: right to 1e-5 of its
/// value up to the cut, without a branch or a call, so that loops over it use vector instructions.
#[inline]
fn gaussian(squared: f32) -> f32 {
    /// `1 / (2 pi (1 - exp(-GAUSSIAN_CUT / 2)))`
    const PEAK: f32 = 0.160_942_8;
    let y = squared * (1.0 / 32.0);
    let series =
        1.0 - y * (1.0 - y * (1.0 / 2.0 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
    let second = series * series;
    let fourth = second * second;
    let eighth = fourth * fourth;
    let value = PEAK * (eighth * eighth);
    if squared < GAUSSIAN_CUT { value } else { 0.0 }
}

/// How photons are spread over their footprints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootprintOptions {
    /// The shape.
    pub kernel: FootprintKernel,
    /// Standard deviation of the kernel along a footprint's axis, in sample spacings; above 0.
    pub scale: f32,
    /// The longer axis may be at most this many times the shorter one, which is widened; at
    /// least 1. Infinite keeps every footprint as its differential says.
    pub max_anisotropy: f32,
}

impl Default for FootprintOptions {
    fn default() -> Self {
        Self {
            kernel: FootprintKernel::Gaussian,
            scale: 0.55,
            max_anisotropy: f32::INFINITY,
        }
    }
}

impl FootprintOptions {
    /// Checks every number.
    ///
    /// # Errors
    /// A scale or an anisotropy out of range.
    pub fn validate(&self) -> Result<(), RenderError> {
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return Err(RenderError::InvalidScale { scale: self.scale });
        }
        if self.max_anisotropy.is_nan() || self.max_anisotropy < 1.0 {
            return Err(RenderError::InvalidAnisotropy {
                max_anisotropy: self.max_anisotropy,
            });
        }
        Ok(())
    }
}

/// A photon's footprint as a density over its receiver's tangent plane.
///
/// The covariance is that of the footprint's axes, enlarged by the pixel's own where there is one.
/// A point off the plane is followed to it along the photon's direction, so that on a curved
/// receiver, or past an edge, the light falls where it would.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Density {
    pub(crate) center: Vec3,
    /// Unit normal on the lit side.
    pub(crate) normal: Vec3,
    /// Direction of the light.
    pub(crate) incoming: Vec3,
    /// Dot products with these are coordinates in standard deviations.
    u_gradient: Vec3,
    v_gradient: Vec3,
    /// Two axes of one standard deviation in the plane.
    axes: [Vec3; 2],
    /// Flux over area and incident cosine: times the kernel and a receiver's own incident cosine,
    /// its irradiance.
    strength: Vec3,
    kernel: FootprintKernel,
}

impl Density {
    /// The density of a photon, blurred by a pixel whose edges on the receiver are `pixel`; `None`
    /// for a footprint without area, which only a photon without a pixel can have.
    pub(crate) fn new(
        photon: &Photon,
        pixel: Option<[Vec3; 2]>,
        options: &FootprintOptions,
    ) -> Option<Self> {
        let mut covariance = Covariance::of_axes(&photon.axes, photon.normal, options);
        if let Some(pixel) = pixel {
            covariance.add_pixel(&pixel, photon.normal, options.kernel);
        }
        Self::spread(&Beam::of(photon), &covariance, options.kernel)
    }

    /// The density of a photon without a pixel, with its standard deviations kept within bounds, and
    /// what was done to that end; `None` only if the numbers overflow.
    pub(crate) fn within(
        photon: &Photon,
        bounds: &ExtentBounds,
        options: &FootprintOptions,
    ) -> Option<(Self, Adjustment)> {
        let longest = bounds.most / options.scale;
        let mut shortened = false;
        let axes = photon.axes.map(|axis| {
            // Before its square overflows.
            let largest = axis.abs().max_element();
            let is_long = largest > longest;
            shortened |= is_long;
            if is_long {
                axis / largest * longest
            } else {
                axis
            }
        });
        let mut covariance = Covariance::of_axes(&axes, photon.normal, options);
        let widened = covariance.widen(bounds.least * bounds.least);
        let density = Self::spread(&Beam::of(photon), &covariance, options.kernel)?;
        Some((density, Adjustment { widened, shortened }))
    }

    /// This density blurred by a pixel whose edges on the receiver are `pixel`.
    pub(crate) fn blurred(&self, pixel: &[Vec3; 2]) -> Option<Self> {
        let (tangent, bitangent) = self.normal.any_orthonormal_pair();
        let [[xx, _], [xy, yy]] = [
            [self.axes[0].dot(tangent), 0.0],
            self.axes.map(|axis| axis.dot(bitangent)),
        ];
        let mut covariance = Covariance {
            xx: xx * xx,
            xy: xx * xy,
            yy: xy * xy + yy * yy,
        };
        covariance.add_pixel(pixel, self.normal, self.kernel);
        let cosine = (-self.incoming.dot(self.normal)).max(MIN_INCIDENCE);
        let beam = Beam {
            center: self.center,
            normal: self.normal,
            incoming: self.incoming,
            flux: self.strength * (xx * yy * cosine),
        };
        Self::spread(&beam, &covariance, self.kernel)
    }

    fn spread(beam: &Beam, covariance: &Covariance, kernel: FootprintKernel) -> Option<Self> {
        let Beam {
            center,
            normal,
            incoming,
            flux,
        } = *beam;
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let [[xx, _], [xy, yy]] = covariance.cholesky()?;
        let area = xx * yy;
        let mut u_gradient = tangent / xx;
        let mut v_gradient = (bitangent - (xy / xx) * tangent) / yy;
        let incidence = incoming.dot(normal);
        if incidence < -MIN_INCIDENCE {
            let slide = |gradient: Vec3| gradient - normal * (incoming.dot(gradient) / incidence);
            (u_gradient, v_gradient) = (slide(u_gradient), slide(v_gradient));
        }
        let cosine = (-incidence).max(MIN_INCIDENCE);
        let density = Self {
            center,
            normal,
            incoming,
            u_gradient,
            v_gradient,
            axes: [xx * tangent + xy * bitangent, yy * bitangent],
            strength: flux / (area * cosine),
            kernel,
        };
        (area > 0.0 && density.strength.is_finite()).then_some(density)
    }

    /// Which points it may light.
    pub(crate) fn gate(&self) -> Gate {
        // Light that grazes the plane comes from far before it: what is followed along the light
        // is limited, too.
        let cosine = -self.incoming.dot(self.normal);
        let reach = self.radius() * (MAX_SLIDE * cosine).clamp(MIN_INCIDENCE, 1.0);
        Gate {
            reach,
            plane_distance: PLANE_DISTANCE * reach,
            normal_cosine: MIN_NORMAL_COSINE,
        }
    }

    /// The way from its plane towards the light, one metre off the plane: how points are followed
    /// to it.
    pub(crate) fn towards_light(&self) -> Vec3 {
        let incidence = self.incoming.dot(self.normal);
        if incidence < -MIN_INCIDENCE {
            self.incoming / incidence
        } else {
            self.normal
        }
    }

    /// Where its longest axis lies: the coordinates, in standard deviations, of a point one
    /// standard deviation along it.
    pub(crate) fn long_direction(&self) -> Vec2 {
        let [a, b] = self.axes;
        let double_angle = (2.0 * a.dot(b)).atan2(a.length_squared() - b.length_squared());
        Vec2::from_angle(0.5 * double_angle)
    }

    /// The displacement for coordinates in standard deviations.
    pub(crate) fn displacement(&self, coordinates: Vec2) -> Vec3 {
        coordinates.x * self.axes[0] + coordinates.y * self.axes[1]
    }

    /// Dot products with these are a displacement's coordinates, in standard deviations.
    pub(crate) fn gradients(&self) -> [Vec3; 2] {
        [self.u_gradient, self.v_gradient]
    }

    /// Irradiance for a value of the kernel on a receiver with unit `normal`.
    #[inline]
    pub(crate) fn irradiance_at(&self, kernel: f32, normal: Vec3) -> Vec3 {
        let cosine = (-normal.dot(self.incoming)).max(0.0);
        self.strength * (kernel * cosine)
    }

    /// Coordinates of a point, in standard deviations.
    #[inline]
    pub(crate) fn coordinates(&self, point: Vec3) -> (f32, f32) {
        let relative = point - self.center;
        (relative.dot(self.u_gradient), relative.dot(self.v_gradient))
    }

    /// Irradiance at a point of a receiver with unit `normal`, by the part of the light that falls
    /// on the side of the normal.
    #[inline]
    pub(crate) fn irradiance(&self, point: Vec3, normal: Vec3) -> Vec3 {
        let (u, v) = self.coordinates(point);
        self.irradiance_at(self.kernel.density(u, v), normal)
    }

    /// What is the same for all points that are lit.
    pub(crate) fn lighting(&self) -> Lighting<'_> {
        Lighting {
            u_gradient: &self.u_gradient,
            v_gradient: &self.v_gradient,
            strength: &self.strength,
            kernel: self.kernel,
        }
    }

    /// What a displacement in the plane adds to the coordinates.
    pub(crate) fn along(&self, displacement: Vec3) -> [f32; 2] {
        [
            displacement.dot(self.u_gradient),
            displacement.dot(self.v_gradient),
        ]
    }

    /// The kernel at coordinates in standard deviations.
    pub(crate) fn kernel_at(&self, coordinates: Vec2) -> f32 {
        self.kernel.density(coordinates.x, coordinates.y)
    }

    /// Squared radius, in standard deviations, beyond which there is no light.
    pub(crate) fn cut(&self) -> f32 {
        self.kernel.cut()
    }

    /// See [`FootprintKernel::outer_reach`].
    pub(crate) fn outer_reach(&self) -> f32 {
        self.kernel.outer_reach()
    }

    /// Makes it `factor` times as bright.
    pub(crate) fn scale_by(&mut self, factor: f32) {
        self.strength *= factor;
    }

    /// Displacements from the center to the middles of the sides of a parallelogram that holds all
    /// of the footprint.
    pub(crate) fn half_extents(&self) -> [Vec3; 2] {
        self.axes.map(|axis| self.kernel.reach() * axis)
    }

    /// No point farther from the center than this, in metres, belongs to the footprint.
    pub(crate) fn radius(&self) -> f32 {
        let [a, b] = self.half_extents();
        (a.length_squared() + b.length_squared()).sqrt()
    }
}

/// Which points a footprint may light.
///
/// What stands before the footprint's plane, as a wall does that its receiver ends at, catches the
/// light on its way to the plane. What lies beyond the plane is lit only if it is the receiver
/// itself, curving away: not what is to be seen past its edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gate {
    /// How far before the footprint's plane, in metres.
    pub(crate) reach: f32,
    /// How far beyond the footprint's plane, in metres.
    pub(crate) plane_distance: f32,
    /// The least cosine between the normals beyond the plane.
    pub(crate) normal_cosine: f32,
}

impl Gate {
    /// Whether a point with a normal passes.
    pub(crate) fn admits(&self, density: &Density, point: Vec3, normal: Vec3) -> bool {
        let off = (point - density.center).dot(density.normal);
        self.admits_at(off, normal.dot(density.normal))
    }

    /// Whether a point passes that lies `off` metres before the plane, and whose normal has this
    /// cosine with the footprint's.
    #[inline]
    pub(crate) fn admits_at(&self, off: f32, normal_cosine: f32) -> bool {
        let lowest = if normal_cosine >= self.normal_cosine {
            -self.plane_distance
        } else {
            0.0
        };
        off >= lowest && off <= self.reach
    }
}

/// The parts of a [`Density`] that loops over many points keep at hand.
pub(crate) struct Lighting<'a> {
    pub(crate) u_gradient: &'a Vec3,
    pub(crate) v_gradient: &'a Vec3,
    pub(crate) strength: &'a Vec3,
    pub(crate) kernel: FootprintKernel,
}

/// What a footprint spreads, and where.
struct Beam {
    center: Vec3,
    normal: Vec3,
    incoming: Vec3,
    flux: Vec3,
}

impl Beam {
    fn of(photon: &Photon) -> Self {
        Self {
            center: photon.position,
            normal: photon.normal,
            incoming: photon.incoming,
            flux: photon.flux,
        }
    }
}

/// The standard deviations that a footprint without a pixel may have, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExtentBounds {
    pub(crate) least: f32,
    pub(crate) most: f32,
}

/// What was done to a footprint to keep it within bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Adjustment {
    pub(crate) widened: bool,
    pub(crate) shortened: bool,
}

/// A symmetric matrix of two dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Covariance {
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Covariance {
    /// The covariance of the kernel over a footprint with `axes`.
    fn of_axes(axes: &[Vec3; 2], normal: Vec3, options: &FootprintOptions) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let mut covariance = Self::default();
        let squared = options.scale * options.scale;
        for axis in axes {
            covariance.add(squared, axis.dot(tangent), axis.dot(bitangent));
        }
        covariance.limit_anisotropy(options.max_anisotropy);
        if options.kernel == FootprintKernel::Disc {
            covariance = covariance.rounded();
        }
        covariance
    }

    fn add_pixel(&mut self, pixel: &[Vec3; 2], normal: Vec3, kernel: FootprintKernel) {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        for axis in pixel {
            self.add(
                kernel.pixel_variance(),
                axis.dot(tangent),
                axis.dot(bitangent),
            );
        }
    }

    /// Adds to all directions what the shortest lacks to a variance of `least`; whether any.
    fn widen(&mut self, least: f32) -> bool {
        let (short, _) = self.eigenvalues();
        let is_short = short < least;
        if is_short {
            self.xx += least - short;
            self.yy += least - short;
        }
        is_short
    }

    fn add(&mut self, weight: f32, x: f32, y: f32) {
        self.xx += weight * x * x;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
    }

    fn eigenvalues(&self) -> (f32, f32) {
        let mean = 0.5 * (self.xx + self.yy);
        let half = 0.5 * (self.xx - self.yy);
        let spread = (half * half + self.xy * self.xy).sqrt();
        ((mean - spread).max(0.0), mean + spread)
    }

    /// Widens the short axis, all around, until the long one is at most `limit` times as long.
    fn limit_anisotropy(&mut self, limit: f32) {
        if !limit.is_finite() {
            return;
        }
        let (short, long) = self.eigenvalues();
        let least = long / (limit * limit);
        if short < least && limit > 1.0 {
            // Adding w to both eigenvalues: (long + w) / (short + w) = limit².
            let widened = (long - limit * limit * short) / (limit * limit - 1.0);
            self.xx += widened;
            self.yy += widened;
        } else if limit <= 1.0 {
            *self = Self {
                xx: long,
                xy: 0.0,
                yy: long,
            };
        }
    }

    /// A disc of the same area.
    fn rounded(&self) -> Self {
        let (short, long) = self.eigenvalues();
        let variance = (short * long).sqrt();
        Self {
            xx: variance,
            xy: 0.0,
            yy: variance,
        }
    }

    /// The lower triangular matrix whose product with its transpose this is: `[[xx, 0], [xy, yy]]`.
    fn cholesky(&self) -> Option<[[f32; 2]; 2]> {
        let xx = self.xx.sqrt();
        let xy = self.xy / xx;
        let yy = (self.yy - xy * xy).max(1e-6 * self.yy).sqrt();
        (xx > 0.0 && yy > 0.0 && xx.is_finite() && yy.is_finite()).then_some([[xx, 0.0], [xy, yy]])
    }
}
