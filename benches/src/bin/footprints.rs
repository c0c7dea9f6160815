//! Measures what each choice of a footprint is worth on the public scenes: the kernel's scale, where
//! it ends, also for photons that overlap, the limit of its anisotropy, the kernel itself, the check against neighbours and the
//! integral over pixels. Writes `docs/footprints.md` and `docs/footprints.svg`.
//!
//! ```text
//! cargo run --release -p caustics-benches --bin footprints [photons]
//! ```
//!
//! Every number is the same on any machine.

use std::fmt::Write as _;
use std::fs;

use caustics::CausticsOptions;
use caustics::filter::Comparison;
use caustics::render::{FootprintKernel, FootprintOptions, GBuffer, splat};
use caustics::trace::{Coverage, Photon, trace_photons};
use caustics_benches::chart::{self, Line, Panel};
use caustics_benches::stage::{Failure, SCENES, Stage};

const SCALES: [f32; 8] = [0.3, 0.4, 0.5, 0.55, 0.6, 0.7, 0.85, 1.0];
const TRUNCATIONS: [f32; 5] = [2.0, 2.5, 3.0, 3.5, 4.0];
const OVERLAP_TRUNCATIONS: [f32; 6] = [1.5, 1.75, 2.0, 2.5, 3.0, 3.5];
const ANISOTROPIES: [f32; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, f32::INFINITY];

/// relMSE of all pixels and of all but the worst 1 %.
type Errors = [f64; 2];

/// A scene's errors, in the order of the tables' columns.
#[derive(Clone)]
struct Measured {
    scene: &'static str,
    scales: Vec<Errors>,
    truncations: Vec<Errors>,
    /// Only of a scene in which most photons overlap.
    overlap_truncations: Vec<Errors>,
    anisotropies: Vec<Errors>,
    kernels: Vec<Errors>,
    even_emission: Errors,
    whole_edges: Errors,
    unchecked: Errors,
    read_at_middles: Errors,
}

fn main() -> Result<(), Failure> {
    let photons: u32 = match std::env::args().nth(1) {
        Some(count) => count.parse()?,
        None => 262_144,
    };
    let measured = SCENES
        .into_iter()
        .map(|scene| measure(scene, photons))
        .collect::<Result<Vec<_>, _>>()?;
    fs::write(
        concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/footprints.md"),
        page(&measured, photons)?,
    )?;
    chart::write("footprints.svg", &SCENES, &panels(&measured))
}

fn measure(scene: &'static str, photons: u32) -> Result<Measured, Failure> {
    eprintln!("{scene}");
    let stage = Stage::load(scene)?;
    let (width, height) = (stage.reference.width(), stage.reference.height());
    let buffer = GBuffer::new(
        &stage.world,
        &stage.intersector,
        &stage.camera,
        width,
        height,
    )?;
    let errors = |photons: &[Photon], options: &FootprintOptions| -> Result<Errors, Failure> {
        let (image, _) = splat(&buffer, photons, options)?;
        let found = Comparison::new(&image, &stage.reference)?;
        Ok([found.relative_mse, found.relative_mse_trimmed])
    };
    let mut options = CausticsOptions::default().trace;
    options.photons = photons;
    let trace = |options: &_| trace_photons(&stage.world, &stage.intersector, options, &|_| {});
    let map = trace(&options)?;
    let default = FootprintOptions::default();
    let each = |all: &[FootprintOptions]| -> Result<Vec<Errors>, Failure> {
        all.iter().map(|it| errors(&map.photons, it)).collect()
    };
    let scales = each(&SCALES.map(|scale| FootprintOptions { scale, ..default }))?;
    let truncations = each(&TRUNCATIONS.map(|truncation| FootprintOptions {
        truncation,
        ..default
    }))?;
    let overlapping = map.photons.iter();
    let overlapping = overlapping.filter(|it| it.coverage == Coverage::Overlap);
    let overlap_truncations = if 2 * overlapping.count() > map.photons.len() {
        each(
            &OVERLAP_TRUNCATIONS.map(|overlap_truncation| FootprintOptions {
                overlap_truncation,
                ..default
            }),
        )?
    } else {
        Vec::new()
    };
    let anisotropies = each(&ANISOTROPIES.map(|max_anisotropy| FootprintOptions {
        max_anisotropy,
        ..default
    }))?;
    let kernels = each(&FootprintKernel::ALL.map(|kernel| FootprintOptions { kernel, ..default }))?;
    let read_at_middles = errors(
        &map.photons,
        &FootprintOptions {
            integrate_pixels: false,
            ..default
        },
    )?;
    options.guide_emission = false;
    let even_emission = errors(&trace(&options)?.photons, &default)?;
    options.guide_emission = true;
    options.divide_edges = false;
    let whole_edges = errors(&trace(&options)?.photons, &default)?;
    options.check_footprints = false;
    let unchecked = errors(&trace(&options)?.photons, &default)?;
    Ok(Measured {
        scene,
        scales,
        truncations,
        overlap_truncations,
        anisotropies,
        kernels,
        even_emission,
        whole_edges,
        unchecked,
        read_at_middles,
    })
}

fn page(measured: &[Measured], photons: u32) -> Result<String, Failure> {
    let mut text = format!(
        "# How footprints are drawn

Measured by `cargo run --release -p caustics-benches --bin footprints`, which writes this page and its
chart: {photons} photons of the default lattice a scene, 512 by 512 pixels. Each cell is the relMSE to
the reference and, after the stroke, that of all but the worst 1 % of pixels. The last line is the
geometric mean over the scenes of what a choice has times the error of the default, which is bold.
Every number is the same on any machine.

![error by scale, by both truncations and by anisotropy](footprints.svg)
"
    );
    let default = FootprintOptions::default();
    let of_default: Vec<Errors> = measured
        .iter()
        .map(|it| {
            let place = SCALES.iter().position(|it| *it == default.scale);
            place.map_or([f64::NAN; 2], |place| it.scales[place])
        })
        .collect();
    let name = |text: String, is_default: bool| {
        if is_default {
            format!("**{text}**")
        } else {
            text
        }
    };
    table(
        &mut text,
        "Scale",
        "`FootprintOptions::scale`: the Gaussian's standard deviation in sample spacings. Narrower, the \
         lattice shows; wider, edges blur.",
        &SCALES.map(|it| name(it.to_string(), it == default.scale)),
        measured,
        |it| it.scales.clone(),
        &of_default,
    )?;
    table(
        &mut text,
        "Truncation",
        "`FootprintOptions::truncation`: where the Gaussian ends, in standard deviations. Sooner, its edge \
         shows; later, it covers more pixels. Footprints that are integrated over pixels always end at 3, \
         and those that overlap have a truncation of their own.",
        &TRUNCATIONS.map(|it| name(it.to_string(), it == default.truncation)),
        measured,
        |it| it.truncations.clone(),
        &of_default,
    )?;
    let (overlapping, its_default): (Vec<Measured>, Vec<Errors>) = measured
        .iter()
        .zip(&of_default)
        .filter(|(it, _)| !it.overlap_truncations.is_empty())
        .map(|(it, default)| (it.clone(), *default))
        .unzip();
    table(
        &mut text,
        "Truncation where photons overlap",
        "`FootprintOptions::overlap_truncation`: the same for photons of lights with an area, of which \
         dozens lie on each point. There is no lattice of them that ends of Gaussians would show, and a \
         Gaussian that ends at 2 covers 0.44 of the pixels of one that ends at 3. It is narrower, too: \
         a little noise is what a picture for less time costs. Only scenes in which most photons overlap.",
        &OVERLAP_TRUNCATIONS.map(|it| name(it.to_string(), it == default.overlap_truncation)),
        &overlapping,
        |it| it.overlap_truncations.clone(),
        &its_default,
    )?;
    table(
        &mut text,
        "Limit of anisotropy",
        "`FootprintOptions::max_anisotropy`: how many times the shorter axis the longer one may have, or \
         the shorter one is widened.",
        &ANISOTROPIES.map(|it| name(it.to_string(), it == default.max_anisotropy)),
        measured,
        |it| it.anisotropies.clone(),
        &of_default,
    )?;
    table(
        &mut text,
        "Kernel",
        "`FootprintOptions::kernel`, at the same scale. All but the Gaussian are read at the middles of \
         pixels.",
        &FootprintKernel::ALL.map(|it| name(it.name().to_owned(), it == default.kernel)),
        measured,
        |it| it.kernels.clone(),
        &of_default,
    )?;
    table(
        &mut text,
        "Emission and checks",
        "With photons sent evenly (`TraceOptions::guide_emission`); without division at the edges of sheets of \
         light (`TraceOptions::divide_edges`), without that and the check against neighbours \
         (`TraceOptions::check_footprints`), and, with both, without the integral of small footprints over \
         the pixel (`FootprintOptions::integrate_pixels`).",
        &[
            "**all**",
            "even emission",
            "edges whole",
            "unchecked",
            "read at middles",
        ]
        .map(str::to_owned),
        measured,
        |it| {
            let all = it.scales[SCALES.iter().position(|it| *it == 0.55).unwrap_or(0)];
            let Measured {
                even_emission,
                whole_edges,
                unchecked,
                read_at_middles,
                ..
            } = *it;
            vec![all, even_emission, whole_edges, unchecked, read_at_middles]
        },
        &of_default,
    )?;
    Ok(text)
}

fn table(
    text: &mut String,
    title: &str,
    introduction: &str,
    columns: &[String],
    measured: &[Measured],
    errors: impl Fn(&Measured) -> Vec<Errors>,
    of_default: &[Errors],
) -> Result<(), Failure> {
    writeln!(text, "\n## {title}\n\n{introduction}\n")?;
    writeln!(text, "| scene | {} |", columns.join(" | "))?;
    writeln!(text, "| --- |{}", " --: |".repeat(columns.len()))?;
    let mut logarithms = vec![[0.0; 2]; columns.len()];
    for (scene, default) in measured.iter().zip(of_default) {
        write!(text, "| {} |", scene.scene)?;
        for (sums, found) in logarithms.iter_mut().zip(errors(scene)) {
            write!(text, " {} / {} |", digits(found[0]), digits(found[1]))?;
            for (sum, (one, other)) in sums.iter_mut().zip(found.iter().zip(default)) {
                *sum += (one / other).ln();
            }
        }
        writeln!(text)?;
    }
    write!(text, "| times the default |")?;
    for sums in logarithms {
        let [all, trimmed] = sums.map(|sum| (sum / measured.len() as f64).exp());
        write!(text, " {all:.2} / {trimmed:.2} |")?;
    }
    writeln!(text)?;
    Ok(())
}

/// Three digits, without an exponent.
fn digits(value: f64) -> String {
    let after = (2.0 - value.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.after$}")
}

fn panels(measured: &[Measured]) -> Vec<Panel> {
    let panel = |title: &str, label, powers, values: Vec<f64>, of: fn(&Measured) -> &[Errors]| {
        let all = measured.iter().enumerate();
        let with_any = all.filter(|(_, scene)| !of(scene).is_empty());
        let lines = with_any.map(|(name, scene)| Line {
            name,
            points: values
                .iter()
                .zip(of(scene))
                .map(|(&value, errors)| [value, errors[1]])
                .collect(),
            // Colours come round after seven.
            is_dashed: name >= 7,
        });
        Panel {
            title: title.to_owned(),
            labels: [label, "relMSE without the worst 1 %"],
            powers,
            lines: lines.collect(),
        }
    };
    let scales = SCALES.map(f64::from).to_vec();
    let truncations = TRUNCATIONS.map(f64::from).to_vec();
    // The last has no limit.
    let limits = ANISOTROPIES.map(|it| f64::from(it.min(100.0))).to_vec();
    vec![
        panel(
            "scale",
            "standard deviation in sample spacings",
            [false, true],
            scales,
            |it| &it.scales,
        ),
        panel(
            "truncation",
            "end in standard deviations",
            [false, true],
            truncations,
            |it| &it.truncations,
        ),
        panel(
            "truncation where photons overlap",
            "end in standard deviations",
            [false, true],
            OVERLAP_TRUNCATIONS.map(f64::from).to_vec(),
            |it| &it.overlap_truncations,
        ),
        panel(
            "anisotropy",
            "limit, 100 for none",
            [true, true],
            limits,
            |it| &it.anisotropies,
        ),
    ]
}
