//! Lights, materials, sequences and ways of branching that the ten scenes do not have.

use crate::common;

use caustics_geometry::shapes::{cuboid, icosphere, quad, torus};
use caustics_sampling::Sequence;
use caustics_scene::{Light, Material, World};
use caustics_trace::{Aim, Branching, EmissionPlan, Fate, TraceOptions};
use caustics_wgpu::glam::Vec3;
use caustics_wgpu::{PhotonTracer, wgpu};

use common::scenes::{add, add_mesh, ball, casters, floor, glass, lamp, lit, sky, under};
use common::tracing::{
    Difference, Stage, ledger_of, shared_tracer, trace_on_gpu, trails_by_cpu, unlike_lines,
};

type Gpu = (wgpu::Device, wgpu::Queue);

const PHOTONS: u32 = 4_000;

fn options() -> TraceOptions {
    TraceOptions {
        photons: PHOTONS,
        ..TraceOptions::default()
    }
}

/// Traces on both sides, and holds the GPU to its promise.
fn hold(
    gpu: &Gpu,
    tracer: &PhotonTracer,
    name: &str,
    stage: &Stage,
    options: &TraceOptions,
) -> Difference {
    let plan = stage.plan(options);
    let traced = trace_on_gpu(gpu, tracer, stage, &plan, 8 * options.photons);
    let trails = trails_by_cpu(stage, options);
    assert_eq!(traced.counters.crowded.count, 0, "{name}");
    let difference = Difference::between(&stage.world, &trails, &traced);
    let ledger = ledger_of(&trails, &plan);
    println!("{name}: {difference:?}");
    let mut beyond = difference.beyond_promise(trails.len());
    beyond.extend(unlike_lines(&traced.counters.ledger, &ledger, trails.len()));
    assert_eq!(beyond, Vec::<String>::new(), "{name}");
    assert!(difference.equal_records.1 > 40, "{name}");
    difference
}

fn with_tracer(test: impl Fn(&Gpu, &PhotonTracer)) {
    if let Some((gpu, tracer)) = shared_tracer() {
        test(gpu, tracer);
    }
}

#[test]
fn every_sequence_and_seed() {
    with_tracer(|gpu, tracer| {
        let stage = lit(glass(), lamp());
        for sequence in Sequence::ALL {
            for seed in [0, 0x1234_5678_9abc_def0] {
                let options = TraceOptions {
                    sequence,
                    seed,
                    ..options()
                };
                hold(gpu, tracer, &format!("{sequence} {seed}"), &stage, &options);
            }
        }
    });
}

#[test]
fn every_way_of_branching() {
    with_tracer(|gpu, tracer| {
        let stage = lit(glass(), lamp());
        for branching in [
            Branching::Roulette,
            Branching::SplitFirst,
            Branching::SplitAll,
        ] {
            for (min_weight, max_depth) in [(0.0, 6), (0.03, 128), (1.0, 128)] {
                let options = TraceOptions {
                    branching,
                    min_weight,
                    max_depth,
                    ..options()
                };
                let name = format!("{branching:?} {min_weight} {max_depth}");
                hold(gpu, tracer, &name, &stage, &options);
            }
        }
    });
}

#[test]
fn every_light() {
    with_tracer(|gpu, tracer| {
        let spot = Light::spot([1.0, 3.0, 0.0], [-0.3, -1.0, 0.0], [9.0; 3], 0.1, 0.4).unwrap();
        let wide = Light::spot([0.0, 1.0, 2.0], [0.0, 0.0, -1.0], [9.0; 3], 0.2, 1.5).unwrap();
        let sun = Light::directional([-0.3, -1.0, -0.1], [100.0, 90.0, 70.0]).unwrap();
        for (name, light) in [
            ("spot", spot),
            ("wide", wide),
            ("sun", sun),
            ("lamp", lamp()),
        ] {
            let stage = lit(glass(), light);
            for aim in [Aim::Casters, Aim::Everywhere] {
                let options = TraceOptions { aim, ..options() };
                hold(gpu, tracer, &format!("{name} {aim:?}"), &stage, &options);
            }
        }
    });
}

#[test]
fn lights_with_an_area() {
    with_tracer(|gpu, tracer| {
        let edges = [[1.0, 0.0, 0.0], [0.0, 0.2, 1.0]];
        let panel = Light::rectangle([-0.5, 3.0, -0.5], edges, [4.0, 3.0, 2.0]).unwrap();
        let disc = Light::disc([0.3, 3.0, 0.0], [0.1, -1.0, 0.0], 0.4, [4.0; 3]).unwrap();
        let bulb = Light::sphere([0.3, 3.0, 0.2], 0.3, [4.0; 3]).unwrap();
        let corners = [[-0.5, 3.0, -0.5], [0.1, 2.8, 0.9], [0.9, 3.1, -0.2]];
        // With its front down.
        let [a, b, c] = corners;
        let shard = Light::triangle([a, c, b], [4.0, 3.0, 2.0]).unwrap();
        for (name, light) in [
            ("panel", panel),
            ("shard", shard),
            ("disc", disc),
            ("bulb", bulb),
        ] {
            let stage = lit(glass(), light);
            for aim in [Aim::Casters, Aim::Everywhere] {
                let options = TraceOptions { aim, ..options() };
                hold(gpu, tracer, &format!("{name} {aim:?}"), &stage, &options);
            }
        }
    });
}

#[test]
fn environments() {
    with_tracer(|gpu, tracer| {
        let stage = under(casters(), sky(96, 48));
        let many = TraceOptions {
            photons: 4 * PHOTONS,
            ..options()
        };
        let trails = trails_by_cpu(&stage, &many);
        let ledger = ledger_of(&trails, &stage.plan(&many));
        // What several casters' discs cover is emitted more than once.
        assert!(ledger.entry(Fate::Overlap).count > 100, "{ledger:?}");
        for sequence in Sequence::ALL {
            for (seed, aim) in [
                (0, Aim::Casters),
                (0x1234_5678_9abc_def0, Aim::Casters),
                (5, Aim::Everywhere),
            ] {
                let options = TraceOptions {
                    sequence,
                    seed,
                    aim,
                    ..many
                };
                let name = format!("sky {sequence} {seed} {aim:?}");
                let difference = hold(gpu, tracer, &name, &stage, &options);
                difference.hold_bits(&gpu.0, &name);
                // Footprints of both kinds: in the light of the sun, and of the rest.
                let (overlaps, all) = (difference.overlaps, difference.equal_records.1);
                assert!(10 * overlaps > all && overlaps < all, "{name}: {overlaps}");
            }
        }
        let mut scene = casters();
        scene.add_light(lamp()).unwrap();
        let stage = under(scene, sky(7, 5));
        let name = "sky and lamp";
        let difference = hold(gpu, tracer, name, &stage, &options());
        difference.hold_bits(&gpu.0, name);
    });
}

/// Casters that hide each other, seen from several lights.
#[test]
fn casters_that_overlap() {
    with_tracer(|gpu, tracer| {
        let mut scene = floor();
        // So thin that most photons to them miss, and so many photons that maps are worth drawing.
        let thin = torus(0.8, 0.02, 64, 16).unwrap();
        for place in 0..3 {
            let at = Vec3::new(0.5 * place as f32, 0.5 + 0.4 * place as f32, 0.0);
            let material = Material::dielectric("ring", 1.5);
            add_mesh(&mut scene, thin.clone(), at, material);
        }
        add(
            &mut scene,
            ball(0.2),
            Vec3::new(2.5, 0.4, 0.3),
            Material::metal("", [0.8; 3]),
        );
        scene.add_light(lamp()).unwrap();
        let spot = Light::spot([2.0, 3.0, 1.0], [-0.5, -1.0, -0.4], [9.0; 3], 0.3, 0.7);
        scene.add_light(spot.unwrap()).unwrap();
        let sun = Light::directional([-0.5, -1.0, 0.1], [3.0; 3]).unwrap();
        scene.add_light(sun).unwrap();
        let bulb = Light::sphere([-0.5, 3.0, 0.2], 0.3, [4.0; 3]).unwrap();
        scene.add_light(bulb).unwrap();
        let stage = Stage::new(World::new(&scene).unwrap());
        let options = options();
        for sequence in [Sequence::Grid, Sequence::Sobol] {
            let options = TraceOptions {
                sequence,
                photons: 16 * PHOTONS,
                ..options
            };
            let plan = EmissionPlan::new(&stage.world, &stage.rays, &options).unwrap();
            assert!(plan.batches().len() > 8);
            assert!(plan.batches().iter().any(|batch| batch.map().is_some()));
            let trails = trails_by_cpu(&stage, &options);
            let ledger = ledger_of(&trails, &stage.plan(&options));
            assert!(ledger.entry(Fate::Overlap).count > 100, "{ledger:?}");
            hold(
                gpu,
                tracer,
                &format!("overlap {sequence}"),
                &stage,
                &options,
            );
        }
    });
}

#[test]
fn surfaces_that_shine() {
    with_tracer(|gpu, tracer| {
        let shining = |double_sided| Material {
            emission: Vec3::new(3.0, 2.0, 1.0),
            double_sided,
            ..Material::diffuse("shining", [0.5; 3])
        };
        let mut scene = glass();
        let panel = quad([-0.5, 3.0, -0.5], [1.0, 0.0, 0.0], [0.0, 0.3, 1.0]).unwrap();
        add_mesh(&mut scene, panel, Vec3::ZERO, shining(true));
        let lumpy = icosphere(0.2, 1).unwrap();
        add_mesh(&mut scene, lumpy, Vec3::new(1.5, 2.0, 0.0), shining(false));
        add(
            &mut scene,
            ball(0.15),
            Vec3::new(-1.5, 1.5, 0.0),
            shining(false),
        );
        scene.add_light(lamp()).unwrap();
        let stage = Stage::new(World::new(&scene).unwrap());
        for aim in [Aim::Casters, Aim::Everywhere] {
            let options = TraceOptions { aim, ..options() };
            hold(gpu, tracer, &format!("shining {aim:?}"), &stage, &options);
        }
    });
}

#[test]
fn every_material() {
    with_tracer(|gpu, tracer| {
        let prism = cuboid([1.0, 1.0, 1.0]).unwrap();
        let mut dispersing = floor();
        let flint = Material::dielectric("flint", 1.7).with_dispersion(0.6);
        let tinted = Material::dielectric("tinted", 1.4)
            .with_attenuation(Vec3::new(0.2, 1.0, 3.0))
            .with_dispersion(0.2);
        add_mesh(
            &mut dispersing,
            prism.clone(),
            Vec3::new(0.2, 0.8, 0.1),
            flint,
        );
        add_mesh(&mut dispersing, prism, Vec3::new(1.5, 0.8, 0.1), tinted);
        hold(
            gpu,
            tracer,
            "dispersion",
            &lit(dispersing, lamp()),
            &options(),
        );

        let mut gold = floor();
        let metal = Material::metal("gold", [1.0, 0.76, 0.33]);
        add_mesh(
            &mut gold,
            torus(0.8, 0.2, 64, 32).unwrap(),
            0.4 * Vec3::Y,
            metal,
        );
        hold(gpu, tracer, "metal", &lit(gold, lamp()), &options());
    });
}

#[test]
fn bodies_that_nest_and_overlap() {
    with_tracer(|gpu, tracer| {
        let mut scene = floor();
        let body = |ior, priority| Material::dielectric("", ior).with_priority(priority);
        let sizes = [
            (1.0, 1.3, 0),
            (0.8, 1.5, 2),
            (0.85, 1.36, -1),
            (0.3, 1.0, 3),
        ];
        for (edge, ior, priority) in sizes {
            let mesh = cuboid([edge, 0.9 * edge, 1.1 * edge]).unwrap();
            add_mesh(
                &mut scene,
                mesh,
                Vec3::new(0.05 * edge, 0.7, 0.0),
                body(ior, priority),
            );
        }
        // The lamp is inside the outermost body and the one in it.
        let inside = Light::point([0.05, 0.75, 0.32], [2.0; 3]).unwrap();
        for (name, light) in [("from outside", lamp()), ("from inside", inside)] {
            let mut scene = scene.clone();
            scene.add_light(light).unwrap();
            let stage = Stage::new(World::new(&scene).unwrap());
            // In which no photon has more branches waiting than the shaders have room for.
            let options = TraceOptions {
                seed: 1,
                ..options()
            };
            let difference = hold(gpu, tracer, name, &stage, &options);
            difference.hold_bits(&gpu.0, name);
        }
    });
}

#[test]
fn exact_spheres() {
    with_tracer(|gpu, tracer| {
        let mut scene = floor();
        let glass = Material::dielectric("glass", 1.5);
        add(&mut scene, ball(0.6), Vec3::new(0.0, 1.0, 0.0), glass);
        let mirror = Material::metal("mirror", [0.9; 3]);
        add(&mut scene, ball(0.4), Vec3::new(1.3, 0.6, 0.3), mirror);
        let water = Material::dielectric("water", 1.33).with_attenuation([0.5, 0.2, 0.1]);
        add(&mut scene, ball(0.5), Vec3::new(-1.2, 0.8, 0.2), water);
        let air = Material::dielectric("bubble", 1.0).with_priority(1);
        add(&mut scene, ball(0.2), Vec3::new(-1.15, 0.85, 0.2), air);
        let stage = lit(scene, lamp());
        hold(gpu, tracer, "spheres", &stage, &options());
        // No photon may meet the sphere that it has just left: it would be lost in it.
        let plan = stage.plan(&options());
        let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 8 * PHOTONS);
        assert_eq!(traced.counters.ledger.entry(Fate::TooDeep).count, 0);
    });
}
