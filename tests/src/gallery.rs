//! The glTF files of this package, and pictures of their caustics by an independent tracer.

use std::path::PathBuf;

use caustics_filter::{Image, read_exr};
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

/// The reference of this name, such as `p03_cognac` or `p10_torus_cube.full`, as the means over
/// squares of `factor` by `factor` pixels.
///
/// # Errors
/// If it cannot be read, or `factor` does not divide its size.
pub fn reference(name: &str, factor: u32) -> Result<Image, TestError> {
    let full = read_exr(path(&format!("reference/{name}.exr")))?;
    let (width, height) = (full.width() / factor, full.height() / factor);
    if (width * factor, height * factor) != (full.width(), full.height()) {
        return Err(format!("{factor} does not divide the size of {name}").into());
    }
    let mut image = Image::new(width, height)?;
    let share = f64::from(factor * factor).recip();
    for (y, row) in (0..).zip(image.rows_mut()) {
        for (x, pixel) in (0..).zip(row) {
            let mut sum = [0.0f64; 3];
            for (j, i) in (0..factor).flat_map(|j| (0..factor).map(move |i| (j, i))) {
                let part = full
                    .pixel(x * factor + i, y * factor + j)
                    .unwrap_or([f32::NAN; 3]);
                for (sum, part) in sum.iter_mut().zip(part) {
                    *sum += f64::from(part);
                }
            }
            *pixel = sum.map(|sum| (sum * share) as f32);
        }
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_reference_has_the_same_mean() -> Result<(), TestError> {
        let (full, small) = (reference("p03_cognac", 1)?, reference("p03_cognac", 8)?);
        assert_eq!(
            (small.width(), small.height()),
            (full.width() / 8, full.height() / 8)
        );
        assert!((small.mean() / full.mean() - 1.0).abs() < 1e-6);
        assert_ne!(small.pixel(0, 32), small.pixel(32, 0));
        assert!(reference("p03_cognac", 7).is_err());
        Ok(())
    }
}
