use caustics_filter::Image;
use caustics_trace::Photon;

use crate::error::RenderError;
use crate::footprint::FootprintOptions;
use crate::gbuffer::GBuffer;
use crate::parallel;
use crate::prepared_splat::{LEVELS, Prepared, Splat};
use crate::screen::Screen;
use crate::splat_level::Level;
use crate::splat_view::PassView;
use crate::surroundings::Surroundings;
use crate::truncated_kernel::Kernels;

/// Photons that are prepared at a time: few enough that what is ready stays in the caches until every
/// band of rows has drawn it.
const BATCH: usize = 1 << 14;

/// The least photons that one task prepares.
const LEAST_PREPARED: usize = 256;

/// What became of the photons that were splatted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SplatStats {
    /// Photons whose footprint overlaps the picture.
    pub splatted: u64,
    /// Photons whose footprint lies outside the picture or behind the camera.
    pub outside: u64,
    /// Photons whose footprint lies behind something else in the picture.
    pub hidden: u64,
    /// Photons on a receiver that shows the camera its other side.
    pub turned_away: u64,
    /// Photons whose footprint is not a finite number.
    pub invalid: u64,
}

/// Radiance of the caustics at every pixel of a G-buffer, in W/(sr m²): each photon spread over
/// its footprint, each footprint blurred by the pixel that sees it.
///
/// The work is done in bands of rows, each in the order of the photons: the result does not depend
/// on the number of threads.
///
/// # Errors
/// If the options are out of range or memory cannot be had.
pub fn splat(
    buffer: &GBuffer,
    photons: &[Photon],
    options: &FootprintOptions,
) -> Result<(Image, SplatStats), RenderError> {
    options.validate()?;
    let view = buffer.splat_view();
    let surroundings = &view.surroundings;
    let mut passes: Vec<Pass<'_>> = view.passes.iter().map(Pass::new).collect();
    let kernels = Kernels::of(options);
    let mut stats = SplatStats::default();
    for batch in photons.chunks(BATCH) {
        let mut prepared = prepare(batch, &buffer.screen, surroundings, options, kernels);
        for fate in &prepared {
            match fate {
                Prepared::Splat(_) => stats.splatted += 1,
                Prepared::Outside => stats.outside += 1,
                Prepared::Hidden => stats.hidden += 1,
                Prepared::TurnedAway => stats.turned_away += 1,
                Prepared::Invalid => stats.invalid += 1,
            }
        }
        prepared.extend(caught(
            batch,
            &buffer.screen,
            surroundings,
            options,
            kernels,
        ));
        for pass in &mut passes {
            pass.accumulate(&prepared, &buffer.screen, surroundings);
        }
    }
    let mut image = Image::new(buffer.width(), buffer.height())?;
    for pass in passes {
        pass.add_to(&mut image);
    }
    Ok((image, stats))
}

/// The light of texels that reflect in one way.
struct Pass<'a> {
    view: &'a PassView,
    /// The finest first.
    levels: Vec<Level<'a>>,
}

impl<'a> Pass<'a> {
    fn new(view: &'a PassView) -> Self {
        let levels = view.levels.iter().map(Level::new).collect();
        Self { view, levels }
    }

    fn accumulate(&mut self, prepared: &[Prepared], screen: &Screen, surroundings: &Surroundings) {
        let coarsest = self.levels.len() as u8 - 1;
        let refined;
        let prepared = if usize::from(coarsest) + 1 < LEVELS {
            refined = prepared
                .iter()
                .map(|one| one.refined(coarsest, screen))
                .collect::<Vec<_>>();
            &refined
        } else {
            prepared
        };
        let levels = self.levels.iter_mut().enumerate().collect();
        parallel::each(levels, |(number, level)| {
            level.accumulate(prepared, screen, surroundings, number);
        });
    }

    fn add_to(mut self, image: &mut Image) {
        let (reflectance, extras) = (&self.view.reflectance, &self.view.extra_reflectance);
        while let Some(coarse) = self.levels.pop() {
            match self.levels.last_mut() {
                Some(fine) => fine.add_coarser(&coarse),
                None => coarse.add_to(reflectance, extras, image),
            }
        }
    }
}

fn prepare(
    photons: &[Photon],
    screen: &Screen,
    surroundings: &Surroundings,
    options: &FootprintOptions,
    kernels: Kernels,
) -> Vec<Prepared> {
    parallel::of_all(photons, LEAST_PREPARED, |photon| {
        Splat::prepare(photon, screen, surroundings, options, kernels)
    })
}

/// What other surfaces catch of photons whose plane is seen edge-on, or from behind.
fn caught(
    photons: &[Photon],
    screen: &Screen,
    surroundings: &Surroundings,
    options: &FootprintOptions,
    kernels: Kernels,
) -> Vec<Prepared> {
    let one = |photon: &Photon| {
        Splat::before_plane(photon, screen, surroundings, options, kernels).map(Prepared::Splat)
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        photons
            .par_iter()
            .with_min_len(LEAST_PREPARED)
            .filter_map(one)
            .collect()
    }
    #[cfg(not(feature = "parallel"))]
    photons.iter().filter_map(one).collect()
}
