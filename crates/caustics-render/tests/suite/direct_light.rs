//! Direct light from lights with an area, against closed forms.

use std::f32::consts::PI;

use caustics_geometry::shapes::quad;
use caustics_render::{DirectLight, EyeTracer};
use caustics_sampling::CounterRng;
use caustics_scene::{BvhOptions, Environment, Instance, Light, Material, Scene, Shape, World};
use caustics_trace::MediumStack;
use glam::Vec3;

/// The mean irradiance, over samples, that a light brings to the origin of a white floor at y = 0,
/// with an opaque ball somewhere.
fn irradiance(light: Light, post: Vec3) -> f32 {
    lit(Lit::By(light), post)
}

#[derive(Clone, Copy)]
enum Lit {
    By(Light),
    /// A sky of this radiance everywhere.
    All(f32),
}

fn lit(light: Lit, post: Vec3) -> f32 {
    const SAMPLES: u64 = 40_000;
    let mut scene = Scene::new();
    let white = scene
        .add_material(Material::diffuse("white", [1.0; 3]))
        .expect("a valid material");
    let floor = quad([-1.0, 0.0, 1.0], 2.0 * Vec3::X, -2.0 * Vec3::Z).expect("a valid floor");
    let shape = Shape::Mesh(scene.add_mesh(floor));
    scene
        .add_instance(Instance::new("floor", shape, white))
        .expect("a valid instance");
    let shape = Shape::Sphere {
        center: post,
        radius: 0.2,
    };
    scene
        .add_instance(Instance::new("post", shape, white))
        .expect("a valid instance");
    match light {
        Lit::By(light) => scene.add_light(light).expect("a valid light"),
        Lit::All(radiance) => {
            let sky = Environment::new(4, 2, vec![[radiance; 3]; 8]).expect("a sky");
            scene.set_environment(Some(sky));
        }
    }
    let world = World::new(&scene).expect("a small world");
    let rays = world
        .intersector(&BvhOptions::default())
        .expect("a small tree");
    let direct = DirectLight::new(&world, &rays);
    let mut eye = EyeTracer::new(&world, &rays, 4);
    let down = caustics_geometry::Ray::new([0.0, 0.05, 0.0], [0.0, -1.0, 0.0]);
    let mut sum = Vec3::ZERO;
    for sample in 0..SAMPLES {
        let mut rng = CounterRng::new(1, sample);
        eye.trace(down, MediumStack::EMPTY, &mut rng, |receiver, rng| {
            sum += direct.radiance(receiver, rng);
        });
    }
    // A white floor reflects its irradiance over pi.
    PI * sum.y / SAMPLES as f32
}

const ASIDE: Vec3 = Vec3::new(0.8, 0.2, 0.8);

#[test]
fn lights_overhead_light_the_floor_as_the_closed_forms_say() {
    let radiance = 3.0f32;
    let (height, radius) = (2.0f32, 0.7f32);
    let above = Vec3::new(0.0, height, 0.0);
    // A disc subtends the angle a: pi L sin² a. A ball of the same angle brings the same.
    let disc = Light::disc(above, Vec3::NEG_Y, radius, [radiance; 3]).expect("a valid light");
    let sine_squared = radius * radius / (radius * radius + height * height);
    let exact = PI * radiance * sine_squared;
    let found = irradiance(disc, ASIDE);
    assert!((found / exact - 1.0).abs() < 2e-3, "{found} {exact}");

    let ball = Light::sphere(above, radius, [radiance; 3]).expect("a valid light");
    let exact = PI * radiance * (radius / height).powi(2);
    let found = irradiance(ball, ASIDE);
    assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");

    // A corner of the rectangle a by b overhead: with A = a/h, B = b/h, L/2 times
    // A/sqrt(1+A²) atan(B/sqrt(1+A²)) + B/sqrt(1+B²) atan(A/sqrt(1+B²)).
    let (a, b) = (1.5f32, 0.8f32);
    let panel = Light::rectangle(above, [a * Vec3::X, b * Vec3::Z], [radiance; 3]);
    let term = |a: f32, b: f32| {
        let hypotenuse = 1.0f32.hypot(a);
        a / hypotenuse * (b / hypotenuse).atan()
    };
    let exact = 0.5 * radiance * (term(a / height, b / height) + term(b / height, a / height));
    let found = irradiance(panel.expect("a valid light"), ASIDE);
    assert!((found / exact - 1.0).abs() < 4e-3, "{found} {exact}");
}

#[test]
fn what_stands_between_casts_its_shadow_and_what_stands_beyond_does_not() {
    let above = Vec3::new(0.0, 2.0, 0.0);
    let lights = [
        Light::disc(above, Vec3::NEG_Y, 0.1, [1.0; 3]),
        Light::sphere(above, 0.1, [1.0; 3]),
        Light::rectangle(above, [0.1 * Vec3::X, 0.1 * Vec3::Z], [1.0; 3]),
    ];
    for light in lights {
        let light = light.expect("a valid light");
        let free = irradiance(light, ASIDE);
        assert!(free > 0.0);
        assert_eq!(irradiance(light, Vec3::new(0.0, 1.0, 0.0)), 0.0);
        assert_eq!(irradiance(light, Vec3::new(0.0, 2.4, 0.0)), free);
    }
    // The back of a disc is dark.
    let turned = Light::disc(above, Vec3::Y, 0.1, [1.0; 3]).expect("a valid light");
    assert_eq!(irradiance(turned, ASIDE), 0.0);
}

#[test]
fn an_even_sky_lights_the_floor_with_pi_times_its_radiance() {
    let free = lit(Lit::All(2.0), Vec3::new(0.0, -5.0, 0.0));
    // One direction a sample varies by 1.3 times its mean: four standard errors.
    assert!((free / (2.0 * PI) - 1.0).abs() < 2.6e-2, "{free}");
    // A ball overhead hides pi L sin² a.
    let hidden = lit(Lit::All(2.0), Vec3::new(0.0, 0.5, 0.0));
    let exact = 2.0 * PI * (1.0 - 0.4 * 0.4);
    assert!((hidden / exact - 1.0).abs() < 2.6e-2, "{hidden} {exact}");
    assert!(hidden < 0.9 * free);
}
