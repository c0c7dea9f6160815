use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// Reflectance at normal incidence of what is not metal: glTF's index of refraction of 1.5.
const DIELECTRIC_F0: f32 = 0.04;

/// Smoother surfaces than this reflect as this one does: their highlights would be narrower than
/// 0.1 degrees.
pub(crate) const LEAST_ROUGHNESS: f32 = 0.04;

/// The base's share of the light that the layer above lets through, for a base that is perfectly
/// white. With `21 / 20 (1 - DIELECTRIC_F0) = 1.008` base and layer would reflect all light where
/// the layer is smooth; a slightly rough one reflects 0.14 % more at some angles.
const COUPLING: f32 = 1.006;

/// How a receiver reflects light into every direction: a Lambertian base, and on it a layer of
/// microscopic mirrors.
///
/// It is the metallic-roughness model of glTF 2.0, appendix B, with one change:
///
/// - Layer: `F D V`, with the normal distribution `D` of GGX for `alpha = roughness²` (Walter et al.
///   2007), the visibility `V = G / (4 (n.l) (n.v))` of Smith's masking and shadowing correlated by
///   height (Heitz 2014), and Schlick's `F` with `f0` between 0.04 and the base colour, by how
///   metallic it is. Light that meets a second facet is lost, as in glTF.
/// - Base: `c / pi` with `c = (1 - metallic) base_color`, times what the layer lets through on the
///   way in and on the way out, `1.006 (1 - (1 - n.l)^5) (1 - (1 - n.v)^5)`, after Ashikhmin and
///   Shirley (2000). The appendix's sample takes `1 - F` at the half vector instead, which reflects
///   more light than arrives at grazing angles.
///
/// Both directions may be exchanged, and no more is reflected than arrives.
///
/// ```
/// use caustics_scene::Brdf;
/// use glam::Vec3;
///
/// let chalk = Brdf::lambertian(Vec3::splat(0.5));
/// let polished = Brdf::metallic_roughness(Vec3::splat(0.5), 0.0, 0.2);
/// let light = Vec3::new(0.6, 0.8, 0.0);
/// let mirrored = Vec3::new(-0.6, 0.8, 0.0);
/// let aside = Vec3::new(0.0, 0.8, 0.6);
/// // Where a mirror would send the light, polish is far brighter than chalk; elsewhere about alike.
/// let ratio = |eye| (polished.evaluate(Vec3::Y, light, eye) / chalk.evaluate(Vec3::Y, light, eye)).x;
/// assert!(ratio(mirrored) > 20.0);
/// assert!((0.9..1.1).contains(&ratio(aside)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brdf {
    /// Reflectance of the base, for each channel.
    base: Vec3,
    /// The layer; `None` where there is the base alone.
    layer: Option<Layer>,
}

/// Microscopic mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    f0: Vec3,
    alpha: f32,
}

impl Brdf {
    /// The same in every direction: `albedo / pi`.
    #[must_use]
    pub fn lambertian(albedo: Vec3) -> Self {
        Self {
            base: albedo,
            layer: None,
        }
    }

    /// glTF's material of this base colour, and of a metallicity and a roughness in 0..=1.
    #[must_use]
    pub fn metallic_roughness(base_color: Vec3, metallic: f32, roughness: f32) -> Self {
        let roughness = roughness.max(LEAST_ROUGHNESS);
        Self {
            base: (1.0 - metallic) * base_color,
            layer: Some(Layer {
                f0: Vec3::splat(DIELECTRIC_F0).lerp(base_color, metallic),
                alpha: roughness * roughness,
            }),
        }
    }

    /// Whether it reflects the same in every direction.
    #[must_use]
    pub fn is_lambertian(&self) -> bool {
        self.layer.is_none()
    }

    /// Reflectance of the base, for each channel; of a Lambertian receiver, its albedo.
    #[must_use]
    pub fn base(&self) -> Vec3 {
        self.base
    }

    /// Reflectance of the layer at normal incidence, for each channel; zero without one.
    #[must_use]
    pub fn f0(&self) -> Vec3 {
        self.layer.map_or(Vec3::ZERO, |layer| layer.f0)
    }

    /// GGX's width of the layer, the squared roughness: about the tangent of the angle by which
    /// facets are tilted. `None` without a layer.
    #[must_use]
    pub fn alpha(&self) -> Option<f32> {
        self.layer.map(|layer| layer.alpha)
    }

    /// The part of the light from the unit direction `to_light` that goes into the unit direction
    /// `to_eye`, in 1/sr: radiance over irradiance, for each channel. Zero where either lies
    /// behind a surface with unit `normal`.
    #[inline]
    #[must_use]
    pub fn evaluate(&self, normal: Vec3, to_light: Vec3, to_eye: Vec3) -> Vec3 {
        let (light, eye) = (normal.dot(to_light), normal.dot(to_eye));
        if light <= 0.0 || eye <= 0.0 {
            return Vec3::ZERO;
        }
        let Some(Layer { f0, alpha }) = self.layer else {
            return FRAC_1_PI * self.base;
        };
        let base = FRAC_1_PI * COUPLING * (1.0 - fifth(1.0 - light)) * (1.0 - fifth(1.0 - eye));
        // The half vector; its length is twice the cosine between it and either direction.
        let sum = to_light + to_eye;
        let length = sum.length();
        let half = sum / length;
        let fresnel = fifth((1.0 - 0.5 * length).max(0.0));
        // By the sine: 1 - cos² would be lost in rounding where the lobe is narrow.
        let cosine = normal.dot(half);
        let sine_squared = normal.cross(half).length_squared();
        let alpha_squared = alpha * alpha;
        let spread = alpha_squared * cosine * cosine + sine_squared;
        let distribution = alpha_squared / (PI * spread * spread);
        let masked = |one: f32, other: f32| {
            other * (alpha_squared + (1.0 - alpha_squared) * one * one).sqrt()
        };
        let visibility = 0.5 / (masked(eye, light) + masked(light, eye));
        base * self.base + (distribution * visibility) * (f0 + (1.0 - f0) * fresnel)
    }
}

#[inline]
fn fifth(x: f32) -> f32 {
    let squared = x * x;
    squared * squared * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_lambertian_receiver_reflects_its_albedo_over_pi_on_its_side() {
        let brdf = Brdf::lambertian(Vec3::new(0.2, 0.4, 0.6));
        let aslant = Vec3::new(0.6, 0.8, 0.0);
        let found = brdf.evaluate(Vec3::Y, aslant, Vec3::Y);
        assert_relative_eq!(found.x, 0.2 / PI);
        assert_relative_eq!(found.z, 0.6 / PI);
        assert_eq!(brdf.evaluate(Vec3::Y, -aslant, Vec3::Y), Vec3::ZERO);
        assert_eq!(brdf.evaluate(Vec3::Y, aslant, Vec3::NEG_Y), Vec3::ZERO);
        assert!(brdf.is_lambertian() && brdf.alpha().is_none());
    }

    #[test]
    fn straight_up_and_back_there_is_no_masking() {
        // D = 1 / (pi alpha²), G = 1, F = f0.
        let gold = Vec3::new(1.0, 0.8, 0.3);
        let brdf = Brdf::metallic_roughness(gold, 1.0, 0.5);
        let found = brdf.evaluate(Vec3::Y, Vec3::Y, Vec3::Y);
        let expected = 1.0 / (PI * 0.25 * 0.25) / 4.0;
        assert_relative_eq!(found.x, expected, max_relative = 1e-5);
        assert_relative_eq!(found.z, 0.3 * expected, max_relative = 1e-5);
        // Not metal: 4 % of that, and the base.
        let plastic = Brdf::metallic_roughness(gold, 0.0, 0.5);
        let found = plastic.evaluate(Vec3::Y, Vec3::Y, Vec3::Y);
        assert_relative_eq!(
            found.y,
            0.04 * expected + 0.8 * 1.006 / PI,
            max_relative = 1e-5
        );
    }
}
