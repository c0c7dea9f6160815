//! Progressive pictures are those of single calls with as many photons.

use caustics::filter::relative_mse;
use caustics::geometry::shapes::quad;
use caustics::glam::Vec3;
use caustics::prelude::*;
use caustics::{Progressive, Quantum};
use std::time::{Duration, Instant};

fn scene(lamp: Vec3) -> Scene {
    let mut scene = Scene::new();
    let glass = scene
        .add_material(Material::dielectric("glass", 1.5))
        .expect("valid");
    let white = scene
        .add_material(Material::diffuse("white", [0.8; 3]))
        .expect("valid");
    let floor = quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]).expect("valid");
    let floor = scene.add_mesh(floor);
    scene
        .add_instance(Instance::new("floor", Shape::Mesh(floor), white))
        .expect("valid");
    let ball = Shape::Sphere {
        center: Vec3::new(0.0, 0.8, 0.0),
        radius: 0.5,
    };
    scene
        .add_instance(Instance::new("ball", ball, glass))
        .expect("valid");
    scene
        .add_light(Light::point(lamp, [10.0; 3]).expect("valid"))
        .expect("valid");
    scene
}

const LAMP: Vec3 = Vec3::new(0.4, 3.0, 0.3);

fn camera() -> Camera {
    Camera::look_at("above", [0.0, 3.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7).expect("valid")
}

const SIZE: PictureOptions = PictureOptions {
    width: 96,
    height: 96,
    samples: 1,
    seed: 0,
    max_depth: 16,
    visibility: Visibility::Direct,
};

fn single(scene: &Scene, photons: u32) -> Image {
    let mut options = CausticsOptions::default();
    options.trace.photons = photons;
    let caustics = Caustics::new(scene, &options).expect("valid");
    caustics.render(&camera(), &SIZE).expect("valid").caustics
}

fn progressive(scene: &Scene, estimate: Estimate, max_photons: u32) -> Progressive {
    let options = CausticsOptions::for_estimate(estimate);
    let mut progressive = Progressive::new(scene, &options, max_photons).expect("valid");
    progressive.look(&camera(), &SIZE).expect("valid");
    progressive
}

#[test]
fn a_whole_pass_is_the_picture_of_a_single_call() {
    let scene = scene(LAMP);
    let mut progressive = progressive(&scene, Estimate::default(), 16_384);
    assert!(
        progressive
            .caustics()
            .expect("valid")
            .pixels()
            .iter()
            .all(|it| *it == [0.0; 3])
    );
    for photons in [4096u32, 8192, 16_384] {
        progressive
            .advance(Quantum::Photons(photons))
            .expect("valid");
        assert_eq!(progressive.shown_photons(), photons);
        assert!(progressive.caustics().expect("valid") == single(&scene, photons));
    }
    // Larger passes than are kept come in parts: the same but for the rounding of sums.
    progressive
        .advance(Quantum::Photons(32_768))
        .expect("valid");
    assert_eq!(progressive.shown_photons(), 32_768);
    let error = relative_mse(
        &progressive.caustics().expect("valid"),
        &single(&scene, 32_768),
    );
    assert!(error.expect("of one size") < 1e-10);
    assert_eq!(progressive.traced_photons(), 4096 + 8192 + 16_384 + 32_768);
}

#[test]
fn the_error_falls_and_memory_stays_bounded() {
    let scene = scene(LAMP);
    let reference = single(&scene, 1 << 20);
    for (estimate, factor) in [(Estimate::default(), 6.0), (Estimate::Nearest, 3.0)] {
        let mut progressive = progressive(&scene, estimate, 32_768);
        let mut errors = Vec::new();
        let mut most = 0;
        while progressive.shown_photons() < 200_000 {
            progressive
                .advance(Quantum::Photons(10_000))
                .expect("valid");
            most = most.max(progressive.photons_in_memory());
            let error = relative_mse(&progressive.caustics().expect("valid"), &reference);
            errors.push((progressive.shown_photons(), error.expect("of one size")));
        }
        let first = errors.iter().find(|it| it.0 > 0).expect("a first pass").1;
        let last = errors.last().expect("a last pass").1;
        println!("{} {first:e} {last:e}, {most} photons", estimate.name());
        assert!(last * factor < first, "{}: {first} {last}", estimate.name());
        // Two passes, of which each photon lands up to a few times.
        assert!(most < 2 * 3 * 32_768, "{most}");
    }
}

#[test]
fn a_changed_light_is_seen_after_one_quantum_and_a_camera_at_once() {
    let before = scene(LAMP);
    let mut progressive = progressive(&before, Estimate::default(), 16_384);
    progressive
        .advance(Quantum::Photons(60_000))
        .expect("valid");
    let old = progressive.caustics().expect("valid");
    // From elsewhere the photons that there are show something at once.
    let aside = Camera::look_at("aside", [2.0, 2.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7);
    progressive
        .look(&aside.expect("valid"), &SIZE)
        .expect("valid");
    assert_eq!(progressive.shown_photons(), 16_384);
    assert!(
        progressive
            .caustics()
            .expect("valid")
            .pixels()
            .iter()
            .any(|it| it[0] > 0.0)
    );
    progressive.look(&camera(), &SIZE).expect("valid");
    progressive
        .advance(Quantum::Photons(40_000))
        .expect("valid");
    assert!(progressive.shown_photons() >= 16_384);

    let moved = scene(LAMP + Vec3::new(0.5, 0.0, 0.0));
    progressive.set_scene(&moved).expect("valid");
    progressive.advance(Quantum::Photons(4096)).expect("valid");
    let new = progressive.caustics().expect("valid");
    assert!(new == single(&moved, 4096));
    assert!(new != old);
}

#[test]
fn time_is_kept_to_within_a_slice() {
    let mut progressive = progressive(&scene(LAMP), Estimate::default(), 65_536);
    let start = Instant::now();
    let traced = progressive
        .advance(Quantum::Time(Duration::from_millis(50)))
        .expect("valid");
    assert!(start.elapsed() >= Duration::from_millis(50));
    assert!(traced > 0 && u64::from(traced) == progressive.traced_photons());
    // Even no time at all makes a little progress.
    assert!(
        progressive
            .advance(Quantum::Time(Duration::ZERO))
            .expect("valid")
            > 0
    );
}
