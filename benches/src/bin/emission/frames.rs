//! What changes from frame to frame, against what should.

use std::fmt::Write as _;
use std::time::Instant;

use caustics::filter::Image;
use caustics::prelude::*;
use caustics::sampling::Sequence;
use caustics::scene::gltf;
use caustics::trace::{LivePhotons, trace_photons};
use caustics_benches::chart::{self, Line, Panel};
use caustics_benches::stage::{Failure, scene_folder};
use glam::{Affine3A, Quat};

use crate::view::{View, difference, mean_absolute};

/// Frames in which the glass turns, and as many in which it stands still again.
const FRAMES: u16 = 60;

/// Photons of a frame.
const PHOTONS: u32 = 1 << 15;

/// Photons of the frames that say what truly changes.
const TRUE_PHOTONS: u32 = 1 << 19;

/// Each how many frames the true change is measured.
const TRUE_STEP: u16 = 6;

/// Degrees that the glass turns in a frame.
const STEP: f32 = 0.25;

const SIZE: u32 = 192;

/// The torus in its cube, turned about the vertical.
struct Turning {
    scene: Scene,
    camera: Camera,
}

impl Turning {
    fn load() -> Result<Self, Failure> {
        let scene = gltf::load_path(scene_folder().join("p10_torus_cube.glb"))?.scene;
        let camera = scene.cameras().first().cloned().ok_or("no camera")?;
        Ok(Self { scene, camera })
    }

    fn at(&self, degrees: f32) -> Result<View, Failure> {
        let world = World::new(&self.scene)?;
        let center = world.specular_bounds().center();
        let turn = Affine3A::from_translation(center)
            * Affine3A::from_quat(Quat::from_rotation_y(degrees.to_radians()))
            * Affine3A::from_translation(-center);
        let mut scene = Scene::new();
        let mut materials = Vec::new();
        for material in self.scene.materials() {
            materials.push(scene.add_material(material.clone())?);
        }
        let mut meshes = Vec::new();
        for mesh in self.scene.meshes() {
            meshes.push(scene.add_mesh(mesh.clone()));
        }
        for instance in self.scene.instances() {
            let mut turned = instance.clone();
            turned.material = materials[instance.material.index()];
            if let Shape::Mesh(mesh) = instance.shape {
                turned.shape = Shape::Mesh(meshes[mesh.index()]);
            }
            let surface = &self.scene.materials()[instance.material.index()].surface;
            if surface.is_specular() {
                turned.transform = turn * instance.transform;
            }
            scene.add_instance(turned)?;
        }
        for light in self.scene.lights() {
            scene.add_light(*light)?;
        }
        View::new(&scene, &self.camera, SIZE)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Method {
    /// A sequence from the same seed in every frame, with a plan made anew.
    Fixed(Sequence),
    /// From another seed in each.
    Fresh(Sequence),
    /// Photons that are kept, of which this part is traced anew.
    Live(f32),
}

const METHODS: [(&str, Method); 6] = [
    ("Halton, fixed", Method::Fixed(Sequence::Halton)),
    ("Halton, fresh each frame", Method::Fresh(Sequence::Halton)),
    (
        "lattice, planned anew each frame",
        Method::Fixed(Sequence::Grid),
    ),
    ("lattice, plan follows", Method::Live(1.0)),
    ("lattice, 25 % a frame", Method::Live(0.25)),
    ("lattice, 10 % a frame", Method::Live(0.1)),
];

/// The pictures of a method in all frames, and the seconds of a turning frame's photons.
fn pictures(method: Method, views: &[&View]) -> Result<(Vec<Image>, f64), Failure> {
    let mut live: Option<LivePhotons> = None;
    let mut images = Vec::new();
    let mut seconds = 0.0;
    for (frame, view) in (0u64..).zip(views) {
        let start = Instant::now();
        let mut options = TraceOptions {
            photons: PHOTONS,
            ..TraceOptions::default()
        };
        let photons = match method {
            Method::Fixed(sequence) | Method::Fresh(sequence) => {
                options.sequence = sequence;
                if matches!(method, Method::Fresh(_)) {
                    options.seed = frame + 1;
                }
                trace_photons(&view.world, &view.rays, &options, &|_| {})?.photons
            }
            Method::Live(fraction) => {
                match &mut live {
                    None => live = Some(LivePhotons::new(&view.world, &view.rays, &options)?),
                    Some(live) => {
                        live.refresh(&view.world, &view.rays, fraction)?;
                    }
                }
                live.as_ref()
                    .map_or_else(Vec::new, |live| live.map().photons)
            }
        };
        if (1..u64::from(FRAMES)).contains(&frame) {
            seconds += start.elapsed().as_secs_f64();
        }
        images.push(view.caustics(&photons)?);
    }
    Ok((images, seconds / f64::from(FRAMES - 1)))
}

/// Pictures of many photons at some frames, and at those after them.
struct Truth {
    pairs: Vec<(usize, Image, Image)>,
    /// The mean of a picture.
    mean: f64,
    /// The mean change of a frame.
    change: f64,
}

impl Truth {
    fn of(views: &[View]) -> Result<Self, Failure> {
        let exact = |view: &View| -> Result<Image, Failure> {
            let options = TraceOptions {
                photons: TRUE_PHOTONS,
                ..TraceOptions::default()
            };
            let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
            view.caustics(&map.photons)
        };
        let mut pairs = Vec::new();
        for frame in (TRUE_STEP..FRAMES - 1).step_by(usize::from(TRUE_STEP)) {
            let frame = usize::from(frame);
            pairs.push((frame, exact(&views[frame])?, exact(&views[frame + 1])?));
        }
        let mean = mean_absolute(pairs[0].1.pixels().iter().copied());
        let changes = pairs
            .iter()
            .map(|(_, now, next)| mean_absolute(difference(next, now)));
        let change = changes.sum::<f64>() / pairs.len() as f64;
        Ok(Self {
            pairs,
            mean,
            change,
        })
    }

    /// By how much a method's changes are off the true ones, and its frames off the true frames.
    fn held_against(&self, images: &[Image]) -> (f64, f64) {
        let (mut excess, mut error) = (0.0, 0.0);
        for (frame, now, next) in &self.pairs {
            let found = difference(&images[frame + 1], &images[*frame]);
            let off = found
                .zip(difference(next, now))
                .map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel]));
            excess += mean_absolute(off) / self.pairs.len() as f64;
            error += mean_absolute(difference(&images[*frame], now)) / self.pairs.len() as f64;
        }
        (excess / self.mean, error / self.mean)
    }
}

/// Zero without decimals only where it is zero to the bit.
fn or_zero(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.4}")
    }
}

pub(crate) fn section() -> Result<String, Failure> {
    let turning = Turning::load()?;
    let mut text = format!(
        "## From frame to frame\n\n\
        {FRAMES} frames of the torus in its glass cube, which turns by {STEP} degrees a frame, and \
        {FRAMES} more in which it stands still; {PHOTONS} photons and {SIZE} by {SIZE} pixels \
        each.\n\n\
        ![change from frame to frame](emission-frames.svg)\n\n\
        *Change* is the mean absolute difference of a frame to the one before, *too much* that of \
        this difference to the one between pictures of {TRUE_PHOTONS} photons (each {TRUE_STEP}th \
        frame), *error* the mean absolute difference of a frame to such a picture: all relative to \
        the mean of the picture. *Still* is the change once the glass stands still, and after how \
        many frames it is zero to the bit, for every pixel. Milliseconds are those of a turning \
        frame's photons. Where only a part of the photons is traced anew, those of several frames \
        lie between each other: the picture lags behind, and the lattice is no longer regular where \
        it moves by more than its spacing.\n\n\
        | photons | change, turning | too much | error | still | zero after | ms |\n\
        | --- | --: | --: | --: | --: | --: | --: |\n"
    );
    let views: Vec<View> = (0..FRAMES)
        .map(|frame| turning.at(STEP * f32::from(frame)))
        .collect::<Result<_, _>>()?;
    let last = usize::from(FRAMES) - 1;
    let all: Vec<&View> = (0..2 * usize::from(FRAMES))
        .map(|frame| &views[frame.min(last)])
        .collect();
    let truth = Truth::of(&views)?;
    writeln!(
        text,
        "| truth | {:.4} | | | 0 | 0 | |",
        truth.change / truth.mean
    )?;
    let mut names = Vec::new();
    let mut lines = Vec::new();
    for (name, method) in METHODS {
        let (images, seconds) = pictures(method, &all)?;
        let changes: Vec<f64> = images
            .windows(2)
            .map(|pair| mean_absolute(difference(&pair[1], &pair[0])) / truth.mean)
            .collect();
        let (turning, still) = changes.split_at(last);
        let change = turning.iter().sum::<f64>() / turning.len() as f64;
        let stirring = still
            .iter()
            .rposition(|it| *it != 0.0)
            .map_or(0, |it| it + 1);
        let after = if stirring == still.len() {
            "never".to_owned()
        } else {
            stirring.to_string()
        };
        let (excess, error) = truth.held_against(&images);
        writeln!(
            text,
            "| {name} | {change:.4} | {excess:.4} | {error:.4} | {} | {after} | {:.0} |",
            or_zero(still[still.len() - 1]),
            1e3 * seconds
        )?;
        let points = (1u16..).zip(&changes).map(|(at, it)| [f64::from(at), *it]);
        lines.push(Line {
            name: names.len(),
            points: points.collect(),
            is_dashed: false,
        });
        names.push(name);
        eprintln!("  {name}");
    }
    let change = truth.change / truth.mean;
    lines.push(Line {
        name: names.len(),
        points: vec![[1.0, change], [last as f64, change]],
        is_dashed: true,
    });
    names.push("true change, turning");
    let panel = |title: &str, range: std::ops::Range<f64>| Panel {
        title: title.to_owned(),
        labels: ["frame", "mean absolute change / mean"],
        powers: [false; 2],
        lines: lines
            .iter()
            .map(|line| Line {
                points: line
                    .points
                    .iter()
                    .copied()
                    .filter(|it| range.contains(&it[0]))
                    .collect(),
                ..*line
            })
            .collect(),
    };
    let whole = 0.0..f64::from(2 * FRAMES);
    let panels = [
        panel("turning, then still from frame 60 on", whole),
        panel("where it comes to rest", 52.0..76.0),
    ];
    chart::write("emission-frames.svg", &names, &panels)?;
    Ok(text)
}
