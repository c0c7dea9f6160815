//! Every watt is booked, in any scene and with any options.

use crate::common;

use caustics_geometry::shapes::quad;
use caustics_sampling::Sequence;
use caustics_scene::{Light, Material, Scene};
use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{Aim, Branching, Coverage, Fate, TraceOptions, trace_photons};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened};
use proptest::prelude::*;

#[derive(Clone, Debug)]
struct Ball {
    center: [f32; 3],
    radius: f32,
    kind: u8,
    ior: f32,
    colour: [f32; 3],
    priority: i32,
}

fn ball() -> impl Strategy<Value = Ball> {
    (
        prop::array::uniform3(-1.0f32..1.0),
        0.1f32..0.9,
        0u8..3,
        1.05f32..2.4,
        prop::array::uniform3(0.0f32..1.0),
        -1i32..2,
    )
        .prop_map(|(center, radius, kind, ior, colour, priority)| Ball {
            center,
            radius,
            kind,
            ior,
            colour,
            priority,
        })
}

#[derive(Clone, Debug)]
enum Lamp {
    Point,
    Spot,
    Sun,
    Panel,
    Rectangle,
    Disc,
    Ball,
}

fn add_lamp(scene: &mut Scene, lamp: &Lamp, colour: [f32; 3]) {
    let above = Vec3::new(0.4, 4.0, -0.3);
    let light = match lamp {
        Lamp::Point => Light::point(above, colour),
        Lamp::Spot => Light::spot(above, -above, colour, 0.2, 0.5),
        Lamp::Sun => Light::directional([0.2, -1.0, 0.1], colour),
        Lamp::Rectangle => Light::rectangle(above, [Vec3::X, Vec3::Z], colour),
        Lamp::Disc => Light::disc(above, -above, 0.6, colour),
        Lamp::Ball => Light::sphere(above, 0.5, colour),
        Lamp::Panel => {
            let panel = quad(above, Vec3::X, Vec3::Z).expect("a valid panel");
            let material = Material::diffuse("panel", [0.0; 3]).with_emission(colour);
            add_mesh(scene, "panel", panel, material);
            return;
        }
    };
    scene
        .add_light(light.expect("a valid light"))
        .expect("a valid light");
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(100)
    })]

    #[test]
    fn what_comes_in_is_accounted_for(
        balls in prop::collection::vec(ball(), 1..6),
        lamps in prop::collection::vec(
            prop_oneof![
                Just(Lamp::Point),
                Just(Lamp::Spot),
                Just(Lamp::Sun),
                Just(Lamp::Panel),
                Just(Lamp::Rectangle),
                Just(Lamp::Disc),
                Just(Lamp::Ball),
            ],
            1..3,
        ),
        colour in prop::array::uniform3(0.01f32..10.0),
        seed in any::<u64>(),
        max_depth in prop_oneof![Just(3u32), Just(16), Just(128)],
        sequence in prop::sample::select(Sequence::ALL.to_vec()),
    ) {
        for dispersion in [0.0, 0.8] {
            let mut scene = Scene::new();
            add_floor(&mut scene, -2.0, 4.0);
            for ball in &balls {
                let material = match ball.kind {
                    0 => Material::dielectric("glass", ball.ior),
                    1 => Material::dielectric("coloured glass", ball.ior)
                        .with_attenuation(10.0 * Vec3::from(ball.colour)),
                    _ => Material::metal("metal", ball.colour),
                };
                let material = material.with_dispersion(dispersion).with_priority(ball.priority);
                add_sphere(&mut scene, ball.center.into(), ball.radius, material);
            }
            for lamp in &lamps {
                add_lamp(&mut scene, lamp, colour);
            }
            let (world, intersector) = flattened(&scene);
            for branching in [Branching::Roulette, Branching::SplitFirst, Branching::SplitAll] {
                for aim in [Aim::Everywhere, Aim::Casters] {
                    // Without roulette, splitting at every event grows without end.
                    let min_weight = if branching == Branching::SplitAll { 1e-2 } else { 1e-3 };
                    let options = TraceOptions {
                        photons: 500, seed, max_depth, branching, min_weight, aim, sequence,
                        divide_edges: seed % 3 != 0,
                        differentials: seed % 4 != 0,
                        ..TraceOptions::default()
                    };
                    let map = trace_photons(&world, &intersector, &options, &|_| {});
                    let map = map.expect("valid options");
                    let what = format!("{branching:?} {aim:?} dispersion {dispersion}");
                    let ledger = &map.ledger;
                    prop_assert!(ledger.imbalance() < 1e-6, "{what}: {:e}", ledger.imbalance());
                    let incoming = ledger.emitted().flux + ledger.roulette_gain();
                    prop_assert!(incoming.is_finite() && incoming.min_element() > 0.0);
                    // What the map says is what the ledger says.
                    let mut own = map.photons.clone();
                    own.retain(|it| it.coverage != Coverage::Reflected);
                    let stored: DVec3 = own.iter().map(|it| it.flux.as_dvec3()).sum();
                    let error = (stored - ledger.entry(Fate::Stored).flux).abs().max_element();
                    prop_assert!(error <= 1e-9 * incoming.max_element(), "{what}: {error:e}");
                    prop_assert_eq!(ledger.entry(Fate::Stored).count, own.len() as u64);
                    prop_assert_eq!(ledger.entry(Fate::Invalid).count, 0);
                    for fate in Fate::ALL {
                        let flux = ledger.entry(fate).flux;
                        // What is not aimed at is a difference to a mean over few photons.
                        prop_assert!(fate == Fate::Unaimed || flux.min_element() >= 0.0);
                    }
                    for photon in &map.photons {
                        prop_assert!(photon.axes.iter().all(|axis| axis.is_finite()), "{photon:?}");
                        prop_assert!(photon.flux.min_element() >= 0.0 && photon.events >= 1);
                        prop_assert!(photon.incoming.dot(photon.normal) <= 0.0);
                    }
                    // The same again, bit for bit.
                    let again = trace_photons(&world, &intersector, &options, &|_| {});
                    prop_assert_eq!(again.expect("valid options"), map);
                }
            }
        }
    }
}

/// A ledger with an entry left out is not balanced: the comparison can fail.
#[test]
fn a_missing_entry_shows() {
    let mut scene = Scene::new();
    add_floor(&mut scene, -2.0, 4.0);
    add_sphere(
        &mut scene,
        Vec3::ZERO,
        0.5,
        Material::dielectric("glass", 1.5),
    );
    add_lamp(&mut scene, &Lamp::Point, [1.0; 3]);
    let (world, intersector) = flattened(&scene);
    let options = TraceOptions {
        photons: 1000,
        ..TraceOptions::default()
    };
    let map = trace_photons(&world, &intersector, &options, &|_| {}).expect("valid options");
    assert!(map.ledger.imbalance() < 1e-6);
    let mut ledger = map.ledger.clone();
    let brightest = map.photons.iter().map(|it| it.flux);
    let brightest = brightest.max_by(|a, b| a.x.total_cmp(&b.x));
    ledger.emit(brightest.expect("photons are stored"));
    assert!(ledger.imbalance() > 1e-6);
}

#[test]
fn photons_without_differentials_land_where_those_with_do() {
    for lamp in [Lamp::Point, Lamp::Sun, Lamp::Panel] {
        let mut scene = Scene::new();
        add_floor(&mut scene, -2.0, 4.0);
        let glass = Material::dielectric("glass", 1.5);
        add_sphere(&mut scene, Vec3::ZERO, 0.5, glass);
        add_lamp(&mut scene, &lamp, [1.0; 3]);
        let (world, intersector) = flattened(&scene);
        let trace = |differentials| {
            let options = TraceOptions {
                photons: 1000,
                differentials,
                guide_emission: false,
                check_footprints: false,
                ..TraceOptions::default()
            };
            trace_photons(&world, &intersector, &options, &|_| {}).expect("valid options")
        };
        let (mut with, without) = (trace(true), trace(false));
        // Without footprints there is nothing to reflect.
        with.photons.retain(|it| it.coverage != Coverage::Reflected);
        assert_eq!(with.photons.len(), without.photons.len());
        for (with, without) in with.photons.iter().zip(&without.photons) {
            assert_eq!(with.position, without.position);
            assert_eq!((with.incoming, with.flux), (without.incoming, without.flux));
            assert_eq!(without.axes, [Vec3::ZERO; 2]);
            assert!(with.axes != [Vec3::ZERO; 2]);
        }
    }
}
