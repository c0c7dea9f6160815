//! What several files share.

pub(crate) mod central;
pub(crate) mod chain;
pub(crate) mod scenes;
pub(crate) mod spill;

use caustics_trace::glam::{DVec3, Vec3};

/// 0.2 degrees, in radians: how far from a critical angle or a silhouette derivatives are
/// held to the tolerance.
pub(crate) const MARGIN: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// The unit direction with this cosine to +Y and this azimuth.
pub(crate) fn direction(cosine: f64, azimuth: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin())
}

/// A unit vector at `angle` from the unit vector `axis`.
pub(crate) fn tilted(axis: DVec3, angle: f64, azimuth: f64) -> DVec3 {
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    let around = azimuth.cos() * tangent + azimuth.sin() * bitangent;
    (angle.cos() * axis + angle.sin() * around).normalize()
}

/// Snell's law in f64, for a unit `normal` that faces the light; `None` on total reflection.
pub(crate) fn refract_exactly(direction: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let tangential = eta * (direction - direction.dot(normal) * normal);
    let squared = 1.0 - tangential.length_squared();
    (squared > 0.0).then(|| tangential - squared.sqrt() * normal)
}

/// The law of reflection in f64.
pub(crate) fn reflect_exactly(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// How far `found` is from `expected`, relative to the latter's length; infinite where it is not a
/// number.
pub(crate) fn relative_error(found: Vec3, expected: DVec3) -> f64 {
    let error = (found.as_dvec3() - expected).length() / expected.length();
    if error.is_nan() { f64::INFINITY } else { error }
}
