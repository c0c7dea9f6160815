use glam::Vec3;

/// The direction of the mirror reflection of a unit `direction` off a surface with unit `normal`.
///
/// The side on which `normal` lies does not matter. The length is kept up to rounding.
#[must_use]
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// The direction of a unit `direction` after refraction, or `None` on total reflection.
///
/// `normal` is the unit normal on the side from which the light comes (`direction · normal < 0`);
/// `eta`, above 0, is the ratio of the refractive index that the light leaves to the one that it
/// enters. The result has unit length.
/// Snell's law: `t = eta d + (eta c - sqrt(1 - eta² (1 - c²))) n` with `c = -d · n`. Total
/// reflection happens only on the way out of the denser medium (`eta > 1`).
#[must_use]
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cosine = -direction.dot(normal);
    let squared = transmitted_cosine_squared(cosine, eta);
    (squared > 0.0)
        .then(|| (eta * direction + (eta * cosine - squared.sqrt()) * normal).normalize_or_zero())
}

/// `1 - eta² (1 - c²)`, not above 0 on total reflection.
///
/// Written without the difference `1 - c²`, in which the cosine of grazing light is lost: media of
/// nearly equal index would reflect it totally.
fn transmitted_cosine_squared(cosine: f32, eta: f32) -> f32 {
    // The cosine of two f32 unit vectors may exceed 1 by a rounding, the transmitted one may not.
    ((1.0 - eta) * (1.0 + eta) + (eta * cosine) * (eta * cosine)).min(1.0)
}

/// The part of unpolarised light that a smooth dielectric interface reflects, in 0..=1.
///
/// `cosine` is that of the angle between the light and the normal, at least 0; `eta` is the ratio
/// of the refractive index that the light leaves to the one that it meets. The mean of Fresnel's
/// two polarised reflectances (Born and Wolf, *Principles of Optics*, section 1.5.3); 1 beyond
/// the critical angle. What is not reflected is transmitted.
#[must_use]
pub fn fresnel_dielectric(cosine: f32, eta: f32) -> f32 {
    let cosine = cosine.clamp(0.0, 1.0);
    let squared = transmitted_cosine_squared(cosine, eta);
    if squared <= 0.0 {
        return 1.0;
    }
    let transmitted = squared.sqrt();
    let perpendicular = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let parallel = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// The part of light that a metal reflects: Schlick's approximation (Schlick 1994).
///
/// `normal_reflectance` is the reflectance at normal incidence (glTF's base colour of a metal),
/// each channel in 0..=1; `cosine` is that of the angle between the light and the normal. The
/// result lies between `normal_reflectance` and 1, which it reaches at grazing incidence.
#[must_use]
pub fn fresnel_schlick(cosine: f32, normal_reflectance: Vec3) -> Vec3 {
    let grazing = 1.0 - cosine.clamp(0.0, 1.0);
    let squared = grazing * grazing;
    normal_reflectance + (Vec3::ONE - normal_reflectance) * (squared * squared * grazing)
}

/// The part of light left, in 0..=1, after `distance` metres (at least 0) in a medium with the
/// absorption coefficient `attenuation` (per metre, each channel at least 0): the law of Beer and
/// Lambert, `exp(-attenuation distance)`.
#[must_use]
pub fn beer_lambert(attenuation: Vec3, distance: f32) -> Vec3 {
    if attenuation == Vec3::ZERO {
        return Vec3::ONE;
    }
    // An infinite distance in a medium that lets a channel pass is 0 times infinity: not a number.
    (-attenuation * distance.min(f32::MAX)).exp()
}

/// The wavelengths that stand for the red, green and blue channel, in nanometres: the dominant
/// wavelengths of the sRGB primaries.
pub const CHANNEL_WAVELENGTHS: [f32; 3] = [611.4, 549.1, 464.3];

/// The refractive index at a wavelength in nanometres, as `KHR_materials_dispersion` defines it
/// from the index `ior` at 587.6 nm and the dispersion 20 / V (V is the Abbe number):
/// `max(n + (n - 1) dispersion / 20 (523655 / wavelength² - 1.5168), 1)`.
#[must_use]
pub fn dispersed_ior(ior: f32, dispersion: f32, wavelength: f32) -> f32 {
    let spread = (ior - 1.0) * dispersion / 20.0;
    (ior + spread * (523_655.0 / (wavelength * wavelength) - 1.5168)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn fresnel_at_normal_incidence_is_the_closed_form() {
        for (eta, expected) in [
            (1.0 / 1.5, 0.04),
            (1.5, 0.04),
            (1.0 / 2.4, (1.4f32 / 3.4).powi(2)),
        ] {
            assert_relative_eq!(fresnel_dielectric(1.0, eta), expected, max_relative = 1e-5);
        }
    }

    #[test]
    fn at_brewsters_angle_only_the_perpendicular_part_is_reflected() {
        // tan θ = n2 / n1; the parallel part vanishes, the perpendicular one is
        // ((n² - 1) / (n² + 1))² for n = n2 / n1.
        let n = 1.5f32;
        let cosine = 1.0 / (1.0 + n * n).sqrt();
        let perpendicular = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert_relative_eq!(
            fresnel_dielectric(cosine, 1.0 / n),
            0.5 * perpendicular,
            max_relative = 1e-4
        );
    }

    #[test]
    fn everything_is_reflected_at_grazing_incidence_and_beyond_the_critical_angle() {
        assert_relative_eq!(fresnel_dielectric(0.0, 1.0 / 1.5), 1.0);
        let critical = (1.0f32 - 1.0 / (1.5 * 1.5)).sqrt();
        assert_eq!(fresnel_dielectric(critical * 0.999, 1.5), 1.0);
        assert!(fresnel_dielectric(critical * 1.01, 1.5) < 0.8);
        assert_eq!(refract(Vec3::new(0.9, -0.43589, 0.0), Vec3::Y, 1.5), None);
    }

    #[test]
    fn a_boundary_between_equal_media_is_not_there_however_grazing_the_light() {
        for cosine in [1.0f32, 0.5, 1e-3, 1e-5] {
            assert!(fresnel_dielectric(cosine, 1.0) < 1e-12, "{cosine}");
            let direction = Vec3::new((1.0 - cosine * cosine).sqrt(), -cosine, 0.0);
            let refracted = refract(direction, Vec3::Y, 1.0).unwrap();
            assert!(refracted.abs_diff_eq(direction, 2e-7), "{cosine}");
        }
    }

    #[test]
    fn schlick_runs_from_the_base_colour_to_white() {
        let gold = Vec3::new(1.0, 0.76, 0.33);
        assert_eq!(fresnel_schlick(1.0, gold), gold);
        assert_relative_eq!(fresnel_schlick(0.0, gold).z, 1.0);
        assert_relative_eq!(
            fresnel_schlick(0.5, gold).z,
            0.33 + 0.67 / 32.0,
            max_relative = 1e-6
        );
    }

    #[test]
    fn beer_lambert_halves_at_the_half_length() {
        let attenuation = Vec3::new(std::f32::consts::LN_2, 0.0, 2.0 * std::f32::consts::LN_2);
        let left = beer_lambert(attenuation, 1.0);
        assert_relative_eq!(left.x, 0.5, max_relative = 1e-6);
        assert_eq!(left.y, 1.0);
        assert_relative_eq!(left.z, 0.25, max_relative = 1e-6);
        assert_eq!(
            beer_lambert(attenuation, f32::INFINITY),
            Vec3::new(0.0, 1.0, 0.0)
        );
    }

    #[test]
    fn dispersion_keeps_the_index_at_the_sodium_line_and_bends_blue_more() {
        assert_relative_eq!(dispersed_ior(1.5, 1.0, 587.6), 1.5, max_relative = 1e-4);
        let [red, green, blue] = CHANNEL_WAVELENGTHS.map(|l| dispersed_ior(1.5, 1.0, l));
        assert!(red < green && green < blue);
        assert_eq!(dispersed_ior(1.0, 20.0, 464.3), 1.0);
    }
}
