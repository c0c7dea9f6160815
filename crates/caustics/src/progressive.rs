use std::time::{Duration, Instant};

use caustics_filter::Image;
use caustics_render::{
    CausticSource, Estimate, GBuffer, NearestEstimate, NearestOptions, Picture, PictureOptions,
    Visibility, render, splat,
};
use caustics_scene::{Camera, Scene, SceneIntersector, World};
use caustics_trace::{EmissionPlan, Photon, PhotonStream, TraceOptions};

use crate::caustics::CausticsOptions;
use crate::error::CausticsError;

/// Photons of the first pass: a picture after some milliseconds.
const FIRST_PASS: u32 = 4096;

/// How many times as many photons each pass has as the one before.
const GROWTH: u32 = 2;

/// Photons that are traced between two looks at the clock.
const SLICE: u32 = 8192;

/// Photons that are drawn at a time: as cheaply as all at once, and soon enough for a frame.
const DRAWN: usize = 32_768;

/// The part of new photons that the nearest ones grow by: alpha of Knaus and Zwicker, gamma of
/// Hachisuka and Jensen (*Stochastic Progressive Photon Mapping*, SIGGRAPH Asia 2009), who take 2/3.
const GAMMA: f64 = 2.0 / 3.0;

/// How long a [`Progressive`] works before it returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantum {
    /// Until so many photons have been traced.
    Photons(u32),
    /// Until so much time has gone by; at least one slice of 8192 photons is traced. What a slice
    /// takes is what it may be exceeded by.
    Time(Duration),
}

/// Caustics that become better for as long as they are given time.
///
/// Photons are traced in passes, each a whole lattice with twice as many points as the one before,
/// so that its footprints are smaller: the error falls as it does for single pictures of ever more
/// photons. What is shown is the last whole pass, which has at least a third of all photons traced.
/// Photons of a pass are kept as long as they are no more than `max_photons`; of larger passes only
/// the picture is, so that memory stays bounded however long it runs.
///
/// Photons come in slices; the last rows of each slice wait for the next, so that footprints are
/// checked against all their neighbours ([`TraceOptions::check_footprints`]) and a whole pass is what
/// [`Caustics`](crate::Caustics) shows for as many photons.
///
/// Footprints are drawn as they come, so that no quantum has more than some ten thousand to draw;
/// nearest photons are looked up when a pass is whole, for the whole picture at once.
///
/// With [`Estimate::Nearest`] the number of nearest photons grows as the total to the power of 2/3,
/// so that the radius shrinks while more photons are in it, as in stochastic progressive photon
/// mapping; passes end at `max_photons` and their pictures are averaged from there on.
///
/// ```
/// use caustics::{CausticsOptions, Progressive, Quantum};
/// use caustics::prelude::*;
/// use caustics::scene::builtin;
///
/// let scene = builtin::cognac_glass();
/// let size = PictureOptions { width: 32, height: 24, samples: 1, ..PictureOptions::default() };
/// let mut progressive = Progressive::new(&scene, &CausticsOptions::default(), 100_000)?;
/// progressive.look(&scene.cameras()[0], &size)?;
/// progressive.advance(Quantum::Photons(20_000))?;
/// assert_eq!(progressive.shown_photons(), 8192);
/// let picture = progressive.caustics()?;
/// assert!(picture.pixels().iter().any(|pixel| pixel[0] > 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Progressive {
    options: CausticsOptions,
    max_photons: u32,
    world: World,
    intersector: SceneIntersector,
    view: Option<View>,
    /// The last whole pass that fits in `max_photons`.
    kept: Vec<Photon>,
    /// Photons emitted for it.
    kept_emitted: u32,
    pass: Pass,
    traced: u64,
}

/// A pass on its way.
#[derive(Debug)]
struct Pass {
    plan: EmissionPlan,
    options: TraceOptions,
    /// Photons traced of it.
    done: u32,
    stream: PhotonStream,
    /// All of them so far or, where they are not kept, those that are still to be drawn.
    photons: Vec<Photon>,
    /// How many of these have been drawn.
    drawn: usize,
    /// Which pass it is of those that are as large as passes can be: 0 while they grow.
    repeat: u32,
}

/// What the camera sees.
#[derive(Debug)]
struct View {
    camera: Camera,
    options: PictureOptions,
    buffer: GBuffer,
    /// The last whole pass, or for nearest photons the mean of several.
    shown: Image,
    shown_emitted: u32,
    /// Passes in that mean.
    repeats: u32,
    /// Of the pass on its way, as far as it is drawn.
    growing: Option<Image>,
}

impl Progressive {
    /// Prepares a scene. Of passes with more than `max_photons` photons only pictures are kept.
    ///
    /// `options` are those of [`Caustics`](crate::Caustics), but for the number of photons, which
    /// grows.
    ///
    /// # Errors
    /// [`CausticsError::NoLight`] without a light; else whatever a stage finds wrong.
    pub fn new(
        scene: &Scene,
        options: &CausticsOptions,
        max_photons: u32,
    ) -> Result<Self, CausticsError> {
        let options = options.clone().settled();
        let max_photons = max_photons.max(FIRST_PASS);
        let (world, intersector) = flattened(scene, &options)?;
        let pass = Pass::first(&world, &intersector, &options)?;
        Ok(Self {
            options,
            max_photons,
            world,
            intersector,
            view: None,
            kept: Vec::new(),
            kept_emitted: 0,
            pass,
            traced: 0,
        })
    }

    /// Begins anew with a changed scene. The next quantum shows it.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn set_scene(&mut self, scene: &Scene) -> Result<(), CausticsError> {
        (self.world, self.intersector) = flattened(scene, &self.options)?;
        self.pass = Pass::first(&self.world, &self.intersector, &self.options)?;
        self.kept = Vec::new();
        self.kept_emitted = 0;
        self.traced = 0;
        if let Some(view) = self.view.take() {
            self.look(&view.camera, &view.options)?;
        }
        Ok(())
    }

    /// Looks from another camera. The photons stay: what they show is seen at once.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn look(&mut self, camera: &Camera, options: &PictureOptions) -> Result<(), CausticsError> {
        options.validate()?;
        let (width, height) = (options.width, options.height);
        let buffer = GBuffer::new(&self.world, &self.intersector, camera, width, height)?;
        let blank = Image::new(width, height).map_err(caustics_render::RenderError::from)?;
        let mut view = View {
            camera: camera.clone(),
            options: PictureOptions { ..*options },
            buffer,
            shown: blank,
            shown_emitted: self.kept_emitted,
            repeats: 0,
            growing: None,
        };
        if self.kept_emitted > 0 {
            view.shown = self.drawn(&view, &self.kept, self.kept_emitted, 1)?;
        }
        self.pass.drawn = 0;
        // A pass whose photons are gone begins again.
        if self.pass.options.photons > self.max_photons {
            self.pass.done = 0;
            self.pass.stream = PhotonStream::default();
            self.pass.photons = Vec::new();
        }
        self.view = Some(view);
        Ok(())
    }

    /// Traces for a quantum; returns how many photons that were.
    ///
    /// # Errors
    /// Whatever a stage finds wrong.
    pub fn advance(&mut self, quantum: Quantum) -> Result<u32, CausticsError> {
        let start = Instant::now();
        let mut traced = 0u32;
        loop {
            let slice = match quantum {
                Quantum::Photons(photons) if traced >= photons => break,
                Quantum::Time(time) if traced > 0 && start.elapsed() >= time => break,
                Quantum::Photons(photons) => SLICE.min(photons - traced),
                Quantum::Time(_) => SLICE,
            };
            let done = self.trace_slice(slice)?;
            if done == 0 {
                // Nothing can be aimed at.
                break;
            }
            traced = traced.saturating_add(done);
        }
        self.traced += u64::from(traced);
        Ok(traced)
    }

    /// The caustics as far as they are known: radiance in W/(sr m²), black before the first pass
    /// is whole or without a camera to [`look`](Self::look) from.
    ///
    /// Footprints show what the camera sees directly; for what it sees through glass and in mirrors
    /// render [`photons`](Self::photons).
    ///
    /// # Errors
    /// If the picture cannot be made.
    pub fn caustics(&self) -> Result<Image, CausticsError> {
        Ok(match &self.view {
            Some(view) => view.shown.clone(),
            None => Image::new(1, 1).map_err(caustics_render::RenderError::from)?,
        })
    }

    /// Emissive surfaces and direct light alone, which do not change as photons come in.
    ///
    /// # Errors
    /// If the picture cannot be made.
    pub fn direct(&self) -> Result<Option<Picture>, CausticsError> {
        let Some(view) = &self.view else {
            return Ok(None);
        };
        Ok(Some(render(
            &self.world,
            &self.intersector,
            &view.camera,
            CausticSource::Dark,
            &view.options,
            &|_| {},
        )?))
    }

    /// The photons of the last whole pass that is not too large to keep.
    #[must_use]
    pub fn photons(&self) -> &[Photon] {
        &self.kept
    }

    /// Photons that were emitted for what is shown.
    #[must_use]
    pub fn shown_photons(&self) -> u32 {
        self.view
            .as_ref()
            .map_or(self.kept_emitted, |view| view.shown_emitted)
    }

    /// Photons traced since the scene changed last.
    #[must_use]
    pub fn traced_photons(&self) -> u64 {
        self.traced
    }

    /// Photons in memory, those of the pass on its way included: at most twice `max_photons`
    /// times the photons that land for each that is emitted, and some ten thousand that wait to be
    /// checked or drawn.
    #[must_use]
    pub fn photons_in_memory(&self) -> usize {
        self.kept.len() + self.pass.photons.len() + self.pass.stream.waiting()
    }

    fn trace_slice(&mut self, slice: u32) -> Result<u32, CausticsError> {
        let total = self.pass.plan.count();
        let traced = slice.min(total - self.pass.done);
        let part = self.pass.stream.advance(
            &self.world,
            &self.intersector,
            &self.pass.plan,
            &self.pass.options,
            traced,
        )?;
        self.pass.done += traced;
        self.pass.photons.extend(part.photons);
        // A slice brings less than that; twice as many soon catch up with a new camera.
        self.draw(2 * DRAWN, DRAWN)?;
        if self.pass.done >= total {
            self.finish()?;
        }
        Ok(traced)
    }

    /// Draws at most so many of the photons of the pass on its way, if there are at least so many to
    /// draw.
    fn draw(&mut self, most: usize, least: usize) -> Result<(), CausticsError> {
        let pass = &mut self.pass;
        if self.options.estimate != Estimate::Nearest
            && let Some(view) = &mut self.view
        {
            let end = pass.photons.len().min(pass.drawn.saturating_add(most));
            while end - pass.drawn >= least.max(1) {
                let batch = pass.drawn..end.min(pass.drawn + DRAWN);
                pass.drawn = batch.end;
                let photons = &pass.photons[batch];
                let (image, _) = splat(&view.buffer, photons, &self.options.footprint)?;
                match &mut view.growing {
                    Some(sum) => add(sum, &image, 1.0),
                    growing => *growing = Some(image),
                }
            }
        } else {
            pass.drawn = pass.photons.len();
        }
        if pass.options.photons > self.max_photons {
            pass.photons.drain(..pass.drawn);
            pass.drawn = 0;
        }
        Ok(())
    }

    /// Shows the pass that is whole now, and begins the next.
    fn finish(&mut self) -> Result<(), CausticsError> {
        self.draw(usize::MAX, 1)?;
        let photons = self.pass.options.photons;
        if photons <= self.max_photons {
            self.kept = std::mem::take(&mut self.pass.photons);
            self.kept_emitted = photons;
        }
        if let Some(mut view) = self.view.take() {
            let image = match (self.options.estimate, view.growing.take()) {
                (Estimate::Nearest, _) => {
                    let passes = self.pass.repeat + 1;
                    self.drawn(&view, &self.kept, photons, passes)?
                }
                (_, Some(image)) => image,
                // Nothing landed.
                (_, None) => Image::new(view.options.width, view.options.height)
                    .map_err(caustics_render::RenderError::from)?,
            };
            if self.pass.repeat == 0 {
                view.shown = image;
                view.repeats = 1;
            } else {
                // The mean of this and those before.
                view.repeats += 1;
                let part = 1.0 / view.repeats as f32;
                for pixel in view.shown.pixels_mut() {
                    *pixel = pixel.map(|it| (1.0 - part) * it);
                }
                add(&mut view.shown, &image, part);
            }
            view.shown_emitted = photons.saturating_mul(view.repeats);
            self.view = Some(view);
        }
        self.pass = self.next_pass()?;
        Ok(())
    }

    fn next_pass(&self) -> Result<Pass, CausticsError> {
        let mut options = self.pass.options;
        let mut repeat = self.pass.repeat;
        let larger = options.photons.checked_mul(GROWTH);
        let ends_growing = self.options.estimate == Estimate::Nearest;
        match larger {
            Some(larger) if larger <= self.max_photons || !ends_growing => options.photons = larger,
            _ => {
                repeat += 1;
                options.seed = options.seed.wrapping_add(1);
            }
        }
        Pass::new(&self.world, &self.intersector, options, repeat)
    }

    /// The picture that photons make. `passes` as large as this one have been traced so far.
    fn drawn(
        &self,
        view: &View,
        photons: &[Photon],
        emitted: u32,
        passes: u32,
    ) -> Result<Image, CausticsError> {
        if self.options.estimate != Estimate::Nearest {
            return Ok(splat(&view.buffer, photons, &self.options.footprint)?.0);
        }
        let growth = f64::from(emitted) / f64::from(FIRST_PASS);
        // As many more as their number to the power of gamma; then the radius of each pass shrinks
        // as if all were together.
        let scale = growth.powf(GAMMA) * f64::from(passes).powf(GAMMA - 1.0);
        let count = (self.options.nearest.count as f64 * scale).round().max(1.0) as usize;
        let nearest = NearestOptions {
            count,
            ..self.options.nearest
        };
        let estimate = NearestEstimate::new(photons, &nearest)?;
        let options = PictureOptions {
            visibility: Visibility::Direct,
            ..view.options
        };
        let source = CausticSource::Nearest(&estimate);
        let picture = render(
            &self.world,
            &self.intersector,
            &view.camera,
            source,
            &options,
            &|_| {},
        )?;
        Ok(picture.caustics)
    }
}

impl Pass {
    fn first(
        world: &World,
        intersector: &SceneIntersector,
        options: &CausticsOptions,
    ) -> Result<Self, CausticsError> {
        let options = TraceOptions {
            photons: FIRST_PASS,
            ..options.trace
        };
        Self::new(world, intersector, options, 0)
    }

    fn new(
        world: &World,
        intersector: &SceneIntersector,
        options: TraceOptions,
        repeat: u32,
    ) -> Result<Self, CausticsError> {
        Ok(Self {
            plan: EmissionPlan::new(world, intersector, &options)?,
            options,
            done: 0,
            stream: PhotonStream::default(),
            photons: Vec::new(),
            drawn: 0,
            repeat,
        })
    }
}

fn flattened(
    scene: &Scene,
    options: &CausticsOptions,
) -> Result<(World, SceneIntersector), CausticsError> {
    let world = World::new(scene)?;
    if !world.is_lit() {
        return Err(CausticsError::NoLight);
    }
    let intersector = world.intersector(&options.bvh)?;
    Ok((world, intersector))
}

/// Adds a picture of the same size, times a factor.
fn add(sum: &mut Image, image: &Image, factor: f32) {
    for (pixel, more) in sum.pixels_mut().iter_mut().zip(image.pixels()) {
        *pixel = std::array::from_fn(|channel| pixel[channel] + factor * more[channel]);
    }
}
