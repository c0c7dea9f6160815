use std::f64::consts::{PI, TAU};

use caustics_geometry::shapes::{ProfilePoint, heightfield_with_slope, revolution_with_normals};
use caustics_scene::{Material, Scene};
use glam::Vec2;

use super::{FlatWater, PlanoConvexLens, RadialLens};
use crate::TestError;
use crate::stage::add_mesh;

/// The height of a circle of this curvature, per metre, through the origin, where it is level; above
/// 0 the circle falls away, below it rises.
fn circle_height(curvature: f64, x: f64) -> f64 {
    let squared = x * x * curvature;
    -squared / (1.0 + (1.0 - squared * curvature).sqrt())
}

/// The slope of the same circle.
fn circle_slope(curvature: f64, x: f64) -> f64 {
    let sine = curvature * x;
    -sine / (1.0 - sine * sine).sqrt()
}

/// A [`PlanoConvexLens`] over a part of a sphere instead of a plane: light that converges, on a
/// curved receiver.
///
/// The sphere touches the lens's receiver below the lens's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensOverCap {
    /// The lens, with the sun.
    pub lens: PlanoConvexLens,
    /// Curvature of the receiver, per metre: above 0 a hill, below a bowl.
    pub curvature: f64,
    /// Distance of the receiver's rim from the axis, in metres; less than the sphere's radius.
    pub rim: f64,
}

/// Where a ray of the lens's beam lands on a [`LensOverCap`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapLanding {
    /// Distance from the axis, in metres.
    pub radius: f64,
    /// Height above the receiver's middle, in metres.
    pub height: f64,
    /// The vertical part of the receiver's unit normal.
    pub upright: f64,
    /// The part of the light that is left.
    pub transmittance: f64,
}

impl LensOverCap {
    /// Where the ray lands that meets the lens's front at this angle.
    #[must_use]
    pub fn land(&self, angle: f64) -> Option<CapLanding> {
        // Two points of the ray tell its line.
        const RISE: f64 = 0.1;
        let above = PlanoConvexLens {
            floor_distance: self.lens.floor_distance - RISE,
            ..self.lens
        };
        let landing = self.lens.land(angle)?;
        let start = landing.position;
        let lean = (above.land(angle)?.position - start) / RISE;
        // k (x² + y²) + 2 y = 0 is the circle, and x = start + lean y the ray: the root near 0.
        let k = self.curvature;
        let (a, b, c) = (
            k * (1.0 + lean * lean),
            1.0 + k * start * lean,
            k * start * start,
        );
        let root = b * b - a * c;
        let height = -c / (b + root.sqrt());
        let x = start + lean * height;
        (root >= 0.0 && x.abs() < self.rim).then_some(CapLanding {
            radius: x.abs(),
            height,
            upright: 1.0 + k * height,
            transmittance: landing.transmittance,
        })
    }

    /// The arrangement, for the tracer: the receiver is a mesh of `rings` from the middle to the rim
    /// and `segments` around, with vertices and normals on the sphere.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, rings: u32, segments: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        self.lens.add_to(&mut scene, 256, 512)?;
        let profile: Vec<ProfilePoint> = (0..=rings)
            .rev()
            .map(|ring| {
                let x = self.rim * f64::from(ring) / f64::from(rings);
                let y = circle_height(self.curvature, x) - self.lens.floor_distance;
                ProfilePoint {
                    position: Vec2::new(x as f32, y as f32),
                    normal: Vec2::new(-circle_slope(self.curvature, x) as f32, 1.0),
                }
            })
            .collect();
        let cap = revolution_with_normals(&profile, segments)?;
        add_mesh(&mut scene, "cap", cap, Material::diffuse("grey", [0.5; 3]))?;
        Ok(scene)
    }

    /// Flux of a ring of the beam between angles `step` apart around `angle`, in watts, without
    /// losses.
    #[must_use]
    pub fn ring_flux(&self, angle: f64, step: f64) -> f64 {
        let area = self.lens.curvature_radius().powi(2) * (2.0 * angle).sin() * step;
        PI * area * self.lens.irradiance()
    }
}

/// Still water in slanting sun over a rippled bottom: light that is parallel, on a receiver that curves
/// both ways.
///
/// The ripples are a sine wave along x, level with the water's own receiver in the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunOverRipples {
    /// The water, with the sun.
    pub water: FlatWater,
    /// The largest slope; so much less than the light's that no ripple shades another.
    pub slope: f64,
    /// The largest curvature, per metre, on the crests and in the troughs; above 0.
    pub curvature: f64,
    /// Half the receiver's width, in metres.
    pub half_width: f64,
}

impl SunOverRipples {
    /// Irradiance at a distance from the axis, in W/m²: what the water lets through, times the cosine
    /// between the light and the surface. The water must reach far enough.
    #[must_use]
    pub fn irradiance_at(&self, x: f64) -> f64 {
        let angle = self.water.refracted_angle();
        let beam = self.water.irradiance() / angle.cos();
        let slope = self.slope_at(x);
        beam * (angle.cos() + slope * angle.sin()) / (1.0 + slope * slope).sqrt()
    }

    /// Length of the ripples, in metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        TAU / self.wave_number()
    }

    /// The arrangement, for the tracer, with the receiver cut into so many strips.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn scene(&self, strips: u32) -> Result<Scene, TestError> {
        let mut scene = Scene::new();
        self.water.add_to(&mut scene)?;
        let ripples = heightfield_with_slope(
            Vec2::splat(2.0 * self.half_width as f32),
            [strips, 1],
            |x, _| self.height_at(f64::from(x)) as f32,
            |x, _| Vec2::new(self.slope_at(f64::from(x)) as f32, 0.0),
        )?;
        let grey = Material::diffuse("grey", [0.5; 3]);
        add_mesh(&mut scene, "ripples", ripples, grey)?;
        Ok(scene)
    }

    fn wave_number(&self) -> f64 {
        self.curvature / self.slope
    }

    fn height_at(&self, x: f64) -> f64 {
        self.slope / self.wave_number() * (self.wave_number() * x).sin()
    }

    fn slope_at(&self, x: f64) -> f64 {
        self.slope * (self.wave_number() * x).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::integrate;
    use crate::optics::refract;
    use glam::DVec3;

    const LENS: PlanoConvexLens = PlanoConvexLens {
        curvature_radius: 1.0,
        aperture: 0.5,
        ior: 1.5,
        floor_distance: 0.9,
        irradiance: 2.0,
    };

    #[test]
    fn rays_land_on_the_sphere() {
        for curvature in [-3.0, 0.0, 1.0, 3.0] {
            let cap = LensOverCap {
                lens: LENS,
                curvature,
                rim: 0.3,
            };
            for angle in [0.05, 0.3, 0.5] {
                let landing = cap.land(angle).expect("lands");
                // By vectors: through the front, through the back.
                let normal = DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
                let entry = normal - DVec3::Y * (1.0f64 - 0.25).sqrt();
                let inside = refract(DVec3::NEG_Y, normal, 1.0, LENS.ior).expect("enters");
                let back = entry - entry.y / inside.y * inside;
                let outside = refract(inside, DVec3::Y, LENS.ior, 1.0).expect("leaves");
                let fall = landing.height - LENS.floor_distance;
                let landed = back + fall / outside.y * outside;
                assert!((landed.x.abs() - landing.radius).abs() < 1e-12, "{landed}");
                let on_circle = circle_height(curvature, landing.radius);
                assert!((on_circle - landing.height).abs() < 1e-12, "{landing:?}");
                let sine = curvature * landing.radius;
                assert!((landing.upright.powi(2) + sine * sine - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_ripple_gets_the_flux_of_its_length() {
        let water = FlatWater {
            ior: 1.33,
            half_width: 2.0,
            depth: 0.5,
            attenuation: 0.0,
            angle: 0.9,
            sun: 2.0,
        };
        let ripples = SunOverRipples {
            water,
            slope: 0.6,
            curvature: 10.0,
            half_width: 0.3,
        };
        let along = |x: f64| ripples.irradiance_at(x) * ripples.slope_at(x).hypot(1.0);
        let caught = integrate(along, 0.0, ripples.length(), 16);
        let exact = water.irradiance() * ripples.length();
        assert!((caught / exact - 1.0).abs() < 1e-12, "{caught} and {exact}");
        // The derivatives are those of the height.
        let step = 1e-5;
        for x in [0.0, 0.03, 0.1] {
            let rise = |f: &dyn Fn(f64) -> f64| (f(x + step) - f(x - step)) / (2.0 * step);
            let slope = rise(&|x| ripples.height_at(x));
            assert!((slope - ripples.slope_at(x)).abs() < 1e-8);
        }
        let crest = 0.25 * ripples.length();
        let bend = (ripples.slope_at(crest + step) - ripples.slope_at(crest - step)) / (2.0 * step);
        assert!((bend + 10.0).abs() < 1e-6, "{bend}");
    }
}
