//! How receivers reflect: reciprocity, energy by quadrature, and the equations in f64.

use caustics_scene::Brdf;
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use std::f64::consts::{FRAC_1_PI, PI};

fn direction(polar_cosine: f64, azimuth: f64) -> DVec3 {
    let sine = (1.0 - polar_cosine * polar_cosine).max(0.0).sqrt();
    DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), polar_cosine)
}

/// GGX's distribution of facets' normals, by the tangent of their tilt (Walter et al. 2007, equation
/// 33).
fn distribution(alpha: f64, cosine: f64) -> f64 {
    let tangent_squared = (1.0 - cosine * cosine) / (cosine * cosine);
    let squared = alpha * alpha;
    squared / (PI * cosine.powi(4) * (squared + tangent_squared).powi(2))
}

/// Masking and shadowing correlated by height (Heitz 2014, equation 99).
fn masking(alpha: f64, light: f64, eye: f64) -> f64 {
    let lambda = |cosine: f64| {
        let tangent_squared = (1.0 - cosine * cosine) / (cosine * cosine);
        0.5 * ((1.0 + alpha * alpha * tangent_squared).sqrt() - 1.0)
    };
    1.0 / (1.0 + lambda(light) + lambda(eye))
}

/// One channel of the whole, from the equations as they are printed.
fn expected(base: f64, metallic: f64, roughness: f64, light: DVec3, eye: DVec3) -> f64 {
    let alpha = roughness * roughness;
    let half = (light + eye).normalize();
    let f0 = 0.04 * (1.0 - metallic) + base * metallic;
    let fresnel = f0 + (1.0 - f0) * (1.0 - half.dot(eye)).powi(5);
    let layer = fresnel * distribution(alpha, half.z) * masking(alpha, light.z, eye.z)
        / (4.0 * light.z * eye.z);
    let through = |cosine: f64| 1.0 - (1.0 - cosine).powi(5);
    let below = (1.0 - metallic) * base * FRAC_1_PI * 1.006 * through(light.z) * through(eye.z);
    layer + below
}

fn found(base: f64, metallic: f64, roughness: f64, light: DVec3, eye: DVec3) -> f64 {
    let brdf =
        Brdf::metallic_roughness(Vec3::splat(base as f32), metallic as f32, roughness as f32);
    f64::from(brdf.evaluate(Vec3::Z, light.as_vec3(), eye.as_vec3()).x)
}

/// The part of the light from a direction that is reflected into all directions, by two sets of
/// points, each as dense as its own part of the integrand, weighted by the balance heuristic: about
/// the mirror direction, spread as facets are, and as the cosine.
fn reflected(light: DVec3, alpha: f64, brdf: impl Fn(DVec3) -> f64) -> f64 {
    const STEPS: u32 = 200;
    let midpoint = |index: u32| (f64::from(index) + 0.5) / f64::from(STEPS);
    let lobe_density = |eye: DVec3| {
        let half = (light + eye).normalize();
        distribution(alpha, half.z) * half.z / (4.0 * half.dot(light))
    };
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        let (u, azimuth) = (midpoint(i % STEPS), 2.0 * PI * midpoint(i / STEPS));
        let cosine = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
        let half = direction(cosine, azimuth);
        let mirrored = 2.0 * half.dot(light) * half - light;
        for eye in [mirrored, direction((1.0 - u).sqrt(), azimuth)] {
            if eye.z > 0.0 {
                let density = lobe_density(eye) + eye.z * FRAC_1_PI;
                sum += brdf(eye) * eye.z / density;
            }
        }
    }
    sum / f64::from(STEPS * STEPS)
}

#[test]
fn facets_cover_the_plane_once() {
    // The integral of D (n.h) over the hemisphere is 1. Straight down and back, D is pi times as
    // bright as the layer of a white metal there: read it from the library.
    for roughness in [0.1, 0.3, 0.6, 1.0] {
        const STEPS: u32 = 20_000;
        let alpha = roughness * roughness;
        let mut sum = 0.0;
        for i in 0..STEPS {
            // Equal steps of the tilt's tangent's arc over alpha: dense where the facets are.
            let x = (f64::from(i) + 0.5) / f64::from(STEPS) * 0.5 * PI;
            let tangent = alpha * x.tan();
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            // Light and eye along the facet's normal: H is it, F is 1.
            let half = direction(cosine, 0.7);
            let layer = found(1.0, 1.0, roughness, half, half);
            let density = layer * 4.0 * cosine * cosine / masking(alpha, cosine, cosine);
            // d(cos²) = -2 cos⁴ tan dtan, dtan = alpha sec² x dx.
            let tangent_step = alpha / x.cos().powi(2) * 0.5 * PI / f64::from(STEPS);
            sum += density * 2.0 * PI * cosine.powi(4) * tangent * tangent_step;
        }
        assert!((sum - 1.0).abs() < 1e-3, "roughness {roughness}: {sum}");
    }
}

#[test]
fn no_more_is_reflected_than_arrives() {
    let mut largest = 0.0f64;
    for roughness in [0.04, 0.1, 0.2, 0.28, 0.4, 0.6, 0.8, 1.0] {
        for metallic in [0.0, 0.3, 1.0] {
            for cosine in [1.0, 0.9, 0.7, 0.5, 0.3, 0.1, 0.03] {
                let light = direction(cosine, 0.3);
                let whole = reflected(light, roughness * roughness, |eye| {
                    found(1.0, metallic, roughness, light, eye)
                });
                // Directions in f32 against the lobe's width.
                let rounding = 1e-6 / (roughness * roughness);
                assert!(
                    whole < 1.0 + 1e-4 + rounding,
                    "metallic {metallic}, roughness {roughness}, cosine {cosine}: {whole}"
                );
                largest = largest.max(whole);
            }
        }
    }
    assert!(largest > 0.99, "{largest}");
}

/// Control: the base weighed by the Fresnel term at the half vector alone, as in the sample of glTF's
/// appendix, reflects more light than arrives at grazing angles; the quadrature shows it.
#[test]
fn control_a_base_that_is_not_coupled_reflects_too_much() {
    let light = direction(0.1, 0.0);
    let whole = reflected(light, 0.01, |eye| {
        let half = (light + eye).normalize();
        let fresnel = 0.04 + 0.96 * (1.0 - half.dot(eye)).powi(5);
        expected(0.0, 0.0, 0.1, light, eye) + (1.0 - fresnel) * FRAC_1_PI
    });
    assert!(whole > 1.1, "{whole}");
}

#[test]
fn a_smooth_layer_reflects_as_fresnel_says() {
    // As facets line up, all of F goes into the mirror direction and the base gets the rest.
    for cosine in [1.0, 0.7, 0.4] {
        let light = direction(cosine, 1.0);
        let fresnel = 0.04 + 0.96 * (1.0f64 - cosine).powi(5);
        let layer = reflected(light, 0.04 * 0.04, |eye| found(0.0, 0.0, 0.04, light, eye));
        assert!(
            (layer - fresnel).abs() < 5e-3 * fresnel,
            "{cosine}: {layer}"
        );
        let base = reflected(light, 0.04 * 0.04, |eye| {
            found(0.5, 0.0, 0.04, light, eye) - found(0.0, 0.0, 0.04, light, eye)
        });
        let rest = 0.5 * (1.0 - fresnel);
        assert!((base - rest).abs() < 5e-3 * rest, "{cosine}: {base}");
    }
}

fn unit() -> impl Strategy<Value = DVec3> {
    (0.02..1.0, 0.0..2.0 * PI).prop_map(|(cosine, azimuth)| direction(cosine, azimuth))
}

proptest! {
    #[test]
    fn directions_may_be_exchanged(
        light in unit(), eye in unit(),
        base in 0.0..1.0, metallic in 0.0..1.0, roughness in 0.04..1.0,
    ) {
        let there = found(base, metallic, roughness, light, eye);
        let back = found(base, metallic, roughness, eye, light);
        prop_assert!((there - back).abs() <= 1e-5 * there, "{there} {back}");
    }

    #[test]
    fn it_is_what_the_equations_say_in_f64(
        light in unit(), eye in unit(),
        base in 0.0..1.0, metallic in 0.0..1.0, roughness in 0.1..1.0,
    ) {
        let (light, eye) = (light.as_vec3().as_dvec3(), eye.as_vec3().as_dvec3());
        let found = found(base, metallic, roughness, light, eye);
        let expected = expected(base, metallic, roughness, light, eye);
        prop_assert!((found - expected).abs() <= 1e-3 * expected, "{found} {expected}");
    }

    #[test]
    fn next_to_the_mirror_direction_a_polish_is_right_to_rounding(
        light in unit(), tilt in 0.0..3.0, azimuth in 0.0..2.0 * PI, roughness in 0.04..0.2,
    ) {
        // Facets tilted by a few widths of the lobe.
        let slope: f64 = tilt * roughness * roughness;
        let half = direction(1.0 / (1.0 + slope * slope).sqrt(), azimuth);
        let eye = 2.0 * half.dot(light) * half - light;
        prop_assume!(eye.z > 0.02);
        let (light, eye) = (light.as_vec3().as_dvec3(), eye.as_vec3().as_dvec3());
        let found = found(0.8, 1.0, roughness, light, eye);
        let expected = expected(0.8, 1.0, roughness, light, eye);
        // A direction in f32 is 6e-8 off, which the lobe's slope multiplies.
        let tolerance = 1e-3 + 1e-6 / (roughness * roughness * light.z.min(eye.z));
        prop_assert!((found - expected).abs() <= tolerance * expected, "{found} {expected}");
    }
}
