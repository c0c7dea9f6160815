//! Caustics on glossy receivers: splat, gather, nearest photons and direct light against each other
//! and against the reflectance in the one direction that all light comes from.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use caustics_accel::{BvhOptions, NearestScratch};
use caustics_geometry::shapes;
use caustics_render::{
    DirectLight, EyeTracer, FootprintGather, FootprintOptions, GBuffer, NearestEstimate,
    NearestOptions, Receiver, splat,
};
use caustics_sampling::CounterRng;
use caustics_scene::{Camera, Instance, Light, Material, Scene, SceneIntersector, Shape, World};
use caustics_trace::{MediumStack, Photon};
use glam::Vec3;
use std::f32::consts::PI;

const SIZE: u32 = 48;
const IRRADIANCE: f32 = 2.0;

/// A floor of two by two metres and a camera that sees light from `incoming` mirrored in its middle.
struct Floor {
    world: World,
    rays: SceneIntersector,
    camera: Camera,
    photons: Vec<Photon>,
}

impl Floor {
    /// With photons `spacing` metres apart, which light it evenly from one direction.
    fn new(material: Material, spacing: f32) -> Self {
        let incoming = Vec3::new(0.6, -0.8, 0.0);
        let mut scene = Scene::new();
        let mesh = shapes::quad(Vec3::new(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z).unwrap();
        let mesh = scene.add_mesh(mesh);
        let material = scene.add_material(material).unwrap();
        let floor = Instance::new("floor", Shape::Mesh(mesh), material);
        scene.add_instance(floor).unwrap();
        scene
            .add_light(Light::directional(incoming, Vec3::splat(IRRADIANCE)).unwrap())
            .unwrap();
        let eye = Vec3::new(1.2, 1.6, 0.0);
        let camera = Camera::look_at("mirrored", eye, Vec3::ZERO, Vec3::Y, 0.5).unwrap();
        let world = World::new(&scene).unwrap();
        let rays = world.intersector(&BvhOptions::default()).unwrap();
        let count = (2.0 / spacing).ceil() as i32;
        let photons = (0..count * count)
            .map(|index| {
                let at = |step: i32| (step as f32 + 0.5) * spacing - 1.0;
                Photon {
                    position: Vec3::new(at(index % count), 0.0, at(index / count)),
                    incoming,
                    // What falls on a square of the lattice, aslant.
                    flux: Vec3::splat(IRRADIANCE * 0.8 * spacing * spacing),
                    normal: Vec3::Y,
                    axes: [spacing * Vec3::X, spacing * Vec3::Z],
                    object: 0,
                    events: 1,
                    source: caustics_trace::FootprintSource::Differential,
                    coverage: caustics_trace::Coverage::Cell,
                }
            })
            .collect();
        Self {
            world,
            rays,
            camera,
            photons,
        }
    }

    /// The radiance of every pixel by splatting.
    fn splatted(&self) -> Vec<Vec3> {
        let buffer = GBuffer::new(&self.world, &self.rays, &self.camera, SIZE, SIZE).unwrap();
        // Read where the gather and glossy texels are: at the pixels' middles.
        let options = FootprintOptions {
            integrate_pixels: false,
            ..FootprintOptions::default()
        };
        let (image, stats) = splat(&buffer, &self.photons, &options).unwrap();
        assert!(stats.splatted > 0);
        image.pixels().iter().map(|&it| Vec3::from(it)).collect()
    }

    /// What `value` makes of what each pixel's middle sees, and of the pixel's edges there.
    fn seen(&self, mut value: impl FnMut(&Receiver, [Vec3; 2]) -> Vec3) -> Vec<Vec3> {
        let mut eye = EyeTracer::new(&self.world, &self.rays, 4);
        let on_floor = |x: f32, y: f32| {
            let ray = self.camera.ray(x, y, SIZE, SIZE);
            ray.at(-ray.origin.y / ray.direction.y)
        };
        (0..SIZE * SIZE)
            .map(|pixel| {
                let (x, y) = ((pixel % SIZE) as f32 + 0.5, (pixel / SIZE) as f32 + 0.5);
                let edges = [
                    on_floor(x + 0.5, y) - on_floor(x - 0.5, y),
                    on_floor(x, y + 0.5) - on_floor(x, y - 0.5),
                ];
                let ray = self.camera.ray(x, y, SIZE, SIZE);
                let mut sum = Vec3::ZERO;
                let media = MediumStack::default();
                eye.trace(ray, media, &mut CounterRng::new(0, 0), |receiver, _| {
                    sum += value(receiver, edges);
                });
                sum
            })
            .collect()
    }
}

fn finishes() -> [Material; 4] {
    [
        Material::glossy("satin", [0.3, 0.5, 0.7], 0.0, 0.5),
        Material::glossy("brushed", [0.9, 0.7, 0.3], 1.0, 0.35),
        Material::glossy("half", [0.9, 0.7, 0.3], 0.5, 0.8),
        Material::glossy("polished", [0.5; 3], 0.0, 0.2),
    ]
}

/// The largest difference of two pictures in any pixel, relative to the brightest.
fn difference(one: &[Vec3], other: &[Vec3]) -> f32 {
    let (mut worst, mut brightest) = (0.0f32, 0.0f32);
    for (one, other) in one.iter().zip(other) {
        worst = worst.max((*one - *other).abs().max_element());
        brightest = brightest.max(other.max_element());
    }
    assert!(brightest > 0.0);
    worst / brightest
}

/// The reflectance that each pixel's middle sees, for the one direction that all light comes from.
fn reflectances(floor: &Floor, material: &Material) -> Vec<Vec3> {
    let brdf = material.surface.brdf().unwrap();
    let to_light = Vec3::new(-0.6, 0.8, 0.0);
    floor.seen(|receiver, _| brdf.evaluate(Vec3::Y, to_light, receiver.outgoing))
}

#[test]
fn with_light_from_one_direction_radiance_is_irradiance_times_reflectance() {
    let chalk = Material::diffuse("chalk", [1.0; 3]);
    for material in finishes() {
        let limit = 1e-4;
        // From half a pixel to five.
        for spacing in [0.01, 0.04, 0.1] {
            let floor = Floor::new(material.clone(), spacing);
            let reflectance = reflectances(&floor, &material);
            let brightest = reflectance.iter().map(|it| it.x).fold(0.0, f32::max);
            let darkest = reflectance.iter().map(|it| it.x).fold(f32::MAX, f32::min);
            assert!(brightest > 1.05 * darkest, "no highlight to be seen");
            let times = |irradiance: Vec<Vec3>| -> Vec<Vec3> {
                let pairs = reflectance.iter().zip(irradiance);
                pairs.map(|(part, all)| *part * all).collect()
            };

            // White chalk reflects its irradiance over pi.
            let white = Floor::new(chalk.clone(), spacing).splatted();
            let expected = times(white.into_iter().map(|it| it * PI).collect());
            assert!(difference(&floor.splatted(), &expected) < limit);

            let options = FootprintOptions::default();
            let gather = FootprintGather::new(&floor.photons, &options).unwrap();
            let at = |receiver: &Receiver| (receiver.point.spawn.position, receiver.normal);
            let found = floor.seen(|receiver, _| gather.radiance(receiver));
            let irradiance = floor.seen(|receiver, _| {
                let (position, normal) = at(receiver);
                gather.irradiance(position, normal)
            });
            assert!(difference(&found, &times(irradiance)) < limit);
            let found = floor.seen(|receiver, pixel| gather.radiance_over(receiver, pixel));
            let irradiance = floor.seen(|receiver, pixel| {
                let (position, normal) = at(receiver);
                gather.irradiance_over(position, normal, pixel)
            });
            assert!(difference(&found, &times(irradiance)) < limit);

            let nearest = NearestEstimate::new(&floor.photons, &NearestOptions::default()).unwrap();
            let mut scratch = NearestScratch::new();
            let found = floor.seen(|receiver, _| nearest.radiance(receiver, &mut scratch));
            let irradiance = floor.seen(|receiver, _| {
                let (position, normal) = at(receiver);
                nearest.irradiance(position, normal, &mut scratch)
            });
            assert!(difference(&found, &times(irradiance)) < limit);

            let direct_light = DirectLight::new(&floor.world, &floor.rays);
            let mut rng = CounterRng::new(0, 0);
            let found = floor.seen(|receiver, _| direct_light.radiance(receiver, &mut rng));
            let irradiance = vec![Vec3::splat(0.8 * IRRADIANCE); found.len()];
            assert!(difference(&found, &times(irradiance)) < limit);
        }
    }
}

/// By how much splat and gather differ.
fn disagreement(material: &Material, spacing: f32) -> f32 {
    let mut floor = Floor::new(material.clone(), spacing);
    // Light that comes to a focus behind the floor: from another direction in each place.
    for photon in &mut floor.photons {
        let focus = Vec3::new(0.9, -1.2, 0.0);
        photon.incoming = (focus - photon.position).normalize();
    }
    let gather = FootprintGather::new(&floor.photons, &FootprintOptions::default()).unwrap();
    let gathered = floor.seen(|receiver, pixel| gather.radiance_over(receiver, pixel));
    difference(&floor.splatted(), &gathered)
}

#[test]
fn splat_and_gather_agree_on_glossy_floors_as_they_do_on_chalk() {
    let chalk = Material::diffuse("chalk", [0.5; 3]);
    // In pixels: about half, two, and five; then so wide that the splat draws coarsely, but no more
    // coarsely than the lobes allow.
    for spacing in [0.01, 0.04, 0.1, 0.5] {
        let limit = disagreement(&chalk, spacing);
        assert!(limit < 0.06, "{spacing}: {limit}");
        for material in finishes() {
            let difference = disagreement(&material, spacing);
            let name = &material.name;
            assert!(
                difference < 1.1 * limit,
                "{name} {spacing}: {difference}, chalk {limit}"
            );
        }
    }
}

/// Control: the comparisons tell a finish from one that is a tenth rougher.
#[test]
fn control_another_roughness_is_noticed() {
    let floor = Floor::new(Material::glossy("satin", [0.3; 3], 0.0, 0.5), 0.05);
    let rougher = Floor::new(Material::glossy("rougher", [0.3; 3], 0.0, 0.55), 0.05);
    assert!(difference(&rougher.splatted(), &floor.splatted()) > 0.01);
}

/// A floor half of chalk and half of brass: each is lit as it would be alone.
#[test]
fn lambertian_and_glossy_receivers_share_a_picture() {
    let chalk = Floor::new(Material::diffuse("chalk", [0.5; 3]), 0.03);
    let brass = Floor::new(finishes()[1].clone(), 0.03);
    let mut scene = Scene::new();
    for (left, material) in [
        (-1.0, Material::diffuse("chalk", [0.5; 3])),
        (0.0, finishes()[1].clone()),
    ] {
        let corner = Vec3::new(-1.0, 0.0, left + 1.0);
        let mesh = scene.add_mesh(shapes::quad(corner, 2.0 * Vec3::X, -Vec3::Z).unwrap());
        let material = scene.add_material(material).unwrap();
        let half = Instance::new("half", Shape::Mesh(mesh), material);
        scene.add_instance(half).unwrap();
    }
    let world = World::new(&scene).unwrap();
    let rays = world.intersector(&BvhOptions::default()).unwrap();
    let mut photons = chalk.photons.clone();
    for photon in &mut photons {
        photon.object = u32::from(photon.position.z > 0.0);
    }
    let both = Floor {
        world,
        rays,
        camera: chalk.camera.clone(),
        photons,
    };
    let (both, chalk, brass) = (both.splatted(), chalk.splatted(), brass.splatted());
    let depth = |pixel: u32| {
        let ray = Floor::new(finishes()[0].clone(), 1.0).camera.ray(
            (pixel % SIZE) as f32 + 0.5,
            (pixel / SIZE) as f32 + 0.5,
            SIZE,
            SIZE,
        );
        ray.at(-ray.origin.y / ray.direction.y).z
    };
    let (mut left, mut right) = (0, 0);
    for (pixel, found) in (0..).zip(&both) {
        // Away from the seam, which footprints may or may not cross.
        let z = depth(pixel);
        if z.abs() < 0.15 {
            continue;
        }
        let expected = if z < 0.0 {
            chalk[pixel as usize]
        } else {
            brass[pixel as usize]
        };
        *(if z < 0.0 { &mut left } else { &mut right }) += 1;
        assert!(
            found.abs_diff_eq(expected, 1e-4 * expected.max_element()),
            "{pixel}"
        );
    }
    assert!(left > 200 && right > 200);
}
