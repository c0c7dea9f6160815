//! The command line of `render`, run as a user runs it.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use caustics::filter::{Display, Image, read_exr};
use caustics::prelude::Estimate;
use serde_json::Value;

mod outputs;
mod refusals;

type TestResult = Result<(), Box<dyn Error>>;

/// Where cargo puts examples: beside the folder of the test's own executable.
fn render() -> Command {
    let test = std::env::current_exe().expect("the test's own path");
    let profile = test
        .ancestors()
        .nth(2)
        .expect("target/<profile>/deps/<test>");
    let program = profile
        .join("examples")
        .join(format!("render{}", std::env::consts::EXE_SUFFIX));
    assert!(
        program.exists(),
        "{} is missing: run all tests of this package, which builds it",
        program.display()
    );
    Command::new(program)
}

/// An empty folder for one test.
fn folder(test: &str) -> Result<PathBuf, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("render")
        .join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Runs `render` in `folder` on a picture of a few pixels.
fn run(folder: &Path, arguments: &[&str]) -> Result<Output, Box<dyn Error>> {
    let small = [
        "--width",
        "32",
        "--height",
        "24",
        "--photons",
        "2000",
        "--samples",
        "1",
    ];
    Ok(render()
        .current_dir(folder)
        .args(small)
        .args(arguments)
        .output()?)
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("the program prints UTF-8")
}

/// The JSON of a floor of one triangle whose positions are in `floor.bin`.
fn floor() -> Value {
    serde_json::json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "uri": "floor.bin", "byteLength": 36 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "nodes": [{ "name": "ground", "mesh": 0 }],
    })
}

/// Writes the document as `floor.gltf`, with its positions beside it.
fn write_floor(folder: &Path, document: &Value) -> TestResult {
    let positions = [[-1.0f32, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let bytes: Vec<u8> = positions
        .as_flattened()
        .iter()
        .flat_map(|it| it.to_le_bytes())
        .collect();
    fs::write(folder.join("floor.bin"), bytes)?;
    fs::write(folder.join("floor.gltf"), document.to_string())?;
    Ok(())
}
