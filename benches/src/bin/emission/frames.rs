//! What changes from frame to frame, against what should.

use std::fmt::Write as _;
use std::time::Instant;

use caustics::filter::Image;
use caustics::prelude::*;
use caustics::sampling::Sequence;
use caustics::scene::gltf;
use caustics::trace::{LivePhotons, trace_photons};
use caustics_benches::stage::{Failure, scene_folder};
use glam::{Affine3A, Quat};

use crate::view::{View, difference, mean_absolute};

const FRAMES: u16 = 60;

/// Photons of a frame.
const PHOTONS: u32 = 1 << 16;

/// Photons of the frames that say what truly changes.
const TRUE_PHOTONS: u32 = 1 << 19;

/// Each how many frames the true change is measured.
const TRUE_STEP: u16 = 6;

/// Degrees that the glass turns in a frame.
const STEP: f32 = 0.25;

const SIZE: u32 = 256;

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

/// The pictures of a method in all frames, and the seconds of a frame's photons.
fn pictures(method: Method, views: &[View]) -> Result<(Vec<Image>, f64), Failure> {
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
        if frame > 0 {
            seconds += start.elapsed().as_secs_f64();
        }
        images.push(view.caustics(&photons)?);
    }
    Ok((images, seconds / (views.len() - 1) as f64))
}

pub(crate) fn section() -> Result<String, Failure> {
    let turning = Turning::load()?;
    let mut text = format!(
        "## From frame to frame\n\n\
        {FRAMES} frames of the torus in its glass cube, {PHOTONS} photons and {SIZE} by {SIZE} \
        pixels each; the glass turns by {STEP} degrees a frame, or stands still. *Change* is the \
        mean absolute difference of a frame to the one before, *too much* that of this difference \
        to the one between pictures of {TRUE_PHOTONS} photons (each {TRUE_STEP}th frame), *error* \
        the mean absolute difference of a frame to such a picture: all relative to the mean of the \
        picture. Milliseconds are those of a frame's photons.\n\n"
    );
    let views: Vec<View> = (0..FRAMES)
        .map(|frame| turning.at(STEP * f32::from(frame)))
        .collect::<Result<_, _>>()?;
    let still: Vec<View> = (0..FRAMES)
        .map(|_| turning.at(0.0))
        .collect::<Result<_, _>>()?;
    // Truth at some frames, and at those after them.
    let mut truths: Vec<(usize, Image, Image)> = Vec::new();
    let exact = |view: &View| -> Result<Image, Failure> {
        let options = TraceOptions {
            photons: TRUE_PHOTONS,
            ..TraceOptions::default()
        };
        let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
        view.caustics(&map.photons)
    };
    for frame in (TRUE_STEP..FRAMES - 1).step_by(usize::from(TRUE_STEP)) {
        let frame = usize::from(frame);
        truths.push((frame, exact(&views[frame])?, exact(&views[frame + 1])?));
    }
    let mean = mean_absolute(truths[0].1.pixels().iter().copied());
    let true_change = truths
        .iter()
        .map(|(_, now, next)| mean_absolute(difference(next, now)))
        .sum::<f64>()
        / truths.len() as f64;
    writeln!(
        text,
        "| photons | change, turning | too much | error | change, still | largest of a pixel, still | ms |\n\
        | --- | --: | --: | --: | --: | --: | --: |\n\
        | truth | {:.4} | | | 0 | 0 | |",
        true_change / mean
    )?;
    for (name, method) in METHODS {
        let (images, seconds) = pictures(method, &views)?;
        let pairs = images.len() - 1;
        let change = images
            .windows(2)
            .map(|pair| mean_absolute(difference(&pair[1], &pair[0])))
            .sum::<f64>()
            / pairs as f64;
        let (mut excess, mut error) = (0.0, 0.0);
        for (frame, now, next) in &truths {
            let found = difference(&images[frame + 1], &images[*frame]);
            let off = found
                .zip(difference(next, now))
                .map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel]));
            excess += mean_absolute(off) / truths.len() as f64;
            error += mean_absolute(difference(&images[*frame], now)) / truths.len() as f64;
        }
        let (images, _) = pictures(method, &still)?;
        let stirred = images
            .windows(2)
            .map(|pair| mean_absolute(difference(&pair[1], &pair[0])))
            .sum::<f64>()
            / pairs as f64;
        let largest = images
            .windows(2)
            .flat_map(|pair| difference(&pair[1], &pair[0]).flatten().collect::<Vec<_>>())
            .map(f32::abs)
            .fold(0.0, f32::max);
        let or_zero = |value: f64| {
            if value == 0.0 {
                "0".to_owned()
            } else {
                format!("{value:.4}")
            }
        };
        writeln!(
            text,
            "| {name} | {:.4} | {:.4} | {:.4} | {} | {} | {:.0} |",
            change / mean,
            excess / mean,
            error / mean,
            or_zero(stirred / mean),
            or_zero(f64::from(largest) / mean),
            1e3 * seconds
        )?;
        eprintln!("  {name}");
    }
    Ok(text)
}
