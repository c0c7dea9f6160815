//! Photons that are kept from frame to frame are those that tracing everything would give.

use crate::common;

use caustics_geometry::Aabb;
use caustics_geometry::shapes::{cuboid, torus};
use caustics_sampling::Sequence;
use caustics_scene::{Light, Material, Scene};
use caustics_trace::glam::{Affine3A, Quat, Vec3};
use caustics_trace::{Change, Fate, LightSource, LivePhotons, PhotonMap, TraceOptions, trace_plan};
use common::scenes::{add_box, add_floor, add_mesh, add_sphere, flattened};
use proptest::prelude::*;

/// Where things of the scene are.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    torus: Vec3,
    turn: f32,
    ball: Vec3,
    lamp: Vec3,
    post: Vec3,
}

const POST: f32 = 0.3;

fn scene(place: Place) -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 5.0);
    let glass = Material::dielectric("glass", 1.5);
    let at = Affine3A::from_rotation_translation(
        Quat::from_rotation_x(place.turn),
        Vec3::new(-1.5, 0.0, 0.0) + place.torus,
    );
    let ring = torus(0.5, 0.15, 32, 12).and_then(|it| it.transformed(&at).map_err(Into::into));
    add_mesh(
        &mut scene,
        "ring",
        ring.expect("a finite mesh"),
        glass.clone(),
    );
    add_sphere(
        &mut scene,
        Vec3::new(1.0, 0.2, 0.0) + place.ball,
        0.5,
        glass.clone(),
    );
    let block = cuboid([0.4; 3]).expect("a valid box");
    let at = Affine3A::from_translation(Vec3::new(2.6, -0.5, 1.0));
    let block = block.transformed(&at).expect("a finite mesh");
    add_mesh(
        &mut scene,
        "block",
        block,
        Material::metal("metal", [0.9, 0.7, 0.5]),
    );
    let post = Vec3::new(0.0, -0.5, 2.0) + place.post;
    add_box(
        &mut scene,
        "post",
        post - POST,
        post + POST,
        Material::diffuse("grey", [0.3; 3]),
    );
    for light in [
        Light::point(Vec3::new(0.0, 3.0, 0.5) + place.lamp, [10.0; 3]),
        Light::directional([0.3, -1.0, 0.1], [1.0; 3]),
        Light::disc([0.5, 3.5, 0.0], [0.0, -1.0, 0.0], 0.3, [5.0; 3]),
    ] {
        scene
            .add_light(light.expect("a valid light"))
            .expect("valid");
    }
    scene
}

fn options(sequence: Sequence) -> TraceOptions {
    TraceOptions {
        photons: 2_000,
        sequence,
        divide_edges: false,
        ..TraceOptions::default()
    }
}

/// What tracing all of the plan in a scene gives.
fn whole(live: &LivePhotons, scene: &Scene, options: &TraceOptions) -> PhotonMap {
    let (world, rays) = flattened(scene);
    trace_plan(&world, &rays, live.plan(), options, &|_| {}).expect("valid options")
}

fn assert_same(live: &LivePhotons, scene: &Scene, options: &TraceOptions) {
    let (kept, fresh) = (live.map(), whole(live, scene, options));
    assert!(kept.photons == fresh.photons);
    assert!(kept.ledger.imbalance() < 1e-6);
    assert_eq!(kept.ledger.rays, fresh.ledger.rays);
    for fate in Fate::ALL {
        let (kept, fresh) = (kept.ledger.entry(fate), fresh.ledger.entry(fate));
        assert_eq!(kept.count, fresh.count, "{}", fate.name());
        let most = fresh.flux.max_element().max(1e-6);
        // Kept in f32 photon by photon; what is not aimed at is a small difference of large sums.
        let tolerance = if fate == Fate::Unaimed { 1e-5 } else { 1e-6 };
        assert!(
            (kept.flux - fresh.flux).abs().max_element() < tolerance * most,
            "{}",
            fate.name()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(12)
    })]

    #[test]
    fn what_a_change_reaches_is_traced_anew_and_nothing_else_need_be(
        moves in prop::collection::vec(
            (0u8..5, prop::array::uniform3(-1.0f32..1.0), prop_oneof![Just(0.02f32), Just(0.4)]),
            1..5),
        sequence in prop::sample::select(vec![Sequence::Grid, Sequence::Halton]),
    ) {
        let options = options(sequence);
        let mut place = Place::default();
        let (world, rays) = flattened(&scene(place));
        let mut live = LivePhotons::new(&world, &rays, &options).expect("valid options");
        assert_same(&live, &scene(place), &options);
        for (what, by, size) in moves {
            let by = size * Vec3::from(by);
            // The ring, the ball and the block are casters 0 to 2 by their order.
            let box_at = |post: Vec3| {
                let center = Vec3::new(0.0, -0.5, 2.0) + post;
                Change::Region(Aabb::new(center - POST, center + POST))
            };
            let before = place.post;
            let change = match what {
                0 => { place.torus += by; vec![Change::Caster(0)] }
                1 => { place.turn += by.x; vec![Change::Caster(0)] }
                2 => { place.ball += by; vec![Change::Caster(1)] }
                3 => { place.lamp += by; vec![Change::Light(LightSource::Light { index: 0 })] }
                _ => { place.post += by; vec![box_at(before), box_at(place.post)] }
            };
            let changed = scene(place);
            let (world, rays) = flattened(&changed);
            live.invalidate(&world, &rays, &change).expect("valid options");
            assert_same(&live, &changed, &options);
        }
    }
}

#[test]
fn a_change_nearby_leaves_the_rest_alone() {
    let options = options(Sequence::Grid);
    let (world, rays) = flattened(&scene(Place::default()));
    let mut live = LivePhotons::new(&world, &rays, &options).expect("valid options");
    let total = live.plan().count();
    let before = live.map();
    // Nothing has changed.
    assert_eq!(live.invalidate(&world, &rays, &[]), Ok(0));
    assert!(live.map() == before);
    // The ring turns a little.
    let place = Place {
        turn: 0.05,
        ..Place::default()
    };
    let (world, rays) = flattened(&scene(place));
    let traced = live
        .invalidate(&world, &rays, &[Change::Caster(0)])
        .expect("valid options");
    println!("{traced} of {total}");
    assert!(
        traced > total / 10 && traced < total * 3 / 4,
        "{traced} of {total}"
    );
    // To name the wrong caster leaves photons that are out of date: the comparison can fail.
    let place = Place {
        turn: 0.1,
        ..Place::default()
    };
    let changed = scene(place);
    let (world, rays) = flattened(&changed);
    live.invalidate(&world, &rays, &[Change::Caster(2)])
        .expect("valid options");
    assert!(live.map().photons != whole(&live, &changed, &options).photons);
}

#[test]
fn refreshes_cover_everything_in_turn() {
    for (fraction, frames) in [(0.1, 10), (0.25, 4), (0.3, 4), (1.0, 1), (7.0, 1)] {
        for sequence in [Sequence::Grid, Sequence::Halton] {
            let options = options(sequence);
            let (world, rays) = flattened(&scene(Place::default()));
            let mut live = LivePhotons::new(&world, &rays, &options).expect("valid options");
            let total = live.plan().count();
            // Still: not a bit changes.
            let before = live.map();
            for _ in 0..3 {
                let traced = live
                    .refresh(&world, &rays, fraction)
                    .expect("valid options");
                let expected = fraction.min(1.0) * total as f32;
                assert!((traced as f32 - expected).abs() < 0.02 * total as f32 + 30.0);
                assert!(live.map() == before, "{sequence} {fraction}");
            }
            // The floor beside the glass has another height: nothing of the emission changes.
            let place = Place {
                post: Vec3::new(0.6, 0.3, -0.8),
                ..Place::default()
            };
            let changed = scene(place);
            let (world, rays) = flattened(&changed);
            for frame in 1..=frames {
                live.refresh(&world, &rays, fraction)
                    .expect("valid options");
                let is_done = live.map().photons == whole(&live, &changed, &options).photons;
                assert_eq!(is_done, frame == frames, "{sequence} {fraction}: {frame}");
            }
            assert_same(&live, &changed, &options);
        }
    }
    // None at all.
    let options = options(Sequence::Grid);
    let (world, rays) = flattened(&scene(Place::default()));
    let mut live = LivePhotons::new(&world, &rays, &options).expect("valid options");
    assert_eq!(live.refresh(&world, &rays, 0.0), Ok(0));
    assert_eq!(live.refresh(&world, &rays, f32::NAN), Ok(0));
}

#[test]
fn casters_and_lights_may_come_and_go() {
    let options = options(Sequence::Grid);
    let (world, rays) = flattened(&scene(Place::default()));
    let mut live = LivePhotons::new(&world, &rays, &options).expect("valid options");
    let mut more = scene(Place::default());
    add_sphere(
        &mut more,
        Vec3::new(-3.0, 0.0, 2.0),
        0.3,
        Material::dielectric("glass", 1.4),
    );
    more.add_light(Light::point([-3.0, 2.0, 2.0], [5.0; 3]).expect("valid"))
        .expect("valid");
    let (world, rays) = flattened(&more);
    live.refresh(&world, &rays, 0.1).expect("valid options");
    assert_same(&live, &more, &options);
    let mut none = Scene::new();
    add_floor(&mut none, 0.0, 1.0);
    let (world, rays) = flattened(&none);
    live.refresh(&world, &rays, 0.1).expect("valid options");
    assert!(live.map().photons.is_empty());
    let (world, rays) = flattened(&more);
    live.refresh(&world, &rays, 0.1).expect("valid options");
    assert_same(&live, &more, &options);
}
