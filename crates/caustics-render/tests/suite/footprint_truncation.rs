//! Gaussian footprints that end at any number of standard deviations: their flux, and where it falls.

use caustics_accel::BvhOptions;
use caustics_filter::Image;
use caustics_geometry::shapes;
use caustics_render::{FootprintGather, FootprintOptions, GBuffer, RenderError, splat};
use caustics_scene::{Camera, Instance, Material, Projection, Scene, Shape, World};
use caustics_trace::{Coverage, Photon};
use glam::{Affine3A, Mat3, Vec2, Vec3};
use proptest::prelude::*;
use std::f32::consts::PI;

const FLUX: f32 = 2.0;
const ALBEDO: f32 = 0.5;
const PIXELS: u32 = 128;
const PIXEL: f32 = 2.0 / PIXELS as f32;

fn photon(position: Vec3, axes: [Vec3; 2], coverage: Coverage) -> Photon {
    Photon {
        position,
        incoming: Vec3::new(0.2, -1.0, -0.1).normalize(),
        flux: Vec3::splat(FLUX),
        normal: Vec3::Y,
        axes,
        object: 0,
        events: 1,
        source: caustics_trace::FootprintSource::Differential,
        coverage,
    }
}

const COVERAGES: [Coverage; 2] = [Coverage::Cell, Coverage::Overlap];

/// Photons of one coverage end at a truncation, those of the other where they do by default.
fn truncated(coverage: Coverage, truncation: f32) -> FootprintOptions {
    let default = FootprintOptions::default();
    match coverage {
        Coverage::Overlap => FootprintOptions {
            overlap_truncation: truncation,
            ..default
        },
        _ => FootprintOptions {
            truncation,
            ..default
        },
    }
}

/// What a camera sees that looks straight down on two by two metres of a floor.
fn floor() -> GBuffer {
    let mut scene = Scene::new();
    let mesh = shapes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z);
    let mesh = scene.add_mesh(mesh.expect("a quad"));
    let material = scene.add_material(Material::diffuse("grey", Vec3::splat(ALBEDO)));
    let floor = Instance::new("floor", Shape::Mesh(mesh), material.expect("valid"));
    scene.add_instance(floor).expect("valid");
    let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
    let pose = Affine3A::from_mat3_translation(down, Vec3::new(0.0, 3.0, 0.0));
    let projection = Projection::Orthographic {
        xmag: 1.0,
        ymag: 1.0,
    };
    let camera = Camera::new("above", pose, projection).expect("valid");
    let world = World::new(&scene).expect("valid");
    let intersector = world.intersector(&BvhOptions::default()).expect("valid");
    GBuffer::new(&world, &intersector, &camera, PIXELS, PIXELS).expect("valid")
}

/// Photons all over the middle of the floor, none at the same place of its pixel as another: so many
/// that what a Gaussian that ends at one deviation has more or less by its place averages out.
fn spread(axes: [Vec3; 2], coverage: Coverage) -> Vec<Photon> {
    (0..4000)
        .map(|index| {
            // The generalised golden ratio's multiples.
            let place = (index as f32 * Vec2::new(0.754_877_7, 0.569_840_3)).fract() - 0.5;
            photon(Vec3::new(place.x, 0.0, place.y), axes, coverage)
        })
        .collect()
}

/// The flux of a picture of the floor over that of its photons.
fn drawn(buffer: &GBuffer, photons: &[Photon], truncation: f32) -> f64 {
    let options = truncated(photons[0].coverage, truncation);
    let (image, stats) = splat(buffer, photons, &options).expect("valid");
    assert_eq!(stats.splatted, photons.len() as u64);
    let sum: f64 = image.pixels().iter().map(|pixel| f64::from(pixel[0])).sum();
    let flux = sum * f64::from(PI / ALBEDO) * f64::from(PIXEL).powi(2);
    flux / photons.iter().map(|it| f64::from(it.flux.x)).sum::<f64>()
}

/// The flux that a gather finds on the floor over that of its one photon, by rings in f64.
fn gathered(axes: [Vec3; 2], coverage: Coverage, truncation: f32) -> f64 {
    const RINGS: u32 = 400;
    const ANGLES: u32 = 64;
    let options = truncated(coverage, truncation);
    let photons = [photon(Vec3::ZERO, axes, coverage)];
    let gather = FootprintGather::new(&photons, &options).expect("valid");
    // In coordinates along the axes the footprint is round.
    let area = f64::from(axes[0].cross(axes[1]).length()) * f64::from(options.scale).powi(2);
    let width = f64::from(truncation) / f64::from(RINGS);
    let mut sum = 0.0;
    for ring in 0..RINGS {
        let radius = (f64::from(ring) + 0.5) * width;
        for angle in 0..ANGLES {
            let angle = std::f64::consts::TAU * f64::from(angle) / f64::from(ANGLES);
            let [u, v] = [angle.cos(), angle.sin()].map(|it| (radius * it) as f32);
            let point = options.scale * (u * axes[0] + v * axes[1]);
            sum += radius * f64::from(gather.irradiance(point, Vec3::Y).x);
        }
    }
    let cell = std::f64::consts::TAU / f64::from(ANGLES) * width * area;
    sum * cell / f64::from(FLUX)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_gather_keeps_the_flux(
        truncation in 1.0f32..=4.0,
        long in 0.01f32..1.0,
        ratio in 0.1f32..1.0,
        slant in -0.5f32..0.5,
        coverage in prop::sample::select(&COVERAGES[..]),
    ) {
        let axes = [long * Vec3::X, ratio * long * Vec3::new(slant, 0.0, 1.0)];
        let found = gathered(axes, coverage, truncation);
        prop_assert!((found - 1.0).abs() < 2e-5, "{found}");
    }

    /// Of footprints that are read at the pixels' middles, at any level of resolution.
    #[test]
    fn a_splat_keeps_the_flux(
        truncation in 1.0f32..=4.0,
        long in 2.0f32..8.0,
        ratio in 0.5f32..1.0,
        slant in -0.5f32..0.5,
        coverage in prop::sample::select(&COVERAGES[..]),
    ) {
        let axes = [long * PIXEL * Vec3::X, ratio * long * PIXEL * Vec3::new(slant, 0.0, 1.0)];
        let found = drawn(&floor(), &spread(axes, coverage), truncation);
        prop_assert!((found - 1.0).abs() < 3e-3, "{found}");
    }
}

/// Footprints that overlap are read at the pixels' middles down to a third of a pixel, but not where
/// they would end before the nearest one.
#[test]
fn small_footprints_that_overlap_keep_the_flux() {
    for truncation in [1.0, 1.5, 2.0, 3.0] {
        for long in [0.1, 0.5, 0.7, 1.0, 1.4] {
            let axes = [long * PIXEL * Vec3::X, long * PIXEL * Vec3::Z];
            let found = drawn(&floor(), &spread(axes, Coverage::Overlap), truncation);
            assert!((found - 1.0).abs() < 1e-4, "{truncation} {long}: {found}");
        }
    }
}

/// Control: a flux that is wrong by a hundredth is noticed.
#[test]
fn control_too_much_flux_is_noticed() {
    let axes = [4.0 * PIXEL * Vec3::X, 4.0 * PIXEL * Vec3::Z];
    let mut photons = spread(axes, Coverage::Cell);
    let right = drawn(&floor(), &photons, 2.0);
    for photon in &mut photons {
        photon.flux *= 1.01;
    }
    let (image, _) = splat(&floor(), &photons, &truncated(Coverage::Cell, 2.0)).expect("valid");
    let sum: f64 = image.pixels().iter().map(|pixel| f64::from(pixel[0])).sum();
    let bright = sum * f64::from(PI / ALBEDO * PIXEL * PIXEL) / f64::from(1000.0 * FLUX);
    assert!((right - 1.0).abs() < 3e-3 && (bright - 1.0).abs() > 3e-3);
}

#[test]
fn pixels_beyond_the_end_are_dark() {
    let axes = [20.0 * PIXEL * Vec3::X, 20.0 * PIXEL * Vec3::Z];
    let buffer = floor();
    let lit = |coverage, truncation| {
        let photons = [photon(Vec3::ZERO, axes, coverage)];
        let options = truncated(coverage, truncation);
        let gather = FootprintGather::new(&photons, &options).expect("valid");
        let (image, _) = splat(&buffer, &photons, &options).expect("valid");
        // Within a standard deviation of 11 pixels, along a row through the middle.
        let row = &image.pixels()[(PIXELS / 2 * PIXELS) as usize..][..PIXELS as usize];
        let drawn = row.iter().filter(|pixel| pixel[0] > 0.0).count() as f32;
        let looked_up = (0..1000)
            .filter(|&step| {
                let point = step as f32 / 1000.0 * Vec3::X;
                gather.irradiance(point, Vec3::Y).x > 0.0
            })
            .count();
        (
            0.5 * drawn / 11.0,
            looked_up as f32 / 1000.0 / (11.0 * PIXEL),
        )
    };
    // A level's pixels are four wide here, and interpolated; or eight.
    for (coverage, level_pixel) in [(Coverage::Cell, 0.8), (Coverage::Overlap, 1.1)] {
        for truncation in [1.0, 2.0, 3.0, 4.0] {
            let (drawn, looked_up) = lit(coverage, truncation);
            println!("{coverage:?} {truncation} {drawn} {looked_up}");
            assert!((looked_up - truncation).abs() < 0.02, "{looked_up}");
            assert!(
                (drawn - truncation).abs() < level_pixel,
                "{coverage:?} {truncation}: {drawn}"
            );
        }
    }
}

/// How far a picture is from another, relative to it, over all pixels.
fn difference(found: &Image, expected: &Image) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for (found, expected) in found.pixels().iter().zip(expected.pixels()) {
        off += f64::from(found[0] - expected[0]).powi(2);
        all += f64::from(expected[0]).powi(2);
    }
    (off / all).sqrt()
}

/// Overlapping footprints are drawn where pixels are wider than they may be for others, and made
/// narrower by what the interpolation between those pixels adds.
#[test]
fn overlapping_footprints_sum_to_what_others_do() {
    let buffer = floor();
    let picture = |spacing: f32, coverage| {
        let axes = [spacing * PIXEL * Vec3::X, 0.8 * spacing * PIXEL * Vec3::Z];
        let photons = spread(axes, coverage);
        let options = truncated(coverage, 3.0);
        splat(&buffer, &photons, &options).expect("valid").0
    };
    // Those of others that are narrower are integrated over pixels.
    for spacing in [2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 16.0, 24.0] {
        let (cells, overlaps) = (
            picture(spacing, Coverage::Cell),
            picture(spacing, Coverage::Overlap),
        );
        let off = difference(&overlaps, &cells);
        let wider = difference(&picture(1.1 * spacing, Coverage::Overlap), &cells);
        println!("{spacing} {off:.5} {wider:.5}");
        assert!(off < 0.01, "{spacing}: {off}");
        // Control: a tenth more width is told apart.
        assert!(wider > 2.0 * off, "{spacing}: {wider}");
    }
}

#[test]
fn a_truncation_out_of_range_is_refused() {
    for truncation in [1.0, 4.0] {
        for coverage in COVERAGES {
            assert_eq!(truncated(coverage, truncation).validate(), Ok(()));
        }
    }
    for truncation in [0.999, 4.001, -3.0, f32::INFINITY] {
        for coverage in COVERAGES {
            let error = RenderError::InvalidTruncation { truncation };
            let options = truncated(coverage, truncation);
            assert_eq!(options.validate(), Err(error.clone()));
            let gather = FootprintGather::new(&[], &options);
            assert_eq!(gather.err(), Some(error));
        }
    }
    assert!(truncated(Coverage::Cell, f32::NAN).validate().is_err());
    assert!(truncated(Coverage::Overlap, f32::NAN).validate().is_err());
}
