//! On the ten scenes the GPU traces the photons that the CPU traces by default, one by one, with
//! their footprints checked against the neighbours'.

use crate::common;

use caustics_trace::{Coverage, TraceOptions};

use common::tracing::{
    Difference, SCENES, Stage, ledger_of, shared_tracer, trace_on_gpu, trails_by_cpu, unlike_lines,
};

const PHOTONS: u32 = 50_000;

#[test]
fn the_same_photons_land_in_the_same_places() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let options = TraceOptions {
        photons: PHOTONS,
        ..TraceOptions::default()
    };
    let mut beyond = Vec::new();
    for name in SCENES {
        let stage = Stage::load(name);
        let plan = stage.plan(&options);
        let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 4 * PHOTONS);
        let trails = trails_by_cpu(&stage, &options);
        let difference = Difference::between(&stage.world, &trails, &traced);
        println!(
            "{name}: {} of {PHOTONS} on other paths, {} of {} records equal in every bit, \
             position {:.0e}, flux {:.0e}, axes {:.0e}, footprints from neighbours {}, divided {}",
            difference.other_paths(),
            difference.equal_records.0,
            difference.equal_records.1,
            difference.position,
            difference.flux,
            difference.axes,
            traced.counters.ledger.replaced_differentials,
            traced.counters.ledger.divided_photons,
        );
        for (cause, (count, first)) in difference.first_of_paths() {
            println!("  {cause}: {count}, the first {first:?}");
        }
        difference.hold_bits(&gpu.0, name);
        let ledger = ledger_of(&trails, &plan);
        let of_scene = difference
            .beyond_promise(trails.len())
            .into_iter()
            .chain(unlike_lines(&traced.counters.ledger, &ledger, trails.len()));
        beyond.extend(of_scene.map(|it| format!("{name}: {it}")));
        assert_eq!(traced.counters.crowded.count, 0, "{name}");
        assert!(traced.counters.ledger.imbalance() < 1e-6, "{name}");
        assert!(difference.equal_records.1 > 1000, "{name}");
        // Lights with an area have no lattice of two parameters.
        let is_checked = name != "p09_cornell.glb";
        assert_eq!(ledger.replaced_differentials > 0, is_checked, "{name}");
        assert_eq!(ledger.divided_photons > 100, is_checked, "{name}");
        // Of those in whose footprints the blur is as wide as the step, rounding decides.
        assert_eq!(difference.overlaps > 1000, !is_checked, "{name}");
        let photons = trails.iter().flat_map(|trail| &trail.photons);
        let images = photons.filter(|photon| photon.coverage == Coverage::Reflected);
        assert_eq!(images.count() > 1000, !is_checked, "{name}");
        let others = difference.other_coverages;
        assert!(others * 1000 <= difference.overlaps, "{name}: {others}");
    }
    assert_eq!(beyond, Vec::<String>::new());
}

#[test]
fn other_photons_are_told_apart() {
    let Some((gpu, tracer)) = shared_tracer() else {
        return;
    };
    let stage = Stage::load("p03_cognac.glb");
    let options = TraceOptions {
        photons: 2_000,
        ..TraceOptions::default()
    };
    let plan = stage.plan(&options);
    let traced = trace_on_gpu(gpu, tracer, &stage, &plan, 10_000);
    // The points of the lattice lie elsewhere in their cells.
    let other = TraceOptions { seed: 1, ..options };
    let trails = trails_by_cpu(&stage, &other);
    let difference = Difference::between(&stage.world, &trails, &traced);
    assert_eq!(difference.beyond_promise(trails.len()).len(), 5);
    // A ledger of fewer photons.
    let ledger = ledger_of(&trails_by_cpu(&stage, &options)[..1_000], &plan);
    assert!(!unlike_lines(&traced.counters.ledger, &ledger, trails.len()).is_empty());
    // Footprints that are not checked.
    let options = TraceOptions {
        divide_edges: false,
        ..options
    };
    let plan = stage.plan(&options);
    let trails = trails_by_cpu(&stage, &options);
    let raw = TraceOptions {
        check_footprints: false,
        ..options
    };
    let raw = trace_on_gpu(gpu, tracer, &stage, &stage.plan(&raw), 10_000);
    let difference = Difference::between(&stage.world, &trails, &raw);
    assert_eq!(difference.other_paths(), 0);
    assert!(difference.axes > 0.5 && difference.position > 1e-4);
    let ledger = ledger_of(&trails, &plan);
    // None is replaced, and none has more or less than its path brought it.
    let replaced = format!("replaced: 0, {}", ledger.replaced_differentials);
    let lines = unlike_lines(&raw.counters.ledger, &ledger, trails.len());
    assert!(lines.contains(&replaced), "{lines:?}");
    let gains = [&raw.counters.ledger, &ledger].map(|it| it.edge_gain.length());
    assert!(gains[0] == 0.0 && gains[1] > 0.0, "{gains:?}");
}
