//! The GPU traces the photons that the CPU traces.

mod common;

use std::path::PathBuf;
use std::time::Instant;

use caustics_sampling::PointSet;
use caustics_scene::gltf::load_path;
use caustics_scene::{BvhOptions, World};
use caustics_trace::{EmissionSample, Emitter, MediumStack, PhotonTrail, TraceOptions, trace_photon};
use caustics_wgpu::glam::Vec3;
use caustics_wgpu::{FootprintRecord, PhotonBuffers, PhotonTracer, SceneBuffers, TraceCounters, TracePlan, wgpu};

fn world(name: &str) -> World {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "../../tests/scenes", name].iter().collect();
    World::new(&load_path(path).unwrap().scene).unwrap()
}

fn cpu(world: &World, options: &TraceOptions) -> Vec<PhotonTrail> {
    let rays = world.intersector(&BvhOptions::default()).unwrap();
    let emitters = Emitter::all(world, options.aim);
    let counts = Emitter::share(&emitters, options.photons);
    let mut all = Vec::new();
    for (emitter, &count) in emitters.iter().zip(&counts) {
        let media = emitter.start().map_or(MediumStack::EMPTY, |start| MediumStack::at(world, &rays, start));
        let points = PointSet::new(options.sequence, count, options.seed);
        for index in 0..count {
            let sample = EmissionSample::of(&points, index);
            let number = all.len() as u32;
            let trail = if emitter.dimensions() == 2 {
                emitter.emit::<2>(&sample).map(|it| trace_photon(world, &rays, options, &it, media, number).unwrap())
            } else {
                emitter.emit::<4>(&sample).map(|it| trace_photon(world, &rays, options, &it, media, number).unwrap())
            };
            all.push(trail.unwrap_or_default());
        }
    }
    all
}

#[test]
fn explore() {
    let Some((device, queue)) = common::test_device() else { return };
    let start = Instant::now();
    let tracer = PhotonTracer::new(&device);
    println!("pipelines {:?}", start.elapsed());
    let names = std::env::var("SCENES").unwrap_or("p01_sphere p02_sphere_box p03_cognac p04_sphere_in_box p05_brass_ring p06_wave_plane p07_pool p08_square p09_cornell p10_torus_cube".into());
    let options = TraceOptions { photons: std::env::var("PHOTONS").map_or(100_000, |it| it.parse().unwrap()), ..TraceOptions::default() };
    for name in names.split(' ') {
        let world = world(&format!("{name}.glb"));
        let rays = world.intersector(&BvhOptions::default()).unwrap();
        let start = Instant::now();
        let trails = cpu(&world, &options);
        let cpu_time = start.elapsed();
        let plan = TracePlan::new(&world, &rays, &options).unwrap();
        let start = Instant::now();
        let scene = SceneBuffers::new(&device, &world).unwrap();
        let upload_time = start.elapsed();
        let buffers = PhotonBuffers::new(&device, options.photons, 1_000_000).unwrap();
        let mut times = Vec::new();
        for _ in 0..2 {
            let start = Instant::now();
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            buffers.clear(&mut encoder);
            tracer.trace(&device, &mut encoder, &scene, &plan, 0..plan.photons(), &buffers).unwrap();
            queue.submit([encoder.finish()]);
            device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            times.push(start.elapsed());
        }
        let counters = TraceCounters::new(&common::words(&device, &queue, buffers.counters()), &plan).unwrap();
        let records = common::words(&device, &queue, buffers.records());
        let records: &[FootprintRecord] = bytemuck::cast_slice(&records);
        let links = common::words(&device, &queue, buffers.links());
        println!("{name}: cpu {cpu_time:?}, build {upload_time:?}, gpu {times:?}, imbalance {:.1e}", counters.ledger.imbalance());
        let mut ledger = caustics_trace::EnergyLedger::default();
        for trail in &trails { ledger.merge(&trail.ledger); }
        println!("  stored {} vs {}, rays {} vs {}, fallbacks {} vs {}, bounded {} vs {} crowded {}", counters.stored, ledger.entry(caustics_trace::Fate::Stored).count, counters.ledger.rays, ledger.rays, counters.ledger.normal_fallbacks, ledger.normal_fallbacks, counters.ledger.bounded_differentials, ledger.bounded_differentials, counters.crowded.count);
        for fate in caustics_trace::Fate::ALL {
            let (g, c) = (counters.ledger.entry(fate), ledger.entry(fate));
            if g.count + c.count > 0 { println!("  {:?}: {} {} flux {:.6} {:.6}", fate, g.count, c.count, g.flux, c.flux); }
        }
        let size = world.bounds().diagonal().length();
        let (mut same, mut other) = (0, 0);
        let mut pos = Vec::new(); let mut flux = Vec::new(); let mut axes = Vec::new();
        for (number, trail) in trails.iter().enumerate() {
            let mut chain = Vec::new();
            let mut next = links[number];
            while next != 0 {
                chain.push(next - 1);
                let at = options.photons as usize + 2 * (next as usize - 1);
                next = links[at];
            }
            chain.reverse();
            let paths: Vec<u32> = chain.iter().map(|&slot| links[options.photons as usize + 2 * slot as usize + 1]).collect();
            if paths == trail.paths { same += 1 } else { other += 1; continue }
            for (&slot, photon) in chain.iter().zip(&trail.photons) {
                let r = &records[slot as usize];
                assert_eq!(r.photon as usize, number);
                pos.push(Vec3::from(r.position).distance(photon.position) / size);
                flux.push((r.flux() - photon.flux).abs().max_element() / photon.flux.max_element());
                let scale = photon.axes[0].length().max(photon.axes[1].length());
                let err = (Vec3::from(r.axis_u) - photon.axes[0]).length().max((Vec3::from(r.axis_v) - photon.axes[1]).length()) / scale;
                if err > 1e-3 { println!("  {number}: {err} {r:?} {photon:?}"); }
                axes.push((Vec3::from(r.axis_u) - photon.axes[0]).length().max((Vec3::from(r.axis_v) - photon.axes[1]).length()) / scale);
            }
        }
        for v in [&mut pos, &mut flux, &mut axes] { v.sort_by(f32::total_cmp); }
        let q = |v: &Vec<f32>| [0.5, 0.99, 0.999, 0.9999, 1.0].map(|p| format!("{:.1e}", v.get(((v.len() as f64 - 1.0) * p) as usize).copied().unwrap_or(0.0)));
        println!("  same {same}, other {other}: {:.5}", other as f64 / trails.len() as f64);
        println!("  positions {:?}", q(&pos)); println!("  flux {:?}", q(&flux)); println!("  axes {:?}", q(&axes));
    }
}
