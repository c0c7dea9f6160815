//! Light that folds over, or comes from two faces of one body, ends where each of its sheets does.

use crate::common;

use caustics_geometry::TriangleMesh;
use caustics_scene::Scene;
use caustics_trace::glam::Vec3;
use caustics_trace::{FootprintSource, Photon, PhotonMap, TraceOptions, trace_photons};

use common::scenes::flattened;
use common::spill::{CEILING, flux, spilt, under_a_lamp};

fn trace(scene: &Scene, photons: u32, is_checked: bool) -> PhotonMap {
    let (world, intersector) = flattened(scene);
    let options = TraceOptions {
        photons,
        check_footprints: is_checked,
        divide_edges: is_checked,
        ..TraceOptions::default()
    };
    trace_photons(&world, &intersector, &options, &|_| {}).expect("valid options")
}

/// Whether as much light arrives as with many more photons.
fn has_all_flux(scene: &Scene, map: &PhotonMap) -> bool {
    let many = trace(scene, 1_000_000, false);
    (flux(map) / flux(&many) - 1.0).abs() < 1e-3
}

/// A level mirror whose normals lean to one side in proportion to the distance from its middle line.
fn creased() -> TriangleMesh {
    const HALF: f32 = 0.3;
    let positions = [-HALF, 0.0, HALF]
        .into_iter()
        .flat_map(|x| [-HALF, HALF].map(|z| Vec3::new(x, 0.0, z)));
    let normals = [-HALF, 0.0, HALF]
        .into_iter()
        .flat_map(|x| [Vec3::new(-0.5 * x.abs(), 1.0, 0.0); 2]);
    let triangles = vec![[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
    TriangleMesh::new(positions.collect(), Some(normals.collect()), triangles)
        .expect("a valid mirror")
}

#[test]
fn both_halves_of_folded_light_end_at_the_fold() {
    // What meets the mirror left of its middle lands left of it, and what meets it right of the middle
    // as well: the light of each half on that of the other, with an edge above the middle.
    let scene = under_a_lamp(creased());
    let (plain, checked) = (trace(&scene, 3000, false), trace(&scene, 3000, true));
    assert!(plain.photons.iter().all(|it| it.position.x < 1e-3));
    let is_dark = |at: Vec3| at.x > 0.0;
    let (spilt_plain, spilt_checked) = (spilt(&plain, is_dark), spilt(&checked, is_dark));
    assert!(
        spilt_plain > 2e-3 && spilt_checked < 0.2 * spilt_plain,
        "{spilt_checked} of {spilt_plain}"
    );
    assert!(has_all_flux(&scene, &checked));

    // On both sides of the middle light is divided there.
    let at_the_fold = |side: f32| {
        let photons = checked.photons.iter();
        let divided = photons.filter(|it| it.source == FootprintSource::Divided);
        let from = |it: &Photon| it.position.x - it.position.y * it.incoming.x / it.incoming.y;
        divided
            .filter(|it| it.position.x > -0.1 && side * from(it) > 0.0)
            .count()
    };
    assert!(at_the_fold(1.0) > 50 && at_the_fold(-1.0) > 50);
}

/// Two flat mirrors that lean away from each other, as one body.
fn roof() -> TriangleMesh {
    const LEAN: f32 = 0.05;
    let corner = |x: f32, z: f32| Vec3::new(x, -LEAN * x.abs(), z);
    let positions = [-0.3, 0.0, 0.3]
        .map(|x: f32| [corner(x, -0.3), corner(x, 0.3)])
        .concat();
    TriangleMesh::with_flat_normals(&positions, &[[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]])
        .expect("a valid mirror")
}

#[test]
fn light_of_two_faces_leaves_what_is_between_their_images_dark() {
    // Light that meets the ridge is thrown to 3 tan(2 lean) on either side.
    let half_gap = CEILING * (2.0 * 0.05f32.atan()).tan();
    let scene = under_a_lamp(roof());
    let (plain, checked) = (trace(&scene, 3000, false), trace(&scene, 3000, true));
    assert!(
        plain
            .photons
            .iter()
            .all(|it| it.position.x.abs() > 0.999 * half_gap)
    );
    let is_dark = |at: Vec3| at.x.abs() < half_gap;
    let (spilt_plain, spilt_checked) = (spilt(&plain, is_dark), spilt(&checked, is_dark));
    assert!(
        spilt_plain > 2e-3 && spilt_checked < 0.2 * spilt_plain,
        "{spilt_checked} of {spilt_plain}"
    );
    assert!(has_all_flux(&scene, &checked));
}
