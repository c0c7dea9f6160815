//! Photons divided where a sheet of light ends: against closed forms, and nothing else changed.

use crate::common;

use caustics_geometry::TriangleMesh;
use caustics_scene::{Light, Material, Scene};
use caustics_trace::glam::{Quat, Vec3};
use caustics_trace::{
    Aim, Branching, Fate, FootprintSource, Photon, PhotonMap, TraceOptions, fresnel_schlick,
    trace_photons,
};

use common::scenes::{add_floor, add_mesh, ball_over_floor, flattened};
use common::spill::{CEILING, LAMP, flux, spilt, under_a_lamp};

fn trace(scene: &Scene, options: &TraceOptions) -> PhotonMap {
    let (world, intersector) = flattened(scene);
    trace_photons(&world, &intersector, options, &|_| {}).expect("valid options")
}

/// Without and with photons divided.
fn whole_and_divided(scene: &Scene, options: TraceOptions) -> [PhotonMap; 2] {
    [false, true].map(|divide_edges| {
        let options = TraceOptions {
            divide_edges,
            ..options
        };
        trace(scene, &options)
    })
}

/// Half the sides of a mirror.
const HALVES: [f32; 2] = [0.31, 0.2];

/// Where the mirror hangs, below a lamp and a ceiling.
const HEIGHT: f32 = 2.0;

/// A flat mirror with these halves of its sides, turned by some angles, that throws a lamp's light at the
/// ceiling: the scene, and the mirror's corners.
fn mirror([a, b]: [f32; 2], roll: f32) -> (Scene, [Vec3; 4]) {
    let turned = Quat::from_rotation_x(0.4) * Quat::from_rotation_y(roll);
    let corner = |x: f32, z: f32| HEIGHT * Vec3::Y + turned * Vec3::new(x, 0.0, z);
    let corners = [corner(-a, b), corner(a, b), corner(a, -b), corner(-a, -b)];
    let mesh = TriangleMesh::with_flat_normals(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let scene = under_a_lamp(mesh.expect("a valid mirror"));
    (scene, corners)
}

/// Whether a place at the ceiling lies outside of the mirror's image.
fn is_outside(at: Vec3, corners: &[Vec3; 4]) -> bool {
    // The lamp's mirror image, from which the light seems to come.
    let normal = (corners[1] - corners[0])
        .cross(corners[3] - corners[0])
        .normalize();
    let image = LAMP - 2.0 * (LAMP - corners[0]).dot(normal) * normal;
    let projected = corners.map(|corner| {
        let way = corner - image;
        image + way * ((CEILING - image.y) / way.y)
    });
    let middle = 0.25 * projected.iter().sum::<Vec3>();
    (0..4).any(|side| {
        let (from, to) = (projected[side], projected[(side + 1) % 4]);
        let mut outwards = (to - from).cross(Vec3::Y).normalize();
        outwards *= (from - middle).dot(outwards).signum();
        (at - from).dot(outwards) > 0.0
    })
}

/// Simpson's rule.
fn integral(from: f64, to: f64, value: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 2000;
    let step = (to - from) / f64::from(STEPS);
    let weight = |number: u32| match number {
        0 | STEPS => 1.0,
        odd if odd % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=STEPS)
        .map(|number| weight(number) * value(from + f64::from(number) * step))
        .sum();
    sum * step / 3.0
}

#[test]
fn a_mirrors_image_ends_where_it_does_and_has_its_light() {
    let (mut worst, mut whole_error, mut divided_error) = (0.0f64, 0.0, 0.0);
    for number in 0..8 {
        let (scene, corners) = mirror(HALVES, 0.1 + 0.19 * number as f32);
        let options = TraceOptions {
            photons: 3000,
            ..TraceOptions::default()
        };
        let [whole, divided] = whole_and_divided(&scene, options);
        // The lamp's light on the mirror, by its parts as small as a point.
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]);
        let area = f64::from(normal.length());
        let normal = normal.normalize();
        let [u, v] = [corners[1] - corners[0], corners[3] - corners[0]];
        let expected = area
            * integral(0.0, 1.0, |x| {
                integral(0.0, 1.0, |y| {
                    let at = corners[0] + x as f32 * u + y as f32 * v;
                    let way = at - LAMP;
                    let cosine = way.normalize().dot(normal).abs();
                    let reflected = fresnel_schlick(cosine, Vec3::splat(0.9)).x;
                    f64::from(10.0 * cosine / way.length_squared() * reflected)
                })
            });
        let [spilt_whole, spilt_divided] =
            [&whole, &divided].map(|map| spilt(map, |at| is_outside(at, &corners)));
        let [light_whole, light_divided] = [&whole, &divided].map(flux);
        assert!(
            spilt_divided < 0.35 * spilt_whole,
            "{number}: {spilt_divided} outside for {spilt_whole}"
        );
        worst = worst.max((light_divided / expected - 1.0).abs());
        whole_error += (light_whole / expected - 1.0).abs();
        divided_error += (light_divided / expected - 1.0).abs();
    }
    assert!(worst < 2e-3, "{worst}");
    assert!(
        divided_error < 0.5 * whole_error,
        "{divided_error} {whole_error}"
    );
}

#[test]
fn light_of_a_mirror_narrower_than_a_cell_stays_on_its_image() {
    let (mut light_whole, mut light_divided) = (0.0, 0.0);
    for number in -4..=4i8 {
        // A cell is 17 mm wide there, and the mirror lies nearly along the rows.
        let (scene, corners) = mirror([0.31, 0.006], 0.06 * f32::from(number));
        let options = TraceOptions {
            photons: 1024,
            aim: Aim::Cones,
            guide_emission: false,
            ..TraceOptions::default()
        };
        let [whole, divided] = whole_and_divided(&scene, options);
        let [spilt_whole, spilt_divided] =
            [&whole, &divided].map(|map| spilt(map, |at| is_outside(at, &corners)));
        assert!(
            spilt_divided < 0.4 * spilt_whole,
            "{number}: {spilt_divided} outside for {spilt_whole}"
        );
        light_whole += flux(&whole);
        light_divided += flux(&divided);
    }
    let ratio = light_divided / light_whole;
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn what_is_divided_is_counted_and_nothing_is_where_the_rest_stays() {
    let scene = ball_over_floor();
    let options = TraceOptions {
        photons: 10_000,
        ..TraceOptions::default()
    };
    let [whole, divided] = whole_and_divided(&scene, options);
    let parts = |map: &PhotonMap| {
        let parts = map.photons.iter();
        let parts = parts.filter(|it| it.source == FootprintSource::Divided);
        parts.count() as u64
    };
    let ledger = &divided.ledger;
    assert!(ledger.divided_photons > 100);
    assert_eq!(parts(&divided), 5 * ledger.divided_photons);
    assert_eq!((parts(&whole), whole.ledger.divided_photons), (0, 0));
    assert_eq!(
        divided.photons.len() as u64,
        whole.photons.len() as u64 + 4 * ledger.divided_photons
    );
    assert_eq!(
        ledger.entry(Fate::Stored).count,
        divided.photons.len() as u64
    );
    assert!(ledger.imbalance() < 1e-6, "{}", ledger.imbalance());
    assert!(ledger.rays > whole.ledger.rays);
    assert!(divided.photons.iter().all(|it| {
        it.position.is_finite()
            && it.flux.is_finite()
            && it.axes.iter().all(|axis| axis.is_finite())
    }));
    // The others are the same, one for one.
    let mut others = divided
        .photons
        .iter()
        .filter(|it| it.source != FootprintSource::Divided);
    let same = whole.photons.iter().filter(|it| {
        let mut rest = others.clone();
        let is_same = rest.next() == Some(it);
        if is_same {
            others = rest;
        }
        is_same
    });
    assert_eq!(
        same.count() as u64,
        whole.photons.len() as u64 - ledger.divided_photons
    );

    // Where chance decides which way a photon goes, its neighbour's way says nothing of an edge.
    for branching in [Branching::Roulette, Branching::SplitFirst] {
        let map = trace(
            &scene,
            &TraceOptions {
                branching,
                ..options
            },
        );
        assert_eq!(
            (parts(&map), map.ledger.divided_photons),
            (0, 0),
            "{branching:?}"
        );
    }
}

#[test]
fn colours_of_dispersing_glass_have_edges_of_their_own() {
    // A prism by its hypotenuse: three images of its faces, one beside the other.
    let mut scene = Scene::new();
    add_floor(&mut scene, -2.0, 30.0);
    let glass = Material::dielectric("flint", 1.6).with_dispersion(2.0);
    let corners = [[-0.5, 0.0], [0.5, 0.0], [-0.4, 0.7]];
    let positions: Vec<Vec3> = [-0.5, 0.5]
        .into_iter()
        .flat_map(|z| corners.map(|[x, y]| Vec3::new(x, y, z)))
        .collect();
    let triangles = [
        [0, 2, 1],
        [3, 4, 5],
        [0, 1, 4],
        [0, 4, 3],
        [1, 2, 5],
        [1, 5, 4],
        [2, 0, 3],
        [2, 3, 5],
    ];
    let prism = TriangleMesh::with_flat_normals(&positions, &triangles).expect("a valid prism");
    add_mesh(&mut scene, "prism", prism, glass);
    let sun = Light::directional([0.1, -1.0, 0.05], [1.0; 3]).expect("a valid sun");
    scene.add_light(sun).expect("a valid sun");
    let map = trace(
        &scene,
        &TraceOptions {
            photons: 4000,
            ..TraceOptions::default()
        },
    );
    assert!(map.ledger.divided_photons > 100);
    // Each colour's sheet has edges, whose parts are of that colour.
    let mut all = 0;
    for channel in 0..3 {
        let own = map.photons.iter().filter(|it| {
            let lit = it.flux.to_array().map(|it| it > 0.0);
            lit[channel] && lit.iter().filter(|it| **it).count() == 1
        });
        let (divided, rest): (Vec<&Photon>, Vec<&Photon>) =
            own.partition(|it| it.source == FootprintSource::Divided);
        assert!(
            rest.len() > 1000 && divided.len() > 300,
            "{channel}: {}",
            divided.len()
        );
        all += divided.len() as u64;
    }
    // None has two colours; what parts give back may be nothing.
    let is_dark = |it: &&Photon| it.flux == Vec3::ZERO && it.source == FootprintSource::Divided;
    let dark = map.photons.iter().filter(is_dark).count() as u64;
    assert_eq!(all + dark, 5 * map.ledger.divided_photons);
    assert!(dark < map.ledger.divided_photons);
}
