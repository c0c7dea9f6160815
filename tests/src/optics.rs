//! Snell's and Fresnel's laws in f64, written independently of the tracer's.

use glam::DVec3;

/// The unit direction of a unit `direction` after refraction from refractive index `from` to `to`
/// at a surface with unit `normal` on the side from which the light comes; `None` on total
/// reflection.
///
/// By components: the tangential part of `index * direction` is the same on both sides (Snell).
#[must_use]
pub fn refract(direction: DVec3, normal: DVec3, from: f64, to: f64) -> Option<DVec3> {
    let along = direction.dot(normal);
    let tangential = (direction - along * normal) * (from / to);
    let rest = 1.0 - tangential.length_squared();
    (rest > 0.0).then(|| tangential - rest.sqrt() * normal)
}

/// The part of unpolarised light that an interface between the refractive indices `from` and `to`
/// lets through, for light that arrives at `angle` radians from the normal; 0 beyond the critical
/// angle.
///
/// Fresnel's reflectances in the form of angles, `sin²(i - t) / sin²(i + t)` and
/// `tan²(i - t) / tan²(i + t)` (Born and Wolf, *Principles of Optics*, section 1.5.2).
#[must_use]
pub fn transmittance(angle: f64, from: f64, to: f64) -> f64 {
    let sine = angle.sin() * from / to;
    if sine >= 1.0 {
        return 0.0;
    }
    let refracted = sine.asin();
    if angle < 1e-4 {
        // Both forms are 0 / 0 at normal incidence; the next term is of fourth order.
        let r = (from - to) / (from + to);
        return 1.0 - r * r;
    }
    let (difference, sum) = (angle - refracted, angle + refracted);
    let perpendicular = (difference.sin() / sum.sin()).powi(2);
    let parallel = (difference.tan() / sum.tan()).powi(2);
    1.0 - 0.5 * (perpendicular + parallel)
}

/// The part of light that a metal with the reflectance `f0` at normal incidence reflects, by
/// Schlick's approximation; `cosine` is that of the angle to the normal.
#[must_use]
pub fn schlick(cosine: f64, f0: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cosine).powi(5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn normal_incidence_on_glass_lets_96_percent_through() {
        assert!((transmittance(0.0, 1.0, 1.5) - 0.96).abs() < 1e-15);
        assert!((transmittance(2e-4, 1.0, 1.5) - 0.96).abs() < 1e-7);
    }

    #[test]
    fn at_brewsters_angle_only_half_of_the_perpendicular_part_is_lost() {
        // There r_s = (1 - n²) / (1 + n²) and r_p = 0.
        let ior = 1.5f64;
        let r = (1.0 - ior * ior) / (1.0 + ior * ior);
        assert!((transmittance(ior.atan(), 1.0, ior) - (1.0 - 0.5 * r * r)).abs() < 1e-14);
    }

    #[test]
    fn transmittance_is_the_same_both_ways_and_ends_at_the_critical_angle() {
        for angle in [0.1, 0.5, 1.0, 1.5] {
            let inside = (f64::sin(angle) / 1.5).asin();
            let (into, out) = (
                transmittance(angle, 1.0, 1.5),
                transmittance(inside, 1.5, 1.0),
            );
            assert!((into - out).abs() < 1e-12, "{into} and {out} at {angle}");
        }
        assert_eq!(transmittance(0.73, 1.5, 1.0), 0.0);
        assert!(transmittance(FRAC_PI_2 - 1e-6, 1.0, 1.5) < 1e-4);
    }

    #[test]
    fn refraction_obeys_snell() {
        let direction = DVec3::new(0.6, -0.8, 0.0);
        let refracted = refract(direction, DVec3::Y, 1.0, 1.5).expect("no total reflection");
        assert!((refracted - DVec3::new(0.4, -(1.0f64 - 0.16).sqrt(), 0.0)).length() < 1e-15);
        assert_eq!(
            refract(DVec3::new(0.8, -0.6, 0.0), DVec3::Y, 1.5, 1.0),
            None
        );
    }
}
