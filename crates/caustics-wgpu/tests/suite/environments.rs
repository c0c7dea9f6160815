//! Large environments, those that change, and a picture of their light.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot be set up has failed"
)]

use crate::common;
use crate::stage;

use caustics_render::FootprintOptions;
use caustics_scene::{Camera, Environment, Scene, World};
use caustics_trace::{TraceOptions, trace_photons};
use caustics_wgpu::{
    FrameLight, GpuError, PhotonBuffers, PhotonTracer, RendererError, RendererOptions,
    SceneBuffers, SceneRefit, TracePlan, wgpu,
};

use common::scenes::{casters, floor, mirrored, sky, under};
use common::tracing::{
    Difference, Stage, ledger_of, read, shared_tracer, trace_on_gpu, trails_by_cpu, unlike_lines,
};

const PHOTONS: u32 = 4_000;

fn options() -> TraceOptions {
    TraceOptions {
        photons: PHOTONS,
        seed: 7,
        ..TraceOptions::default()
    }
}

fn encoder(device: &wgpu::Device) -> wgpu::CommandEncoder {
    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

fn scene_changed(error: &RendererError) -> Option<(&'static str, u64, u64)> {
    match *error {
        RendererError::Gpu(GpuError::SceneChanged {
            what,
            given,
            expected,
        }) => Some((what, given, expected)),
        _ => None,
    }
}

#[test]
fn two_million_texels_fit_the_default_limits() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let large = sky(2048, 1024);
    let stage = under(casters(), large.clone());
    let plan = stage.plan(&options());
    let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS);
    let trails = trails_by_cpu(&stage, &options());
    let difference = Difference::between(&stage.world, &trails, &traced);
    println!("{difference:?}");
    let mut beyond = difference.beyond_promise(trails.len());
    let ledger = ledger_of(&trails, &plan);
    beyond.extend(unlike_lines(&traced.counters.ledger, &ledger, trails.len()));
    assert_eq!(beyond, Vec::<String>::new());
    assert!(traced.counters.ledger.imbalance() < 1e-6);
    assert!(difference.equal_records.1 > 1000);
    // Another sky of the size is told apart.
    let other = under(casters(), mirrored(&large));
    let trails = trails_by_cpu(&other, &options());
    let difference = Difference::between(&stage.world, &trails, &traced);
    assert!(!difference.beyond_promise(trails.len()).is_empty());
}

#[test]
fn more_texels_than_a_binding_holds_are_refused() {
    let Some((small, _)) = common::limited_device(wgpu::Limits {
        max_storage_buffer_binding_size: 1 << 20,
        ..wgpu::Limits::default()
    }) else {
        return;
    };
    let refused = |sky: Environment| {
        let stage = under(floor(), sky);
        SceneBuffers::new(&small, &stage.world).err()
    };
    // 16 bytes for each texel, each row and the floor's two triangles.
    let texel = |height: u32| {
        let pixels = vec![[1.0; 3]; 1024 * height as usize];
        Environment::new(1024, height, pixels).unwrap()
    };
    assert_eq!(refused(texel(63)), None);
    assert_eq!(
        refused(texel(64)),
        Some(RendererError::Gpu(GpuError::BufferTooLarge {
            what: "triangles with the texels of the environment",
            bytes: 16 * (1024 * 64 + 64 + 2),
            limit: 1 << 20,
        }))
    );
}

/// Traces all photons of a plan through buffers that are there.
fn traced(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    tracer: &PhotonTracer,
    mut encoder: wgpu::CommandEncoder,
    scene: &SceneBuffers,
    plan: &TracePlan,
) -> Result<common::tracing::Traced, RendererError> {
    let buffers = PhotonBuffers::new(device, PHOTONS, 8 * PHOTONS)?;
    buffers.clear(&mut encoder);
    let all = 0..plan.photons();
    tracer.trace(device, &mut encoder, scene, plan, all, &buffers)?;
    queue.submit([encoder.finish()]);
    Ok(read(device, queue, plan, &buffers))
}

#[test]
fn buffers_follow_an_environment_that_changes() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let device = &gpu.0;
    let sky = sky(64, 32);
    let before = under(casters(), sky.clone());
    let after = under(casters(), mirrored(&sky));
    let plan = after.plan(&options());
    let trails = trails_by_cpu(&after, &options());
    let mut scene = SceneBuffers::new(device, &before.world).unwrap();
    let run = |scene: &SceneBuffers, encoder| {
        let traced = traced(gpu, tracer, encoder, scene, &plan).unwrap();
        Difference::between(&after.world, &trails, &traced)
    };
    let old = run(&scene, encoder(device));
    assert!(!old.beyond_promise(trails.len()).is_empty());
    let refit = SceneRefit::new(device);
    // The second time, no table travels: those of the first are still there.
    for _ in 0..2 {
        let mut encoder = encoder(device);
        refit
            .update(device, &mut encoder, &mut scene, &after.world)
            .unwrap();
        let new = run(&scene, encoder);
        assert_eq!(new.beyond_promise(trails.len()), Vec::<String>::new());
        assert!(new.equal_records.1 > 1000, "{new:?}");
    }

    let none = Stage::new(World::new(&casters()).unwrap());
    let wide = under(casters(), common::scenes::sky(128, 32));
    let low = under(casters(), common::scenes::sky(64, 16));
    for (stage, expected) in [
        (&none, ("columns of its environment", 0, 64)),
        (&wide, ("columns of its environment", 128, 64)),
        (&low, ("rows of its environment", 16, 32)),
    ] {
        let mut encoder = encoder(device);
        let error = refit.update(device, &mut encoder, &mut scene, &stage.world);
        assert_eq!(scene_changed(&error.unwrap_err()), Some(expected));
    }
    // A plan of another sky than the scene's.
    let error = traced(gpu, tracer, encoder(device), &scene, &low.plan(&options())).err();
    let expected = ("rows of its environment", 16, 32);
    assert_eq!(scene_changed(&error.unwrap()), Some(expected));
    let bare = SceneBuffers::new(device, &none.world).unwrap();
    let error = traced(gpu, tracer, encoder(device), &bare, &plan).err();
    let expected = ("columns of its environment", 64, 0);
    assert_eq!(scene_changed(&error.unwrap()), Some(expected));
}

/// What a camera sees of a scene, and its photons by the CPU.
fn seen(mut scene: Scene, sky: Environment, options: &TraceOptions) -> stage::Stage {
    scene.set_environment(Some(sky));
    let Stage { world, rays } = Stage::new(World::new(&scene).unwrap());
    let map = trace_photons(&world, &rays, options, &|_| {}).unwrap();
    let (eye, at) = ([1.0, 4.0, 5.0], [0.2, 0.3, 0.0]);
    stage::Stage {
        photons: map.photons,
        camera: Camera::look_at("", eye, at, [0.0, 1.0, 0.0], 0.9).unwrap(),
        world,
        rays,
    }
}

#[test]
fn the_picture_is_that_of_the_cpu() {
    let Some((device, queue)) = stage::device_with(wgpu::Features::empty()) else {
        return;
    };
    let options = TraceOptions {
        // Half as many have footprints so wide that shaders draw them 1.1e-3 differently.
        photons: 40_000,
        ..options()
    };
    let sky = sky(256, 128);
    let ours = seen(casters(), sky.clone(), &options);
    let picture = ours.picture(&ours.camera, [200, 150]);
    let expected = ours.splat(&picture, &FootprintOptions::default()).unwrap();
    let plan = TracePlan::new(&ours.world, &ours.rays, &options).unwrap();
    let scene = SceneBuffers::new(&device, &ours.world).unwrap();
    let light = FrameLight::Traced {
        scene: &scene,
        plan: &plan,
    };
    let renderer = RendererOptions::default();
    let (found, stats) = stage::irradiance_of(&device, &queue, &renderer, &picture, light).unwrap();
    // To the bit that of the CPU's photons, drawn by the same splat.
    let photons = [&ours.photons[..]];
    let (drawn, _) = stage::irradiance(&device, &queue, &renderer, &picture, &photons).unwrap();
    if device.adapter_info().device_type == wgpu::DeviceType::Cpu {
        assert!(found == drawn);
    }
    let found = picture.radiance(&found);
    let (off, wrong) = stage::differences(&picture, &found, &expected);
    println!("off by {off:.2e}, {wrong:.2e} of the pixels, {stats:?}");
    assert!(off < 1e-3, "{off}, {wrong} of the pixels, {stats:?}");
    // Control: under another sky it is another picture.
    let other = seen(casters(), mirrored(&sky), &options);
    let other = other.splat(&picture, &FootprintOptions::default()).unwrap();
    let (off, _) = stage::differences(&picture, &found, &other);
    assert!(off > 0.1, "{off}");
}
