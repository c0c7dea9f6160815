//! The error of progressive pictures against photons and time.

use std::fmt::Write as _;
use std::time::Instant;

use caustics::filter::{read_exr, relative_mse};
use caustics::prelude::*;
use caustics::scene::gltf;
use caustics::{Progressive, Quantum};
use caustics_benches::stage::{Failure, scene_folder};

/// Photons that are kept at most.
const KEPT: u32 = 1 << 18;

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Progressive pictures\n\n\
        relMSE to the reference after each whole pass, and the seconds of tracing and drawing up to \
        it. Photons of passes up to {KEPT} are kept, of larger ones only pictures; *kept* is the \
        most that were in memory so far. References end at a noise of their own, of 0.0001 to 0.003.\n\n\
        | scene | estimate | photons | seconds | relMSE | kept |\n\
        | --- | --- | --: | --: | --: | --: |\n"
    );
    let cases = [
        ("p06_wave_plane", Estimate::GridGaussian, 1u32 << 22),
        ("p07_pool", Estimate::GridGaussian, 1 << 20),
        ("p01_sphere", Estimate::GridGaussian, 1 << 20),
        ("p06_wave_plane", Estimate::Nearest, 1 << 18),
    ];
    for (name, estimate, last) in cases {
        let scene = gltf::load_path(scene_folder().join(format!("{name}.glb")))?.scene;
        let reference = read_exr(scene_folder().join("reference").join(format!("{name}.exr")))?;
        let camera = scene.cameras().first().cloned().ok_or("no camera")?;
        let options = CausticsOptions::for_estimate(estimate);
        let mut progressive = Progressive::new(&scene, &options, KEPT)?;
        let size = PictureOptions {
            width: reference.width(),
            height: reference.height(),
            samples: 1,
            ..PictureOptions::default()
        };
        progressive.look(&camera, &size)?;
        let (mut seconds, mut shown, mut kept) = (0.0, 0, 0);
        while shown < last {
            let start = Instant::now();
            progressive.advance(Quantum::Photons(8192))?;
            seconds += start.elapsed().as_secs_f64();
            kept = kept.max(progressive.photons_in_memory());
            if progressive.shown_photons() > shown {
                shown = progressive.shown_photons();
                // A quarter of the passes is enough to see the slope.
                let pass = (shown / 4096).ilog2();
                if pass % 2 == 0 && shown.is_power_of_two() {
                    let error = relative_mse(&progressive.caustics()?, &reference)?;
                    writeln!(
                        text,
                        "| {name} | {} | {shown} | {seconds:.2} | {error:.5} | {kept} |",
                        estimate.name()
                    )?;
                }
            }
        }
        eprintln!("  {name}");
    }
    Ok(text)
}
