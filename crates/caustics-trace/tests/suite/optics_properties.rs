//! Laws that reflection, refraction, Fresnel's and Schlick's terms and absorption obey for any
//! input, against f64.

use crate::common;

use caustics_trace::glam::Vec3;
use caustics_trace::{
    CHANNEL_WAVELENGTHS, beer_lambert, dispersed_ior, fresnel_dielectric, fresnel_schlick, reflect,
    refract,
};
use common::{direction, reflect_exactly, refract_exactly, tilted};
use proptest::prelude::*;

const TAU: f64 = std::f64::consts::TAU;

/// A unit direction and a unit normal that faces it.
fn incidence() -> impl Strategy<Value = (Vec3, Vec3)> {
    (
        -1.0..1.0,
        0.0..TAU,
        0.0..std::f64::consts::FRAC_PI_2,
        0.0..TAU,
    )
        .prop_map(|(cosine, azimuth, angle, around)| {
            let onwards = direction(cosine, azimuth);
            (onwards.as_vec3(), tilted(-onwards, angle, around).as_vec3())
        })
}

/// `1 - eta² (1 - c²)` of f32 vectors, in f64.
fn transmitted_squared(onwards: Vec3, normal: Vec3, eta: f32) -> f64 {
    let (onwards, normal) = (
        onwards.as_dvec3().normalize(),
        normal.as_dvec3().normalize(),
    );
    let sine = onwards.cross(normal).length();
    1.0 - (f64::from(eta) * sine).powi(2)
}

/// What an interface transmits by Fresnel's transmission coefficients in f64, which the crate does
/// not use: the mean of `(n2 c2) / (n1 c1) t²` over both polarisations.
fn transmittance(cosine: f64, eta: f64) -> f64 {
    let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if squared <= 0.0 {
        return 0.0;
    }
    let transmitted = squared.sqrt();
    // With n2 = 1 and n1 = eta.
    let perpendicular = 2.0 * eta * cosine / (eta * cosine + transmitted);
    let parallel = 2.0 * eta * cosine / (cosine + eta * transmitted);
    0.5 * transmitted / (eta * cosine) * (perpendicular.powi(2) + parallel.powi(2))
}

/// Of how far a rounding of its arguments moves the transmittance: what f32 cannot know.
fn transmittance_spread(cosine: f64, eta: f64) -> f64 {
    let rounding = f64::from(f32::EPSILON);
    let center = transmittance(cosine, eta);
    let mut spread = 0.0f64;
    for (by_cosine, by_eta) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let moved = transmittance(
            (cosine + by_cosine * rounding).clamp(1e-12, 1.0),
            eta * (1.0 + by_eta * rounding),
        );
        spread = spread.max((moved - center).abs());
    }
    2.0 * spread + 4.0 * rounding
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        max_global_rejects: 100_000,
        ..ProptestConfig::with_cases(20_000)
    })]

    #[test]
    fn reflection_obeys_its_law_and_undoes_itself((onwards, normal) in incidence()) {
        let reflected = reflect(onwards, normal);
        let exact = reflect_exactly(onwards.as_dvec3(), normal.as_dvec3());
        prop_assert!((reflected.as_dvec3() - exact).length() < 5e-7);
        prop_assert!((reflected.dot(normal) + onwards.dot(normal)).abs() < 5e-7);
        prop_assert!((reflected.length() - 1.0).abs() < 5e-7);
        // The same plane, and the same direction off the other side of the surface.
        prop_assert!(reflected.cross(onwards).dot(normal).abs() < 5e-7);
        prop_assert_eq!(reflect(onwards, -normal), reflected);
        prop_assert!((reflect(reflected, normal) - onwards).length() < 1e-6);
    }

    #[test]
    fn refraction_obeys_snells_law((onwards, normal) in incidence(), eta in 0.3f32..3.0) {
        let squared = transmitted_squared(onwards, normal, eta);
        let Some(refracted) = refract(onwards, normal, eta) else {
            // Exactly beyond the critical angle, up to the rounding of the two unit vectors.
            prop_assert!(squared < 1e-6 * f64::from(eta * eta).max(1.0), "{squared:e}");
            prop_assert!(eta > 1.0 || squared < 1e-6);
            prop_assert_eq!(fresnel_dielectric(-onwards.dot(normal), eta), 1.0);
            return Ok(());
        };
        prop_assert!(squared > -1e-6 * f64::from(eta * eta).max(1.0), "{squared:e}");
        prop_assert!((refracted.length() - 1.0).abs() < 5e-7);
        // n1 sin i = n2 sin t, and both in one plane: as vectors.
        let [light, refracted_exactly, axis] =
            [onwards, refracted, normal].map(|it| it.as_dvec3().normalize());
        let law = f64::from(eta) * light.cross(axis) - refracted_exactly.cross(axis);
        // Normalisation trades a too short normal part for a longer tangential one where the
        // transmitted cosine is itself a rounding.
        prop_assert!(law.length() < 1e-6 * f64::from(eta).max(1.0), "{law}");
        prop_assert!(refracted.dot(normal) < f32::EPSILON);
        if let Some(exact) = refract_exactly(light, axis, f64::from(eta)) {
            let cosine = squared.max(1e-7).sqrt();
            let error = (refracted.as_dvec3() - exact).length();
            prop_assert!(error * cosine < 1e-6 * f64::from(eta).max(1.0), "{error:e}");
        }
    }

    #[test]
    fn refraction_in_and_out_returns_the_direction(
        (onwards, normal) in incidence(),
        eta in 0.3f32..3.0,
    ) {
        // 0.1 degrees from grazing on either side: there a direction is the root of a rounding.
        let cosine = -onwards.dot(normal);
        prop_assume!(cosine > 1.7e-3 && transmitted_squared(onwards, normal, eta) > 3e-6);
        let inside = refract(onwards, normal, eta);
        prop_assert!(inside.is_some());
        let inside = inside.unwrap();
        let tolerance = 3e-6 / cosine.min(inside.dot(-normal));
        // Out of a plate with parallel faces, and back on the same way.
        let out = refract(inside, normal, eta.recip());
        prop_assert!(out.is_some_and(|out| (out - onwards).length() < tolerance));
        let back = refract(-inside, -normal, eta.recip());
        prop_assert!(back.is_some_and(|back| (back + onwards).length() < tolerance));
    }

    #[test]
    fn what_fresnel_does_not_reflect_is_transmitted(
        cosine in prop_oneof![0.0f32..=1.0, Just(0.0), Just(1.0), (-6.0f32..0.0).prop_map(|it| 10f32.powf(it))],
        eta in 0.3f32..3.0,
    ) {
        let reflected = f64::from(fresnel_dielectric(cosine, eta));
        prop_assert!((0.0..=1.0).contains(&reflected));
        let (cosine, eta) = (f64::from(cosine).max(1e-12), f64::from(eta));
        let error = reflected + transmittance(cosine, eta) - 1.0;
        prop_assert!(error.abs() <= transmittance_spread(cosine, eta), "{error:e}");
        // The control: Fresnel's terms with one polarisation alone do not add up.
        let r = (eta * cosine - 1.0) / (eta * cosine + 1.0);
        prop_assume!(cosine > 0.1 && cosine < 0.9 && (eta - 1.0).abs() > 0.2);
        let wrong = r * r + transmittance(cosine, eta) - 1.0;
        prop_assert!(wrong.abs() > transmittance_spread(cosine, eta));
    }

    #[test]
    fn reflectance_is_the_same_on_the_way_back(cosine in 1e-3f32..=1.0, eta in 0.3f32..3.0) {
        let exact_eta = f64::from(eta);
        let squared = 1.0 - exact_eta * exact_eta * (1.0 - f64::from(cosine).powi(2));
        prop_assume!(squared > 1e-5);
        let back = squared.sqrt();
        let there = f64::from(fresnel_dielectric(cosine, eta));
        let and_back = f64::from(fresnel_dielectric(back as f32, (1.0 / exact_eta) as f32));
        let spread = transmittance_spread(f64::from(cosine), exact_eta)
            + transmittance_spread(back, exact_eta.recip());
        prop_assert!((there - and_back).abs() <= spread, "{there} and {and_back}");
    }

    #[test]
    fn metals_reflect_at_least_their_base_colour_and_at_most_everything(
        cosines in (0.0f32..=1.0, 0.0f32..=1.0),
        base in prop::array::uniform3(0.0f32..=1.0),
    ) {
        let base = Vec3::from(base);
        let (lower, upper) = (cosines.0.min(cosines.1), cosines.0.max(cosines.1));
        let (grazing, steep) = (fresnel_schlick(lower, base), fresnel_schlick(upper, base));
        prop_assert!(steep.cmpge(base).all() && grazing.cmple(Vec3::splat(1.0 + f32::EPSILON)).all());
        prop_assert!((grazing - steep).cmpge(Vec3::splat(-2.0 * f32::EPSILON)).all());
        prop_assert_eq!(fresnel_schlick(1.0, base), base);
        prop_assert!((fresnel_schlick(0.0, base) - Vec3::ONE).length() < 2e-7);
    }

    #[test]
    fn absorption_over_two_stretches_is_that_over_their_sum(
        attenuation in prop::array::uniform3(prop_oneof![Just(0.0f32), 1e-3f32..1e3]),
        other in prop::array::uniform3(0.0f32..1e2),
        distances in (0.0f32..0.05, 0.0f32..0.05),
    ) {
        let (attenuation, other) = (Vec3::from(attenuation), Vec3::from(other));
        let (first, second) = distances;
        let whole = beer_lambert(attenuation, first + second);
        // Exponents are rounded three times on both sides together: the sum, and the products. A power
        // is off by its exponent times as much, and by a unit in the last place of its own.
        let half_unit = 0.5 * f32::EPSILON;
        let off = |exponent: f32| half_unit * (3.0 * exponent + 8.0);
        let tolerance = off(attenuation.max_element() * (first + second));
        // What underflows is rounded absolutely.
        let close = |a: Vec3, b: Vec3, tolerance: f32| {
            (a - b).abs().cmple(tolerance * a.max(b) + Vec3::splat(f32::MIN_POSITIVE)).all()
        };
        let parts = beer_lambert(attenuation, first) * beer_lambert(attenuation, second);
        prop_assert!(close(whole, parts, tolerance), "{whole} and {parts}");
        prop_assert!(whole.cmpge(Vec3::ZERO).all() && whole.cmple(Vec3::ONE).all());
        prop_assert!(whole.cmple(beer_lambert(attenuation, first)).all());
        // Of two pigments in one liquid as of two liquids.
        let mixed = beer_lambert(attenuation + other, first);
        let tolerance = off((attenuation.max_element() + other.max_element()) * first);
        let stacked = beer_lambert(attenuation, first) * beer_lambert(other, first);
        prop_assert!(close(mixed, stacked, tolerance), "{mixed} and {stacked}");
        prop_assert_eq!(beer_lambert(attenuation, 0.0), Vec3::ONE);
    }

    #[test]
    fn dispersion_bends_short_waves_more(
        ior in 1.0f32..3.0,
        dispersion in 0.0f32..2.0,
        wavelengths in (380.0f32..780.0, 380.0f32..780.0),
    ) {
        let (short, long) =
            (wavelengths.0.min(wavelengths.1), wavelengths.0.max(wavelengths.1));
        let bent = dispersed_ior(ior, dispersion, short);
        prop_assert!(bent >= dispersed_ior(ior, dispersion, long) && bent >= 1.0);
        prop_assert_eq!(dispersed_ior(ior, 0.0, short), ior);
        // The definition of the Abbe number: (n_d - 1) / (n_F - n_C) = 20 / dispersion.
        let spread = dispersed_ior(ior, dispersion, 486.1) - dispersed_ior(ior, dispersion, 656.3);
        let expected = (ior - 1.0) * dispersion / 20.0;
        prop_assume!(dispersed_ior(ior, dispersion, 656.3) > 1.0);
        prop_assert!((spread - expected).abs() < 1e-3 * expected + 5e-7, "{spread} {expected}");
        let [red, green, blue] = CHANNEL_WAVELENGTHS.map(|it| dispersed_ior(ior, dispersion, it));
        prop_assert!(red <= green && green <= blue);
    }
}
