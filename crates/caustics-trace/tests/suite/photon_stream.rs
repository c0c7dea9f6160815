//! Photons that come in parts, or alone, are those that come at once.

use crate::common;

use caustics_geometry::shapes::quad;
use caustics_sampling::Sequence;
use caustics_scene::{Light, Material, Scene};
use caustics_trace::glam::Vec3;
use caustics_trace::{
    Branching, Culling, EmissionPlan, Fate, FootprintSource, PhotonMap, PhotonStream, TraceOptions,
    trace_photon, trace_plan,
};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened};

/// A ball and a cylinder-like row of balls under lamps of several kinds: lattices with and without
/// projection maps, and a light with an area.
fn scene() -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 6.0);
    let glass = Material::dielectric("glass", 1.5);
    add_sphere(&mut scene, Vec3::ZERO, 0.5, glass);
    let metal = Material::metal("metal", [0.9; 3]);
    let plate = quad([1.0, -0.5, 0.4], Vec3::new(0.9, 0.9, 0.0), Vec3::NEG_Z).expect("a plate");
    add_mesh(&mut scene, "plate", plate, metal);
    let edges = [Vec3::X, Vec3::Z];
    for light in [
        Light::point([0.3, 3.0, 0.2], [10.0; 3]),
        Light::directional([0.5, -1.0, 0.1], [3.0; 3]),
        Light::rectangle([-0.5, 2.5, -0.5], edges, [2.0; 3]),
    ] {
        scene
            .add_light(light.expect("a valid light"))
            .expect("a valid light");
    }
    scene
}

fn close(parts: &PhotonMap, whole: &PhotonMap) {
    assert!(parts.photons == whole.photons);
    // Each part finds anew the ways of the paths that end in it.
    let (rays, least) = (parts.ledger.rays, whole.ledger.rays);
    assert!(
        (least..least + least / 20).contains(&rays),
        "{rays} {least}"
    );
    assert_eq!(parts.ledger.divided_photons, whole.ledger.divided_photons);
    assert_eq!(
        parts.ledger.replaced_differentials,
        whole.ledger.replaced_differentials
    );
    let imbalances = [parts, whole].map(|it| it.ledger.imbalance());
    assert!(imbalances[0] < 1e-6, "{imbalances:?}");
    for fate in Fate::ALL {
        let (part, all) = (parts.ledger.entry(fate), whole.ledger.entry(fate));
        assert_eq!(part.count, all.count, "{}", fate.name());
        let most = whole.ledger.emitted().flux.x;
        let error = (part.flux - all.flux).abs().max_element() / most;
        assert!(error < 1e-9, "{}: {error:e}", fate.name());
    }
}

#[test]
fn all_parts_are_the_whole() {
    let (world, rays) = flattened(&scene());
    let culling = Culling {
        max_area: 1e-3,
        min_flux: 2e-4,
        ..Culling::default()
    };
    for (sequence, culling) in [
        (Sequence::Grid, Culling::default()),
        (Sequence::Grid, culling),
        (Sequence::Halton, Culling::default()),
    ] {
        let options = TraceOptions {
            photons: 30_000,
            sequence,
            culling,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&world, &rays, &options).expect("valid options");
        let whole = trace_plan(&world, &rays, &plan, &options, &|_| {}).expect("valid options");
        let is_checked = whole
            .photons
            .iter()
            .any(|it| it.source == FootprintSource::Checked);
        assert_eq!(is_checked, sequence == Sequence::Grid);
        for part in [97, 4096, u32::MAX] {
            let mut stream = PhotonStream::default();
            let mut parts = PhotonMap::default();
            let mut most = 0;
            while !stream.is_finished(&plan) {
                let next = stream.advance(&world, &rays, &plan, &options, part);
                let mut next = next.expect("valid options");
                parts.photons.append(&mut next.photons);
                parts.ledger.merge(&next.ledger);
                most = most.max(stream.waiting());
            }
            close(&parts, &whole);
            assert_eq!(stream.waiting(), 0);
            // Three rows of at most 173 points, each with a few photons, and the part itself.
            let bound = 6 * (3 * 173 + part.min(30_000) as usize);
            assert!(most < bound, "{most}");
            // Nothing more comes.
            let none = stream.advance(&world, &rays, &plan, &options, 100);
            assert_eq!(none.expect("valid options"), PhotonMap::default());
        }
    }
}

#[test]
fn photons_side_by_side_are_as_alone() {
    let (world, rays) = flattened(&scene());
    for branching in [
        Branching::Roulette,
        Branching::SplitFirst,
        Branching::SplitAll,
    ] {
        let options = TraceOptions {
            photons: 3000,
            branching,
            check_footprints: false,
            ..TraceOptions::default()
        };
        let plan = EmissionPlan::new(&world, &rays, &options).expect("valid options");
        let together = trace_plan(&world, &rays, &plan, &options, &|_| {}).expect("valid options");
        let mut alone = PhotonMap::default();
        for photon in 0..plan.count() {
            let mut trail =
                trace_photon(&world, &rays, &plan, &options, photon).expect("valid options");
            alone.photons.append(&mut trail.photons);
            alone.ledger.merge(&trail.ledger);
        }
        assert!(alone.photons.len() > 1000, "{branching:?}");
        assert!(alone.photons == together.photons, "{branching:?}");
        assert_eq!(alone.ledger.rays, together.ledger.rays);
        for fate in Fate::ALL {
            let counts = [&alone, &together].map(|it| it.ledger.entry(fate).count);
            assert_eq!(counts[0], counts[1], "{branching:?} {}", fate.name());
        }
    }
}
