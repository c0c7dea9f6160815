use std::time::Instant;

use caustics_accel::BvhOptions;
use caustics_render::{
    CausticSource, Estimate, FootprintOptions, NearestEstimate, NearestOptions, Picture,
    PictureOptions, render,
};
use caustics_scene::{Camera, Scene, SceneIntersector, World};
use caustics_trace::{PhotonMap, TraceOptions, trace_photons};

use crate::error::CausticsError;

/// Everything that can be chosen about photons and how they become radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct CausticsOptions {
    /// How the acceleration structure is built.
    pub bvh: BvhOptions,
    /// How photons are traced.
    pub trace: TraceOptions,
    /// How they become radiance. It decides the points that photons are emitted from and the shape
    /// of their footprints, whatever `trace.sequence` and `footprint.kernel` say.
    pub estimate: Estimate,
    /// The options of [`Estimate::Nearest`].
    pub nearest: NearestOptions,
    /// The options of all other estimates.
    pub footprint: FootprintOptions,
}

impl CausticsOptions {
    /// The defaults, with another estimate.
    #[must_use]
    pub fn for_estimate(estimate: Estimate) -> Self {
        Self {
            bvh: BvhOptions::default(),
            trace: TraceOptions::default(),
            estimate,
            nearest: NearestOptions::default(),
            footprint: FootprintOptions::default(),
        }
        .settled()
    }

    /// With what the estimate decides.
    pub(crate) fn settled(mut self) -> Self {
        self.trace.sequence = self.estimate.sequence();
        if let Some(kernel) = self.estimate.kernel() {
            self.footprint.kernel = kernel;
        }
        self
    }
}

impl Default for CausticsOptions {
    fn default() -> Self {
        Self::for_estimate(Estimate::default())
    }
}

/// A part of the work, as progress reports name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// Flattening the scene and building the acceleration structure.
    Build,
    /// Tracing photons; its unit is a photon.
    Trace,
    /// Rendering a picture; its unit is a row.
    Render,
}

/// Some units of a stage that have just been finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The stage.
    pub stage: Stage,
    /// Units finished since the last report of this stage.
    pub finished: u64,
    /// All units of the stage.
    pub total: u64,
}

/// Wall-clock time of the stages, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Flattening the scene and building the acceleration structure.
    pub build: f64,
    /// Tracing photons.
    pub trace: f64,
}

/// A scene whose photons have been traced: caustics, ready to be seen from any camera.
#[derive(Debug)]
pub struct Caustics {
    world: World,
    intersector: SceneIntersector,
    map: PhotonMap,
    options: CausticsOptions,
    seconds: StageSeconds,
}

impl Caustics {
    /// Flattens `scene`, builds its acceleration structure and traces the photons.
    ///
    /// # Errors
    /// [`CausticsError::NoLight`] without a light; else whatever a stage finds wrong.
    pub fn new(scene: &Scene, options: &CausticsOptions) -> Result<Self, CausticsError> {
        Self::with_progress(scene, options, &|_| {})
    }

    /// Like [`new`](Self::new), reporting progress from any thread.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_progress(
        scene: &Scene,
        options: &CausticsOptions,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Self, CausticsError> {
        let options = options.clone().settled();
        let start = Instant::now();
        let world = World::new(scene)?;
        if !world.is_lit() {
            return Err(CausticsError::NoLight);
        }
        let intersector = world.intersector(&options.bvh)?;
        let build = start.elapsed().as_secs_f64();
        progress(Progress {
            stage: Stage::Build,
            finished: 1,
            total: 1,
        });

        let start = Instant::now();
        let total = u64::from(options.trace.photons);
        let map = trace_photons(&world, &intersector, &options.trace, &|finished| {
            progress(Progress {
                stage: Stage::Trace,
                finished: u64::from(finished),
                total,
            });
        })?;
        let trace = start.elapsed().as_secs_f64();
        let seconds = StageSeconds { build, trace };
        Ok(Self {
            world,
            intersector,
            map,
            options,
            seconds,
        })
    }

    /// The picture that `camera` takes: direct light and caustics apart, as linear radiance.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn render(
        &self,
        camera: &Camera,
        options: &PictureOptions,
    ) -> Result<Picture, CausticsError> {
        self.render_with_progress(camera, options, &|_| {})
    }

    /// Like [`render`](Self::render), reporting progress from any thread.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_with_progress(
        &self,
        camera: &Camera,
        options: &PictureOptions,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Picture, CausticsError> {
        let photons = &self.map.photons;
        let nearest;
        let source = if self.options.estimate == Estimate::Nearest {
            nearest = NearestEstimate::new(photons, &self.options.nearest)?;
            CausticSource::Nearest(&nearest)
        } else {
            CausticSource::Footprints {
                photons,
                options: &self.options.footprint,
            }
        };
        let total = u64::from(options.height);
        Ok(render(
            &self.world,
            &self.intersector,
            camera,
            source,
            options,
            &|rows| {
                progress(Progress {
                    stage: Stage::Render,
                    finished: u64::from(rows),
                    total,
                });
            },
        )?)
    }

    /// The scene in world space.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What rays are shot at.
    #[must_use]
    pub fn intersector(&self) -> &SceneIntersector {
        &self.intersector
    }

    /// The photons, and the ledger of where all the energy went.
    #[must_use]
    pub fn map(&self) -> &PhotonMap {
        &self.map
    }

    /// How long the stages took.
    #[must_use]
    pub fn seconds(&self) -> StageSeconds {
        self.seconds
    }
}
