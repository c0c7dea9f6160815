//! Photons go where they are wanted, and no light comes or goes by it.

use crate::common;

use caustics_geometry::shapes::icosphere;
use caustics_sampling::Sequence;
use caustics_scene::{Light, Material, Scene, SceneIntersector, World};
use caustics_trace::glam::{Quat, Vec3};
use caustics_trace::{Aim, EmissionPlan, Fate, PhotonMap, TraceOptions, trace_photons, trace_plan};
use common::scenes::{add_floor, add_mesh, flattened};

/// A glass ball over a floor, beside its place by that.
fn ball(beside: f32, light: Light) -> (World, SceneIntersector) {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 6.0);
    let mesh = icosphere(0.5, 5).expect("a mesh");
    let mesh = mesh.transformed(&caustics_trace::glam::Affine3A::from_rotation_translation(
        Quat::IDENTITY,
        Vec3::new(beside, 0.0, 0.0),
    ));
    add_mesh(
        &mut scene,
        "ball",
        mesh.expect("finite"),
        Material::dielectric("glass", 1.5),
    );
    scene.add_light(light).expect("a valid light");
    flattened(&scene)
}

fn lights() -> [Light; 4] {
    let at = [0.5, 3.0, 0.4];
    let down = [-0.1, -1.0, 0.05];
    let edges = [[0.4, 0.0, 0.0], [0.0, 0.0, 0.4]];
    [
        Light::point(at, [5.0; 3]),
        Light::spot(at, down, [5.0; 3], 0.2, 0.5),
        Light::directional(down, [1.0; 3]),
        Light::rectangle(at, edges, [5.0; 3]),
    ]
    .map(|it| it.expect("a valid light"))
}

fn options(guide_emission: bool) -> TraceOptions {
    TraceOptions {
        photons: 20_000,
        guide_emission,
        ..TraceOptions::default()
    }
}

fn trace((world, rays): &(World, SceneIntersector), options: &TraceOptions) -> PhotonMap {
    trace_photons(world, rays, options, &|_| {}).expect("valid options")
}

#[test]
fn no_light_comes_or_goes() {
    for light in lights() {
        let scene = ball(0.0, light);
        for sequence in Sequence::ALL {
            let [guided, even] = [true, false].map(|guide_emission| {
                trace(
                    &scene,
                    &TraceOptions {
                        sequence,
                        ..options(guide_emission)
                    },
                )
            });
            assert!(guided.ledger.imbalance() < 1e-6, "{sequence}");
            for fate in [Fate::Stored, Fate::Missed] {
                let [found, expected] = [&guided, &even].map(|it| it.ledger.entry(fate).flux.x);
                let all = even.ledger.emitted().flux.x;
                let off = (found - expected) / all;
                // Russian roulette and the sequences' own noise.
                assert!(off.abs() < 4e-3, "{light:?} {sequence} {fate:?}: {off}");
            }
        }
    }
}

/// The footprints' longer axes, in order, of photons that are not parts of others.
fn lengths(map: &PhotonMap) -> Vec<f32> {
    let longer = |axes: [Vec3; 2]| axes[0].length().max(axes[1].length());
    let mut lengths: Vec<f32> = map.photons.iter().map(|it| longer(it.axes)).collect();
    lengths.sort_by(f32::total_cmp);
    lengths
}

#[test]
fn footprints_are_more_alike() {
    for light in &lights()[..3] {
        let scene = ball(0.0, *light);
        let spread = |guide_emission: bool| {
            let plain = TraceOptions {
                divide_edges: false,
                ..options(guide_emission)
            };
            let lengths = lengths(&trace(&scene, &plain));
            let part = |part: f32| lengths[(part * (lengths.len() - 1) as f32) as usize];
            part(0.9) / part(0.3)
        };
        let (guided, even) = (spread(true), spread(false));
        println!("{guided} for {even}");
        assert!(guided < 0.75 * even, "{guided} for {even}: {light:?}");
    }
}

#[test]
fn nothing_is_guided_where_nothing_can_be_known_or_gained() {
    let (world, rays) = ball(0.0, lights()[0]);
    let is_guided = |options: &TraceOptions| {
        let plan = EmissionPlan::new(&world, &rays, options).expect("valid options");
        plan.batches().iter().any(|batch| batch.density().is_some())
    };
    let guided = options(true);
    assert!(is_guided(&guided));
    assert!(!is_guided(&options(false)));
    assert!(!is_guided(&TraceOptions {
        aim: Aim::Everywhere,
        ..guided
    }));
    assert!(!is_guided(&TraceOptions {
        differentials: false,
        ..guided
    }));
    assert!(!is_guided(&TraceOptions {
        photons: 500,
        ..guided
    }));
}

#[test]
fn densities_stay_while_rays_do() {
    let (world, rays) = ball(0.0, lights()[0]);
    let options = options(true);
    let first = EmissionPlan::new(&world, &rays, &options).expect("valid options");
    let follow = |plan: &EmissionPlan, beside: f32| {
        let (world, rays) = ball(beside, lights()[0]);
        let next = plan
            .following(&world, &rays, &options)
            .expect("valid options");
        let map = trace_plan(&world, &rays, &next, &options, &|_| {}).expect("valid options");
        assert!(map.ledger.imbalance() < 1e-6);
        next
    };
    // The first step takes wider cones, which serve for the others.
    let settled = follow(&first, 0.02);
    let next = follow(&settled, 0.021);
    let [before, after] = [&settled, &next].map(|it| &it.batches()[0]);
    assert_eq!(before.emitter().domain(), after.emitter().domain());
    assert_eq!(before.density(), after.density());
    assert!(before.density().is_some() && before.density() != first.batches()[0].density());
    for index in 0..before.count() {
        assert_eq!(before.sample(index), after.sample(index));
    }
    // But not where they are no longer asked for.
    let (world, rays) = ball(0.021, lights()[0]);
    for unguided in [
        self::options(false),
        TraceOptions {
            differentials: false,
            ..options
        },
    ] {
        let even = next
            .following(&world, &rays, &unguided)
            .expect("valid options");
        assert_eq!(even.batches()[0].density(), None);
        let guided = even
            .following(&world, &rays, &options)
            .expect("valid options");
        assert!(guided.batches()[0].density().is_some());
    }
}
