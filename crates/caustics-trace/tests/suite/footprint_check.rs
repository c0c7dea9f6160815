//! Footprints checked against where neighbours landed: shorter, drawn in, and nothing else changed.

use crate::common;

use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{Fate, FootprintSource, PhotonMap, TraceOptions, trace_photons};

use common::scenes::{ball_over_floor, flattened};

/// The ball's outline is a silhouette all around.
fn trace(check_footprints: bool, photons: u32) -> PhotonMap {
    let (world, intersector) = flattened(&ball_over_floor());
    let options = TraceOptions {
        photons,
        check_footprints,
        divide_edges: false,
        ..TraceOptions::default()
    };
    trace_photons(&world, &intersector, &options, &|_| {}).expect("valid options")
}

#[test]
fn the_check_shortens_and_moves_and_weighs_what_is_at_silhouettes() {
    let (plain, checked) = (trace(false, 20_000), trace(true, 20_000));
    assert_eq!(plain.photons.len(), checked.photons.len());
    assert_eq!(plain.ledger.replaced_differentials, 0);
    let [
        mut replaced,
        mut verified,
        mut averaged,
        mut moved,
        mut weighed,
    ] = [0; 5];
    let mut gain = DVec3::ZERO;
    for (before, after) in plain.photons.iter().zip(&checked.photons) {
        let weight = after.flux.x / before.flux.x;
        if after.source == FootprintSource::Neighbour {
            assert!((0.5..1.5001).contains(&weight), "{weight}");
            weighed += u64::from(weight != 1.0);
        } else {
            assert_eq!(before.flux, after.flux);
        }
        gain += after.flux.as_dvec3() - before.flux.as_dvec3();
        assert_eq!(
            (before.incoming, before.object),
            (after.incoming, after.object)
        );
        assert!(!matches!(
            before.source,
            FootprintSource::Checked | FootprintSource::Neighbour
        ));
        let lengths = before.axes.map(Vec3::length);
        for (axis, length) in after.axes.iter().zip(lengths) {
            assert!(
                axis.is_finite() && axis.length() <= 1.126 * length,
                "{after:?}"
            );
        }
        let way = before.position.distance(after.position);
        assert!(way <= lengths[0] + lengths[1], "{way} of {lengths:?}");
        moved += u64::from(way > 0.0);
        match after.source {
            FootprintSource::Neighbour => replaced += 1,
            FootprintSource::Checked => {
                verified += 1;
                // Even light at an edge is drawn in; what neighbours agree with changes a little.
                let shortest = [0, 1].map(|i| after.axes[i].length() / lengths[i]);
                if shortest.into_iter().all(|it| it > 0.7) {
                    assert!(shortest.into_iter().all(|it| it > 0.89), "{after:?}");
                    assert!(way <= 0.07 * (lengths[0] + lengths[1]), "{way}");
                    averaged += u64::from(before.axes != after.axes);
                }
            }
            FootprintSource::Thinned => assert_eq!(before.axes, after.axes),
            _ => {}
        }
    }
    assert_eq!(checked.ledger.replaced_differentials, replaced);
    // All around the silhouette, and hardly anywhere else.
    assert!(replaced > 100, "{replaced}");
    assert!(moved > 100, "{moved}");
    assert!(weighed > 100, "{weighed}");
    assert!((gain - checked.ledger.edge_gain).length() < 1e-12);
    // Some get more and some get less; here, where all rows end alike, mostly less.
    let stored = checked.ledger.entry(Fate::Stored).flux;
    assert!(gain.length() < 3e-3 * stored.length(), "{gain} of {stored}");
    assert!(checked.ledger.imbalance() < 1e-6);
    assert!(verified > 10 * replaced, "{verified} {replaced}");
    assert!(averaged > verified / 2, "{averaged} of {verified}");
}

#[test]
fn light_reflected_at_the_outline_keeps_out_of_the_shadow() {
    // Light that meets the ball just inside its outline is reflected straight on, to the edge of the
    // shadow on the floor. How far footprints reach into it, weighted by flux.
    let (distance, radius, depth) = (3.0f32, 0.5f32, 0.6f32);
    let shadow = (distance + depth) * radius / (distance * distance - radius * radius).sqrt();
    let spilt = |map: &PhotonMap| -> f32 {
        map.photons
            .iter()
            .filter(|photon| photon.events == 1 && photon.position.y < 0.0)
            .map(|photon| {
                let place = photon.position.with_y(0.0);
                let outwards = place.normalize();
                let reach = photon.axes.map(|axis| axis.dot(outwards).abs());
                let inner = place.length() - reach[0].max(reach[1]);
                photon.flux.x * (shadow - inner).max(0.0)
            })
            .sum()
    };
    let (plain, checked) = (spilt(&trace(false, 20_000)), spilt(&trace(true, 20_000)));
    assert!(plain > 0.0 && checked < 0.6 * plain, "{checked} of {plain}");
}
