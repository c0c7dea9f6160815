//! What is culled is counted, and what is thinned loses nothing.

use crate::common;

use caustics_scene::{Camera, Light, Material, Scene};
use caustics_trace::glam::Vec3;
use caustics_trace::{Culling, Fate, Photon, PhotonMap, TraceOptions, ViewVolume, trace_photons};
use common::scenes::{add_floor, add_sphere, flattened};

fn scene() -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 6.0);
    add_sphere(
        &mut scene,
        Vec3::ZERO,
        0.5,
        Material::dielectric("glass", 1.5),
    );
    add_sphere(
        &mut scene,
        Vec3::new(1.5, 0.0, 0.0),
        0.4,
        Material::metal("metal", [0.9; 3]),
    );
    let lamp = Light::point([0.3, 3.0, 0.2], [10.0; 3]).expect("a valid light");
    scene.add_light(lamp).expect("a valid light");
    scene
}

fn trace(culling: Culling) -> PhotonMap {
    let (world, rays) = flattened(&scene());
    let options = TraceOptions {
        photons: 20_000,
        culling,
        ..TraceOptions::default()
    };
    let map = trace_photons(&world, &rays, &options, &|_| {}).expect("valid options");
    assert!(map.ledger.imbalance() < 1e-6);
    assert_eq!(
        map.ledger.entry(Fate::Stored).count,
        map.photons.len() as u64
    );
    map
}

#[test]
fn faint_photons_become_few_and_keep_their_light() {
    let all = trace(Culling::default());
    let brightest = all.photons.iter().map(|it| it.flux.x).fold(0.0, f32::max);
    let min_flux = 0.5 * brightest;
    let thinned = trace(Culling {
        min_flux,
        ..Culling::default()
    });
    assert!(
        thinned
            .photons
            .iter()
            .all(|it| it.flux.max_element() >= 0.9999 * min_flux)
    );
    let faint = all.photons.iter().filter(|it| it.flux.x < min_flux).count();
    let (before, after) = (all.photons.len(), thinned.photons.len());
    println!("{before} {after}, {faint} faint");
    assert!(faint > before / 10 && after + faint / 2 < before);
    // The flux in the mean, and each survivor's density: its footprint is as much wider.
    let flux = |map: &PhotonMap| map.ledger.entry(Fate::Stored).flux.x;
    let error = (flux(&thinned) / flux(&all) - 1.0).abs();
    assert!(error < 0.01, "{error}");
    let area = |it: &Photon| it.axes[0].cross(it.axes[1]).length();
    for photon in &thinned.photons {
        let mut same = all
            .photons
            .iter()
            .filter(|it| it.position == photon.position);
        let before = same.next().expect("a photon that was there before");
        let density = photon.flux.x / area(photon);
        assert!((density * area(before) / before.flux.x - 1.0).abs() < 1e-3 || area(before) < 1e-9);
    }
}

#[test]
fn wide_and_unseen_photons_are_booked() {
    let all = trace(Culling::default());
    let area = |it: &Photon| it.axes[0].cross(it.axes[1]).length();
    let max_area = 1e-2;
    let narrow = trace(Culling {
        max_area,
        ..Culling::default()
    });
    let wide: Vec<_> = all
        .photons
        .iter()
        .filter(|it| area(it) > max_area)
        .collect();
    assert!(!wide.is_empty());
    assert_eq!(narrow.ledger.entry(Fate::Wide).count, wide.len() as u64);
    assert_eq!(narrow.photons.len() + wide.len(), all.photons.len());

    let camera = Camera::look_at("", [0.0, 2.0, 2.0], [0.3, -1.0, 0.0], [0.0, 1.0, 0.0], 0.4);
    let view = ViewVolume::of(&camera.expect("a valid camera"), 64, 64);
    let seen = trace(Culling {
        view,
        ..Culling::default()
    });
    let unseen = seen.ledger.entry(Fate::Unseen).count;
    assert!(unseen > 1000 && seen.photons.len() > 1000, "{unseen}");
    assert_eq!(seen.photons.len() as u64 + unseen, all.photons.len() as u64);
    let view = view.expect("a view");
    for photon in &all.photons {
        // Every photon that lands in the picture stays.
        assert!(!view.meets(photon.position, 0.0) || seen.photons.contains(photon));
    }
}
