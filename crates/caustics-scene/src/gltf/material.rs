//! Materials from the metallic-roughness model and its extensions.

use super::document::{Document, is_supported};
use super::element::Element;
use super::error::GltfError;
use super::options::LoadOptions;
use super::warning::{WarningKind, Warnings};
use crate::material::{MAX_ATTENUATION, Material, Surface};
use ::gltf::json;
use glam::Vec3;
use json::material::AlphaMode;
use json::validation::Checked;
use serde_json::Value;

/// The index of refraction of a material that does not state one.
const DEFAULT_IOR: f32 = 1.5;

/// What a primitive without a material is made of: white, and Lambertian.
pub(crate) fn default_material() -> Material {
    Material::diffuse("default", Vec3::ONE)
}

/// The material of this number; see the module's page for what becomes of what.
pub(crate) fn convert(
    document: &Document,
    index: usize,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Material, GltfError> {
    let source = &document.materials[index];
    let element = document.material_element(index);
    report(source, &element, warnings);
    let surface = surface(source, &element, options, warnings)?;
    let extensions = source.extensions.as_ref();
    let strength = extensions
        .and_then(|extensions| extensions.emissive_strength.as_ref())
        .map_or(1.0, |extension| extension.emissive_strength.0);
    let material = Material {
        name: source.name.clone().unwrap_or_else(|| element.to_string()),
        surface,
        emission: Vec3::from(source.emissive_factor.0) * strength,
        double_sided: source.double_sided,
    };
    match material.validate() {
        Ok(()) => Ok(material),
        Err(source) => Err(GltfError::Material { element, source }),
    }
}

fn surface(
    source: &json::Material,
    element: &Element,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Surface, GltfError> {
    let in_unit = |quantity, value: f32| match value {
        value if (0.0..=1.0).contains(&value) => Ok(value),
        value => {
            let (element, expected) = (element.clone(), "between 0 and 1");
            Err(GltfError::Value {
                element,
                quantity,
                value,
                expected,
            })
        }
    };
    let pbr = &source.pbr_metallic_roughness;
    let [r, g, b, _] = pbr.base_color_factor.0;
    let base_color = Vec3::new(r, g, b);
    let metallic = in_unit("metallicFactor", pbr.metallic_factor.0)?;
    let roughness = in_unit("roughnessFactor", pbr.roughness_factor.0)?;
    let extension = source
        .extensions
        .as_ref()
        .and_then(|e| e.transmission.as_ref());
    let transmission = extension.map_or(0.0, |extension| extension.transmission_factor.0);
    let transmission = in_unit("transmissionFactor", transmission)?;

    if transmission == 1.0 && roughness == 0.0 {
        if metallic > 0.0 {
            warnings.push(element, WarningKind::MetallicDielectric { metallic });
        }
        if base_color != Vec3::ONE {
            warnings.push(element, WarningKind::TintedDielectric);
        }
        return dielectric(source, element, warnings);
    }
    if metallic == 1.0 && roughness == 0.0 {
        // Only what is not metal transmits, so that a transmission counts for nothing here.
        return Ok(Surface::Metal { f0: base_color });
    }
    if transmission == 1.0 {
        warnings.push(element, WarningKind::Roughness { roughness });
    } else if transmission > 0.0 {
        warnings.push(element, WarningKind::PartialTransmission { transmission });
    } else if options.glossy_receivers {
        return Ok(Surface::Glossy {
            base_color,
            metallic,
            roughness,
        });
    } else if metallic > 0.0 || roughness < 1.0 {
        warnings.push(
            element,
            WarningKind::Gloss {
                metallic,
                roughness,
            },
        );
    }
    // A rough metal reflects about its base colour in all, as the base of a dielectric does.
    Ok(Surface::Diffuse { albedo: base_color })
}

fn dielectric(
    source: &json::Material,
    element: &Element,
    warnings: &mut Warnings,
) -> Result<Surface, GltfError> {
    let extensions = source.extensions.as_ref();
    let mut ior = extensions
        .and_then(|e| e.ior.as_ref())
        .map_or(DEFAULT_IOR, |e| e.ior.0);
    if ior == 0.0 {
        warnings.push(element, WarningKind::ZeroIor);
        ior = DEFAULT_IOR;
    }
    let volume = extensions.and_then(|e| e.volume.as_ref());
    if volume.is_none_or(|volume| volume.thickness_factor.0 == 0.0) {
        warnings.push(element, WarningKind::ThinWalled);
    }
    let attenuation = match volume {
        Some(volume) => {
            let color = Vec3::from(volume.attenuation_color.0);
            attenuation(color, volume.attenuation_distance.0, element)?
        }
        None => Vec3::ZERO,
    };
    Ok(Surface::Dielectric {
        ior,
        attenuation,
        dispersion: dispersion(source, element)?,
        priority: priority(source, element, warnings),
    })
}

/// The absorption coefficient in 1/m with which white light becomes `color` over `distance`.
fn attenuation(color: Vec3, distance: f32, element: &Element) -> Result<Vec3, GltfError> {
    let error = |quantity, value, expected| {
        Err(GltfError::Value {
            element: element.clone(),
            quantity,
            value,
            expected,
        })
    };
    if distance.is_nan() || distance <= 0.0 {
        return error("attenuationDistance", distance, "above 0");
    }
    if let Some(value) = color
        .to_array()
        .into_iter()
        .find(|c| !(0.0..=1.0).contains(c))
    {
        return error("attenuationColor", value, "between 0 and 1");
    }
    // The logarithm of 0 is infinite, as no real body is; black stands for what f32 cannot tell
    // from it.
    let optical_depth = color
        .max(Vec3::splat(f32::MIN_POSITIVE))
        .map(|channel| -channel.ln());
    // Adding zero turns the -0 of a logarithm of 1 into +0.
    Ok((optical_depth / distance).min(Vec3::splat(MAX_ATTENUATION)) + Vec3::ZERO)
}

fn dispersion(source: &json::Material, element: &Element) -> Result<f32, GltfError> {
    let others = source
        .extensions
        .as_ref()
        .map(|extensions| &extensions.others);
    let Some(extension) = others.and_then(|others| others.get("KHR_materials_dispersion")) else {
        return Ok(0.0);
    };
    match extension.get("dispersion") {
        None => Ok(0.0),
        Some(value) => value
            .as_f64()
            .map(|number| number as f32)
            .ok_or_else(|| GltfError::Json {
                place: element.to_string(),
                message: "dispersion is not a number".to_owned(),
            }),
    }
}

/// The priority among nested bodies, which glTF has no word for, from the material's extras.
fn priority(source: &json::Material, element: &Element, warnings: &mut Warnings) -> i32 {
    let extras = source.extras.as_ref();
    let extras: Option<Value> = extras.and_then(|raw| serde_json::from_str(raw.get()).ok());
    let Some(value) = extras.as_ref().and_then(|extras| extras.get("priority")) else {
        return 0;
    };
    let integer = value.as_i64().and_then(|number| i32::try_from(number).ok());
    integer.unwrap_or_else(|| {
        warnings.push(element, WarningKind::Priority);
        0
    })
}

/// Notes what a material has that is not modelled at all.
fn report(source: &json::Material, element: &Element, warnings: &mut Warnings) {
    let pbr = &source.pbr_metallic_roughness;
    let extensions = source.extensions.as_ref();
    let transmission = extensions.and_then(|e| e.transmission.as_ref());
    let volume = extensions.and_then(|e| e.volume.as_ref());
    let textures = [
        ("baseColorTexture", pbr.base_color_texture.is_some()),
        (
            "metallicRoughnessTexture",
            pbr.metallic_roughness_texture.is_some(),
        ),
        ("normalTexture", source.normal_texture.is_some()),
        ("occlusionTexture", source.occlusion_texture.is_some()),
        ("emissiveTexture", source.emissive_texture.is_some()),
        (
            "transmissionTexture",
            transmission.is_some_and(|t| t.transmission_texture.is_some()),
        ),
        (
            "thicknessTexture",
            volume.is_some_and(|v| v.thickness_texture.is_some()),
        ),
    ];
    for (slot, _) in textures.into_iter().filter(|(_, used)| *used) {
        warnings.push(element, WarningKind::Texture { slot });
    }
    let mode = match source.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => None,
        Checked::Valid(AlphaMode::Mask) => Some("MASK"),
        Checked::Valid(AlphaMode::Blend) => Some("BLEND"),
        Checked::Invalid => Some("unknown"),
    };
    if let Some(mode) = mode {
        warnings.push(element, WarningKind::Alpha { mode });
    }
    for name in extensions
        .iter()
        .flat_map(|extensions| extensions.others.keys())
    {
        if !is_supported(name) {
            warnings.push(element, WarningKind::Extension { name: name.clone() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::element::ElementKind;
    use super::*;

    #[test]
    fn attenuation_is_the_logarithm_over_the_distance() {
        let element = Element::new(ElementKind::Material, 0, None);
        let color = Vec3::new(1.0, (-1.0f32).exp(), (-3.0f32).exp());
        let found = attenuation(color, 0.5, &element).unwrap();
        assert!(found.abs_diff_eq(Vec3::new(0.0, 2.0, 6.0), 1e-5), "{found}");
        assert!(found.x.is_sign_positive());
        assert_eq!(
            attenuation(color, f32::INFINITY, &element).unwrap(),
            Vec3::ZERO
        );
        let black = attenuation(Vec3::ZERO, 1e-30, &element).unwrap();
        assert_eq!(black, Vec3::splat(MAX_ATTENUATION));
        for distance in [0.0, -1.0, f32::NAN] {
            assert!(attenuation(color, distance, &element).is_err());
        }
        assert!(attenuation(Vec3::splat(1.5), 1.0, &element).is_err());
        assert!(attenuation(Vec3::NAN, 1.0, &element).is_err());
    }
}
