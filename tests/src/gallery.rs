//! The glTF files of this package.

use std::path::PathBuf;

use caustics_scene::Scene;
use caustics_scene::gltf::load_path;

use crate::TestError;

/// The file of this name beside the scenes, such as `p03_cognac.glb`.
#[must_use]
pub fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "scenes", name]
        .iter()
        .collect()
}

/// The names of all scenes, without the ending, in order.
///
/// # Errors
/// If the folder cannot be read.
pub fn names() -> Result<Vec<String>, TestError> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(path(""))? {
        let file = entry?.path();
        if file.extension().is_some_and(|ending| ending == "glb") {
            names.extend(
                file.file_stem()
                    .map(|stem| stem.to_string_lossy().into_owned()),
            );
        }
    }
    names.sort();
    Ok(names)
}

/// The scene of a file, named without its ending.
///
/// # Errors
/// If it cannot be loaded.
pub fn load(name: &str) -> Result<Scene, TestError> {
    Ok(load_path(path(&format!("{name}.glb")))?.scene)
}
