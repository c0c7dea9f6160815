//! The error of progressive pictures against photons and time.

use std::fmt::Write as _;
use std::time::Instant;

use caustics::filter::{Image, read_exr, relative_errors, trimmed_mean};
use caustics::prelude::*;
use caustics::scene::gltf;
use caustics::{Progressive, Quantum};
use caustics_benches::chart::{self, Line, Panel};
use caustics_benches::stage::{Failure, scene_folder};

/// Photons that are kept at most.
const KEPT: u32 = 1 << 18;

/// Photons traced between two looks at the clock.
const QUANTUM: u32 = 8192;

/// The part of the worst pixels that is left out: references have single bright ones.
const TRIM: f64 = 0.001;

/// The scene that is held against many photons instead of its reference, which has noise.
const EXACT: &str = "p06_wave_plane";

/// Photons of that.
const TRUE_PHOTONS: u32 = 1 << 23;

/// A scene, an estimate, whether footprints are checked, and the photons of the last pass.
const CASES: [(&str, Estimate, bool, u32); 7] = [
    (EXACT, Estimate::GridGaussian, true, 1 << 22),
    (EXACT, Estimate::GridGaussian, false, 1 << 20),
    ("p07_pool", Estimate::GridGaussian, true, 1 << 19),
    ("p07_pool", Estimate::GridGaussian, false, 1 << 19),
    ("p01_sphere", Estimate::GridGaussian, true, 1 << 19),
    ("p01_sphere", Estimate::GridGaussian, false, 1 << 19),
    (EXACT, Estimate::Nearest, true, 1 << 18),
];

const NAMES: [&str; 4] = [
    "grid-gaussian, footprints checked",
    "grid-gaussian, unchecked",
    "nearest (radius shrinks)",
    "error ~ 1 / photons",
];

/// A whole pass.
struct Shown {
    photons: u32,
    seconds: f64,
    error: f64,
    kept: usize,
}

fn stage(name: &str) -> Result<(Scene, Camera, Image), Failure> {
    let scene = gltf::load_path(scene_folder().join(format!("{name}.glb")))?.scene;
    let camera = scene.cameras().first().cloned().ok_or("no camera")?;
    let file = scene_folder().join("reference").join(format!("{name}.exr"));
    let mut reference = read_exr(file)?;
    if name == EXACT {
        let mut options = CausticsOptions::default();
        options.trace.photons = TRUE_PHOTONS;
        options.trace.seed = 1;
        let size = size_of(&reference);
        reference = Caustics::new(&scene, &options)?
            .render(&camera, &size)?
            .caustics;
    }
    Ok((scene, camera, reference))
}

fn size_of(image: &Image) -> PictureOptions {
    PictureOptions {
        width: image.width(),
        height: image.height(),
        samples: 1,
        visibility: Visibility::Direct,
        ..PictureOptions::default()
    }
}

fn passes(
    (scene, camera, reference): &(Scene, Camera, Image),
    estimate: Estimate,
    is_checked: bool,
    last: u32,
) -> Result<(Vec<Shown>, f64), Failure> {
    let mut options = CausticsOptions::for_estimate(estimate);
    options.trace.check_footprints = is_checked;
    let mut progressive = Progressive::new(scene, &options, KEPT)?;
    progressive.look(camera, &size_of(reference))?;
    let (mut seconds, mut longest, mut kept) = (0.0, 0.0f64, 0);
    let mut all: Vec<Shown> = Vec::new();
    while all.last().is_none_or(|it| it.photons < last) {
        let start = Instant::now();
        progressive.advance(Quantum::Photons(QUANTUM))?;
        let taken = start.elapsed().as_secs_f64();
        seconds += taken;
        longest = longest.max(taken);
        kept = kept.max(progressive.photons_in_memory());
        let photons = progressive.shown_photons();
        if photons > all.last().map_or(0, |it| it.photons) {
            let errors = relative_errors(&progressive.caustics()?, reference)?;
            all.push(Shown {
                photons,
                seconds,
                error: trimmed_mean(&errors, TRIM),
                kept,
            });
        }
    }
    Ok((all, longest))
}

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Progressive pictures\n\n\
        relMSE (of all but the worst 0.1 % of pixels) after whole passes, to the reference or, of \
        `{EXACT}`, to {TRUE_PHOTONS} photons of another seed, and the seconds of tracing and drawing up to it, with footprints checked against their neighbours \
        and not. Photons of passes up to {KEPT} are kept, of larger ones only pictures; *kept* is \
        the most that were in memory so far. References end at a noise of their own, of 0.0001 to \
        0.003, which that many photons do not have. Under waves the error falls as one over the \
        photons, which the dashed lines are, over three decades; in the other two scenes more slowly, \
        by their edges and what their references are off. Checked footprints have less error at few \
        photons under the waves and behind the sphere, and more in the pool. Other programs shared \
        the machine, so that seconds are several times those of an idle one.\n\n\
        ![error against photons and seconds](emission-progressive.svg)\n\n\
        | scene | estimate | checked | photons | seconds | relMSE | kept |\n\
        | --- | --- | --- | --: | --: | --: | --: |\n"
    );
    let mut panels: Vec<Panel> = Vec::new();
    let mut quanta = Vec::new();
    let mut stages: Vec<(&str, (Scene, Camera, Image))> = Vec::new();
    for (name, estimate, is_checked, last) in CASES {
        let known = stages.iter().position(|it| it.0 == name);
        let index = match known {
            Some(index) => index,
            None => {
                stages.push((name, stage(name)?));
                stages.len() - 1
            }
        };
        let (all, longest) = passes(&stages[index].1, estimate, is_checked, last)?;
        for shown in &all {
            // A part of the passes is enough to see the slope.
            if (shown.photons / 4096).ilog2() % 2 == 0 && shown.photons.is_power_of_two() {
                writeln!(
                    text,
                    "| {name} | {} | {} | {} | {:.2} | {:.1e} | {} |",
                    estimate.name(),
                    if is_checked { "yes" } else { "no" },
                    shown.photons,
                    shown.seconds,
                    shown.error,
                    shown.kept
                )?;
            }
        }
        let what = match (estimate, is_checked) {
            (Estimate::Nearest, _) => "nearest",
            (_, true) => "checked",
            (_, false) => "unchecked",
        };
        quanta.push(format!("{:.0} ms ({name}, {what})", 1e3 * longest));
        if panels.iter().all(|it| it.title != name) {
            let first = &all[0];
            let rate: Vec<[f64; 2]> = [first.photons, last]
                .into_iter()
                .map(f64::from)
                .map(|at| [at, first.error * f64::from(first.photons) / at])
                .collect();
            let dashed = Line {
                name: 3,
                points: rate,
                is_dashed: true,
            };
            for (label, lines) in [("photons", vec![dashed]), ("seconds", Vec::new())] {
                panels.push(Panel {
                    title: name.to_owned(),
                    labels: [label, "relMSE"],
                    powers: [true; 2],
                    lines,
                });
            }
        }
        let line = match (estimate, is_checked) {
            (Estimate::Nearest, _) => 2,
            (_, true) => 0,
            (_, false) => 1,
        };
        let of_scene = panels.iter_mut().filter(|it| it.title == name);
        for (panel, by_time) in of_scene.zip([false, true]) {
            let at = |it: &Shown| {
                if by_time {
                    it.seconds
                } else {
                    f64::from(it.photons)
                }
            };
            panel.lines.push(Line {
                name: line,
                points: all.iter().map(|it| [at(it), it.error]).collect(),
                is_dashed: false,
            });
        }
        eprintln!("  {name}");
    }
    writeln!(
        text,
        "\nThe longest quantum of {QUANTUM} photons, which ends a pass and draws it, or begins one, \
        took {}.",
        quanta.join(", ")
    )?;
    chart::write("emission-progressive.svg", &NAMES, &panels)?;
    Ok(text)
}
