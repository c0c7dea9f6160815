//! Batches, scenes that move, and what does not fit.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot be set up has failed"
)]

use crate::common;

use caustics_geometry::shapes::{heightfield, icosphere};
use caustics_scene::{Camera, Instance, Light, Material, Scene, Shape, World};
use caustics_trace::{Culling, SolidAngleLimit, TraceOptions, ViewVolume};
use caustics_wgpu::glam::{Affine3A, Vec3};
use caustics_wgpu::{
    GpuError, PhotonBuffers, RendererError, SceneBuffers, SceneRefit, TraceCounters, TracePlan,
    wgpu,
};

use common::scenes::{add_mesh, floor, glass, lamp, lit};
use common::tracing::{
    Difference, Stage, read, records_of, shared_tracer, trace_on_gpu, trails_by_cpu,
};
use common::words;

const PHOTONS: u32 = 4_000;

fn options() -> TraceOptions {
    TraceOptions {
        photons: PHOTONS,
        ..TraceOptions::default()
    }
}

fn encoder(device: &wgpu::Device) -> wgpu::CommandEncoder {
    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

#[test]
fn batches_have_the_photons_of_one_run() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let (device, queue) = gpu;
    let stage = lit(glass(), lamp());
    let plan = stage.plan(&options());
    let whole = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS);

    let scene = SceneBuffers::new(device, &stage.world).unwrap();
    let buffers = PhotonBuffers::new(device, 1_500, 16_000).unwrap();
    let mut photons = Vec::new();
    for (number, first) in (0..PHOTONS).step_by(1_500).enumerate() {
        let mut encoder = encoder(device);
        if number == 0 {
            buffers.clear(&mut encoder);
        } else {
            buffers.forget_records(&mut encoder);
        }
        let batch = first..(first + 1_500).min(PHOTONS);
        let work = tracer
            .trace(device, &mut encoder, &scene, &plan, batch.clone(), &buffers)
            .unwrap();
        // Its photons, those beside it, two for edges, and five for their order.
        let beside = u32::from(batch.start > 0) + u32::from(batch.end < PHOTONS);
        assert_eq!((work.passes, work.dispatches), (4, 1 + beside + 2 + 5));
        queue.submit([encoder.finish()]);
        photons.extend(records_of(device, queue, &buffers, batch));
    }
    assert!(photons == whole.photons);
    // Sums of integers: the same to the last bit, whatever their order.
    let counters = TraceCounters::new(&words(device, queue, buffers.counters()), &plan).unwrap();
    assert_eq!(counters.ledger, whole.counters.ledger);
}

#[test]
fn the_same_photons_again_have_the_same_bits() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let (device, queue) = gpu;
    // Many more than one workgroup has, with several parts each.
    let stage = Stage::load("p04_sphere_in_box.glb");
    let options = TraceOptions {
        photons: 5 * PHOTONS,
        ..options()
    };
    let plan = stage.plan(&options);
    let scene = SceneBuffers::new(device, &stage.world).unwrap();
    let buffers = PhotonBuffers::new(device, plan.photons(), 8 * PHOTONS * 5).unwrap();
    let run = || {
        let mut encoder = encoder(device);
        buffers.clear(&mut encoder);
        let all = 0..plan.photons();
        tracer
            .trace(device, &mut encoder, &scene, &plan, all, &buffers)
            .unwrap();
        queue.submit([encoder.finish()]);
        let counters = words(device, queue, buffers.counters());
        let stored = counters[0] as usize;
        let mut records = words(device, queue, buffers.records());
        records.truncate(20 * stored);
        let mut paths = words(device, queue, buffers.paths());
        paths.truncate(stored);
        let starts = words(device, queue, buffers.starts());
        [counters, records, paths, starts]
    };
    let first = run();
    assert!(first[2].len() > 2 * plan.photons() as usize);
    let numbers = first[1].chunks_exact(20).map(|record| record[19]);
    assert!(numbers.is_sorted());
    for _ in 0..3 {
        assert!(run() == first);
    }
}

#[test]
fn what_has_no_room_is_counted() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let stage = lit(glass(), lamp());
    let plan = stage.plan(&options());
    let whole = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS).counters;
    let crowded = trace_on_gpu(gpu, tracer, &stage, &plan, 100).counters;
    assert_eq!((crowded.stored, whole.crowded.count), (100, 0));
    let landed = u64::from(whole.stored) - 4 * whole.ledger.divided_photons;
    assert_eq!(crowded.crowded.count, landed - 100);
    let ledger = &crowded.ledger;
    let incoming = ledger.emitted().flux + ledger.roulette_gain() + ledger.edge_gain;
    let missing = incoming - ledger.accounted();
    assert!((missing - crowded.crowded.flux).abs().max_element() < 1e-6);
    assert!(crowded.crowded.flux.min_element() > 0.0);
}

#[test]
fn photons_whose_parts_have_no_room_stay_whole() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let stage = lit(glass(), lamp());
    let plan = stage.plan(&options());
    let whole = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS);
    let divided = whole.counters.ledger.divided_photons;
    let landed = whole.counters.stored - 4 * divided as u32;
    assert!(divided > 100);
    for room in [0, 1, 6, 30, 31] {
        let traced = trace_on_gpu(gpu, tracer, &stage, &plan, landed + room);
        let TraceCounters {
            stored,
            ledger,
            crowded,
        } = traced.counters;
        assert_eq!(crowded.count, 0);
        // Five places for each of those that are divided.
        assert_eq!(ledger.divided_photons, u64::from(room / 5));
        assert_eq!(stored, landed + 4 * (room / 5));
        assert!(ledger.imbalance() < 1e-6);
        // All others have one record for each part that landed.
        let all = traced.photons.iter().zip(&whole.photons);
        let as_whole = all.clone().filter(|(a, b)| a == b).count();
        let edges = all.filter(|(a, b)| a.len() != b.len()).count() as u64;
        assert!(edges <= divided - u64::from(room / 5));
        assert!(as_whole as u64 >= u64::from(PHOTONS) - edges);
    }
}

/// A ball of glass, turned and moved.
fn moved(by: f32) -> Stage {
    let mut scene = floor();
    let glass = scene
        .add_material(Material::dielectric("glass", 1.5))
        .unwrap();
    let mesh = Shape::Mesh(scene.add_mesh(icosphere(0.5, 3).unwrap()));
    let place = Affine3A::from_rotation_y(by) * Affine3A::from_translation(Vec3::new(by, 0.8, 0.0));
    let instance = Instance {
        transform: place,
        ..Instance::new("ball", mesh, glass)
    };
    scene.add_instance(instance).unwrap();
    let exact = Shape::Sphere {
        center: Vec3::new(-1.0, 0.7 + by, 0.3),
        radius: 0.3,
    };
    scene
        .add_instance(Instance::new("exact", exact, glass))
        .unwrap();
    lit(scene, lamp())
}

#[test]
fn buffers_follow_a_scene_that_moves() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let (device, queue) = gpu;
    let (before, after) = (moved(0.0), moved(0.9));
    let plan = after.plan(&options());
    let trails = trails_by_cpu(&after, &options());
    let mut scene = SceneBuffers::new(device, &before.world).unwrap();
    let fresh = SceneBuffers::new(device, &after.world).unwrap();
    let buffers = PhotonBuffers::new(device, PHOTONS, 8 * PHOTONS).unwrap();
    let trace = |scene: &SceneBuffers, mut encoder: wgpu::CommandEncoder| {
        buffers.clear(&mut encoder);
        tracer
            .trace(device, &mut encoder, scene, &plan, 0..PHOTONS, &buffers)
            .unwrap();
        queue.submit([encoder.finish()]);
        let traced = read(device, queue, &plan, &buffers);
        Difference::between(&after.world, &trails, &traced)
    };
    // The old scene is told apart.
    let old = trace(&scene, encoder(device));
    assert!(!old.beyond_promise(trails.len()).is_empty());

    let refit = SceneRefit::new(device);
    let mut encoder = encoder(device);
    let work = refit
        .update(device, &mut encoder, &mut scene, &after.world)
        .unwrap();
    assert!(work.dispatches > 2 && work.passes == 1);
    let new = trace(&scene, encoder);
    assert_eq!(new.beyond_promise(trails.len()), Vec::<String>::new());
    assert!(new.equal_records.1 > 500, "{new:?}");

    // The root's box is as tight as that of a new hierarchy.
    let root = |scene: &SceneBuffers| words(device, queue, scene.nodes())[..8].to_vec();
    let (fitted, built) = (root(&scene), root(&fresh));
    for place in [0, 1, 2, 4, 5, 6] {
        let [fitted, built] = [fitted[place], built[place]].map(f32::from_bits);
        assert!((fitted - built).abs() < 1e-5, "{fitted} {built}");
    }

    let other = lit(glass(), lamp());
    let mut encoder = self::encoder(device);
    let error = refit.update(device, &mut encoder, &mut scene, &other.world);
    assert!(matches!(
        error,
        Err(RendererError::Gpu(GpuError::SceneChanged {
            what: "objects",
            ..
        }))
    ));
}

#[test]
fn half_a_million_triangles_fit_the_default_limits() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let mut scene = floor();
    let waves = heightfield([2.0, 2.0], [512, 512], |x, z| {
        0.02 * (9.0 * x).sin() * (7.0 * z).cos()
    });
    let water = Material::dielectric("water", 1.33);
    add_mesh(&mut scene, waves.unwrap(), Vec3::Y, water);
    let stage = lit(
        scene,
        Light::directional([0.1, -1.0, 0.0], [10.0; 3]).unwrap(),
    );
    assert!(stage.world.triangles().len() > 500_000);
    let plan = stage.plan(&options());
    let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS);
    let trails = trails_by_cpu(&stage, &options());
    let difference = Difference::between(&stage.world, &trails, &traced);
    assert_eq!(
        difference.beyond_promise(trails.len()),
        Vec::<String>::new()
    );
    assert!(difference.equal_records.1 > 1000);
    // Two million photons, in two batches.
    assert!(PhotonBuffers::new(&gpu.0, 1_000_000, 1_500_000).is_ok());
}

#[test]
fn buffers_that_cannot_be_bound_are_refused() {
    let Some((device, _)) = common::shared_device() else {
        return;
    };
    let error = PhotonBuffers::new(device, 1_000, 2_000_000).unwrap_err();
    assert_eq!(
        error,
        RendererError::Gpu(GpuError::BufferTooLarge {
            what: "footprint records",
            bytes: 160_000_000,
            limit: 128 << 20,
        })
    );
    let Some((small, _)) = common::limited_device(wgpu::Limits {
        max_storage_buffer_binding_size: 1 << 16,
        ..wgpu::Limits::default()
    }) else {
        return;
    };
    let stage = lit(glass(), lamp());
    let error = SceneBuffers::new(&small, &stage.world).unwrap_err();
    assert!(
        matches!(
            error,
            RendererError::Gpu(GpuError::BufferTooLarge {
                what: "nodes",
                limit: 65_536,
                ..
            })
        ),
        "{error}"
    );
}

#[test]
fn what_the_shaders_cannot_do_is_an_error() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let (device, _) = gpu;
    let stage = lit(glass(), lamp());
    let plan = |options: &TraceOptions| TracePlan::new(&stage.world, &stage.rays, options);
    let camera = Camera::look_at("", [0.0, 1.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8).unwrap();
    let none = Culling::default();
    for (named, culling) in [
        (
            "min_flux",
            Culling {
                min_flux: 1e-6,
                ..none
            },
        ),
        (
            "max_area",
            Culling {
                max_area: 1.0,
                ..none
            },
        ),
        (
            "max_solid_angle",
            Culling {
                max_solid_angle: SolidAngleLimit::of_pixels(&camera, 48, 9.0),
                ..none
            },
        ),
        (
            "view",
            Culling {
                view: ViewVolume::of(&camera, 64, 48),
                ..none
            },
        ),
    ] {
        assert_ne!(culling, none);
        let culled = TraceOptions {
            culling,
            ..options()
        };
        let error = plan(&culled).unwrap_err();
        assert!(
            matches!(error, GpuError::Unsupported { what } if what.contains(named)),
            "{named}: {error}"
        );
    }
    let heavy = TraceOptions {
        min_weight: 2.0,
        ..options()
    };
    assert!(matches!(plan(&heavy), Err(GpuError::Options(_))));
    let many = TraceOptions {
        photons: u32::MAX,
        ..options()
    };
    assert!(matches!(
        plan(&many),
        Err(GpuError::TooMany {
            what: "photons",
            ..
        })
    ));

    let plan = plan(&options()).unwrap();
    let scene = SceneBuffers::new(device, &stage.world).unwrap();
    let buffers = PhotonBuffers::new(device, 100, 1_000).unwrap();
    for range in [0..101, PHOTONS - 1..PHOTONS + 1] {
        let mut encoder = encoder(device);
        let error = tracer.trace(device, &mut encoder, &scene, &plan, range, &buffers);
        assert!(matches!(
            error,
            Err(RendererError::Gpu(GpuError::PhotonRange { batch: 100, .. }))
        ));
    }
    assert!(matches!(
        TraceCounters::new(&[0; 7], &plan),
        Err(GpuError::CounterSize { words: 7, .. })
    ));
}

#[test]
fn nothing_to_see_or_nothing_that_shines_stores_nothing() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let dark = Stage::new(World::new(&glass()).unwrap());
    let empty = lit(Scene::new(), lamp());
    for stage in [dark, empty, lit(floor(), lamp())] {
        let plan = stage.plan(&options());
        let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 100);
        assert_eq!(traced.counters.stored, 0);
        assert!(traced.counters.ledger.imbalance() < 1e-6);
    }
}
