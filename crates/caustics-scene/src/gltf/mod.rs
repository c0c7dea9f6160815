//! Loading glTF 2.0: `.glb`, and `.gltf` with buffers in other files or in data URIs.
//!
//! The scene shown is the default one, or the first, or, in a file without scenes, all nodes.
//! Cameras and lights come in the order in which a walk from the roots meets their nodes.
//!
//! # What becomes of materials
//! | in the file | in the scene |
//! | --- | --- |
//! | `transmissionFactor` 1, `roughnessFactor` 0 | [`Dielectric`](crate::Surface::Dielectric): index of refraction from `KHR_materials_ior` (1.5 without), absorption `-ln(attenuationColor) / attenuationDistance` from `KHR_materials_volume`, dispersion from `KHR_materials_dispersion`, priority from an integer `priority` in the material's extras (0 without) |
//! | otherwise, `metallicFactor` 1, `roughnessFactor` 0 | [`Metal`](crate::Surface::Metal) with `f0` the base colour |
//! | otherwise, with [`LoadOptions::glossy_receivers`], anything that transmits nothing | [`Glossy`](crate::Surface::Glossy) with base colour, metallicity and roughness |
//! | anything else | [`Diffuse`](crate::Surface::Diffuse) with the base colour as albedo, however metallic or transmissive, since that is about the light that it sends back in all |
//! | no material | the same, white |
//! | `emissiveFactor` times `emissiveStrength` | radiance, from the front, and from the back where `doubleSided` |
//!
//! Intensities are read as radiometric: point and spot lights in W/sr, directional lights in W/m^2,
//! emission in W/(sr m^2).
//!
//! # What is not modelled
//! comes back as a list of [`Warning`]s: textures, rough glass, partial transmission, gloss where it is not asked for,
//! alpha, vertex colours, skins, animations, morph targets, points and lines, ranges of lights,
//! extensions that are optional and unknown. What a file *requires* and is not known is an error.
//!
//! # Broken files
//! are errors that name the node, mesh, accessor or other part in one line. Whatever the bytes,
//! loading neither panics nor hangs, and memory stays in proportion to them: all accessors together
//! may have 16 times the bytes of all buffers (and 4 MiB), and all meshes together as many triangles
//! as there are bytes (and 65,536). Nothing else is out of reach of a file's references: a buffer may
//! name any regular file that the system lets one read.
//!
//! ```no_run
//! let loaded = caustics_scene::gltf::load_path("glass.glb")?;
//! for warning in &loaded.warnings {
//!     eprintln!("glass.glb: {warning}");
//! }
//! println!("{} triangles", loaded.scene.triangle_count());
//! # Ok::<(), caustics_scene::gltf::GltfError>(())
//! ```

mod accessor;
mod buffers;
mod container;
mod document;
mod element;
mod error;
mod hierarchy;
mod loader;
mod material;
mod options;
mod primitive;
mod uri;
mod warning;

use crate::scene::Scene;
use std::path::Path;

pub use element::{Element, ElementKind};
pub use error::{AccessorProblem, GltfError};
pub use options::LoadOptions;
pub use warning::{Warning, WarningKind};

/// A scene from a file, and what of the file it leaves out.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The scene. It may lack lights, cameras, or objects, if the file does.
    pub scene: Scene,
    /// What is not modelled, each once.
    pub warnings: Vec<Warning>,
}

/// Loads a file, and those that it refers to.
///
/// # Errors
/// See [`GltfError`]; messages do not name the file, but the parts in it and other files.
pub fn load_path(path: impl AsRef<Path>) -> Result<LoadedScene, GltfError> {
    load_path_with(path, &LoadOptions::default())
}

/// Like [`load_path`], with options.
///
/// # Errors
/// As [`load_path`].
pub fn load_path_with(
    path: impl AsRef<Path>,
    options: &LoadOptions,
) -> Result<LoadedScene, GltfError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| GltfError::Read { source })?;
    // The folder of a bare name is the current one, an empty path.
    load_slice_with(
        &bytes,
        Some(path.parent().unwrap_or(Path::new(""))),
        options,
    )
}

/// Loads the bytes of a file. `base` is the folder in which other files that it refers to are looked
/// for; without it, they are an error.
///
/// ```
/// use caustics_scene::gltf::load_slice;
///
/// let text = r#"{
///     "asset": { "version": "2.0" },
///     "extensionsUsed": ["KHR_lights_punctual"],
///     "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 5 }] } },
///     "nodes": [{ "name": "lamp", "extensions": { "KHR_lights_punctual": { "light": 0 } } }]
/// }"#;
/// let loaded = load_slice(text.as_bytes(), None)?;
/// assert_eq!(loaded.scene.lights().len(), 1);
/// assert!(loaded.warnings.is_empty());
///
/// let broken = text.replace(r#""light": 0"#, r#""light": 7"#);
/// let error = load_slice(broken.as_bytes(), None).unwrap_err();
/// assert_eq!(error.to_string(), r#"node 0 "lamp" refers to light 7, but there are 1"#);
/// # Ok::<(), caustics_scene::gltf::GltfError>(())
/// ```
///
/// # Errors
/// See [`GltfError`].
pub fn load_slice(bytes: &[u8], base: Option<&Path>) -> Result<LoadedScene, GltfError> {
    load_slice_with(bytes, base, &LoadOptions::default())
}

/// Like [`load_slice`], with options.
///
/// # Errors
/// See [`GltfError`].
pub fn load_slice_with(
    bytes: &[u8],
    base: Option<&Path>,
    options: &LoadOptions,
) -> Result<LoadedScene, GltfError> {
    let container = container::split(bytes)?;
    let document = document::Document::parse(container.json)?;
    let buffers = buffers::Buffers::load(&document, container.bin, base)?;
    let (scene, warnings) = loader::Loader::new(&document, &buffers, options).load()?;
    Ok(LoadedScene {
        scene,
        warnings: warnings.into_vec(),
    })
}
