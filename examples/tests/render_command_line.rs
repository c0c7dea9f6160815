//! The command line of `render`, run as a user runs it.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use caustics::filter::{Display, Image, read_exr};
use caustics::prelude::Estimate;
use serde_json::Value;

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

#[test]
fn a_scene_without_light_and_camera_gets_both_and_notes() -> TestResult {
    let folder = folder("lamp")?;
    write_floor(&folder, &floor())?;
    let output = run(&folder, &["floor.gltf", "--direct-only", "direct.exr"])?;
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    let notes: Vec<&str> = errors
        .lines()
        .filter(|line| line.starts_with("note: "))
        .collect();
    assert!(
        notes.iter().any(|note| note.contains("no light")),
        "{errors}"
    );
    assert!(
        notes.iter().any(|note| note.contains("no camera")),
        "{errors}"
    );
    assert!(
        notes.iter().any(|note| note.contains("no caustic")),
        "{errors}"
    );
    let direct = read_exr(folder.join("direct.exr"))?;
    assert!(
        direct.mean() > 0.0,
        "the lamp lights nothing that the camera sees"
    );
    Ok(())
}

#[test]
fn what_is_not_modelled_is_reported() -> TestResult {
    let folder = folder("warnings")?;
    let mut document = floor();
    document["animations"] = serde_json::json!([{
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": 0, "output": 0 }],
    }]);
    write_floor(&folder, &document)?;
    let output = run(&folder, &["floor.gltf"])?;
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    let warnings: Vec<&str> = errors
        .lines()
        .filter(|it| it.starts_with("warning: "))
        .collect();
    assert_eq!(warnings.len(), 1, "{errors}");
    assert!(warnings[0].contains("floor.gltf: animation 0"), "{errors}");
    Ok(())
}

#[test]
fn estimates_are_listed_and_each_renders() -> TestResult {
    let folder = folder("estimates")?;
    let output = render().arg("--list-estimates").output()?;
    assert_eq!(output.status.code(), Some(0));
    let listed: Vec<&str> = text(&output.stdout)
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert_eq!(listed, Estimate::ALL.map(Estimate::name));
    assert_eq!(listed[0], "nearest");
    for name in listed {
        let picture = format!("{name}.exr");
        let output = run(&folder, &["--estimate", name, "--caustics-only", &picture])?;
        assert_eq!(
            output.status.code(),
            Some(0),
            "{name}: {}",
            text(&output.stderr)
        );
        assert!(
            read_exr(folder.join(picture))?.mean() > 0.0,
            "{name} makes no caustic"
        );
    }
    Ok(())
}

#[test]
fn help_names_every_option() -> TestResult {
    let output = render().arg("--help").output()?;
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stderr), "");
    for option in [
        "--width",
        "--height",
        "--photons",
        "--seed",
        "--samples",
        "--camera",
        "--estimate",
        "--list-estimates",
        "--backend",
        "--threads",
        "--out",
        "--caustics-only",
        "--direct-only",
        "--visibility",
        "--exposure",
        "--stats",
    ] {
        assert!(text(&output.stdout).contains(option), "{option}");
    }
    Ok(())
}

#[test]
fn statistics_have_their_documented_keys_and_balance() -> TestResult {
    let folder = folder("statistics")?;
    let output = run(&folder, &["--stats", "stats.json", "--seed", "5"])?;
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let stats: Value = serde_json::from_slice(&fs::read(folder.join("stats.json"))?)?;
    let keys: Vec<&str> = stats
        .as_object()
        .ok_or("no object")?
        .keys()
        .map(String::as_str)
        .collect();
    // The readme's list, in its order; and each is a row of the readme.
    let mut documented = [
        "scene",
        "estimate",
        "width",
        "height",
        "samples",
        "seed",
        "triangles",
        "photons_emitted",
        "photons_stored",
        "energy",
        "normal_fallbacks",
        "bounded_differentials",
        "replaced_differentials",
        "divided_photons",
        "seconds",
        "photon_rays",
        "photon_rays_per_second",
        "eye_rays",
        "eye_rays_per_second",
    ];
    let readme = include_str!("../../README.md");
    for key in documented {
        assert!(
            readme.contains(&format!("`{key}`")),
            "{key} is not in the readme"
        );
    }
    let mut sorted = keys;
    sorted.sort_unstable();
    documented.sort_unstable();
    assert_eq!(sorted, documented);

    assert_eq!(
        (stats["width"].as_u64(), stats["height"].as_u64()),
        (Some(32), Some(24))
    );
    assert_eq!(
        (stats["seed"].as_u64(), stats["photons_emitted"].as_u64()),
        (Some(5), Some(2000))
    );
    for stage in ["load", "build", "trace", "render", "write"] {
        assert!(
            stats["seconds"][stage].as_f64().is_some_and(|it| it >= 0.0),
            "{stage}: {stats:#}"
        );
    }

    // In equals out, from the numbers in the file alone.
    let energy = &stats["energy"];
    let red = |entry: &Value| entry["watts"][0].as_f64().ok_or("no watts");
    let fates = energy["fates"].as_object().ok_or("no fates")?;
    let out = fates.values().map(red).sum::<Result<f64, _>>()?;
    let gain = energy["roulette_gain"][0].as_f64().ok_or("no gain")?;
    let weighed = energy["edge_gain"][0].as_f64().ok_or("no gain")?;
    let in_all = red(&energy["emitted"])? + gain + weighed;
    assert!(
        in_all > 0.0 && (out / in_all - 1.0).abs() < 1e-4,
        "{in_all} W in, {out} W out"
    );
    assert!(
        energy["imbalance"].as_f64().is_some_and(|it| it < 1e-4),
        "{stats:#}"
    );
    Ok(())
}

/// The pixels of an 8-bit RGB file.
fn read_png(path: &Path) -> Result<Vec<[u8; 3]>, Box<dyn Error>> {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(fs::File::open(path)?)).read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("too large")?];
    let info = reader.next_frame(&mut bytes)?;
    assert_eq!(
        (info.color_type, info.bit_depth),
        (png::ColorType::Rgb, png::BitDepth::Eight)
    );
    let (pixels, _) = bytes[..info.buffer_size()].as_chunks::<3>();
    Ok(pixels.to_vec())
}

#[test]
fn the_two_parts_sum_to_the_picture() -> TestResult {
    let folder = folder("parts_sum")?;
    let output = run(
        &folder,
        &[
            "--exposure",
            "-0.5",
            "--out",
            "picture.png",
            "--caustics-only",
            "caustics.exr",
            "--direct-only",
            "direct.exr",
        ],
    )?;
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("wrote picture.png"));
    let picture = read_png(&folder.join("picture.png"))?;
    let [caustics, direct]: [Image; 2] = [
        read_exr(folder.join("caustics.exr"))?,
        read_exr(folder.join("direct.exr"))?,
    ];
    assert_eq!(picture.len(), 32 * 24);
    assert!(caustics.mean() > 0.0 && direct.mean() > 0.0);
    let display = Display {
        exposure_ev: -0.5,
        ..Display::default()
    };
    let shown = |sum: &dyn Fn(f32, f32) -> f32| -> Vec<[u8; 3]> {
        let pairs = direct.pixels().iter().zip(caustics.pixels());
        let sums = pairs.map(|(a, b)| std::array::from_fn(|channel| sum(a[channel], b[channel])));
        sums.map(|pixel| display.encode(pixel)).collect()
    };
    assert!(picture == shown(&|direct, caustic| direct + caustic));
    // Neither part alone is the picture.
    assert!(picture != shown(&|direct, _| direct));
    assert!(picture != shown(&|_, caustic| caustic));
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() -> TestResult {
    let folder = folder("threads")?;
    let mut files = Vec::new();
    for (threads, seed) in [("1", "3"), ("2", "3"), ("1", "4")] {
        let path = format!("{threads}-{seed}.exr");
        let output = run(
            &folder,
            &[
                "--threads",
                threads,
                "--seed",
                seed,
                "--caustics-only",
                &path,
            ],
        )?;
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        files.push(fs::read(folder.join(path))?);
    }
    assert!(
        files[0] == files[1],
        "two threads make another picture than one"
    );
    assert!(files[0] != files[2], "the seed changes nothing");
    Ok(())
}
