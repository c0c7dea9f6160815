//! What is wrong is named, in one line, before anything is written.

use super::*;

/// Asserts that the arguments are refused with status 2 and one line that has all of `parts`.
fn assert_refused(folder: &Path, arguments: &[&str], parts: &[&str]) -> TestResult {
    let output = run(folder, arguments)?;
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
    assert_eq!(errors.lines().count(), 1, "{arguments:?}: {errors}");
    assert!(errors.ends_with('\n'), "{arguments:?}: {errors}");
    assert_eq!(text(&output.stdout), "", "{arguments:?}");
    for part in parts {
        assert!(
            errors.contains(part),
            "{arguments:?}: no {part:?} in {errors:?}"
        );
    }
    assert!(
        !folder.join("caustics.png").exists(),
        "{arguments:?} left a picture"
    );
    Ok(())
}

#[test]
fn options_that_mean_nothing_are_refused_by_name() -> TestResult {
    let folder = folder("options")?;
    let cases: &[(&[&str], &[&str])] = &[
        (&["--colour", "red"], &["unknown option --colour"]),
        (&["-x"], &["unknown option -x"]),
        (&["--width"], &["--width", "missing"]),
        (&["--out"], &["--out", "missing"]),
        (&["--width", "wide"], &["--width wide", "digit"]),
        (&["--width", "0"], &["--width 0", "at least 1"]),
        (&["--height", "-3"], &["--height -3"]),
        (&["--height", "40000"], &["--height", "40000", "32768"]),
        (&["--samples", "0"], &["--samples 0", "at least 1"]),
        (&["--photons", "1e6"], &["--photons 1e6"]),
        (
            &["--photons", "5000000000"],
            &["--photons 5000000000", "large"],
        ),
        (&["--seed", "-1"], &["--seed -1"]),
        (&["--threads", "0"], &["--threads 0", "at least 1"]),
        (&["--exposure", "nan"], &["--exposure NaN", "not finite"]),
        (&["--neighbours", "0"], &["--neighbours 0", "at least 1"]),
        (&["--radius", "0"], &["--radius 0", "above 0"]),
        (&["--radius", "inf"], &["--radius inf", "not finite"]),
        (
            &["--estimate", "best"],
            &["--estimate best", "nearest", "grid-gaussian"],
        ),
        (&["--kernel", "sinc"], &["--kernel sinc", "silverman"]),
        (
            &["--branching", "both"],
            &["--branching both", "split-first"],
        ),
        (&["--aim", "up"], &["--aim up", "everywhere"]),
        (
            &["--visibility", "none"],
            &["--visibility none", "direct", "full"],
        ),
        (&["--backend", "gpu"], &["--backend gpu", "cpu"]),
        (&["one.glb", "two.glb"], &["two.glb", "one scene"]),
    ];
    for (arguments, parts) in cases {
        assert_refused(&folder, arguments, parts)?;
    }
    Ok(())
}

#[test]
fn files_that_are_no_scenes_are_refused_by_name() -> TestResult {
    let folder = folder("files")?;
    assert_refused(&folder, &["absent.glb"], &["absent.glb", "cannot be read"])?;
    assert_refused(&folder, &["."], &["cannot be read"])?;

    fs::write(
        folder.join("letter.glb"),
        "Dear reader,\nthis is no scene.\n",
    )?;
    assert_refused(&folder, &["letter.glb"], &["letter.glb"])?;
    fs::write(folder.join("empty.glb"), "")?;
    assert_refused(&folder, &["empty.glb"], &["empty.glb"])?;

    let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes/p05_brass_ring.glb");
    let bytes = fs::read(whole)?;
    for length in [8, 100, bytes.len() / 2, bytes.len() - 1] {
        fs::write(folder.join("short.glb"), &bytes[..length])?;
        assert_refused(&folder, &["short.glb"], &["short.glb", "bytes"])?;
    }
    Ok(())
}

#[test]
fn what_is_wrong_in_a_file_is_named() -> TestResult {
    let folder = folder("parts")?;
    let mut document = floor();
    document["nodes"][0]["mesh"] = 7.into();
    write_floor(&folder, &document)?;
    assert_refused(
        &folder,
        &["floor.gltf"],
        &["floor.gltf", "node 0 \"ground\"", "mesh 7"],
    )?;

    let mut document = floor();
    document["accessors"][0]["count"] = 4.into();
    write_floor(&folder, &document)?;
    assert_refused(
        &folder,
        &["floor.gltf"],
        &["floor.gltf", "accessor 0", "48", "36"],
    )?;

    write_floor(&folder, &floor())?;
    fs::remove_file(folder.join("floor.bin"))?;
    assert_refused(
        &folder,
        &["floor.gltf"],
        &["floor.gltf", "buffer 0", "floor.bin"],
    )
}

#[test]
fn a_camera_that_is_not_there_is_refused() -> TestResult {
    let folder = folder("camera")?;
    assert_refused(
        &folder,
        &["--camera", "1"],
        &["cognac", "no camera 1", "has 1"],
    )?;
    // One that says more than an error: the notes and warnings about it wait.
    let mut document = floor();
    document["animations"] = serde_json::json!([{ "channels": [], "samplers": [] }]);
    write_floor(&folder, &document)?;
    assert_refused(
        &folder,
        &["floor.gltf", "--camera", "3"],
        &["floor.gltf", "no camera 3"],
    )
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() -> TestResult {
    let folder = folder("outputs")?;
    write_floor(&folder, &floor())?;
    fs::create_dir(folder.join("taken"))?;
    for option in ["--out", "--caustics-only", "--direct-only", "--stats"] {
        assert_refused(
            &folder,
            &[option, "nowhere/a.file"],
            &["nowhere/a.file", "cannot write"],
        )?;
        assert_refused(&folder, &[option, "taken"], &["taken", "cannot write"])?;
    }
    assert_refused(
        &folder,
        &["--out", "same.exr", "--direct-only", "same.exr"],
        &["same.exr", "two outputs"],
    )?;
    assert_refused(
        &folder,
        &["floor.gltf", "--stats", "floor.gltf"],
        &["floor.gltf", "itself"],
    )?;
    // Asking left nothing behind, and changed nothing.
    let mut names: Vec<_> = fs::read_dir(&folder)?
        .map(|it| Ok(it?.file_name()))
        .collect::<std::io::Result<_>>()?;
    names.sort();
    assert_eq!(names, ["floor.bin", "floor.gltf", "taken"]);
    assert_eq!(
        serde_json::from_slice::<Value>(&fs::read(folder.join("floor.gltf"))?)?,
        floor()
    );
    Ok(())
}
