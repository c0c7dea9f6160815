//! The crates know only those below them.

use std::collections::BTreeMap;
use std::process::Command;

use caustics_tests::TestError;
use serde_json::Value;

/// What each library may depend on, in code, build scripts and tests.
const ARROWS: [(&str, &[&str]); 10] = [
    ("caustics-geometry", &[]),
    ("caustics-sampling", &[]),
    ("caustics-filter", &[]),
    ("caustics-accel", &["geometry"]),
    ("caustics-scene", &["sampling", "accel", "geometry"]),
    (
        "caustics-trace",
        &["sampling", "scene", "accel", "geometry"],
    ),
    (
        "caustics-render",
        &["trace", "filter", "sampling", "scene", "accel", "geometry"],
    ),
    ("caustics-gpu-readback", &[]),
    // Its tests compare it with its twins in `render`, and read back from its device.
    (
        "caustics-wgpu",
        &[
            "gpu-readback",
            "render",
            "trace",
            "filter",
            "sampling",
            "scene",
            "accel",
            "geometry",
        ],
    ),
    (
        "caustics",
        &[
            "wgpu", "render", "trace", "filter", "sampling", "scene", "accel", "geometry",
        ],
    ),
];

/// Packages that nobody depends on, and that may depend on everything.
const TOPS: [&str; 4] = [
    "caustics-examples",
    "caustics-gpu-examples",
    "caustics-tests",
    "caustics-benches",
];

type Arrows = BTreeMap<String, Vec<String>>;

/// The members of the workspace with the members that they depend on.
fn arrows() -> Result<Arrows, TestError> {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
            "--manifest-path",
        ])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))
        .output()?;
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let packages = metadata["packages"].as_array().ok_or("no packages")?;
    let members: Vec<String> = packages.iter().map(name).collect();
    let below = |package: &Value| {
        let all = package["dependencies"]
            .as_array()
            .into_iter()
            .flatten()
            .map(name);
        all.filter(|dependency| members.contains(dependency))
            .collect()
    };
    Ok(packages
        .iter()
        .map(|package| (name(package), below(package)))
        .collect())
}

/// All dependencies that the house does not have, as `from -> to`.
fn violations(arrows: &Arrows) -> Vec<String> {
    let allowed = |from: &str, to: &str| {
        if TOPS.contains(&from) {
            return !TOPS.contains(&to);
        }
        let row = ARROWS.iter().find(|(name, _)| *name == from);
        row.is_some_and(|(_, below)| below.iter().any(|it| format!("caustics-{it}") == to))
    };
    let mut found = Vec::new();
    for (from, below) in arrows {
        found.extend(
            below
                .iter()
                .filter(|to| !allowed(from, to))
                .map(|to| format!("{from} -> {to}")),
        );
        let known = TOPS.contains(&from.as_str()) || ARROWS.iter().any(|(name, _)| name == from);
        if !known {
            found.push(format!("{from} has no row"));
        }
    }
    found
}

#[test]
fn arrows_point_down() -> Result<(), TestError> {
    let arrows = arrows()?;
    // An empty list of dependencies would satisfy every rule.
    let direct = &arrows["caustics-trace"];
    assert!(direct.contains(&"caustics-scene".to_owned()), "{arrows:?}");
    assert_eq!(violations(&arrows), Vec::<String>::new());
    Ok(())
}

#[test]
fn an_arrow_up_or_sideways_is_found() -> Result<(), TestError> {
    for (from, to) in [
        ("caustics-geometry", "caustics-filter"),
        ("caustics-sampling", "caustics-geometry"),
        ("caustics-scene", "caustics-trace"),
        ("caustics-render", "caustics"),
        ("caustics-tests", "caustics-benches"),
    ] {
        let mut arrows = arrows()?;
        arrows
            .entry(from.to_owned())
            .or_default()
            .push(to.to_owned());
        assert_eq!(violations(&arrows), [format!("{from} -> {to}")]);
    }
    let mut arrows = arrows()?;
    arrows.insert("caustics-helpers".to_owned(), Vec::new());
    assert_eq!(violations(&arrows), ["caustics-helpers has no row"]);
    Ok(())
}
