//! What surfaces do with light.

use crate::brdf::Brdf;
use glam::Vec3;
use thiserror::Error;

/// Largest absorption coefficient that a dielectric may have, in 1/m. A millimetre of it lets
/// through exp(-1000), which is 0 in f32.
pub const MAX_ATTENUATION: f32 = 1.0e6;

/// How a surface scatters light.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Surface {
    /// Lambertian reflection: every direction alike, `albedo / pi` per steradian. Receivers of
    /// caustics.
    Diffuse {
        /// Fraction of light reflected, linear RGB, each in [0, 1].
        albedo: Vec3,
    },
    /// A Lambertian base under a layer of microscopic mirrors, or a rough metal, as in glTF's
    /// metallic-roughness model: see [`Brdf::metallic_roughness`]. Receivers of caustics, like
    /// [`Diffuse`](Self::Diffuse) ones; they throw none.
    Glossy {
        /// Colour of the base, and of the mirrors as far as they are metal; linear RGB, each in
        /// [0, 1].
        base_color: Vec3,
        /// From 0, plastic or paint, to 1, bare metal.
        metallic: f32,
        /// From 0, a polish, to 1. Below 0.04 it reflects as with 0.04.
        roughness: f32,
    },
    /// The smooth boundary of a clear body, such as glass or water. The body lies on the side that
    /// the geometric normals point away from.
    Dielectric {
        /// Index of refraction at the sodium line (587.6 nm), at least 1.
        ior: f32,
        /// Absorption coefficient of the body (Beer-Lambert), RGB, in 1/m: over a path of `d`
        /// metres the fraction `exp(-attenuation * d)` remains. From 0 to [`MAX_ATTENUATION`].
        attenuation: Vec3,
        /// Strength of dispersion, 20 / (Abbe number), as in `KHR_materials_dispersion`: 0 for
        /// none, about 0.33 for crown glass. Not negative.
        dispersion: f32,
        /// Which body a point belongs to where closed bodies overlap: the one with the highest
        /// priority (Schmidt and Budge, "Simple nested dielectrics in ray traced images", 2002).
        priority: i32,
    },
    /// A smooth mirror with Schlick's approximation to Fresnel's reflectance.
    Metal {
        /// Reflectance at normal incidence, linear RGB, each in [0, 1].
        f0: Vec3,
    },
}

impl Surface {
    /// Whether light leaves the surface in single directions (dielectric or metal), so that it can
    /// throw a caustic.
    #[must_use]
    pub const fn is_specular(&self) -> bool {
        matches!(self, Self::Dielectric { .. } | Self::Metal { .. })
    }

    /// How the surface reflects light into all directions; `None` where it is specular.
    #[must_use]
    pub fn brdf(&self) -> Option<Brdf> {
        match *self {
            Self::Diffuse { albedo } => Some(Brdf::lambertian(albedo)),
            Self::Glossy {
                base_color,
                metallic,
                roughness,
            } => Some(Brdf::metallic_roughness(base_color, metallic, roughness)),
            Self::Dielectric { .. } | Self::Metal { .. } => None,
        }
    }
}

/// A surface's scattering and its own light.
///
/// ```
/// use caustics_scene::{Material, Surface};
/// use glam::Vec3;
///
/// let brandy = Material::dielectric("brandy", 1.36)
///     .with_attenuation(Vec3::new(8.0, 30.0, 90.0))
///     .with_priority(-1);
/// brandy.validate()?;
/// assert!(brandy.surface.is_specular());
/// assert!(Material::dielectric("vacuum foam", 0.9).validate().is_err());
/// # Ok::<(), caustics_scene::MaterialError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// A name for messages; need not be unique.
    pub name: String,
    /// How light is scattered.
    pub surface: Surface,
    /// Radiance that the surface emits, RGB, in W/(sr m^2), the same in every direction. From the
    /// front, which is where geometric normals point, and from the back too where `double_sided`.
    pub emission: Vec3,
    /// Whether the back emits as the front does. Scattering is two-sided in any case.
    pub double_sided: bool,
}

impl Material {
    /// A surface that emits nothing.
    #[must_use]
    pub fn new(name: impl Into<String>, surface: Surface) -> Self {
        Self {
            name: name.into(),
            surface,
            emission: Vec3::ZERO,
            double_sided: false,
        }
    }

    /// A Lambertian surface.
    #[must_use]
    pub fn diffuse(name: impl Into<String>, albedo: impl Into<Vec3>) -> Self {
        Self::new(
            name,
            Surface::Diffuse {
                albedo: albedo.into(),
            },
        )
    }

    /// A glossy surface, as glTF's of this base colour, metallicity and roughness.
    #[must_use]
    pub fn glossy(
        name: impl Into<String>,
        base_color: impl Into<Vec3>,
        metallic: f32,
        roughness: f32,
    ) -> Self {
        let base_color = base_color.into();
        let surface = Surface::Glossy {
            base_color,
            metallic,
            roughness,
        };
        Self::new(name, surface)
    }

    /// A colourless dielectric of priority 0.
    #[must_use]
    pub fn dielectric(name: impl Into<String>, ior: f32) -> Self {
        let attenuation = Vec3::ZERO;
        Self::new(
            name,
            Surface::Dielectric {
                ior,
                attenuation,
                dispersion: 0.0,
                priority: 0,
            },
        )
    }

    /// A mirror.
    #[must_use]
    pub fn metal(name: impl Into<String>, f0: impl Into<Vec3>) -> Self {
        Self::new(name, Surface::Metal { f0: f0.into() })
    }

    /// The same material with this absorption coefficient in 1/m; no effect on other surfaces
    /// than dielectrics.
    #[must_use]
    pub fn with_attenuation(mut self, coefficient: impl Into<Vec3>) -> Self {
        if let Surface::Dielectric { attenuation, .. } = &mut self.surface {
            *attenuation = coefficient.into();
        }
        self
    }

    /// The same material with this dispersion; no effect on other surfaces than dielectrics.
    #[must_use]
    pub fn with_dispersion(mut self, strength: f32) -> Self {
        if let Surface::Dielectric { dispersion, .. } = &mut self.surface {
            *dispersion = strength;
        }
        self
    }

    /// The same material with this priority among nested bodies; no effect on other surfaces than
    /// dielectrics.
    #[must_use]
    pub fn with_priority(mut self, rank: i32) -> Self {
        if let Surface::Dielectric { priority, .. } = &mut self.surface {
            *priority = rank;
        }
        self
    }

    /// The same material, emitting this radiance in W/(sr m^2).
    #[must_use]
    pub fn with_emission(mut self, radiance: impl Into<Vec3>) -> Self {
        self.emission = radiance.into();
        self
    }

    /// The same material, emitting from both sides.
    #[must_use]
    pub fn with_both_sides(mut self) -> Self {
        self.double_sided = true;
        self
    }

    /// Whether the surface emits light.
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// Whether every number lies in its range.
    ///
    /// # Errors
    /// Names the first quantity that does not.
    pub fn validate(&self) -> Result<(), MaterialError> {
        match self.surface {
            Surface::Diffuse { albedo } => fraction("albedo", albedo)?,
            Surface::Glossy {
                base_color,
                metallic,
                roughness,
            } => {
                fraction("base colour", base_color)?;
                fraction("metallicity", Vec3::splat(metallic))?;
                fraction("roughness", Vec3::splat(roughness))?;
            }
            Surface::Metal { f0 } => fraction("reflectance", f0)?,
            Surface::Dielectric {
                ior,
                attenuation,
                dispersion,
                ..
            } => {
                if !(ior.is_finite() && ior >= 1.0) {
                    return Err(MaterialError::Ior { ior });
                }
                within("attenuation", attenuation, MAX_ATTENUATION)?;
                if !(dispersion.is_finite() && dispersion >= 0.0) {
                    return Err(MaterialError::Dispersion { dispersion });
                }
            }
        }
        within("emission", self.emission, f32::MAX)
    }
}

fn fraction(quantity: &'static str, value: Vec3) -> Result<(), MaterialError> {
    within(quantity, value, 1.0)
}

fn within(quantity: &'static str, value: Vec3, limit: f32) -> Result<(), MaterialError> {
    match value
        .to_array()
        .into_iter()
        .find(|v| !(0.0..=limit).contains(v))
    {
        Some(value) => Err(MaterialError::OutOfRange {
            quantity,
            value,
            limit,
        }),
        None => Ok(()),
    }
}

/// A material that makes no physical sense.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MaterialError {
    /// A number, or a channel of a colour, outside its range, or not a number.
    #[error("{quantity} {value} is not between 0 and {limit}")]
    OutOfRange {
        /// What it is the value of.
        quantity: &'static str,
        /// The offending number.
        value: f32,
        /// The largest value allowed.
        limit: f32,
    },
    /// An index of refraction below that of vacuum, or not a finite number.
    #[error("index of refraction {ior} is not a finite number of at least 1")]
    Ior {
        /// The value.
        ior: f32,
    },
    /// A negative dispersion, or not a finite number.
    #[error("dispersion {dispersion} is not a finite number of at least 0")]
    Dispersion {
        /// The value.
        dispersion: f32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builders_reach_only_dielectrics() {
        let water = Material::dielectric("water", 1.33)
            .with_attenuation([1.0, 2.0, 3.0])
            .with_dispersion(0.5)
            .with_priority(7);
        let expected = Surface::Dielectric {
            ior: 1.33,
            attenuation: Vec3::new(1.0, 2.0, 3.0),
            dispersion: 0.5,
            priority: 7,
        };
        assert_eq!(water.surface, expected);

        let plain = Material::diffuse("chalk", [0.8; 3]);
        let same = plain
            .clone()
            .with_attenuation([1.0; 3])
            .with_dispersion(1.0)
            .with_priority(3);
        assert_eq!(same, plain);
    }

    #[test]
    fn only_smooth_surfaces_are_specular() {
        assert!(Material::dielectric("glass", 1.5).surface.is_specular());
        assert!(
            Material::metal("brass", [0.9, 0.8, 0.4])
                .surface
                .is_specular()
        );
        let chalk = Material::diffuse("chalk", [0.8; 3]).surface;
        let steel = Material::glossy("steel", [0.6; 3], 1.0, 0.3).surface;
        assert!(!chalk.is_specular() && !steel.is_specular());
        assert!(chalk.brdf().is_some_and(|brdf| brdf.is_lambertian()));
        assert!(steel.brdf().is_some_and(|brdf| !brdf.is_lambertian()));
        assert_eq!(Material::dielectric("glass", 1.5).surface.brdf(), None);
    }

    #[test]
    fn emission_on_either_side() {
        let lamp = Material::diffuse("lamp", [0.0; 3]).with_emission([0.0, 2.0, 0.0]);
        assert!(lamp.is_emissive() && !lamp.double_sided);
        assert!(lamp.with_both_sides().double_sided);
        assert!(!Material::diffuse("chalk", [0.8; 3]).is_emissive());
    }

    #[test]
    fn values_out_of_range_are_named() {
        let bright = Material::diffuse("too bright", [0.5, 1.5, 0.5]).validate();
        assert_eq!(
            bright.unwrap_err().to_string(),
            "albedo 1.5 is not between 0 and 1"
        );
        let nan = Material::metal("undefined", [0.5, f32::NAN, 0.5]).validate();
        assert_eq!(
            nan.unwrap_err().to_string(),
            "reflectance NaN is not between 0 and 1"
        );
        let rough = Material::glossy("too rough", [0.5; 3], 0.0, 1.5).validate();
        assert_eq!(
            rough.unwrap_err().to_string(),
            "roughness 1.5 is not between 0 and 1"
        );
        assert!(
            Material::glossy("undefined", [0.5; 3], f32::NAN, 1.0)
                .validate()
                .is_err()
        );
        for ior in [0.99, 0.0, -1.5, f32::NAN, f32::INFINITY] {
            let error = Material::dielectric("glass", ior).validate().unwrap_err();
            assert!(matches!(error, MaterialError::Ior { .. }), "{ior}: {error}");
        }
        let glass = Material::dielectric("glass", 1.5);
        assert!(
            glass
                .clone()
                .with_attenuation([0.0, 0.0, f32::INFINITY])
                .validate()
                .is_err()
        );
        assert!(
            glass
                .clone()
                .with_attenuation([0.0, -1.0, 0.0])
                .validate()
                .is_err()
        );
        assert!(glass.clone().with_dispersion(-0.1).validate().is_err());
        assert!(
            glass
                .clone()
                .with_emission([f32::INFINITY; 3])
                .validate()
                .is_err()
        );
        assert!(
            glass
                .with_attenuation([MAX_ATTENUATION; 3])
                .validate()
                .is_ok()
        );
    }
}
