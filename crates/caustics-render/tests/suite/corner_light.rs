//! Small footprints where a floor and a wall meet: each surface has its own irradiance up to the corner.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use caustics_accel::{BvhOptions, Intersect};
use caustics_geometry::shapes;
use caustics_render::{FootprintOptions, GBuffer, splat};
use caustics_scene::{Camera, Instance, Material, Scene, SceneIntersector, Shape, World};
use caustics_trace::{Coverage, FootprintSource, Photon};
use glam::Vec3;
use std::f32::consts::PI;

const SIZE: u32 = 64;

/// Metres between the photons, across the light.
const STEP: f32 = 0.008;

/// White chalk: a floor at y = 0, object 0, that ends at a wall at x = 0, object 1.
struct Corner {
    world: World,
    rays: SceneIntersector,
}

impl Corner {
    fn new() -> Self {
        let mut scene = Scene::new();
        let chalk = Material::diffuse("chalk", [1.0; 3]);
        let chalk = scene.add_material(chalk).unwrap();
        let across = 8.0 * Vec3::NEG_Z;
        for (start, along, across) in [
            (Vec3::new(-4.0, 0.0, 4.0), 4.0 * Vec3::X, across),
            (Vec3::new(0.0, 0.0, 4.0), across, 4.0 * Vec3::Y),
        ] {
            let mesh = scene.add_mesh(shapes::quad(start, along, across).unwrap());
            let instance = Instance::new("side", Shape::Mesh(mesh), chalk);
            scene.add_instance(instance).unwrap();
        }
        let world = World::new(&scene).unwrap();
        let rays = world.intersector(&BvhOptions::default()).unwrap();
        Self { world, rays }
    }

    /// What a pixel sees of the irradiance that is `floor` on the floor and `wall` on the wall, by a
    /// grid of rays.
    fn mixed(&self, camera: &Camera, pixel: u32, [floor, wall]: [f32; 2]) -> (f32, f32) {
        const FINE: u32 = 16;
        let [column, row] = [pixel % SIZE, pixel / SIZE].map(|it| it as f32);
        let mut on_floor = 0.0;
        for sample in 0..FINE * FINE {
            let [x, y] = [sample % FINE, sample / FINE].map(|it| (it as f32 + 0.5) / FINE as f32);
            let ray = camera.ray(column + x, row + y, SIZE, SIZE);
            let hit = self.rays.closest_hit(&ray).unwrap();
            let object = self.world.surface(&ray, &hit).unwrap().object;
            on_floor += if object == 0 { 1.0 } else { 0.0 };
        }
        let part = on_floor / (FINE * FINE) as f32;
        (part, part * floor + (1.0 - part) * wall)
    }
}

/// Light of one watt a square metre on a square lattice across it, that goes towards the wall at an
/// angle from it.
fn lattice(angle: f32) -> Vec<Photon> {
    let (sine, cosine) = angle.sin_cos();
    let incoming = Vec3::new(sine, -cosine, 0.0);
    let mut photons = Vec::new();
    for row in -80i32..80 {
        let z = (row as f32 + 0.5) * STEP;
        for column in -80i32..80 {
            // Off the ray through the corner. Before it, the floor is lit, behind it the wall.
            let off = (column as f32 + 0.37) * STEP;
            let (position, normal, along, object) = if off < 0.0 {
                let position = Vec3::new(off / cosine, 0.0, z);
                (position, Vec3::Y, STEP / cosine * Vec3::X, 0)
            } else {
                let position = Vec3::new(0.0, off / sine, z);
                (position, Vec3::NEG_X, STEP / sine * Vec3::Y, 1)
            };
            photons.push(Photon {
                position,
                incoming,
                flux: Vec3::splat(STEP * STEP),
                normal,
                axes: [along, STEP * Vec3::Z],
                object,
                events: 1,
                source: FootprintSource::Differential,
                coverage: Coverage::Cell,
            });
        }
    }
    photons
}

/// Before light was followed to what catches it, the row of pixels at the corner was a quarter too
/// bright here: it had the long footprints of one side in the pixels of the other.
#[test]
fn each_side_of_a_corner_has_its_own_irradiance() {
    let corner = Corner::new();
    // With the corner along a row of pixels, and aslant.
    for eye in [Vec3::new(-3.0, 1.3, 0.0), Vec3::new(-3.0, 1.3, 0.7)] {
        let camera = Camera::look_at("low", eye, [0.0, 0.004, 0.0], Vec3::Y, 0.2).unwrap();
        let buffer = GBuffer::new(&corner.world, &corner.rays, &camera, SIZE, SIZE).unwrap();
        for angle in [0.3f32, 0.5] {
            let options = FootprintOptions::default();
            let (image, _) = splat(&buffer, &lattice(angle), &options).unwrap();
            let irradiance = [angle.cos(), angle.sin()];
            let mut seams = 0;
            for row in SIZE / 4..3 * SIZE / 4 {
                let (mut found, mut expected) = (0.0, 0.0);
                for column in SIZE / 4..3 * SIZE / 4 {
                    let pixel = row * SIZE + column;
                    let own = PI * image.pixels()[pixel as usize][0];
                    let (part, mix) = corner.mixed(&camera, pixel, irradiance);
                    seams += u32::from(part > 0.0 && part < 1.0);
                    found += own;
                    expected += mix;
                    // The parts of a pixel are counted on eight by eight places.
                    assert!(
                        (own / mix - 1.0).abs() < 0.05,
                        "{eye}, {angle}: {own} for {mix} in {column}, {row}"
                    );
                }
                assert!(
                    (found / expected - 1.0f32).abs() < 0.01,
                    "{eye}, {angle}: {found} for {expected} in row {row}"
                );
            }
            assert!(seams >= SIZE / 2, "{seams}");
        }
    }
}
