//! What is printed and written.

use super::*;

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
    let readme = include_str!("../../../README.md");
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
