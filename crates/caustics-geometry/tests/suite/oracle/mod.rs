//! What the tests compare with: the same questions answered in f64, by other formulas, from the
//! exact f32 input.

use caustics_geometry::glam::{DMat3, DVec3, Vec3};
use caustics_geometry::{Ray, Sphere, Triangle, TriangleHit};
use proptest::prelude::*;

/// Machine epsilon of f32.
pub(crate) const EPSILON: f64 = f32::EPSILON as f64;

/// A parameter and barycentric weights in f64, and how far an f32 answer may be off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactHit {
    pub(crate) t: f64,
    pub(crate) u: f64,
    pub(crate) v: f64,
    /// Bound on the error of `u` and `v`.
    pub(crate) weight_error: f64,
    /// Bound on the error of `t`.
    pub(crate) t_error: f64,
}

impl ExactHit {
    /// Solves `origin + t d = a + u ab + v ac` by Cramer's rule; none for parallel rays.
    pub(crate) fn new(ray: &Ray, triangle: &Triangle) -> Option<Self> {
        let a = triangle.a.as_dvec3();
        let (ab, ac) = (triangle.b.as_dvec3() - a, triangle.c.as_dvec3() - a);
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let matrix = DMat3::from_cols(-direction, ab, ac);
        let determinant = matrix.determinant();
        if determinant == 0.0 {
            return None;
        }
        let s = origin - a;
        let solve = |x, y, z| DMat3::from_cols(x, y, z).determinant() / determinant;
        let (t, u, v) = (
            solve(s, ab, ac),
            solve(-direction, s, ac),
            solve(-direction, ab, s),
        );
        // To first order the error of a determinant is machine epsilon times the product of its
        // columns' lengths, times a small number of operations.
        const OPERATIONS: f64 = 16.0;
        let reach = [triangle.a, triangle.b, triangle.c]
            .map(|vertex| (vertex.as_dvec3() - origin).length())
            .into_iter()
            .fold(0.0, f64::max);
        let size = ab.length().max(ac.length()).max((ab - ac).length());
        let condition = reach * size * direction.length() / determinant.abs();
        let weight_error = OPERATIONS * EPSILON * condition;
        let t_error =
            weight_error * size / direction.length() + 4.0 * EPSILON * reach / direction.length();
        Some(Self {
            t,
            u,
            v,
            weight_error,
            t_error,
        })
    }

    /// The smallest barycentric weight: negative outside.
    pub(crate) fn depth_inside(&self) -> f64 {
        self.u.min(self.v).min(1.0 - self.u - self.v)
    }

    /// Whether an f32 answer is right within the error bounds. Where rounding decides whether
    /// there is a hit at all, both answers are.
    pub(crate) fn agrees(&self, found: Option<TriangleHit>) -> bool {
        let inside = self.depth_inside() > self.weight_error && self.t > self.t_error;
        let outside = self.depth_inside() < -self.weight_error || self.t < -self.t_error;
        match found {
            None => !inside,
            Some(hit) => {
                !outside
                    && (f64::from(hit.t) - self.t).abs() <= self.t_error
                    && (f64::from(hit.u) - self.u).abs() <= self.weight_error
                    && (f64::from(hit.v) - self.v).abs() <= self.weight_error
            }
        }
    }
}

/// Both parameters at which a line meets a sphere, from the distance of the line by a cross
/// product; and how near to tangent it is, relative to the radius: negative where it misses.
pub(crate) fn sphere_roots(ray: &Ray, sphere: &Sphere) -> ([f64; 2], f64) {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let speed = direction.length();
    let unit = direction / speed;
    let to_center = sphere.center.as_dvec3() - origin;
    let along = to_center.dot(unit);
    let distance = to_center.cross(unit).length();
    let radius = f64::from(sphere.radius);
    let half_chord = ((radius - distance) * (radius + distance)).max(0.0).sqrt();
    (
        [(along - half_chord) / speed, (along + half_chord) / speed],
        1.0 - distance / radius,
    )
}

/// A small generator of random numbers (`SplitMix64`, Steele, Lea and Flood 2014) for tests of more
/// rays than a property test draws. The seed is fixed, so that a failure repeats.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform from 0 up to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two limits.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// From 10^low to 10^high, uniform in the logarithm.
    pub(crate) fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(self.between(low, high))
    }

    /// One of `count` indices.
    pub(crate) fn index(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// A point of the cube from -1 to 1.
    pub(crate) fn in_cube(&mut self) -> DVec3 {
        DVec3::new(
            self.between(-1.0, 1.0),
            self.between(-1.0, 1.0),
            self.between(-1.0, 1.0),
        )
    }

    /// A direction, uniform on the sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let angle = self.between(0.0, std::f64::consts::TAU);
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
    }
}

/// 10 to a power that is uniform between two limits.
pub(crate) fn log_uniform(low: f32, high: f32) -> impl Strategy<Value = f32> {
    (low..high).prop_map(|power| 10.0_f32.powf(power))
}

/// A point of the cube from -1 to 1.
pub(crate) fn in_cube() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0_f32..1.0).prop_map(Vec3::from)
}

/// A unit vector, away from the few points of the cube too near its center.
pub(crate) fn unit_vector() -> impl Strategy<Value = Vec3> {
    in_cube().prop_filter_map("too short", |p| (p.length() > 0.05).then(|| p.normalize()))
}

/// A displacement from the origin of up to 10^4 units, often none.
pub(crate) fn translation() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        1 => Just(Vec3::ZERO),
        3 => (in_cube(), log_uniform(-4.0, 4.0)).prop_map(|(p, size)| p * size),
    ]
}
