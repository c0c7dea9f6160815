//! Lattices that are made finer where caustics have edges: the energy, the budget, the place.

use caustics_scene::{BvhOptions, Instance, Light, Material, Scene, Shape, World};
use caustics_trace::{
    EnergyLedger, Fate, Photon, PhotonMap, Refinement, TraceOptions, trace_photons,
};
use glam::Vec3;

/// A glass sphere over a floor, and a lamp.
fn world() -> World {
    let mut scene = Scene::new();
    let glass = scene
        .add_material(Material::dielectric("glass", 1.5))
        .expect("valid");
    let white = scene
        .add_material(Material::diffuse("white", [0.8; 3]))
        .expect("valid");
    let ball = Shape::Sphere {
        center: Vec3::new(0.0, 1.5, 0.0),
        radius: 1.0,
    };
    scene
        .add_instance(Instance::new("ball", ball, glass))
        .expect("valid");
    let floor =
        caustics_geometry::shapes::quad([-5.0, 0.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]);
    let floor = Shape::Mesh(scene.add_mesh(floor.expect("valid")));
    scene
        .add_instance(Instance::new("floor", floor, white))
        .expect("valid");
    scene
        .add_light(Light::point([-1.0, 6.0, 0.5], [100.0; 3]).expect("valid"))
        .expect("valid");
    World::new(&scene).expect("valid")
}

fn trace(levels: u32, photons: u32, seed: u64) -> PhotonMap {
    let world = world();
    let intersector = world.intersector(&BvhOptions::default()).expect("valid");
    let refinement = Refinement {
        levels,
        ..Refinement::default()
    };
    let options = TraceOptions {
        photons,
        seed,
        refinement,
        ..TraceOptions::default()
    };
    trace_photons(&world, &intersector, &options, &|_| {}).expect("valid")
}

fn stored(ledger: &EnergyLedger) -> f64 {
    ledger.entry(Fate::Stored).flux.x
}

#[test]
fn energy_balances_and_is_that_of_an_even_lattice() {
    let even = trace(0, 40_000, 0);
    for (levels, seed) in [(1, 0), (3, 0), (5, 7)] {
        let refined = trace(levels, 40_000, seed);
        assert!(
            refined.ledger.imbalance() < 1e-9,
            "{}",
            refined.ledger.imbalance()
        );
        let emitted = refined.ledger.emitted();
        assert!(
            emitted.count <= 40_000 && emitted.count > 20_000,
            "{}",
            emitted.count
        );
        let total = refined.ledger.emitted().flux.x / even.ledger.emitted().flux.x;
        assert!((total - 1.0).abs() < 1e-6, "{total}");
        // What paths brought: refined lattices have no neighbours that tell silhouettes.
        let brought = stored(&even.ledger) - even.ledger.edge_gain.x;
        let caustic = stored(&refined.ledger) / brought;
        assert!((caustic - 1.0).abs() < 2e-3, "{caustic}");
        let photons: f64 = refined.photons.iter().map(|it| f64::from(it.flux.x)).sum();
        assert!((photons / stored(&refined.ledger) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn photons_gather_at_the_edge_of_the_lens() {
    // Photons that came through near the silhouette stand for less flux than those in the middle.
    let refined = trace(4, 40_000, 0);
    let flux = |photon: &Photon| photon.flux.x / (photon.events as f32);
    let largest = refined.photons.iter().map(flux).fold(0.0, f32::max);
    let small = refined
        .photons
        .iter()
        .filter(|it| flux(it) < 0.1 * largest)
        .count();
    let even = trace(0, 40_000, 0);
    let even_small = even
        .photons
        .iter()
        .filter(|it| flux(it) < 0.1 * largest)
        .count();
    assert!(small > 2 * even_small, "{small} {even_small}");
}

#[test]
fn the_same_seed_gives_the_same_photons() {
    assert_eq!(trace(3, 10_000, 5), trace(3, 10_000, 5));
    assert_ne!(trace(3, 10_000, 5), trace(3, 10_000, 6));
}

#[test]
fn only_cells_that_may_reach_the_caster_are_refined() {
    // A slanted mirror, long and narrow, that fills little of the cone around it.
    let mut scene = Scene::new();
    let metal = scene.add_material(Material::metal("metal", [0.9; 3]));
    let white = scene.add_material(Material::diffuse("white", [0.8; 3]));
    let mut add = |name, corner: [f32; 3], edges: [[f32; 3]; 2], material| {
        let mesh = caustics_geometry::shapes::quad(corner, edges[0], edges[1]).expect("valid");
        let mesh = Shape::Mesh(scene.add_mesh(mesh));
        scene
            .add_instance(Instance::new(name, mesh, material))
            .expect("valid");
    };
    add(
        "mirror",
        [-1.0, 0.2, 0.0],
        [[2.0, 0.1, 0.0], [0.0, 0.2, 0.02]],
        metal.expect("valid"),
    );
    add(
        "floor",
        [-5.0, 0.0, 5.0],
        [[10.0, 0.0, 0.0], [0.0, 0.0, -10.0]],
        white.expect("valid"),
    );
    let light = Light::point([0.0, 3.0, 1.0], [100.0; 3]).expect("valid");
    scene.add_light(light).expect("valid");
    let world = World::new(&scene).expect("valid");
    let rays = world.intersector(&BvhOptions::default()).expect("valid");
    let traced = |levels| {
        let options = TraceOptions {
            photons: 200_000,
            refinement: Refinement {
                levels,
                ..Refinement::default()
            },
            ..TraceOptions::default()
        };
        trace_photons(&world, &rays, &options, &|_| {}).expect("valid")
    };
    let (even, refined) = (traced(0), traced(2));
    let emitted = refined.ledger.emitted();
    assert!(emitted.count <= 200_000, "{}", emitted.count);
    // Most photons of the cone would miss.
    let wasted =
        refined.ledger.entry(Fate::Missed).count + refined.ledger.entry(Fate::Direct).count;
    assert!(wasted * 2 < emitted.count, "{wasted} of {}", emitted.count);
    assert!(refined.ledger.imbalance() < 1e-9);
    let total = emitted.flux.x / even.ledger.emitted().flux.x;
    assert!((total - 1.0).abs() < 1e-6, "{total}");
    let landed = stored(&refined.ledger) / stored(&even.ledger);
    assert!((landed - 1.0).abs() < 0.01, "{landed}");
}
