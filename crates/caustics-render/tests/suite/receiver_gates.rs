//! What footprints light beside, above, below and behind their receivers, in splat and gather.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use caustics_accel::{BvhOptions, Intersect};
use caustics_geometry::shapes;
use caustics_render::{EyeTracer, FootprintGather, FootprintOptions, GBuffer, SplatStats, splat};
use caustics_sampling::CounterRng;
use caustics_scene::{
    Camera, Instance, Material, Projection, Scene, SceneIntersector, Shape, World,
};
use caustics_trace::{MediumStack, Photon};
use glam::{Affine3A, Mat3, Vec3};
use proptest::prelude::*;
use std::f32::consts::PI;

const SIZE: u32 = 64;

/// Rectangles of white chalk, each an object of its own, and a camera.
struct Room {
    world: World,
    rays: SceneIntersector,
    camera: Camera,
}

impl Room {
    fn new(rectangles: &[[Vec3; 3]], camera: Camera) -> Self {
        let mut scene = Scene::new();
        let chalk = Material::diffuse("chalk", [1.0; 3]);
        let chalk = scene.add_material(chalk).unwrap();
        for [corner, along, across] in rectangles {
            let mesh = scene.add_mesh(shapes::quad(*corner, *along, *across).unwrap());
            let instance = Instance::new("rectangle", Shape::Mesh(mesh), chalk);
            scene.add_instance(instance).unwrap();
        }
        let world = World::new(&scene).unwrap();
        let rays = world.intersector(&BvhOptions::default()).unwrap();
        Self {
            world,
            rays,
            camera,
        }
    }

    fn splatted(&self, photons: &[Photon]) -> (Vec<Vec3>, SplatStats) {
        let buffer = GBuffer::new(&self.world, &self.rays, &self.camera, SIZE, SIZE).unwrap();
        let (image, stats) = splat(&buffer, photons, &FootprintOptions::default()).unwrap();
        // Chalk reflects its irradiance over pi.
        let pixels = image.pixels().iter();
        (pixels.map(|&it| PI * Vec3::from(it)).collect(), stats)
    }

    /// The irradiance by gathering, and the object, of what each pixel's middle sees.
    fn gathered(&self, photons: &[Photon]) -> Vec<Option<(u32, Vec3)>> {
        let gather = FootprintGather::new(photons, &FootprintOptions::default()).unwrap();
        let mut eye = EyeTracer::new(&self.world, &self.rays, 2);
        (0..SIZE * SIZE)
            .map(|pixel| {
                let at = |step: u32| step as f32 + 0.5;
                let (x, y) = (at(pixel % SIZE), at(pixel / SIZE));
                let ray = self.camera.ray(x, y, SIZE, SIZE);
                let mut found = None;
                let mut rng = CounterRng::new(0, 0);
                eye.trace(ray, MediumStack::default(), &mut rng, |receiver, _| {
                    found = Some((receiver.point.object, PI * gather.radiance(receiver)));
                });
                found
            })
            .collect()
    }
}

/// Whether a pixel and those around it see the same object: not on a seam, where one sees both.
fn is_inside(seen: &[Option<(u32, Vec3)>], pixel: usize) -> bool {
    let object = |pixel: usize| seen.get(pixel).copied().flatten().map(|it| it.0);
    let size = SIZE as usize;
    let around = [
        pixel + 1,
        pixel + size,
        pixel.wrapping_sub(1),
        pixel.wrapping_sub(size),
    ];
    around
        .into_iter()
        .all(|other| object(other) == object(pixel))
}

/// One watt.
fn photon(position: Vec3, incoming: Vec3, spacing: f32, object: u32) -> Photon {
    Photon {
        position,
        incoming: incoming.normalize(),
        flux: Vec3::ONE,
        normal: Vec3::Y,
        axes: [spacing * Vec3::X, spacing * Vec3::Z],
        object,
        events: 1,
        source: caustics_trace::FootprintSource::Differential,
        coverage: caustics_trace::Coverage::Cell,
    }
}

const FLOOR: [Vec3; 3] = [
    Vec3::new(-2.0, 0.0, 2.0),
    Vec3::new(4.0, 0.0, 0.0),
    Vec3::new(0.0, 0.0, -4.0),
];

/// Upright at x = 0.5, facing the other way.
const WALL: [Vec3; 3] = [
    Vec3::new(0.5, 0.0, 2.0),
    Vec3::new(0.0, 0.0, -4.0),
    Vec3::new(0.0, 2.0, 0.0),
];

#[test]
fn a_pixel_that_a_wall_cuts_has_the_light_that_ends_there() {
    const STEP: f32 = 0.002;
    // The seam goes aslant through the picture.
    let up = Vec3::new(0.3, 1.0, 0.4);
    let eye = Vec3::new(-2.0, 2.5, 0.5);
    let camera = Camera::look_at("aslant", eye, [0.4, 0.0, 0.0], up, 0.4).unwrap();
    let room = Room::new(&[FLOOR, WALL], camera);
    let places = |low: f32, high: f32| {
        let count = ((high - low) / STEP).round() as u32;
        (0..count).map(move |it| low + (it as f32 + 0.5) * STEP)
    };
    // From straight above, up to the wall, which catches none.
    let photons: Vec<Photon> = places(-0.1, 0.5)
        .flat_map(|x| places(-0.5, 0.5).map(move |z| Vec3::new(x, 0.0, z)))
        .map(|it| photon(it, Vec3::NEG_Y, STEP, 0))
        .collect();
    let (found, _) = room.splatted(&photons);
    let even = 1.0 / (STEP * STEP);
    let (mut seams, mut light, mut seen) = (0, 0.0, 0.0);
    for pixel in 0..SIZE * SIZE {
        let [column, row] = [pixel % SIZE, pixel / SIZE].map(|it| it as f32);
        const FINE: u32 = 32;
        let mut floor = 0.0;
        let mut is_lit = true;
        for sample in 0..FINE * FINE {
            let [x, y] = [sample % FINE, sample / FINE].map(|it| (it as f32 + 0.5) / FINE as f32);
            let ray = room.camera.ray(column + x, row + y, SIZE, SIZE);
            let hit = room.rays.closest_hit(&ray).unwrap();
            let point = room.world.surface(&ray, &hit).unwrap();
            let place = point.spawn.position;
            is_lit &= place.z.abs() < 0.4 && place.x > 0.0;
            floor += if point.object == 0 { 1.0 } else { 0.0 };
        }
        let part = floor / (FINE * FINE) as f32;
        if is_lit && part > 0.0 && part < 1.0 {
            let own = found[pixel as usize].x / even;
            assert!((own - part).abs() < 0.1, "{pixel}: {own} of {part}");
            seams += 1;
            light += own;
            seen += part;
        }
    }
    assert!(seams > 10, "{seams}");
    assert!((light / seen - 1.0).abs() < 0.03, "{light} of {seen}");
}

#[test]
fn a_wall_beside_a_lit_floor_catches_what_the_gather_says() {
    // From in front, and with the floor almost edge-on.
    for eye in [Vec3::new(-3.0, 2.5, 0.5), Vec3::new(-4.0, 0.6, 0.5)] {
        let camera = Camera::look_at("front", eye, [0.3, 0.3, 0.0], Vec3::Y, 0.5).unwrap();
        let room = Room::new(&[FLOOR, WALL], camera);
        // Wide footprints beside the wall, with light that goes towards it.
        let light = Vec3::new(1.0, -1.0, 0.2);
        let photons: Vec<Photon> = (0..12)
            .map(|i| {
                let z = 0.1 * i as f32 - 0.6;
                photon(Vec3::new(0.3, 0.0, z), light, 0.3, 0)
            })
            .collect();
        let (splatted, _) = room.splatted(&photons);
        let gathered = room.gathered(&photons);
        let brightest = gathered
            .iter()
            .flatten()
            .map(|it| it.1.x)
            .fold(0.0, f32::max);
        let (mut worst, mut lit) = (0.0f32, 0);
        for (pixel, found) in gathered.iter().enumerate() {
            if let Some((1, irradiance)) = found
                && is_inside(&gathered, pixel)
            {
                worst = worst.max((splatted[pixel].x - irradiance.x).abs());
                lit += u32::from(irradiance.x > 0.1 * brightest);
            }
        }
        assert!(lit > 50, "{lit} pixels of the wall are lit");
        assert!(worst < 0.05 * brightest, "{worst} of {brightest}");
    }
}

/// Looks straight down on two by two metres.
fn from_above() -> Camera {
    let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
    let pose = Affine3A::from_mat3_translation(down, Vec3::new(0.0, 3.0, 0.0));
    let projection = Projection::Orthographic {
        xmag: 1.0,
        ymag: 1.0,
    };
    Camera::new("above", pose, projection).unwrap()
}

/// A floor whose right half lies `depth` metres lower, as another object.
fn step(depth: f32) -> Room {
    let half = |x: f32, y: f32| {
        let corner = Vec3::new(x, y, 2.0);
        [corner, 2.0 * Vec3::X, -4.0 * Vec3::Z]
    };
    Room::new(&[half(-2.0, 0.0), half(0.0, -depth)], from_above())
}

#[test]
fn parallel_surfaces_do_not_share_light_but_tiles_of_one_floor_do() {
    // On the upper half, whose footprint reaches far over the edge.
    let photons = [photon(Vec3::new(-0.1, 0.0, 0.0), Vec3::NEG_Y, 0.4, 0)];
    let sum = |room: &Room, object: u32| {
        let (splatted, _) = room.splatted(&photons);
        let gathered = room.gathered(&photons);
        let of_object = gathered.iter().zip(&splatted).filter_map(|(found, splat)| {
            let (found_on, irradiance) = (*found)?;
            (found_on == object).then_some((splat.x, irradiance.x))
        });
        of_object.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
    };
    // A sheet's thickness of a fifth of the footprint's radius, and more.
    for depth in [0.1, 0.2, 0.5] {
        assert_eq!(sum(&step(depth), 1), (0.0, 0.0), "depth {depth}");
    }
    let (splatted, gathered) = sum(&step(0.0), 1);
    assert!(splatted > 100.0 && (splatted / gathered - 1.0).abs() < 0.02);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Two rooms with floors of their own, one a step below the other, and a thin wall between. The
    /// step is a part of the distance between photons, and no light comes through the wall.
    #[test]
    fn a_thin_wall_between_two_rooms_leaks_nothing(
        x in -0.5..-0.02f32, z in -0.5..0.5f32, spacing in 0.02..0.5f32,
        slant in 0.0..0.9f32, thickness in 0.001..0.02f32, depth in 0.15..0.5f32,
    ) {
        let floor = |from: f32, to: f32, y: f32| {
            [Vec3::new(from, y, 2.0), (to - from) * Vec3::X, -4.0 * Vec3::Z]
        };
        let face = |x: f32, across: Vec3| [Vec3::new(x, -0.5, 0.0) - 0.5 * across, across, 2.0 * Vec3::Y];
        let rectangles = [
            floor(-2.0, 0.0, 0.0),
            floor(thickness, 2.0, -depth * spacing),
            face(0.0, 4.0 * Vec3::Z),
            face(thickness, -4.0 * Vec3::Z),
        ];
        let eye = Vec3::new(1.5, 1.2, 0.3);
        let camera = Camera::look_at("b", eye, [0.1, 0.0, 0.0], Vec3::Y, 0.7).unwrap();
        let room = Room::new(&rectangles, camera);
        let light = Vec3::new(slant, -1.0, 0.1);
        let photons = [photon(Vec3::new(x, 0.0, z), light, spacing, 0)];
        let (splatted, _) = room.splatted(&photons);
        let gathered = room.gathered(&photons);
        let mut dark = 0;
        for (pixel, found) in gathered.iter().enumerate() {
            // The floor and the face of the other room.
            if let Some((1 | 3, irradiance)) = found {
                prop_assert_eq!(*irradiance, Vec3::ZERO);
                dark += 1;
                if is_inside(&gathered, pixel) {
                    prop_assert_eq!(splatted[pixel], Vec3::ZERO);
                }
            }
        }
        prop_assert!(dark > 500);
    }

    /// What falls on the receiver's back is dark, whatever the camera and the kernel.
    #[test]
    fn light_on_the_wrong_side_lights_nothing(
        x in -0.5..0.5f32, z in -0.5..0.5f32, spacing in 0.02..0.5f32, slant in -2.0..2.0f32,
    ) {
        let room = Room::new(&[FLOOR], from_above());
        let mut below = photon(Vec3::new(x, 0.0, z), Vec3::new(slant, 1.0, 0.3), spacing, 0);
        below.normal = Vec3::NEG_Y;
        let (splatted, stats) = room.splatted(&[below]);
        prop_assert_eq!(stats.turned_away, 1);
        prop_assert!(splatted.iter().all(|it| *it == Vec3::ZERO));
        let gathered = room.gathered(&[below]);
        prop_assert!(gathered.iter().flatten().all(|it| it.1 == Vec3::ZERO));
    }

    /// All of a footprint's flux is on the floor, or beyond the floor's edge.
    #[test]
    fn the_flux_on_a_floor_is_what_does_not_fall_off_it(
        x in -1.0..0.3f32, z in -0.8..0.8f32, log_spacing in -3.0..-0.5f32, slant in -1.0..1.0f32,
    ) {
        // A floor that ends at x = 0.3.
        let edge = 0.3;
        let floor = [Vec3::new(-2.0, 0.0, 2.0), (edge + 2.0) * Vec3::X, -4.0 * Vec3::Z];
        let room = Room::new(&[floor], from_above());
        let spacing = 10f32.powf(log_spacing);
        let one = photon(Vec3::new(x, 0.0, z), Vec3::new(slant, -1.0, 0.0), spacing, 0);
        let options = FootprintOptions::default();
        let buffer = GBuffer::new(&room.world, &room.rays, &room.camera, SIZE, SIZE).unwrap();
        let (image, stats) = splat(&buffer, &[one], &options).unwrap();
        let pixel = 2.0 / SIZE as f32;
        let deposited = image.pixels().iter().map(|it| it[0] * PI).sum::<f32>() * pixel * pixel;

        // The part of the same footprint that lies off the floor or the picture, counted on a fine
        // grid.
        let gather = FootprintGather::new(&[one], &options).unwrap();
        let half = 4.5 * 0.55 * spacing;
        const STEPS: u32 = 300;
        let step = 2.0 * half / STEPS as f32;
        let (mut on, mut off, mut beside) = (0.0f64, 0.0f64, 0.0f64);
        let column = |x: f32| ((x + 1.0) / pixel).floor();
        for index in 0..STEPS * STEPS {
            let at = |number: u32| (number as f32 + 0.5) * step - half;
            let place = one.position + Vec3::new(at(index % STEPS), 0.0, at(index / STEPS));
            let light = gather.irradiance(place, Vec3::Y).x;
            let is_on = place.x < edge && place.x.abs().max(place.z.abs()) < 1.0;
            *(if is_on { &mut on } else { &mut off }) += f64::from(light * step * step);
            if column(place.x) == column(edge) {
                beside += f64::from(light * step * step);
            }
        }
        prop_assert!((on + off - 1.0).abs() < 0.01, "{on} + {off}");
        prop_assert_eq!(stats.splatted + stats.outside, 1);
        // A pixel that the edge cuts is lit as if its light were even: that of a narrow footprint may
        // be on either side.
        let tolerance = 0.02 + beside * f64::from(pixel / (spacing + pixel));
        prop_assert!((f64::from(deposited) - on).abs() < tolerance, "{deposited} of {on}, {off} off, {beside} beside the edge");
    }
}
