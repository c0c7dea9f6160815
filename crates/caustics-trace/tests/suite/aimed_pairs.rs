//! Pairs of a light and a caster: every caustic once, whatever overlaps, from photons that stay the
//! same.

use crate::common;

use caustics_geometry::shapes::quad;
use caustics_sampling::Sequence;
use caustics_scene::{Environment, Instance, Light, Material, Scene, Shape};
use caustics_trace::glam::Vec3;
use caustics_trace::{
    Aim, Casters, EmissionBatch, EmissionPlan, Fate, LightSource, Photon, PhotonMap, TraceOptions,
    trace_part, trace_photons, trace_plan,
};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened};
use proptest::prelude::*;

fn lamp() -> impl Strategy<Value = Light> {
    let above = Vec3::new(0.2, 4.0, -0.3);
    prop_oneof![
        Just(Light::point(above, [10.0; 3])),
        Just(Light::spot(above, -above, [10.0; 3], 0.2, 0.5)),
        Just(Light::directional([0.2, -1.0, 0.1], [1.0; 3])),
        Just(Light::rectangle(above, [Vec3::X, Vec3::Z], [3.0; 3])),
        Just(Light::disc(above, -above, 0.6, [3.0; 3])),
        Just(Light::sphere(above, 0.5, [3.0; 3])),
    ]
    .prop_map(|light| light.expect("a valid light"))
}

/// Balls of glass and metal that overlap, nest, and stand before each other.
fn heap(balls: &[([f32; 3], f32, bool)], light: Light) -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -2.0, 8.0);
    for &(center, radius, is_glass) in balls {
        let material = if is_glass {
            Material::dielectric("glass", 1.5)
        } else {
            Material::metal("metal", [0.9, 0.8, 0.5])
        };
        add_sphere(&mut scene, center.into(), radius, material);
    }
    scene.add_light(light).expect("a valid light");
    scene
}

fn trace(scene: &Scene, options: &TraceOptions) -> PhotonMap {
    let (world, intersector) = flattened(scene);
    trace_photons(&world, &intersector, options, &|_| {}).expect("valid options")
}

/// The stored flux: mean and standard error over seeds.
fn stored(scene: &Scene, aim: Aim, photons: u32) -> (f64, f64) {
    const SEEDS: u64 = 8;
    let values: Vec<f64> = (1..=SEEDS)
        .map(|seed| {
            let options = TraceOptions {
                photons,
                seed,
                aim,
                sequence: Sequence::Halton,
                ..TraceOptions::default()
            };
            let map = trace(scene, &options);
            assert!(map.ledger.imbalance() < 1e-6);
            map.ledger.entry(Fate::Stored).flux.x
        })
        .collect();
    let mean = values.iter().sum::<f64>() / SEEDS as f64;
    let variance = values.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
    (mean, (variance / SEEDS as f64).sqrt())
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(12)
    })]

    #[test]
    fn aimed_and_unaimed_photons_bring_the_same_light(
        balls in prop::collection::vec(
            (prop::array::uniform3(-1.2f32..1.2), 0.2f32..0.7, any::<bool>()), 2..6),
        light in lamp(),
    ) {
        let scene = heap(&balls, light);
        let (aimed, error) = stored(&scene, Aim::Casters, 8_192);
        let (unaimed, other) = stored(&scene, Aim::Everywhere, 65_536);
        // Standard errors of eight values are themselves uncertain, and sequences of low
        // discrepancy err less at random than by their structure.
        let allowed = 6.0 * error.hypot(other) + 2e-3 * unaimed;
        prop_assert!((aimed - unaimed).abs() < allowed, "{aimed} {unaimed} +- {allowed}");
    }
}

#[test]
fn a_sky_lights_overlapping_casters_aimed_as_unaimed() {
    let mut scene = heap(
        &row(),
        Light::point([0.0, 9.0, 0.0], [0.0; 3]).expect("valid"),
    );
    let pixels = (0..32 * 16).map(|it| [if it == 70 { 200.0 } else { 0.5 }; 3]);
    let sky = Environment::new(32, 16, pixels.collect()).expect("a sky");
    scene.set_environment(Some(sky));
    let (aimed, error) = stored(&scene, Aim::Casters, 8_192);
    let (unaimed, other) = stored(&scene, Aim::Everywhere, 65_536);
    let allowed = 6.0 * error.hypot(other) + 2e-3 * unaimed;
    println!("{aimed} {unaimed} +- {allowed}");
    assert!(
        (aimed - unaimed).abs() < allowed,
        "{aimed} {unaimed} +- {allowed}"
    );
}

/// Two glass balls, one behind the other as the lamp sees them, and a third that is only half
/// hidden.
fn row() -> Vec<([f32; 3], f32, bool)> {
    vec![
        ([0.0, 1.5, 0.0], 0.5, true),
        ([-0.05, 0.0, 0.05], 0.5, true),
        ([0.5, -1.0, 0.0], 0.5, false),
    ]
}

#[test]
fn what_two_pairs_cover_is_booked_and_counted_once() {
    for light in [
        Light::point([0.2, 4.0, -0.3], [10.0; 3]),
        Light::directional([0.0, -1.0, 0.0], [1.0; 3]),
        Light::disc([0.0, 4.0, 0.0], [0.0, -1.0, 0.0], 0.3, [3.0; 3]),
    ] {
        let scene = heap(&row(), light.expect("a valid light"));
        let (world, intersector) = flattened(&scene);
        // Cones, which are exactly as many: a projection map may leave some photons unused.
        let options = TraceOptions {
            photons: 40_000,
            aim: Aim::Cones,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
        assert_eq!(plan.casters().len(), 3);
        let total: u32 = plan.batches().iter().map(EmissionBatch::count).sum();
        assert_eq!(total, 40_000);
        let map = trace_plan(&world, &intersector, &plan, &options, &|_| {});
        let ledger = map.expect("valid options").ledger;
        let overlap = ledger.entry(Fate::Overlap);
        assert!(overlap.count > 1000, "{}", overlap.count);
        let power = plan.batches()[0].emitter().power();
        let emitted = ledger.emitted().flux - overlap.flux;
        assert!((emitted - power).length() < 1e-9 * power.length());
        assert!(ledger.entry(Fate::Unaimed).flux.min_element() > 0.0);
        // Without the rule, the overlap would be a good part of the caustic.
        assert!(overlap.flux.x > 0.05 * ledger.entry(Fate::Stored).flux.x);
    }
}

#[test]
fn parts_join_to_the_whole() {
    let scene = apart(0.0);
    let (world, intersector) = flattened(&scene);
    let options = TraceOptions {
        photons: 9_000,
        // A part does not know the neighbours of its last photons.
        check_footprints: false,
        ..TraceOptions::default()
    };
    let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
    let whole = trace_plan(&world, &intersector, &plan, &options, &|_| {}).expect("valid options");
    let mut photons = Vec::new();
    let mut rays = 0;
    for start in (0..plan.count()).step_by(777) {
        let part = trace_part(&world, &intersector, &plan, &options, start..start + 777);
        let part = part.expect("valid options");
        assert!(part.ledger.imbalance() < 1e-6);
        photons.extend(part.photons);
        rays += part.ledger.rays;
    }
    assert!(photons == whole.photons);
    assert_eq!(rays, whole.ledger.rays);
    let beyond = trace_part(
        &world,
        &intersector,
        &plan,
        &options,
        plan.count()..u32::MAX,
    );
    assert!(beyond.expect("valid options").photons.is_empty());
}

#[test]
fn photons_are_shared_by_caustic_power_with_a_floor() {
    let mut scene = heap(
        &row()[..1],
        Light::point([0.0, 4.0, 0.0], [1000.0; 3]).expect("valid"),
    );
    scene
        .add_light(Light::point([2.0, 4.0, 0.0], [1.0; 3]).expect("valid"))
        .expect("valid");
    let (world, intersector) = flattened(&scene);
    for (floor, least) in [(0.25, 1250), (1.0, 5000), (0.0, 1)] {
        let options = TraceOptions {
            photons: 10_000,
            share_floor: floor,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
        let counts: Vec<u32> = plan.batches().iter().map(EmissionBatch::count).collect();
        assert_eq!(counts.iter().sum::<u32>(), 10_000);
        assert!(counts[1] >= least, "{floor}: {counts:?}");
        // A thousandth of the power from farther away.
        assert!(floor > 0.0 || counts[1] < 12, "{counts:?}");
    }
    // What cannot be reached gets nothing: a spot light that shines upwards.
    scene
        .add_light(
            Light::spot([0.0, 4.0, 1.0], [0.0, 1.0, 0.0], [9.0; 3], 0.2, 0.4).expect("valid"),
        )
        .expect("valid");
    let (world, intersector) = flattened(&scene);
    let options = TraceOptions::default();
    let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
    assert_eq!(plan.batches()[2].count(), 0);
    assert_eq!(
        plan.batches()[2].emitter().source(),
        LightSource::Light { index: 2 }
    );
}

/// Two glass balls far apart, each over a floor of its own, under a lamp and the sun.
fn apart(moved: f32) -> Scene {
    let mut scene = Scene::new();
    let glass = Material::dielectric("glass", 1.5);
    for (x, shift) in [(-4.0, 0.0), (4.0, moved)] {
        let corner = Vec3::new(x - 1.5, -1.0, 1.5);
        let floor = quad(corner, 3.0 * Vec3::X, -3.0 * Vec3::Z).expect("a valid floor");
        add_mesh(
            &mut scene,
            "floor",
            floor,
            Material::diffuse("white", [0.8; 3]),
        );
        add_sphere(&mut scene, Vec3::new(x, shift, 0.0), 0.5, glass.clone());
    }
    // No light goes from the one to the other.
    let wall = quad([0.0, -1.5, -4.0], 4.0 * Vec3::Y, 8.0 * Vec3::Z).expect("a valid wall");
    add_mesh(
        &mut scene,
        "wall",
        wall,
        Material::diffuse("white", [0.8; 3]),
    );
    let post = scene
        .add_material(Material::diffuse("grey", [0.2; 3]))
        .expect("valid");
    let shape = Shape::Sphere {
        center: Vec3::new(0.0, 7.0, 0.0),
        radius: 0.1,
    };
    scene
        .add_instance(Instance::new("post", shape, post))
        .expect("valid");
    for light in [
        Light::point([0.0, 4.0, 0.0], [10.0; 3]),
        Light::directional([0.0, -1.0, 0.0], [1.0; 3]),
        Light::disc([0.0, 5.0, 1.0], [0.0, -1.0, 0.0], 0.5, [10.0; 3]),
    ] {
        scene
            .add_light(light.expect("a valid light"))
            .expect("valid");
    }
    scene
}

/// The photons of the first ball, which all land on its own floor.
fn of_first_ball(map: &PhotonMap) -> Vec<Photon> {
    map.photons
        .iter()
        .filter(|it| it.object == 0)
        .copied()
        .collect()
}

#[test]
fn moving_one_caster_changes_no_photon_of_another() {
    for sequence in Sequence::ALL {
        for seed in [0, 7] {
            let options = TraceOptions {
                photons: 6_000,
                sequence,
                seed,
                ..TraceOptions::default()
            };
            let (world, intersector) = flattened(&apart(0.0));
            let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
            let before = trace_plan(&world, &intersector, &plan, &options, &|_| {});
            let before = before.expect("valid options");
            let (world, intersector) = flattened(&apart(0.07));
            let plan = plan
                .following(&world, &intersector, &options)
                .expect("valid options");
            let after = trace_plan(&world, &intersector, &plan, &options, &|_| {});
            let after = after.expect("valid options");
            let kept = of_first_ball(&before);
            assert!(kept.len() > 1500, "{}", kept.len());
            // Roulette had a say in them.
            assert!(before.ledger.entry(Fate::Roulette).count > 100);
            assert!(kept == of_first_ball(&after), "{sequence} {seed}");
            assert!(before.photons != after.photons, "{sequence} {seed}");
        }
    }
}

/// A pair that comes to count for much more or less has its photons shared anew.
#[test]
fn a_plan_follows_large_changes() {
    let options = TraceOptions {
        photons: 6_000,
        ..TraceOptions::default()
    };
    let counts = |plan: &EmissionPlan| -> Vec<u32> {
        plan.batches().iter().map(EmissionBatch::count).collect()
    };
    let (world, intersector) = flattened(&apart(0.0));
    let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
    let (world, intersector) = flattened(&apart(2.5));
    let moved = plan
        .following(&world, &intersector, &options)
        .expect("valid options");
    assert_ne!(counts(&plan), counts(&moved));
    let fresh = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
    assert_eq!(counts(&fresh), counts(&moved));
    // And so does the number of photons itself.
    let more = TraceOptions {
        photons: 7_000,
        ..options
    };
    let larger = plan
        .following(&world, &intersector, &more)
        .expect("valid options");
    assert_eq!(counts(&larger).iter().sum::<u32>(), 7_000);
}

#[test]
fn objects_that_nest_are_one_caster() {
    let balls = [
        ([0.0, 0.0, 0.0], 1.0, true),
        ([0.1, 0.0, 0.0], 0.5, true),
        ([3.0, 0.0, 0.0], 0.5, false),
    ];
    let light = Light::point([0.0, 4.0, 0.0], [1.0; 3]).expect("valid");
    let (world, _) = flattened(&heap(&balls, light));
    let casters = Casters::of(&world);
    assert_eq!(casters.len(), 2);
    // Object 0 is the floor.
    assert_eq!(casters.objects(0), [1, 2]);
    assert_eq!(casters.objects(1), [3]);
    assert_eq!(casters.of_object(0), None);
    assert_eq!(casters.of_object(3), Some(1));
    assert!(casters.objects(2).is_empty());
}
