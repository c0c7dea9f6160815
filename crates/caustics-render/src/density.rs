use caustics_trace::{Coverage, Photon};
use glam::{Vec2, Vec3};

use crate::covariance::Covariance;
use crate::extent_bounds::ExtentBounds;
use crate::footprint::FootprintOptions;
use crate::gate::Gate;
use crate::truncated_kernel::TruncatedKernel;

/// The least cosine between a photon's direction and its receiver at which other points of the
/// receiver are still followed along that direction; below it they are followed along the normal.
const MIN_INCIDENCE: f32 = 0.05;

/// How far along its light a point is followed to the footprint's plane, relative to the distance
/// allowed off that plane: at grazing incidence, points that the light passes far above are not
/// the footprint's.
pub(crate) const MAX_SLIDE: f32 = 2.0;

/// The cosine that a photon's flux arrives at, kept off zero.
pub(crate) fn incident_cosine(photon: &Photon) -> f32 {
    (-photon.incoming.dot(photon.normal)).max(MIN_INCIDENCE)
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
    kernel: TruncatedKernel,
    /// Index of its receiver among the world's objects.
    pub(crate) object: u32,
    pub(crate) coverage: Coverage,
}

impl Density {
    /// The density of a photon, blurred by a pixel whose edges on the receiver are `pixel`; `None`
    /// for a footprint without area, which only a photon without a pixel can have.
    pub(crate) fn new(
        photon: &Photon,
        pixel: Option<[Vec3; 2]>,
        options: &FootprintOptions,
        kernel: TruncatedKernel,
    ) -> Option<Self> {
        let pixel = pixel.map(|edges| (edges, kernel.shape.pixel_variance()));
        Self::with_variance(photon, pixel, options, kernel)
    }

    /// The density of a photon with a multiple of the variance of a pixel's edges on the receiver
    /// added; a negative one makes it narrower.
    pub(crate) fn with_variance(
        photon: &Photon,
        pixel: Option<([Vec3; 2], f32)>,
        options: &FootprintOptions,
        kernel: TruncatedKernel,
    ) -> Option<Self> {
        let mut covariance = Covariance::of_axes(&photon.axes, photon.normal, options);
        if let Some((edges, variance)) = pixel {
            covariance.add_pixel(&edges, photon.normal, variance);
        }
        Self::spread(&Beam::of(photon), &covariance, kernel)
    }

    /// The density of a photon on what catches its light before its plane, blurred by a pixel whose
    /// edges there are `pixel`.
    pub(crate) fn before_plane(
        photon: &Photon,
        pixel: [Vec3; 2],
        options: &FootprintOptions,
        kernel: TruncatedKernel,
    ) -> Option<Self> {
        let up = towards_light(photon.incoming, photon.normal);
        let slid = pixel.map(|edge| edge - edge.dot(photon.normal) * up);
        Self::new(photon, Some(slid), options, kernel)
    }

    /// The density of a photon without a pixel, with its standard deviations kept within bounds, and
    /// what was done to that end; `None` only if the numbers overflow.
    pub(crate) fn within(
        photon: &Photon,
        bounds: &ExtentBounds,
        options: &FootprintOptions,
        kernel: TruncatedKernel,
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
        let density = Self::spread(&Beam::of(photon), &covariance, kernel)?;
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
        let variance = self.kernel.shape.pixel_variance();
        covariance.add_pixel(pixel, self.normal, variance);
        let cosine = (-self.incoming.dot(self.normal)).max(MIN_INCIDENCE);
        let beam = Beam {
            center: self.center,
            normal: self.normal,
            incoming: self.incoming,
            flux: self.strength * (xx * yy * cosine),
            object: self.object,
            coverage: self.coverage,
        };
        Self::spread(&beam, &covariance, self.kernel)
    }

    fn spread(beam: &Beam, covariance: &Covariance, kernel: TruncatedKernel) -> Option<Self> {
        let Beam {
            center,
            normal,
            incoming,
            flux,
            object,
            coverage,
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
            object,
            coverage,
        };
        (area > 0.0 && density.strength.is_finite()).then_some(density)
    }

    /// Which points it may light.
    pub(crate) fn gate(&self) -> Gate {
        // Light that grazes the plane comes from far before it: what is followed along the light
        // is limited, too.
        let cosine = -self.incoming.dot(self.normal);
        let reach = self.radius() * (MAX_SLIDE * cosine).clamp(MIN_INCIDENCE, 1.0);
        Gate::new(reach)
    }

    /// The way from its plane towards the light, one metre off the plane: how points are followed
    /// to it.
    pub(crate) fn towards_light(&self) -> Vec3 {
        towards_light(self.incoming, self.normal)
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

    /// See [`TruncatedKernel::outer_reach`].
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

    /// No point farther from the center than this, in metres, belongs to the footprint, but for the
    /// corners of a tent, which may lie farther by the root of two.
    ///
    /// It depends on the covariance only, whatever axes that is written in: so a blur by a pixel adds no more
    /// than its own radius. How far a tent's corners lie depends on those axes, which a small blur may turn.
    pub(crate) fn radius(&self) -> f32 {
        let [a, b] = self.half_extents();
        (a.length_squared() + b.length_squared()).sqrt()
    }
}

/// The way from a plane towards the light, one metre off the plane.
fn towards_light(incoming: Vec3, normal: Vec3) -> Vec3 {
    let incidence = incoming.dot(normal);
    if incidence < -MIN_INCIDENCE {
        incoming / incidence
    } else {
        normal
    }
}

/// The parts of a [`Density`] that loops over many points keep at hand.
pub(crate) struct Lighting<'a> {
    pub(crate) u_gradient: &'a Vec3,
    pub(crate) v_gradient: &'a Vec3,
    pub(crate) strength: &'a Vec3,
    pub(crate) kernel: TruncatedKernel,
}

/// What a footprint spreads, and where.
struct Beam {
    center: Vec3,
    normal: Vec3,
    incoming: Vec3,
    flux: Vec3,
    object: u32,
    coverage: Coverage,
}

impl Beam {
    fn of(photon: &Photon) -> Self {
        Self {
            center: photon.position,
            normal: photon.normal,
            incoming: photon.incoming,
            flux: photon.flux,
            object: photon.object,
            coverage: photon.coverage,
        }
    }
}

/// What was done to a footprint to keep it within bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Adjustment {
    pub(crate) widened: bool,
    pub(crate) shortened: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::footprint_kernel::FootprintKernel;
    use crate::landed::landed;
    use crate::truncated_kernel::Kernels;

    /// A gather looks that much farther for what a pixel's blur lights.
    #[test]
    fn a_blur_adds_no_more_than_its_own_radius() {
        for kernel in FootprintKernel::ALL {
            let options = FootprintOptions {
                kernel,
                ..FootprintOptions::default()
            };
            let kernel = Kernels::of(&options).get(caustics_trace::Coverage::Cell);
            // Streaks at all angles to the axes that a covariance is written in.
            for step in 0..1000 {
                let (sine, cosine) = (step as f32 * 0.1).sin_cos();
                let axis = Vec3::new(cosine, 0.0, sine);
                let axes = [3.3 * axis, 0.002 * Vec3::new(-sine, 0.0, cosine)];
                let density = Density::new(&landed(Vec3::ZERO, axes), None, &options, kernel);
                let density = density.expect("it has an area");
                let pixel = [0.05 * Vec3::X, 0.05 * Vec3::Z];
                let blurred = density.blurred(&pixel).expect("it has an area");
                let blur = kernel.reach() * (2.0 * kernel.shape.pixel_variance()).sqrt() * 0.05;
                let most = 1.0001 * (density.radius() + blur);
                assert!(blurred.radius() <= most, "{:?}, {step}", kernel.shape);
            }
        }
    }

    /// Light falls nowhere beyond the radius, or a tent's corners, and close to it, for footprints that
    /// lie askew.
    #[test]
    fn the_radius_is_how_far_light_reaches() {
        for kernel in FootprintKernel::ALL {
            let options = FootprintOptions {
                kernel,
                ..FootprintOptions::default()
            };
            let photon = landed(
                Vec3::ZERO,
                [Vec3::new(1.0, 0.0, 0.8), Vec3::new(0.1, 0.0, 0.3)],
            );
            let kernel = Kernels::of(&options).get(photon.coverage);
            let density = Density::new(&photon, None, &options, kernel).expect("it has an area");
            let radius = density.radius();
            let mut farthest = 0.0f32;
            for step in 0..200_000 {
                let (sine, cosine) = (step as f32 * 2.399_963).sin_cos();
                let far = 1.5 * radius * (step as f32 / 200_000.0).sqrt();
                let point = far * Vec3::new(cosine, 0.0, sine);
                if density.irradiance(point, Vec3::Y).x > 0.0 {
                    farthest = farthest.max(far);
                }
            }
            let corners = kernel.outer_reach() / kernel.reach();
            assert!(
                farthest <= corners * radius,
                "{:?}: {farthest} of {radius}",
                kernel.shape
            );
            assert!(
                // A disc reaches 1 over the root of two of it.
                farthest > 0.7 * radius,
                "{:?}: {farthest} of {radius}",
                kernel.shape
            );
        }
    }
}
