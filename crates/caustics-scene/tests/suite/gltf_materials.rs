//! What becomes of materials, and what is reported as not modelled.

use crate::writer;

use caustics_scene::gltf::{GltfError, LoadOptions, WarningKind, load_slice, load_slice_with};
use caustics_scene::{Material, Surface};
use glam::Vec3;
use serde_json::{Value, json};
use writer::Writer;

/// A file of one mesh with this material.
fn file_of(material: Value) -> Writer {
    let mut file = Writer::new();
    let material = file.push("materials", material);
    let mesh = file.tetrahedron();
    file.root["meshes"][mesh]["primitives"][0]["material"] = material.into();
    file.node(json!({ "mesh": mesh }));
    file
}

fn convert(material: Value) -> Result<(Material, Vec<String>), GltfError> {
    let loaded = load_slice(&file_of(material).glb(), None)?;
    let warnings = loaded.warnings.iter().map(ToString::to_string).collect();
    Ok((loaded.scene.materials()[0].clone(), warnings))
}

fn pbr(metallic: f64, roughness: f64) -> Value {
    json!({
        "baseColorFactor": [0.2, 0.4, 0.6, 1],
        "metallicFactor": metallic,
        "roughnessFactor": roughness
    })
}

fn transmission(factor: f64) -> Value {
    json!({
        "KHR_materials_transmission": { "transmissionFactor": factor },
        "KHR_materials_volume": { "thicknessFactor": 1 }
    })
}

const DIFFUSE: Surface = Surface::Diffuse {
    albedo: Vec3::new(0.2, 0.4, 0.6),
};

#[test]
fn a_clear_dielectric_with_everything() {
    let (material, warnings) = convert(json!({
        "name": "flint",
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
        "extras": { "priority": -7 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_ior": { "ior": 1.62 },
            "KHR_materials_dispersion": { "dispersion": 0.55 },
            "KHR_materials_volume": {
                "thicknessFactor": 0.01,
                "attenuationDistance": 0.25,
                "attenuationColor": [1, 0.5, 0.1]
            }
        }
    }))
    .unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(material.name, "flint");
    let Surface::Dielectric {
        ior,
        attenuation,
        dispersion,
        priority,
    } = material.surface
    else {
        panic!("{material:?}")
    };
    assert_eq!((ior, dispersion, priority), (1.62, 0.55, -7));
    let expected = Vec3::new(0.0, 4.0 * 2f32.ln(), 4.0 * 10f32.ln());
    assert!(attenuation.abs_diff_eq(expected, 1e-5), "{attenuation}");
}

#[test]
fn a_dielectric_of_defaults() {
    let mut material = json!({ "extensions": transmission(1.0) });
    material["pbrMetallicRoughness"] = json!({ "metallicFactor": 0, "roughnessFactor": 0 });
    let (material, warnings) = convert(material).unwrap();
    let expected = Surface::Dielectric {
        ior: 1.5,
        attenuation: Vec3::ZERO,
        dispersion: 0.0,
        priority: 0,
    };
    assert_eq!((material.surface, warnings), (expected, vec![]));
}

#[test]
fn a_mirror() {
    let material = json!({ "pbrMetallicRoughness": pbr(1.0, 0.0), "doubleSided": true });
    let (material, warnings) = convert(material).unwrap();
    assert_eq!(
        material.surface,
        Surface::Metal {
            f0: Vec3::new(0.2, 0.4, 0.6)
        }
    );
    assert!(material.double_sided && warnings.is_empty());
}

#[test]
fn everything_else_is_lambertian_and_says_so_unless_it_is() {
    for (metallic, roughness, factor, message) in [
        (0.0, 1.0, 0.0, ""),
        (0.0, 0.5, 0.0, "metallic 0 and roughness 0.5 are left out"),
        (0.0, 0.0, 0.0, "metallic 0 and roughness 0 are left out"),
        (1.0, 0.25, 0.0, "metallic 1 and roughness 0.25 are left out"),
        (1.0, 1.0, 0.0, "metallic 1 and roughness 1 are left out"),
        (0.5, 0.0, 0.0, "metallic 0.5 and roughness 0 are left out"),
        (0.0, 0.25, 1.0, "roughness 0.25 is not modelled"),
        (0.0, 0.0, 0.5, "transmission 0.5 is not modelled"),
    ] {
        let material = json!({
            "name": "m",
            "pbrMetallicRoughness": pbr(metallic, roughness),
            "extensions": transmission(factor)
        });
        let (material, warnings) = convert(material).unwrap();
        assert_eq!(material.surface, DIFFUSE, "{metallic} {roughness} {factor}");
        if message.is_empty() {
            assert!(warnings.is_empty(), "{warnings:?}");
        } else {
            let expected = format!("material 0 \"m\": {message}, taken as Lambertian");
            assert_eq!(warnings, [expected]);
        }
    }
}

#[test]
fn receivers_are_as_glossy_as_the_file_says_when_asked_for() {
    let options = LoadOptions {
        glossy_receivers: true,
    };
    let convert = |metallic, roughness, factor| {
        let material = json!({
            "name": "m",
            "pbrMetallicRoughness": pbr(metallic, roughness),
            "extensions": transmission(factor)
        });
        let loaded = load_slice_with(&file_of(material).glb(), None, &options).unwrap();
        (loaded.scene.materials()[0].surface, loaded.warnings.len())
    };
    for (metallic, roughness) in [
        (0.0, 1.0),
        (0.0, 0.5),
        (0.0, 0.0),
        (1.0, 0.25),
        (1.0, 1.0),
        (0.5, 0.0),
    ] {
        let glossy = Surface::Glossy {
            base_color: Vec3::new(0.2, 0.4, 0.6),
            metallic: metallic as f32,
            roughness: roughness as f32,
        };
        assert_eq!(convert(metallic, roughness, 0.0), (glossy, 0));
    }
    // What is specular stays so, and what transmits is not modelled either way.
    assert!(matches!(convert(1.0, 0.0, 0.0), (Surface::Metal { .. }, 0)));
    assert!(matches!(
        convert(0.0, 0.0, 1.0),
        (Surface::Dielectric { .. }, _)
    ));
    assert_eq!(convert(0.0, 0.25, 1.0), (DIFFUSE, 1));
    assert_eq!(convert(0.0, 0.0, 0.5), (DIFFUSE, 1));
}

#[test]
fn emission_is_factor_times_strength() {
    let mut lamp = json!({ "emissiveFactor": [1, 0.5, 0] });
    assert_eq!(
        convert(lamp.clone()).unwrap().0.emission,
        Vec3::new(1.0, 0.5, 0.0)
    );
    lamp["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 20 } });
    let (material, _) = convert(lamp).unwrap();
    assert_eq!(material.emission, Vec3::new(20.0, 10.0, 0.0));
    assert!(!material.double_sided);
}

#[test]
fn a_primitive_without_material_is_white() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    file.node(json!({ "mesh": mesh }));
    let loaded = load_slice(&file.glb(), None).unwrap();
    assert!(loaded.warnings.is_empty());
    assert_eq!(
        loaded.scene.materials()[0].surface,
        Surface::Diffuse { albedo: Vec3::ONE }
    );
}

#[test]
fn what_a_material_has_and_is_not_modelled_is_reported_once() {
    let texture = json!({ "index": 0 });
    let material = json!({
        "name": "busy",
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {
            "baseColorFactor": [1, 0.5, 0.5, 1],
            "roughnessFactor": 0,
            "baseColorTexture": texture,
            "metallicRoughnessTexture": texture
        },
        "normalTexture": texture,
        "occlusionTexture": texture,
        "emissiveTexture": texture,
        "extras": { "priority": "high" },
        "extensions": {
            "KHR_materials_transmission":
                { "transmissionFactor": 1, "transmissionTexture": texture },
            "KHR_materials_volume": { "thicknessTexture": texture },
            "KHR_materials_ior": { "ior": 0 },
            "KHR_materials_clearcoat": {}
        }
    });
    let mut file = file_of(material);
    // A second use reports nothing again.
    file.node(json!({ "mesh": 0 }));
    let loaded = load_slice(&file.glb(), None).unwrap();
    let slot = |slot| WarningKind::Texture { slot };
    let kinds: Vec<WarningKind> = loaded.warnings.iter().map(|w| w.kind.clone()).collect();
    let expected = [
        slot("baseColorTexture"),
        slot("metallicRoughnessTexture"),
        slot("normalTexture"),
        slot("occlusionTexture"),
        slot("emissiveTexture"),
        slot("transmissionTexture"),
        slot("thicknessTexture"),
        WarningKind::Alpha { mode: "BLEND" },
        WarningKind::Extension {
            name: "KHR_materials_clearcoat".into(),
        },
        WarningKind::MetallicDielectric { metallic: 1.0 },
        WarningKind::TintedDielectric,
        WarningKind::ZeroIor,
        WarningKind::ThinWalled,
        WarningKind::Priority,
    ];
    assert_eq!(kinds, expected);
    for warning in &loaded.warnings {
        assert!(
            warning.to_string().starts_with("material 0 \"busy\": "),
            "{warning}"
        );
    }
}

#[test]
fn what_a_scene_has_and_is_not_modelled_is_reported_once() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    let positions = file.vectors(&writer::TETRAHEDRON);
    let attributes = json!({ "POSITION": positions, "COLOR_0": positions });
    let primitives = json!([
        { "attributes": attributes, "mode": 0 },
        { "attributes": { "POSITION": positions }, "mode": 3 },
        { "attributes": { "NORMAL": positions } },
        { "attributes": { "POSITION": positions }, "targets": [{ "POSITION": positions }] }
    ]);
    file.root["meshes"][mesh]["name"] = "shapes".into();
    file.root["meshes"][mesh]["primitives"] = primitives;
    let light = file.push_light(json!({ "type": "spot", "range": 5, "spot":
        { "innerConeAngle": 0.5, "outerConeAngle": 0.5 } }));
    file.node(json!({
        "name": "here", "mesh": mesh, "skin": 0,
        "extensions": {
            "KHR_lights_punctual": { "light": light },
            "EXT_mesh_gpu_instancing": {}
        }
    }));
    file.node(json!({ "mesh": mesh, "name": "flat", "scale": [0, 1, 1],
        "extensions": { "KHR_lights_punctual": { "light": light } } }));
    file.push("skins", json!({ "joints": [0] }));
    file.push(
        "animations",
        json!({ "name": "spin", "channels": [], "samplers": [] }),
    );
    file.root["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "EXT_mesh_gpu_instancing",
        "KHR_texture_transform"
    ]);
    let loaded = load_slice(&file.glb(), None).unwrap();
    let messages: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    let expected = [
        "node 0 \"here\": skin is ignored, bind pose shown",
        "node 0 \"here\": extension \"EXT_mesh_gpu_instancing\" is ignored",
        "mesh 0 \"shapes\", primitive 0: vertex colours are ignored",
        "mesh 0 \"shapes\", primitive 0: points are left out",
        "mesh 0 \"shapes\", primitive 1: lines are left out",
        "mesh 0 \"shapes\", primitive 2: left out, since it has no positions",
        "mesh 0 \"shapes\", primitive 3: morph targets are ignored",
        "mesh 0 \"shapes\", primitive 3: 1 indices at the end make no triangle",
        "light 0: range is ignored",
        "light 0: spot has no soft edge, a narrow one taken",
        "node 1 \"flat\": mesh is left out, since the transform flattens it",
        "animation 0 \"spin\": animation is ignored",
        "extension \"KHR_texture_transform\" is ignored",
    ];
    assert_eq!(messages, expected);
    assert_eq!(loaded.scene.instances().len(), 1);
    assert_eq!(loaded.scene.lights().len(), 2);
}

#[test]
fn impossible_values_name_their_material() {
    let dielectric = |extra: Value| {
        let mut extensions = transmission(1.0);
        for (key, value) in extra.as_object().unwrap() {
            extensions[key] = value.clone();
        }
        let pbr = json!({ "metallicFactor": 0, "roughnessFactor": 0 });
        json!({ "name": "x", "pbrMetallicRoughness": pbr, "extensions": extensions })
    };
    let volume = |volume: Value| dielectric(json!({ "KHR_materials_volume": volume }));
    for (material, message) in [
        (
            dielectric(json!({ "KHR_materials_ior": { "ior": 0.5 } })),
            "index of refraction 0.5",
        ),
        (
            dielectric(json!({ "KHR_materials_dispersion": { "dispersion": -1 } })),
            "dispersion -1",
        ),
        (
            dielectric(json!({ "KHR_materials_dispersion": { "dispersion": "a" } })),
            "not a number",
        ),
        (
            volume(json!({ "attenuationDistance": 0 })),
            "attenuationDistance 0 is not above 0",
        ),
        (
            volume(json!({ "attenuationColor": [2, 1, 1] })),
            "attenuationColor 2 is not between",
        ),
        (
            json!({ "name": "x", "pbrMetallicRoughness": pbr(2.0, 0.0) }),
            "metallicFactor 2",
        ),
        (
            json!({ "name": "x", "pbrMetallicRoughness": pbr(0.0, -1.0) }),
            "roughnessFactor -1",
        ),
        (
            json!({ "name": "x", "extensions": transmission(1.5) }),
            "transmissionFactor 1.5",
        ),
        (
            json!({ "name": "x", "emissiveFactor": [-1, 0, 0] }),
            "emission -1",
        ),
        (
            json!({ "name": "x", "pbrMetallicRoughness": { "baseColorFactor": [1.5, 1, 1, 1] } }),
            "albedo 1.5",
        ),
        (
            json!({ "name": "x", "pbrMetallicRoughness": 3 }),
            "invalid type",
        ),
    ] {
        let error = convert(material).unwrap_err().to_string();
        assert!(error.starts_with("material 0 \"x\": "), "{error}");
        assert!(error.contains(message), "{error} should say {message}");
    }
}
