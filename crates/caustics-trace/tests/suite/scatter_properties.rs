//! What leaves a specular surface, for any geometric and interpolated normal, also where the two
//! disagree.

use crate::common;

use caustics_geometry::SpawnPoint;
use caustics_scene::{Instance, Material, Scene, Shape, SurfacePoint, World};
use caustics_trace::glam::Vec3;
use caustics_trace::{Event, MediumStack, reflect, refract, scatter};
use common::{direction, tilted};
use proptest::prelude::*;

const TAU: f64 = std::f64::consts::TAU;

/// Spheres of glass of an index, of a metal, and of chalk, in this order.
fn world(ior: f32, base: [f32; 3]) -> World {
    let mut scene = Scene::new();
    for (place, material) in [
        Material::dielectric("glass", ior),
        Material::metal("metal", base),
        Material::diffuse("chalk", [0.5; 3]),
    ]
    .into_iter()
    .enumerate()
    {
        let material = scene.add_material(material).expect("valid materials");
        let center = Vec3::new(3.0 * place as f32, 0.0, 0.0);
        let instance = Instance::new(
            "ball",
            Shape::Sphere {
                center,
                radius: 1.0,
            },
            material,
        );
        scene.add_instance(instance).expect("valid spheres");
    }
    World::new(&scene).expect("a small world")
}

fn point(object: u32, geometric: Vec3, shading: Vec3, onwards: Vec3) -> SurfacePoint {
    SurfacePoint {
        spawn: SpawnPoint::free(Vec3::ZERO),
        geometric_normal: geometric,
        shading_normal: shading,
        object,
        material: object,
        primitive: object,
        u: 0.0,
        v: 0.0,
        from_outside: onwards.dot(geometric) < 0.0,
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(20_000)
    })]

    #[test]
    fn energy_is_kept_on_the_right_sides(
        light in (-1.0..1.0, 0.0..TAU),
        geometric in (-1.0..1.0, 0.0..TAU),
        // Mostly near the geometric normal, sometimes anywhere.
        bend in (prop_oneof![4 => 0.0..0.6, 1 => 0.0..std::f64::consts::PI, 1 => Just(0.0)], 0.0..TAU),
        ior in prop_oneof![Just(1.0f32), 1.0f32..2.6],
        base in prop::array::uniform3(0.0f32..=1.0),
        object in 0u32..3,
    ) {
        let onwards = direction(light.0, light.1).as_vec3();
        let exact_normal = direction(geometric.0, geometric.1);
        let geometric = exact_normal.as_vec3();
        let shading = tilted(exact_normal, bend.0, bend.1).as_vec3();
        let world = world(ior, base);
        let point = point(object, geometric, shading, onwards);
        let media = if point.from_outside || object != 0 {
            MediumStack::EMPTY
        } else {
            MediumStack::EMPTY.entered(0)
        };
        let scattering = scatter(&world, &point, onwards, &media, None);
        if object == 2 {
            prop_assert_eq!(scattering, None);
            return Ok(());
        }
        prop_assert!(scattering.is_some());
        let scattering = scattering.unwrap();
        // Facing the light.
        let side = if point.from_outside { 1.0 } else { -1.0 };
        let (facing, bent) = (side * geometric, side * shading);
        let slope = -onwards.dot(facing);

        let mut sum = scattering.absorbed;
        let mut stood_in = 0;
        for outgoing in scattering.outgoing() {
            sum += outgoing.weight;
            prop_assert!(outgoing.weight.cmpge(Vec3::ZERO).all());
            prop_assert!(outgoing.weight.cmple(Vec3::splat(1.0 + f32::EPSILON)).all());
            prop_assert!((outgoing.direction.length() - 1.0).abs() < 1e-6);
            let along = outgoing.direction.dot(facing);
            let rounding = 2.0 * f32::EPSILON;
            // Light in the very plane of the surface is on neither side.
            match outgoing.event {
                Event::Reflection => prop_assert!(along > -rounding || slope < rounding, "{along}"),
                Event::Refraction => prop_assert!(along < rounding, "{along}"),
                Event::Passage => prop_assert!(false, "nothing displaces the ball"),
            }
            prop_assert_eq!(outgoing.normal, if outgoing.interpolated { bent } else { facing });
            let expected = match outgoing.event {
                Event::Refraction => refract(onwards, outgoing.normal, outgoing.eta),
                _ => Some(reflect(onwards, outgoing.normal).normalize()),
            };
            prop_assert_eq!(Some(outgoing.direction), expected);
            let into = usize::from(point.from_outside);
            let inside = match outgoing.event {
                Event::Refraction => into,
                _ => 1 - into,
            };
            prop_assert_eq!(outgoing.media.objects().len(), if object == 0 { inside } else { 0 });
            stood_in += u32::from(!outgoing.interpolated);
        }
        prop_assert!((sum - Vec3::ONE).abs().max_element() <= 2.0 * f32::EPSILON, "{sum}");
        prop_assert!(scattering.absorbed.cmpge(Vec3::ZERO).all());
        prop_assert_eq!(scattering.absorbed == Vec3::ZERO, object == 0 || base == [1.0; 3]);

        let refracts = scattering.outgoing().any(|it| it.event == Event::Refraction);
        let allowed = if object == 0 && !refracts { stood_in..=stood_in + 1 } else { stood_in..=stood_in };
        prop_assert!(allowed.contains(&scattering.fallbacks));
        if bent.dot(onwards) >= 0.0 {
            prop_assert!(scattering.fallbacks >= 1 && scattering.outgoing().all(|it| !it.interpolated));
        }
        if bend.0 == 0.0 && slope > 1e-5 {
            prop_assert_eq!(scattering.fallbacks, 0);
        }
    }
}

/// The interpolated normal would let the light out, but to the wrong side, and the geometric one
/// reflects it totally: counted, and nothing is lost.
#[test]
fn a_refraction_that_the_geometric_normal_forbids_is_counted() {
    let world = world(1.5, [1.0; 3]);
    let mut counted = 0;
    for step in 0..2000 {
        let angle = 0.7 + 0.0004 * f64::from(step);
        let onwards = direction(angle.cos(), 0.0).as_vec3();
        let shading = direction(0.45f64.cos(), 0.0).as_vec3();
        let point = point(0, Vec3::Y, shading, onwards);
        let media = MediumStack::EMPTY.entered(0);
        let scattering = scatter(&world, &point, onwards, &media, None).expect("glass");
        let total = scattering.outgoing().count() == 1;
        let all_interpolated = scattering.outgoing().all(|it| it.interpolated);
        if total && all_interpolated && scattering.fallbacks == 1 {
            // Below the critical angle of the normal that let it out.
            assert!(refract(onwards, -shading, 1.5).is_some());
            assert_eq!(refract(onwards, Vec3::NEG_Y, 1.5), None);
            counted += 1;
        }
    }
    assert!(counted > 50, "{counted}");
}
