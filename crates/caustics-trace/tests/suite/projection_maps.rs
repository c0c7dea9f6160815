//! Projection maps leave out only what could not become a caustic, and keep the lattice.

use crate::common;

use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::{cuboid, icosphere, torus};
use caustics_sampling::{CounterRng, PointSet, Sequence};
use caustics_scene::{Intersect, Light, Material, Scene};
use caustics_trace::glam::{Affine3A, Mat3A, Quat, Vec2, Vec3};
use caustics_trace::{
    Aim, EmissionBatch, EmissionPlan, EmissionSample, Fate, TraceOptions, trace_plan,
};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened};
use proptest::prelude::*;

fn shape(kind: u8) -> Option<TriangleMesh> {
    match kind {
        0 => torus(0.5, 0.1, 40, 12).ok(),
        1 => cuboid([0.1, 1.4, 0.3]).ok(),
        2 => icosphere(0.5, 1).ok(),
        _ => None,
    }
}

fn lamp(kind: u8, at: Vec3) -> Light {
    match kind {
        0 => Light::point(at, [10.0; 3]),
        1 => Light::spot(at, -at, [10.0; 3], 0.1, 0.3),
        _ => Light::directional(-at, [1.0; 3]),
    }
    .expect("a valid light")
}

fn scene(casters: &[(u8, [f32; 3], [f32; 3])], light: Light) -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -2.0, 8.0);
    for &(kind, center, turn) in casters {
        let glass = Material::dielectric("glass", 1.5);
        match shape(kind) {
            Some(mesh) => {
                let turn = Quat::from_scaled_axis(3.0 * Vec3::from(turn));
                let place = Affine3A::from_rotation_translation(turn, center.into());
                assert!(place.matrix3 != Mat3A::ZERO);
                let mesh = mesh.transformed(&place).expect("a finite mesh");
                add_mesh(&mut scene, "glass", mesh, glass);
            }
            None => add_sphere(&mut scene, center.into(), 0.4, glass),
        }
    }
    scene.add_light(light).expect("a valid light");
    scene
}

const PHOTONS: u32 = 40_000;

fn options(aim: Aim) -> TraceOptions {
    TraceOptions {
        photons: PHOTONS,
        aim,
        ..TraceOptions::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(60)
    })]

    /// Of random rays of the emitter, none that first meets its caster comes from a cell that is
    /// not marked; from near by, all around, and far off.
    #[test]
    fn no_ray_to_a_caster_is_left_out(
        casters in prop::collection::vec(
            (0u8..4, prop::array::uniform3(-1.0f32..1.0), prop::array::uniform3(-1.0f32..1.0)),
            1..4),
        light in 0u8..3,
        towards in prop::array::uniform3(-1.0f32..1.0),
        distance in prop_oneof![0.05f32..1.0, 1.0f32..4.0, 10.0f32..1000.0],
        seed in any::<u64>(),
    ) {
        let towards = Vec3::from(towards);
        prop_assume!(towards.length() > 0.1);
        let scene = scene(&casters, lamp(light, distance * towards.normalize()));
        let (world, intersector) = flattened(&scene);
        let plan = EmissionPlan::new(&world, &intersector, &options(Aim::Casters));
        let plan = plan.expect("valid options");
        for batch in plan.batches() {
            let Some(map) = batch.map() else { continue };
            prop_assert!(map.coverage() <= 0.9);
            let caster = batch.emitter().caster();
            for index in 0..4000 {
                let point = CounterRng::new(seed, index).next_vec2();
                let sample = EmissionSample {
                    point,
                    spacing: [Vec2::X, Vec2::Y],
                    place: Vec2::ZERO,
                    count: 1,
                    weight: 1.0,
                };
                let Some(emission) = batch.emitter().emit::<2>(&world, &sample) else { continue };
                let hit = intersector.closest_hit(&emission.ray);
                let object = hit.and_then(|hit| world.object_of(hit.primitive));
                if object.and_then(|it| plan.casters().of_object(it)) == caster {
                    prop_assert!(map.contains(point), "{point} from {distance}");
                }
            }
        }
    }
}

/// A thin ring on edge, from a lamp: most of its cone is empty.
fn ring() -> Scene {
    let turn = [0.3, 0.1, 0.0];
    scene(&[(0, [0.0, 0.0, 0.0], turn)], lamp(0, 3.0 * Vec3::Y))
}

fn batch(plan: &EmissionPlan) -> &EmissionBatch {
    &plan.batches()[0]
}

#[test]
fn the_traced_photons_are_those_of_a_whole_lattice() {
    let (world, intersector) = flattened(&ring());
    for (sequence, guide_emission) in Sequence::ALL
        .into_iter()
        .flat_map(|it| [(it, false), (it, true)])
    {
        let options = TraceOptions {
            sequence,
            guide_emission,
            ..options(Aim::Casters)
        };
        let plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
        let mapped = batch(&plan);
        assert_eq!(mapped.density().is_some(), guide_emission);
        let map = mapped.map().expect("a ring leaves its cone empty");
        // Almost as many as there may be, and never more.
        let least = if sequence == Sequence::Grid {
            0.99
        } else {
            0.999
        };
        assert!(mapped.count() <= PHOTONS, "{sequence}");
        assert!(
            f64::from(mapped.count()) > least * f64::from(PHOTONS),
            "{sequence}"
        );
        // Exactly the points in marked cells, in their order.
        let points = PointSet::new(sequence, mapped.points().count(), 0);
        assert_eq!(mapped.points(), &points);
        let numbers: Vec<u32> = (0..mapped.count())
            .map(|it| mapped.point_number(it))
            .collect();
        let expected: Vec<u32> = (0..points.count())
            .filter(|&it| {
                let point = points.point(it);
                let warped = mapped.density().map(|density| density.sample(point).value);
                map.contains(warped.unwrap_or(point))
            })
            .collect();
        assert!(numbers == expected, "{sequence}");
        if guide_emission {
            // Other pilots go ahead in the whole cone.
            continue;
        }
        // The same caustic, photon by photon, as from the whole lattice in the cone.
        let whole = TraceOptions {
            aim: Aim::Cones,
            photons: points.count(),
            ..options
        };
        let cone_plan = EmissionPlan::new(&world, &intersector, &whole).expect("valid options");
        let trace = |plan: &EmissionPlan, options: &TraceOptions| {
            trace_plan(&world, &intersector, plan, options, &|_| {}).expect("valid options")
        };
        let (mapped, in_cone) = (trace(&plan, &options), trace(&cone_plan, &whole));
        assert!(mapped.photons == in_cone.photons, "{sequence}");
        assert!(mapped.ledger.imbalance() < 1e-9);
        let direct = |map: &caustics_trace::PhotonMap| map.ledger.entry(Fate::Direct).count;
        assert!(3 * direct(&mapped) < direct(&in_cone), "{sequence}");
    }
}

#[test]
fn maps_are_drawn_where_they_pay() {
    let (world, intersector) = flattened(&ring());
    let plan = |options: &TraceOptions| {
        EmissionPlan::new(&world, &intersector, options).expect("valid options")
    };
    let mapped = plan(&options(Aim::Casters));
    let coverage = batch(&mapped).map().expect("a map").coverage();
    println!("{coverage}");
    assert!((0.1..0.6).contains(&coverage), "{coverage}");
    assert!(batch(&plan(&options(Aim::Cones))).map().is_none());
    assert!(batch(&plan(&options(Aim::Everywhere))).map().is_none());
    // Fewer photons than triangles: to find the outline would cost more than the photons.
    let few = TraceOptions {
        photons: 64,
        ..options(Aim::Casters)
    };
    assert!(batch(&plan(&few)).map().is_none());
    // A ball fills its cone.
    let ball = scene(&[(3, [0.0; 3], [0.0; 3])], lamp(0, 3.0 * Vec3::Y));
    let (world, intersector) = flattened(&ball);
    let plan = EmissionPlan::new(&world, &intersector, &options(Aim::Casters));
    assert!(batch(&plan.expect("valid options")).map().is_none());
}

/// While the ring turns a little, its photons stay in the same directions.
#[test]
fn a_plan_that_follows_keeps_its_lattice() {
    let turned = |angle: f32| scene(&[(0, [0.0; 3], [0.3, 0.1, angle])], lamp(0, 3.0 * Vec3::Y));
    let (world, intersector) = flattened(&turned(0.0));
    let options = options(Aim::Casters);
    let mut plan = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
    let mut kept = 0;
    for step in 1u8..=20 {
        let (world, intersector) = flattened(&turned(0.003 * f32::from(step)));
        let next = plan
            .following(&world, &intersector, &options)
            .expect("valid options");
        let (old, new) = (batch(&plan), batch(&next));
        let same = old.emitter().domain() == new.emitter().domain() && old.points() == new.points();
        kept += u32::from(same);
        // What the cone leaves out is seen to be out: the caustic stays whole.
        let map =
            trace_plan(&world, &intersector, &next, &options, &|_| {}).expect("valid options");
        let fresh = EmissionPlan::new(&world, &intersector, &options).expect("valid options");
        let exact = trace_plan(&world, &intersector, &fresh, &options, &|_| {});
        let exact = exact
            .expect("valid options")
            .ledger
            .entry(Fate::Stored)
            .flux
            .x;
        let stored = map.ledger.entry(Fate::Stored).flux.x;
        assert!((stored / exact - 1.0).abs() < 5e-3, "{stored} {exact}");
        plan = next;
    }
    assert!(kept >= 17, "{kept}");
}
