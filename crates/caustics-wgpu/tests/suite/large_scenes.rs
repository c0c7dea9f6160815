//! Half a million triangles and two million photons, within WebGPU's default limits.

use crate::stage;

use caustics_geometry::shapes::{heightfield, quad};
use caustics_gpu_readback::{read_buffer, read_texture};
use caustics_scene::{BvhOptions, Camera, Instance, Light, Material, Scene, Shape, Surface, World};
use caustics_trace::TraceOptions;
use caustics_wgpu::glam::{Affine3A, Vec3};
use caustics_wgpu::{
    CausticsRenderer, FrameLight, FrameParams, GpuError, RendererError, RendererOptions,
    SceneBuffers, SplatStats, TraceCounters, TracePlan, wgpu,
};
use stage::{Stage, TestError, device_with};

/// Water with ripples of so many triangles over a white or a glossy ground, in the sun.
fn pool(cells: u32, ground: Surface) -> Result<Scene, TestError> {
    let mut scene = Scene::new();
    let ripples = |x: f32, z: f32| 0.01 * (9.0 * x).sin() * (7.0 * z + 1.0).cos();
    let water = scene.add_mesh(heightfield([2.0, 2.0], [cells, cells], ripples)?);
    let white = scene.add_mesh(quad([-1.5, 0.0, 1.5], [3.0, 0.0, 0.0], [0.0, 0.0, -3.0])?);
    for (mesh, height, material) in [
        (water, 0.6, Material::dielectric("water", 1.33)),
        (white, 0.0, Material::new("ground", ground)),
    ] {
        let material = scene.add_material(material)?;
        scene.add_instance(Instance {
            transform: Affine3A::from_translation(height * Vec3::Y),
            ..Instance::new("", Shape::Mesh(mesh), material)
        })?;
    }
    scene.add_light(Light::directional([0.2, -1.0, 0.1], [1.0; 3])?)?;
    let eye = [0.3, 3.0, 3.0];
    scene.add_camera(Camera::look_at("above", eye, [0.0; 3], Vec3::Y, 0.8)?)?;
    Ok(scene)
}

/// The light of a frame, and what became of photons and footprints.
struct Frame {
    light: f64,
    counters: Vec<TraceCounters>,
    stats: SplatStats,
}

fn draw(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    scene: &Scene,
    photons: u32,
    options: &RendererOptions,
) -> Result<Frame, TestError> {
    let world = World::new(scene)?;
    let rays = world.intersector(&BvhOptions::default())?;
    let trace = TraceOptions {
        photons,
        ..TraceOptions::default()
    };
    let plan = TracePlan::new(&world, &rays, &trace)?;
    let buffers = SceneBuffers::new(device, &world)?;
    let camera = scene.cameras()[0].clone();
    let stage = Stage {
        photons: Vec::new(),
        world,
        rays,
        camera,
    };
    let picture = stage.picture(&stage.camera, [160, 120]);
    let textures = picture.textures(device, queue);
    let mut renderer = CausticsRenderer::new(device, options)?;
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let light = FrameLight::Traced {
        scene: &buffers,
        plan: &plan,
    };
    let views = [picture.view(&textures)];
    let frame = FrameParams {
        light,
        views: &views,
    };
    let prepared = renderer.prepare(device, queue, &mut encoder, &frame)?;
    queue.submit([encoder.finish()]);
    let texture = prepared.irradiance(0)?.texture().clone();
    let texels = read_texture(device, queue, &texture, 16)?;
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&texels);
    let stats = read_buffer(device, queue, prepared.stats(0)?, SplatStats::BYTES)?;
    let mut counters = Vec::new();
    for batch in prepared.photons() {
        let words = 4 * TraceCounters::WORDS as u64;
        let words = read_buffer(device, queue, batch.counters(), words)?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&words);
        counters.push(TraceCounters::new(&words, &plan)?);
    }
    Ok(Frame {
        light: texels.iter().map(|it| f64::from(it[0])).sum(),
        counters,
        stats: SplatStats::from_bytes(&stats).ok_or("too short")?,
    })
}

const WHITE: Surface = Surface::Diffuse {
    albedo: Vec3::splat(0.8),
};

#[test]
fn glossy_receivers_are_refused_unless_they_may_be_matt() -> Result<(), TestError> {
    let Some(gpu) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let glossy = Surface::Glossy {
        base_color: Vec3::splat(0.8),
        metallic: 0.0,
        roughness: 0.3,
    };
    let scene = pool(8, glossy)?;
    let refused = draw(&gpu, &scene, 500, &RendererOptions::default());
    let error = refused.err().ok_or("it was not refused")?;
    let error = error.downcast::<RendererError>()?;
    let is_named = matches!(*error, RendererError::Gpu(GpuError::Unsupported { .. }));
    assert!(is_named, "{error}");
    let options = RendererOptions {
        glossy_as_matt: true,
        ..RendererOptions::default()
    };
    // The light lands as on a matt ground. The stage's camera takes no glossy receiver for one, so
    // that none of it is seen.
    let landings = |frame: &Frame| frame.counters.iter().map(|it| it.stored).sum::<u32>();
    let glossy = draw(&gpu, &scene, 500, &options)?;
    let matt = draw(&gpu, &pool(8, WHITE)?, 500, &RendererOptions::default())?;
    assert!(landings(&glossy) > 0);
    assert_eq!(landings(&glossy), landings(&matt));
    assert!(glossy.light == 0.0 && matt.light > 0.0);
    Ok(())
}

#[test]
#[ignore = "takes minutes on a software adapter, and 2 GB"]
fn half_a_million_triangles_and_two_million_photons_are_drawn() -> Result<(), TestError> {
    let Some(gpu) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let scene = pool(500, WHITE)?;
    let options = RendererOptions::default();
    let few = draw(&gpu, &scene, 20_000, &options)?;
    let many = draw(&gpu, &scene, 2_000_000, &options)?;
    let triangles = World::new(&scene)?.triangles().len();
    let stored: u32 = many.counters.iter().map(|it| it.stored).sum();
    println!("{triangles} triangles, {stored} landings, {:?}", many.stats);
    assert!(triangles >= 500_000);
    assert!(many.counters.len() > 1);
    let crowded: u64 = many.counters.iter().map(|it| it.crowded.count).sum();
    assert_eq!((crowded, many.stats.dropped_pairs), (0, 0));
    // The same light as of few photons.
    assert!(
        (many.light / few.light - 1.0).abs() < 0.02,
        "{} {}",
        many.light,
        few.light
    );
    Ok(())
}
