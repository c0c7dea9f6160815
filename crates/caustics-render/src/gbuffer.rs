use std::sync::{Arc, OnceLock};

use caustics_accel::Intersect;
use caustics_geometry::Ray;
use caustics_scene::{Brdf, Camera, Material, World};
use glam::Vec3;

use crate::error::RenderError;
use crate::parallel;
use crate::picture::PictureOptions;
use crate::pixel_samples::PixelSamples;
use crate::screen::Screen;
use crate::splat_view::SplatView;

/// The least cosine between the normals of two samples of one smooth surface.
pub(crate) const SMOOTH_COSINE: f32 = 0.98;

/// A receiver, or the part of one, that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// A point of it, in metres.
    pub position: Vec3,
    /// Unit geometric normal on the side that is seen.
    pub normal: Vec3,
    /// Unit interpolated normal on the same side.
    pub shading_normal: Vec3,
    /// The part of the pixel that it fills.
    pub coverage: f32,
    /// Where in the pixel that is.
    pub(crate) samples: PixelSamples,
    /// Index among the world's materials.
    pub material: u32,
    /// Index among the world's objects.
    pub object: u32,
}

/// The receivers that a camera sees without a glass or a mirror between: what footprints are
/// splatted to.
///
/// A pixel inside a surface has one texel. A pixel that an edge goes through has one for each
/// surface in it, weighted by how much of the pixel it fills, so that a caustic is as
/// smooth along an edge as a picture with many samples a pixel.
///
/// The first splat into a buffer makes what those that follow find there: levels of resolution and
/// tiles, some 70 bytes a pixel, and several times as much where some receivers are glossy. A clone
/// shares what was made before it.
#[derive(Clone, Debug)]
pub struct GBuffer {
    pub(crate) screen: Screen,
    /// The largest part of each pixel, row by row.
    pub(crate) texels: Arc<Vec<Option<Texel>>>,
    /// The further parts, ordered by pixel.
    pub(crate) extras: Arc<Vec<(u32, Texel)>>,
    /// How the world's materials reflect; those that are not specular.
    brdfs: Vec<Option<Brdf>>,
    rays: u64,
    /// What the first splat makes of all this for itself and those that follow.
    view: OnceLock<Arc<SplatView>>,
}

impl GBuffer {
    /// Looks at the world through a camera.
    ///
    /// # Errors
    /// If the size is out of range.
    pub fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        camera: &Camera,
        width: u32,
        height: u32,
    ) -> Result<Self, RenderError> {
        PictureOptions {
            width,
            height,
            ..PictureOptions::default()
        }
        .validate()?;
        let looker = Looker {
            world,
            intersect,
            camera,
            width,
            height,
        };
        let rows = parallel::made(height, 1, |y| looker.row(y));
        let centers: Vec<Option<Texel>> = rows.into_iter().flatten().collect();
        let refined = parallel::made(height, 1, |y| looker.refine_row(y, &centers));

        let (mut texels, mut extras) = (centers.clone(), Vec::new());
        let mut rays = centers.len() as u64;
        for (pixel, parts) in refined.into_iter().flatten() {
            rays += PixelSamples::COUNT as u64;
            let mut parts = parts.into_iter();
            texels[pixel as usize] = parts.next();
            extras.extend(parts.map(|part| (pixel, part)));
        }
        let brdf = |material: &Material| material.surface.brdf();
        Ok(Self {
            screen: Screen::new(camera, width, height),
            texels: Arc::new(texels),
            extras: Arc::new(extras),
            brdfs: world.materials().iter().map(brdf).collect(),
            rays,
            view: OnceLock::new(),
        })
    }

    /// What splats ask of this buffer, made when the first one asks.
    pub(crate) fn splat_view(&self) -> &SplatView {
        if let Some(view) = self.view.get() {
            return view;
        }
        // Not within `get_or_init`: a thread that waits there for parts of it may take up another splat
        // into this buffer, and would wait for itself. At worst it is made twice.
        let view = Arc::new(SplatView::of(self));
        self.view.get_or_init(|| view)
    }

    /// How a texel of this buffer reflects.
    pub(crate) fn brdf(&self, texel: &Texel) -> Brdf {
        let brdf = self.brdfs.get(texel.material as usize).copied().flatten();
        brdf.unwrap_or(Brdf::lambertian(Vec3::ZERO))
    }

    /// Whether some texel is not Lambertian.
    pub(crate) fn is_glossy(&self) -> bool {
        let is_glossy = |brdf: &Option<Brdf>| brdf.is_some_and(|brdf| !brdf.is_lambertian());
        self.brdfs.iter().any(is_glossy)
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.screen.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.screen.height
    }

    /// Rays that it took.
    #[must_use]
    pub fn rays(&self) -> u64 {
        self.rays
    }
}

struct Looker<'a, I: ?Sized> {
    world: &'a World,
    intersect: &'a I,
    camera: &'a Camera,
    width: u32,
    height: u32,
}

impl<I: Intersect + ?Sized> Looker<'_, I> {
    fn row(&self, y: u32) -> Vec<Option<Texel>> {
        (0..self.width)
            .map(|x| self.look(x as f32 + 0.5, y as f32 + 0.5))
            .collect()
    }

    fn look(&self, x: f32, y: f32) -> Option<Texel> {
        let ray: Ray = self.camera.ray(x, y, self.width, self.height);
        let hit = self.intersect.closest_hit(&ray)?;
        let point = self.world.surface(&ray, &hit)?;
        let material = &self.world.materials()[point.material as usize];
        if material.surface.is_specular() {
            return None;
        }
        let side = if point.from_outside { 1.0 } else { -1.0 };
        let texel = Texel {
            position: point.spawn.position,
            normal: side * point.geometric_normal,
            shading_normal: side * point.shading_normal,
            coverage: 1.0,
            samples: PixelSamples::ALL,
            material: point.material,
            object: point.object,
        };
        Some(texel)
    }

    /// The parts of each pixel of a row that holds an edge, the largest first.
    fn refine_row(&self, y: u32, centers: &[Option<Texel>]) -> Vec<(u32, Vec<Texel>)> {
        let at = |x: u32, y: u32| &centers[(y * self.width + x) as usize];
        (0..self.width)
            .filter(|&x| {
                let center = at(x, y);
                let differs = |other: &Option<Texel>| !is_smooth(center, other);
                (x > 0 && differs(at(x - 1, y)))
                    || (x + 1 < self.width && differs(at(x + 1, y)))
                    || (y > 0 && differs(at(x, y - 1)))
                    || (y + 1 < self.height && differs(at(x, y + 1)))
            })
            .map(|x| (y * self.width + x, self.parts(x, y)))
            .collect()
    }

    fn parts(&self, x: u32, y: u32) -> Vec<Texel> {
        let mut parts: Vec<Texel> = Vec::new();
        for sample in 0..PixelSamples::COUNT {
            let place = PixelSamples::place(sample);
            let Some(mut seen) = self.look(x as f32 + place.x, y as f32 + place.y) else {
                continue;
            };
            match parts.iter_mut().find(|part| part.is_like(&seen)) {
                Some(part) => {
                    part.position += seen.position;
                    part.samples.insert(sample);
                }
                None => {
                    seen.samples = PixelSamples::default();
                    seen.samples.insert(sample);
                    parts.push(seen);
                }
            }
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.samples.count()));
        for part in &mut parts {
            part.position /= part.samples.count() as f32;
            part.coverage = part.samples.coverage();
        }
        parts
    }
}

impl Texel {
    /// Whether two samples lie on one smooth surface.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.object == other.object && self.normal.dot(other.normal) > SMOOTH_COSINE
    }
}

/// Whether no edge goes between two neighbouring pixels' middles.
fn is_smooth(one: &Option<Texel>, other: &Option<Texel>) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => one.is_like(other),
        _ => false,
    }
}

#[cfg(all(test, feature = "parallel"))]
mod tests {
    use glam::Vec3;
    use rayon::prelude::*;

    use crate::floor_and_ball::floor_and_ball;
    use crate::footprint::FootprintOptions;
    use crate::landed::landed;
    use crate::splat::splat;

    #[test]
    fn many_tasks_of_one_pool_may_splat_into_a_new_buffer() {
        let photons = [landed(Vec3::ZERO, [0.2 * Vec3::X, 0.2 * Vec3::Z])];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8);
        pool.build().unwrap().install(|| {
            for tasks in 2..34 {
                let buffer = floor_and_ball();
                let pictures: Vec<_> = (0..tasks)
                    .into_par_iter()
                    .with_max_len(1)
                    .map(|_| splat(&buffer, &photons, &FootprintOptions::default()).unwrap())
                    .collect();
                assert!(pictures[0].0.pixels().iter().any(|it| it[0] > 0.0));
                assert!(pictures.windows(2).all(|it| it[0] == it[1]));
            }
        });
    }
}
