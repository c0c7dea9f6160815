//! A picture of a caustic without bias: photons counted in the pixels in which they land.
//!
//! No footprint, no kernel and no lattice has a part in it, so that its error is noise alone, and
//! that noise has nothing to do with the reference's or with that of a picture under test. That is
//! what [`crate::noise`] needs to tell a reference's noise from a picture's error.

use caustics::accel::Intersect;
use caustics::filter::Image;
use caustics::sampling::Sequence;
use caustics::scene::{Camera, Projection};
use caustics::trace::{Photon, TraceOptions, trace_photons};
use glam::Vec3;
use rayon::prelude::*;
use std::time::Instant;

use crate::stage::{Failure, Stage};

/// Photons that are in memory at once, at most.
const BATCH: u32 = 2_000_000;

/// Independent parts of a counted picture.
pub const PARTS: usize = 4;

/// The first batch's seed. Pictures under test are traced with seed 0.
const FIRST_SEED: u64 = 1000;

/// How far from a photon the camera's ray may end, over the photon's distance.
const DISTANCE_TOLERANCE: f32 = 1e-4;

/// Independent pictures of one caustic, linear radiance in W/(sr m²), whose mean is the counted
/// picture.
#[derive(Clone, Debug)]
pub struct Counted {
    /// Each with as many photons, and seeds of its own.
    pub parts: [Image; PARTS],
    /// Photons emitted for all of them together.
    pub photons: u32,
    /// Seconds that it took.
    pub seconds: f64,
}

impl Counted {
    /// Traces `photons` photons, or a few less, in batches of equal size, each by a scrambling of its own of
    /// Sobol's sequence, and counts what the camera sees of them in a picture of the reference's
    /// size.
    ///
    /// # Errors
    /// If a photon cannot be traced or the camera's projection is unknown.
    pub fn new(stage: &Stage, photons: u32) -> Result<Self, Failure> {
        let start = Instant::now();
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let batches = photons
            .div_ceil(BATCH)
            .max(1)
            .next_multiple_of(PARTS as u32);
        let of_one = photons / batches;
        let mut sums = [(); PARTS].map(|()| vec![[0.0_f64; 3]; (width * height) as usize]);
        for batch in 0..batches {
            let options = TraceOptions {
                photons: of_one,
                seed: FIRST_SEED + u64::from(batch),
                // In proportion to flux: no picture is to be had of few photons here.
                share_floor: 0.0,
                sequence: Sequence::Sobol,
                check_footprints: false,
                divide_edges: false,
                differentials: false,
                ..TraceOptions::default()
            };
            let map = trace_photons(&stage.world, &stage.intersector, &options, &|_| {})?;
            let counted = map
                .photons
                .par_iter()
                .map(|photon| radiance_of(stage, photon, width, height))
                .collect::<Result<Vec<_>, Failure>>()?;
            let sum = &mut sums[batch as usize % PARTS];
            for (pixel, radiance) in counted.into_iter().flatten() {
                for (sum, value) in sum[pixel as usize].iter_mut().zip(radiance.to_array()) {
                    *sum += f64::from(value);
                }
            }
        }
        let share = PARTS as f64 / f64::from(batches);
        let mut parts = [(); PARTS].map(|()| stage.reference.clone());
        for (part, sum) in parts.iter_mut().zip(sums) {
            for (pixel, sum) in part.pixels_mut().iter_mut().zip(sum) {
                *pixel = sum.map(|sum| (share * sum) as f32);
            }
        }
        Ok(Self {
            parts,
            photons: of_one * batches,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// The mean of the parts.
    #[must_use]
    pub fn picture(&self) -> Image {
        let mut picture = self.parts[0].clone();
        for (index, pixel) in picture.pixels_mut().iter_mut().enumerate() {
            for (channel, value) in pixel.iter_mut().enumerate() {
                let values = self.parts.iter().map(|part| part.pixels()[index][channel]);
                *value = values.sum::<f32>() / PARTS as f32;
            }
        }
        picture
    }
}

/// The pixel in which the camera sees a photon, and the mean radiance over that pixel that is due
/// to it; `None` if the camera does not see it.
fn radiance_of(
    stage: &Stage,
    photon: &Photon,
    width: u32,
    height: u32,
) -> Result<Option<(u32, Vec3)>, Failure> {
    let camera = &stage.camera;
    let Some(at) = camera.project(photon.position, width, height) else {
        return Ok(None);
    };
    if at.x < 0.0 || at.y < 0.0 || at.x >= width as f32 || at.y >= height as f32 {
        return Ok(None);
    }
    let ray = camera.ray(at.x, at.y, width, height);
    let distance = (photon.position - ray.origin).length();
    let Some(hit) = stage.intersector.closest_hit(&ray) else {
        return Ok(None);
    };
    if (hit.t - distance).abs() > DISTANCE_TOLERANCE * distance {
        return Ok(None);
    }
    let Some(point) = stage.world.surface(&ray, &hit) else {
        return Ok(None);
    };
    let surface = &stage.world.materials()[point.material as usize].surface;
    let (true, Some(brdf)) = (point.object == photon.object, surface.brdf()) else {
        return Ok(None);
    };
    let side = if point.from_outside { 1.0 } else { -1.0 };
    let normal = side * point.geometric_normal;
    let reflected = brdf.evaluate(normal, -photon.incoming, -ray.direction);
    let density = pixels_per_area(camera, ray.direction, distance, normal, height)?;
    let pixel = at.y as u32 * width + at.x as u32;
    Ok(Some((pixel, photon.flux * reflected * density)))
}

/// Pixels that the picture of a small surface takes up, over its area in m², seen in the unit
/// `direction` at a distance in metres.
fn pixels_per_area(
    camera: &Camera,
    direction: Vec3,
    distance: f32,
    normal: Vec3,
    height: u32,
) -> Result<f32, Failure> {
    let half_height = 0.5 * height as f32;
    let cosine = (-normal.dot(direction)).max(0.0);
    match camera.projection {
        Projection::Perspective { yfov } => {
            let scale = half_height / (0.5 * yfov).tan();
            // The image plane is farther away, and tilted, off the axis.
            let axial = direction.dot(camera.forward());
            Ok(scale * scale * cosine / (distance * distance * axial * axial * axial))
        }
        Projection::Orthographic { ymag, .. } => Ok((half_height / ymag).powi(2) * cosine),
        _ => Err("a counted picture wants a perspective or an orthographic camera".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics::CausticsOptions;
    use caustics::accel::BvhOptions;
    use caustics::geometry::shapes::quad;
    use caustics::glam::{Affine3A, Vec2};
    use caustics::render::{GBuffer, splat};
    use caustics::scene::{Instance, Light, Material, Scene, Shape, World};
    use std::f32::consts::{FRAC_1_PI, FRAC_1_SQRT_2};

    const SIZE: u32 = 64;
    const ALBEDO: f32 = 0.6;
    const IRRADIANCE: f32 = 3.0;
    /// Half the side of the square mirror, and half the extent of what it lights along x.
    const HALF: f32 = 0.2;
    const HALF_LIT: f32 = HALF * FRAC_1_SQRT_2;

    /// A sun that travels along x meets a mirror at 45 degrees, one metre above a floor, which
    /// throws it straight down: the floor has the sun's irradiance under the mirror and none beside.
    /// With a `screen`, a plate hides that from the camera without being in the way of the light.
    fn stage(camera: Camera, screen: bool) -> Stage {
        let mut scene = Scene::new();
        let mut add = |name: &str, corner: Vec3, edges: [Vec3; 2], material: Material| {
            let mesh = scene.add_mesh(quad(corner, edges[0], edges[1]).unwrap());
            let material = scene.add_material(material).unwrap();
            let instance = Instance::new(name, Shape::Mesh(mesh), material);
            scene.add_instance(instance).unwrap();
        };
        let floor = Material::diffuse("floor", Vec3::splat(ALBEDO));
        let edges = [10.0 * Vec3::Z, 10.0 * Vec3::X];
        add("floor", Vec3::new(-5.0, 0.0, -5.0), edges, floor);
        let slope = Vec3::new(HALF_LIT, -HALF_LIT, 0.0);
        add(
            "mirror",
            Vec3::Y - slope - HALF * Vec3::Z,
            [2.0 * slope, 2.0 * HALF * Vec3::Z],
            Material::metal("mirror", Vec3::ONE),
        );
        if screen {
            add(
                "screen",
                Vec3::new(0.5, 0.01, -2.0),
                [4.0 * Vec3::Z, 2.0 * Vec3::Y],
                Material::diffuse("screen", Vec3::ONE),
            );
        }
        let light = Light::directional(Vec3::X, Vec3::splat(IRRADIANCE)).unwrap();
        scene.add_light(light).unwrap();
        let world = World::new(&scene).unwrap();
        let intersector = world.intersector(&BvhOptions::default()).unwrap();
        Stage {
            name: "mirror".into(),
            world,
            intersector,
            camera,
            reference: Image::new(SIZE, SIZE).unwrap(),
            load_seconds: 0.0,
        }
    }

    fn perspective() -> Camera {
        let eye = Vec3::new(2.0, 1.2, 0.7);
        Camera::look_at("c", eye, [0.1, 0.0, 0.1], Vec3::Y, 0.7).unwrap()
    }

    fn orthographic() -> Camera {
        let pose: Affine3A = perspective().transform;
        let projection = Projection::Orthographic {
            xmag: 0.6,
            ymag: 0.6,
        };
        Camera::new("o", pose, projection).unwrap()
    }

    fn sum(image: &Image) -> f64 {
        image.pixels().iter().map(|pixel| f64::from(pixel[1])).sum()
    }

    /// Radiance is the same all over the lit square, so that a picture's sum is that radiance times
    /// the area of the square's projection, in pixels: that of a polygon.
    fn sum_by_hand(camera: &Camera) -> f64 {
        let corners: Vec<Vec2> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .into_iter()
            .map(|(x, z)| Vec3::new(x * HALF_LIT, 0.0, z * HALF))
            .map(|corner| camera.project(corner, SIZE, SIZE).unwrap())
            .collect();
        let doubled: f32 = (0..4)
            .map(|index| corners[index].perp_dot(corners[(index + 1) % 4]))
            .sum();
        f64::from(ALBEDO * FRAC_1_PI * IRRADIANCE * 0.5 * doubled.abs())
    }

    #[test]
    fn a_picture_has_the_flux_that_is_known() {
        for camera in [perspective(), orthographic()] {
            let expected = sum_by_hand(&camera);
            let stage = stage(camera, false);
            let counted = Counted::new(&stage, 40_000).unwrap();
            assert_eq!(counted.photons, 40_000);
            for image in counted.parts.iter().chain([&counted.picture()]) {
                let ratio = sum(image) / expected;
                assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
            }
        }
    }

    #[test]
    fn a_picture_has_the_flux_of_the_default_estimate() {
        let stage = stage(perspective(), false);
        let counted = Counted::new(&stage, 40_000).unwrap().picture();
        let options = CausticsOptions::default();
        let (world, rays) = (&stage.world, &stage.intersector);
        let map = trace_photons(world, rays, &options.trace, &|_| {}).unwrap();
        let buffer = GBuffer::new(world, rays, &stage.camera, SIZE, SIZE).unwrap();
        let (image, _) = splat(&buffer, &map.photons, &options.footprint).unwrap();
        let ratio = sum(&counted) / sum(&image);
        assert!((ratio - 1.0).abs() < 3e-3, "{ratio}");
    }

    #[test]
    fn parts_are_of_photons_of_their_own() {
        let counted = Counted::new(&stage(perspective(), false), 4000).unwrap();
        for (index, part) in counted.parts.iter().enumerate() {
            assert!(counted.parts[..index].iter().all(|other| other != part));
        }
    }

    #[test]
    fn what_is_behind_something_is_not_counted() {
        let stage = stage(perspective(), true);
        let counted = Counted::new(&stage, 4000).unwrap();
        assert_eq!(sum(&counted.picture()), 0.0);
    }

    #[test]
    fn what_is_outside_of_the_picture_is_not_counted() {
        let eye = Vec3::new(2.0, 1.2, 0.7);
        let away = Camera::look_at("c", eye, [4.0, 0.0, 0.7], Vec3::Y, 0.7).unwrap();
        let counted = Counted::new(&stage(away, false), 4000).unwrap();
        assert_eq!(sum(&counted.picture()), 0.0);
    }
}
