//! What each way of leaving photons out saves, and what it costs.

use std::fmt::Write as _;

use caustics::accel::Intersect;
use caustics::filter::{Image, relative_errors, trimmed_mean};
use caustics::prelude::*;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::scene::Projection;
use caustics::trace::{Culling, Fate, PhotonMap, SolidAngleLimit, ViewVolume, trace_photons};
use caustics_benches::chart::{self, Line, Panel};
use caustics_benches::stage::{Failure, Stage};
use glam::Vec3;

const PHOTONS: u32 = 1 << 16;

const SCENES: [&str; 3] = ["p03_cognac", "p06_wave_plane", "p10_torus_cube"];

/// Depths at which paths are cut off.
const DEPTHS: [u32; 6] = [2, 3, 4, 6, 8, 12];

/// Least fluxes, in mean fluxes of the photons that are stored.
const FLUXES: [f32; 4] = [0.25, 1.0, 4.0, 16.0];

/// Footprints that are dropped for their width, in parts of all.
const WIDEST: [f64; 4] = [0.01, 0.05, 0.1, 0.25];

/// The part of the worst pixels that is left out: single ones that no estimate finds would decide.
const TRIM: f64 = 0.01;

/// How much narrower the view is made so that photons lie outside.
const ZOOMS: [f32; 3] = [1.0, 2.0, 4.0];

const WAYS: [&str; 5] = [
    "depth",
    "flux (survivors widened)",
    "area of the footprint",
    "solid angle of the footprint",
    "view (its own picture)",
];

struct Case<'a> {
    stage: &'a Stage,
    buffer: GBuffer,
    all: PhotonMap,
    image: Image,
}

/// What was saved and lost, relative to no culling.
struct Outcome {
    rays: f64,
    stored: f64,
    /// Flux that no longer arrives, of what did.
    lost: f64,
    error: f64,
    /// Without culling.
    error_before: f64,
}

impl<'a> Case<'a> {
    fn new(stage: &'a Stage, camera: &Camera) -> Result<Self, Failure> {
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let buffer = GBuffer::new(&stage.world, &stage.intersector, camera, width, height)?;
        let all = traced(stage, Culling::default(), TraceOptions::default().max_depth)?;
        let (image, _) = splat(&buffer, &all.photons, &FootprintOptions::default())?;
        Ok(Self {
            stage,
            buffer,
            all,
            image,
        })
    }

    /// Held against a reference of the same view.
    fn outcome(&self, culling: Culling, depth: u32, reference: &Image) -> Result<Outcome, Failure> {
        let map = traced(self.stage, culling, depth)?;
        let (image, _) = splat(&self.buffer, &map.photons, &FootprintOptions::default())?;
        let flux = |map: &PhotonMap| map.ledger.entry(Fate::Stored).flux.element_sum();
        Ok(Outcome {
            rays: 1.0 - map.ledger.rays as f64 / self.all.ledger.rays as f64,
            stored: 1.0 - map.photons.len() as f64 / self.all.photons.len() as f64,
            lost: 1.0 - flux(&map) / flux(&self.all),
            error: error(&image, reference)?,
            error_before: error(&self.image, reference)?,
        })
    }
}

fn error(image: &Image, reference: &Image) -> Result<f64, Failure> {
    Ok(trimmed_mean(&relative_errors(image, reference)?, TRIM))
}

fn traced(stage: &Stage, culling: Culling, max_depth: u32) -> Result<PhotonMap, Failure> {
    let options = TraceOptions {
        photons: PHOTONS,
        culling,
        max_depth,
        ..TraceOptions::default()
    };
    Ok(trace_photons(
        &stage.world,
        &stage.intersector,
        &options,
        &|_| {},
    )?)
}

/// The value that this part of all exceed.
fn exceeded_by(mut values: Vec<f32>, part: f64) -> f32 {
    values.sort_by(|a, b| b.total_cmp(a));
    values[((values.len() as f64 * part) as usize).min(values.len() - 1)]
}

/// The camera itself, or one in its place with a narrower view of the brightest spot of its picture.
fn towards(case: &Case<'_>, camera: &Camera, zoom: f32) -> Result<Camera, Failure> {
    let Projection::Perspective { yfov } = camera.projection else {
        return Err("the camera sees no pixels".into());
    };
    if zoom == 1.0 {
        return Ok(camera.clone());
    }
    let (width, height) = (case.image.width(), case.image.height());
    let (brightest, _) = (0u32..)
        .zip(case.image.pixels())
        .max_by(|a, b| a.1[0].total_cmp(&b.1[0]))
        .ok_or("a picture has pixels")?;
    let at = [brightest % width, brightest / width].map(|it| it as f32 + 0.5);
    let ray = camera.ray(at[0], at[1], width, height);
    let hit = case.stage.intersector.closest_hit(&ray);
    let target = ray.at(hit.ok_or("light lies on something")?.t);
    let up: Vec3 = camera.transform.matrix3.y_axis.into();
    let narrow = 2.0 * ((0.5 * yfov).tan() / zoom).atan();
    Ok(Camera::look_at(
        "near",
        camera.position(),
        target,
        up,
        narrow,
    )?)
}

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Culling\n\n\
        What each way of leaving photons out saves of {PHOTONS} and costs: rays and stored footprints \
        saved, flux lost, and relMSE to the reference (of all but the worst 1 % of pixels). All is \
        off by default. *Depth* is the most surfaces that a path meets; the least *flux* is in means \
        of the stored photons' own; *area* and *solid angle* are such that they drop the widest 1 to \
        25 % of footprints (solid angles also in pixels); the *view* is the camera's, and narrower \
        ones of its brightest spot, whose references are pictures of {} aimed photons.\n\n\
        Only depth saves rays: the others save memory, uploads and drawing. A view drops nothing that \
        its picture shows. Thinning by flux keeps the light and widens the survivors: for as many footprints saved \
        it costs less than dropping the widest, but they are picked at random, and the gaps \
        between them cost the more the more are thinned. Dropping wide footprints loses their \
        light for good: only the widest few in a hundred are cheap to lose, where they are the \
        faint rest of a caustic as behind the glass, and not where all are alike, as under \
        waves.\n\n\
        ![what culling saves and costs](emission-cull.svg)\n\n\
        | scene | option | limit | rays saved | footprints saved | flux lost | relMSE | without |\n\
        | --- | --- | --: | --: | --: | --: | --: | --: |\n",
        8 * PHOTONS
    );
    let mut panels = Vec::new();
    for name in SCENES {
        let stage = Stage::load(name)?;
        let case = Case::new(&stage, &stage.camera)?;
        let mut rows: Vec<(usize, String, Outcome)> = Vec::new();
        let off = Culling::default();
        let deep = TraceOptions::default().max_depth;
        for depth in DEPTHS {
            rows.push((
                0,
                depth.to_string(),
                case.outcome(off, depth, &stage.reference)?,
            ));
        }
        let fluxes = case.all.photons.iter().map(|it| it.flux.max_element());
        let mean = fluxes.sum::<f32>() / case.all.photons.len() as f32;
        for factor in FLUXES {
            let culling = Culling {
                min_flux: factor * mean,
                ..off
            };
            let limit = format!("{factor} means");
            rows.push((1, limit, case.outcome(culling, deep, &stage.reference)?));
        }
        let area = |it: &Photon| it.axes[0].cross(it.axes[1]).length();
        for part in WIDEST {
            let max_area = exceeded_by(case.all.photons.iter().map(area).collect(), part);
            let culling = Culling { max_area, ..off };
            let limit = format!("{max_area:.2e} m²");
            rows.push((2, limit, case.outcome(culling, deep, &stage.reference)?));
        }
        let height = stage.reference.height();
        let one = SolidAngleLimit::of_pixels(&stage.camera, height, 1.0)
            .ok_or("the camera sees no pixels")?;
        let angle = |it: &Photon| {
            let to_eye = one.eye - it.position;
            it.axes[0].cross(it.axes[1]).dot(to_eye).abs() / to_eye.length().powi(3)
        };
        for part in WIDEST {
            let steradians = exceeded_by(case.all.photons.iter().map(angle).collect(), part);
            let culling = Culling {
                max_solid_angle: Some(SolidAngleLimit { steradians, ..one }),
                ..off
            };
            let limit = format!("{:.1} pixels", steradians / one.steradians);
            rows.push((3, limit, case.outcome(culling, deep, &stage.reference)?));
        }
        let many = TraceOptions {
            photons: 8 * PHOTONS,
            ..TraceOptions::default()
        };
        let many = trace_photons(&stage.world, &stage.intersector, &many, &|_| {})?;
        for zoom in ZOOMS {
            let camera = towards(&case, &stage.camera, zoom)?;
            let near = Case::new(&stage, &camera)?;
            let (truth, _) = splat(&near.buffer, &many.photons, &FootprintOptions::default())?;
            let culling = Culling {
                view: ViewVolume::of(&camera, stage.reference.width(), height),
                ..off
            };
            rows.push((
                4,
                format!("{zoom} times"),
                near.outcome(culling, deep, &truth)?,
            ));
        }
        for (way, limit, outcome) in &rows {
            writeln!(
                text,
                "| {name} | {} | {limit} | {:.1} % | {:.1} % | {:.2} % | {:.5} | {:.5} |",
                WAYS[*way],
                100.0 * outcome.rays,
                100.0 * outcome.stored,
                100.0 * outcome.lost,
                outcome.error,
                outcome.error_before,
            )?;
        }
        let lines = |of: fn(&Outcome) -> f64| -> Vec<Line> {
            (0..WAYS.len())
                .map(|way| {
                    let of_way = rows.iter().filter(|row| row.0 == way);
                    let mut points: Vec<[f64; 2]> = of_way
                        .map(|(_, _, it)| [100.0 * it.stored, of(it)])
                        .collect();
                    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                    Line {
                        name: way,
                        points,
                        is_dashed: false,
                    }
                })
                .collect()
        };
        let panel = |label, lines| Panel {
            title: name.to_owned(),
            labels: ["footprints saved, %", label],
            powers: [false, label != "flux lost, %"],
            lines,
        };
        panels.push(panel(
            "relMSE / relMSE without",
            lines(|it| it.error / it.error_before),
        ));
        panels.push(panel("flux lost, %", lines(|it| 100.0 * it.lost.max(0.0))));
        eprintln!("  {name}");
    }
    chart::write("emission-cull.svg", &WAYS, &panels)?;
    Ok(text)
}
