//! Closed bodies inside and across one another: which of them is there, what a boundary does, and
//! where a path starts.

use crate::common;

use caustics_geometry::glam::Vec2;
use caustics_geometry::shapes::{RevolutionOptions, heightfield, revolution};
use caustics_scene::{Material, Scene, World};
use caustics_trace::glam::Vec3;
use caustics_trace::{Crossing, Fate, MediumStack};
use common::scenes::{add_box, add_floor, add_mesh, add_sphere, flattened, single_ray, trace_one};
use proptest::prelude::*;

/// Spheres of the given materials around one center, by their order.
fn nested(materials: impl IntoIterator<Item = Material>) -> World {
    let mut scene = Scene::new();
    for (place, material) in materials.into_iter().enumerate() {
        add_sphere(&mut scene, Vec3::ZERO, 1.0 + place as f32, material);
    }
    World::new(&scene).expect("a small world")
}

fn stack(objects: &[u32]) -> MediumStack {
    objects
        .iter()
        .fold(MediumStack::EMPTY, |stack, &object| stack.entered(object))
}

/// The indices on both sides, or `None` where light goes straight on.
fn interface(world: &World, media: &MediumStack, object: u32, outside: bool) -> Option<[f32; 2]> {
    match media.cross(world, object, outside, None) {
        Crossing::Through(_) => None,
        Crossing::Interface {
            index_from,
            index_to,
            ..
        } => Some([index_from, index_to]),
    }
}

#[test]
fn the_higher_priority_is_there() {
    let glass = Material::dielectric("glass", 1.5).with_priority(1);
    // Denser than the glass, and yet displaced.
    let oil = Material::dielectric("oil", 1.6).with_attenuation([7.0; 3]);
    let world = nested([glass, oil]);
    assert_eq!(interface(&world, &stack(&[0]), 1, true), None);
    assert_eq!(interface(&world, &stack(&[0, 1]), 1, false), None);
    assert_eq!(
        interface(&world, &stack(&[0, 1]), 0, false),
        Some([1.5, 1.6])
    );
    assert_eq!(interface(&world, &stack(&[1]), 0, true), Some([1.6, 1.5]));
    assert_eq!(stack(&[0, 1]).attenuation(&world), Vec3::ZERO);
    assert_eq!(stack(&[1]).attenuation(&world), Vec3::splat(7.0));
    assert_eq!(MediumStack::EMPTY.attenuation(&world), Vec3::ZERO);
}

#[test]
fn of_equal_priorities_the_denser_is_there() {
    let world = nested([
        Material::dielectric("glass", 1.5),
        Material::dielectric("water", 1.33),
    ]);
    assert_eq!(interface(&world, &stack(&[0]), 1, true), None);
    assert_eq!(interface(&world, &stack(&[1]), 0, true), Some([1.33, 1.5]));
    assert_eq!(
        interface(&world, &stack(&[1, 0]), 0, false),
        Some([1.5, 1.33])
    );
    // Where both are the same there is a boundary, but one that does nothing.
    let twins = nested([
        Material::dielectric("ice", 1.31),
        Material::dielectric("ice", 1.31),
    ]);
    assert_eq!(interface(&twins, &stack(&[0]), 1, true), Some([1.31, 1.31]));
}

#[test]
fn leaving_what_was_never_entered_changes_nothing() {
    let world = nested([
        Material::dielectric("glass", 1.5),
        Material::dielectric("water", 1.33),
    ]);
    assert_eq!(MediumStack::EMPTY.left(0), MediumStack::EMPTY);
    assert_eq!(stack(&[1]).left(0), stack(&[1]));
    // It is refracted as if the path had been inside.
    assert_eq!(
        interface(&world, &MediumStack::EMPTY, 0, false),
        Some([1.5, 1.0])
    );
    let Crossing::Interface { beyond, .. } = stack(&[1]).cross(&world, 0, false, None) else {
        panic!("an interface");
    };
    assert_eq!(beyond, stack(&[1]));
}

#[test]
fn opaque_objects_are_no_media() {
    let world = nested([Material::metal("silver", [0.9; 3])]);
    assert_eq!(interface(&world, &MediumStack::EMPTY, 0, true), None);
    assert_eq!(interface(&world, &MediumStack::EMPTY, 77, true), None);
    assert_eq!(stack(&[0]).attenuation(&world), Vec3::ZERO);
}

#[test]
fn channels_see_their_own_index() {
    let world = nested([Material::dielectric("flint", 1.6).with_dispersion(0.5)]);
    let index = |channel| match MediumStack::EMPTY.cross(&world, 0, true, channel) {
        Crossing::Interface { index_to, .. } => index_to,
        Crossing::Through(_) => f32::NAN,
    };
    assert_eq!(index(None), 1.6);
    assert!(index(Some(0)) < index(Some(1)) && index(Some(1)) < index(Some(2)));
    assert_eq!(index(Some(200)), index(Some(2)));
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(2_000)
    })]

    /// Entering and leaving in any order against a list without a limit.
    #[test]
    fn the_stack_is_a_list_that_forgets_the_outermost(
        steps in prop::collection::vec((0u32..12, any::<bool>()), 0..60),
    ) {
        let mut media = MediumStack::EMPTY;
        let mut list: Vec<u32> = Vec::new();
        for (object, enters) in steps {
            if enters {
                media = media.entered(object);
                list.push(object);
                // The documented capacity.
                if list.len() > 8 {
                    list.remove(0);
                }
            } else {
                media = media.left(object);
                if let Some(place) = list.iter().rposition(|&it| it == object) {
                    list.remove(place);
                }
            }
            prop_assert_eq!(media.objects(), &list[..]);
        }
    }

    /// What is there does not depend on the order of entering; and a crossing and its reverse see
    /// the same two indices.
    #[test]
    fn order_does_not_matter(
        bodies in prop::collection::vec((-2i32..3, 1.01f32..2.0), 1..7),
        keys in prop::collection::vec(any::<u32>(), 7),
        chosen in any::<prop::sample::Index>(),
    ) {
        let materials = bodies.iter().map(|&(priority, ior)| {
            Material::dielectric("body", ior).with_priority(priority).with_attenuation([ior; 3])
        });
        let world = nested(materials);
        let object = chosen.index(bodies.len()) as u32;
        let mut order: Vec<u32> = (0..bodies.len() as u32).filter(|&it| it != object).collect();
        let plain = stack(&order);
        order.sort_by_key(|&it| keys[it as usize]);
        let shuffled = stack(&order);
        prop_assert_eq!(plain.attenuation(&world), shuffled.attenuation(&world));
        let into = interface(&world, &plain, object, true);
        prop_assert_eq!(into, interface(&world, &shuffled, object, true));
        let out = interface(&world, &shuffled.entered(object), object, false);
        prop_assert_eq!(into, out.map(|[from, to]| [to, from]));
        // The strongest of all, by brute force.
        let strength = |it: u32| (bodies[it as usize].0, bodies[it as usize].1);
        let other = order.iter().copied().max_by(|&a, &b| {
            strength(a).partial_cmp(&strength(b)).expect("finite numbers")
        });
        let displaced = other.is_some_and(|it| strength(it) > strength(object));
        prop_assert_eq!(into.is_none(), displaced);
        if let Some([from, to]) = into {
            prop_assert_eq!(from, other.map_or(1.0, |it| bodies[it as usize].1));
            prop_assert_eq!(to, bodies[object as usize].1);
        }
    }
}

#[test]
fn a_path_may_start_inside() {
    // A tumbler with a thick bottom; the water reaches a little into its wall.
    let mut scene = Scene::new();
    let profile = [
        (0.0, 0.0),
        (1.0, 0.0),
        (1.0, 3.0),
        (0.8, 3.0),
        (0.8, 0.4),
        (0.0, 0.4),
    ];
    let profile = profile.map(|(x, y)| Vec2::new(x, y));
    let glass = revolution(&profile, &RevolutionOptions::default()).expect("a valid profile");
    let profile = [(0.0, 0.3), (0.9, 0.3), (0.9, 2.0), (0.0, 2.0)].map(|(x, y)| Vec2::new(x, y));
    let water = revolution(&profile, &RevolutionOptions::default()).expect("a valid profile");
    assert!(glass.signed_volume() > 0.0 && water.signed_volume() > 0.0);
    add_floor(&mut scene, -1.0, 10.0);
    add_mesh(
        &mut scene,
        "glass",
        glass,
        Material::dielectric("glass", 1.5).with_priority(1),
    );
    add_mesh(
        &mut scene,
        "water",
        water,
        Material::dielectric("water", 1.33),
    );
    let (world, intersector) = flattened(&scene);
    let media = |x: f32, y: f32| {
        let mut objects = MediumStack::at(&world, &intersector, Vec3::new(x, y, 0.1))
            .objects()
            .to_vec();
        objects.sort_unstable();
        objects
    };
    assert_eq!(media(0.1, 1.0), [2], "in the water");
    assert_eq!(media(0.1, 2.5), [0u32; 0], "in the air over it");
    assert_eq!(media(0.95, 1.0), [1], "in the wall");
    assert_eq!(media(0.85, 1.0), [1, 2], "where both overlap");
    assert_eq!(
        media(0.1, 0.35),
        [1, 2],
        "in the bottom, where both overlap"
    );
    assert_eq!(media(0.1, 0.1), [1], "in the bottom");
    assert_eq!(media(3.0, 1.0), [0u32; 0], "beside it");
    assert_eq!(media(0.1, -0.5), [0u32; 0], "under it");
}

#[test]
fn a_sheet_of_water_is_bottomless() {
    let mut scene = Scene::new();
    add_floor(&mut scene, -2.0, 20.0);
    let waves = heightfield([40.0, 40.0], [20, 20], |x, z| 0.1 * (x + 0.5 * z).sin());
    add_mesh(
        &mut scene,
        "sea",
        waves.expect("a valid sheet"),
        Material::dielectric("water", 1.33),
    );
    let (world, intersector) = flattened(&scene);
    let at = |y: f32| MediumStack::at(&world, &intersector, Vec3::new(0.3, y, 0.2));
    assert_eq!(at(-1.0).objects(), [1]);
    assert_eq!(at(1.0), MediumStack::EMPTY);
    // Under the bottom of the sea there is still the sea: nothing says where it ends.
    assert_eq!(at(-3.0).objects(), [1]);
}

/// A layer of glass over one of water that reaches into it, both wide, with a floor below.
fn layers(glass_priority: i32) -> Scene {
    let mut scene = Scene::new();
    let (wide, deep) = (Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 0.0, 20.0));
    let glass = Material::dielectric("glass", 1.5).with_priority(glass_priority);
    add_floor(&mut scene, -2.0, 30.0);
    add_box(&mut scene, "glass", wide, deep + Vec3::Y, glass);
    let water = Material::dielectric("water", 1.33);
    add_box(
        &mut scene,
        "water",
        wide - Vec3::Y,
        deep + 0.25 * Vec3::Y,
        water,
    );
    scene
}

/// Where a ray that starts at height 2 with this angle to the vertical lands on the floor at -2,
/// through layers of the given indices and thicknesses, and what Fresnel leaves of it.
fn through_layers(angle: f64, layers: &[(f64, f64)]) -> (f64, f64) {
    let sine = angle.sin();
    let (mut offset, mut left, mut before) = (0.0, 1.0, 1.0);
    for &(index, thickness) in layers {
        let (c1, c2) = {
            let cosine = |n: f64| (1.0 - (sine / n).powi(2)).sqrt();
            (cosine(before), cosine(index))
        };
        let perpendicular = (before * c1 - index * c2) / (before * c1 + index * c2);
        let parallel = (index * c1 - before * c2) / (index * c1 + before * c2);
        left *= 1.0 - 0.5 * (perpendicular.powi(2) + parallel.powi(2));
        offset += thickness * (sine / index) / c2;
        before = index;
    }
    (offset, left)
}

#[test]
fn liquid_that_reaches_into_its_glass_refracts_with_the_ratio_of_both() {
    for (priority, boundary) in [(1, 0.0), (0, 0.0), (-1, 0.25)] {
        let scene = layers(priority);
        let (_, intersector) = flattened(&scene);
        for degrees in [0.0f64, 10.0, 35.0, 60.0, 80.0] {
            let angle = degrees.to_radians();
            let onwards = Vec3::new(angle.sin() as f32, -angle.cos() as f32, 0.0);
            let light = single_ray(Vec3::new(0.0, 2.0, 0.0), onwards, 1e-3);
            let map = trace_one(&scene, &intersector, light);
            // Three refractions and nothing else: the branch that is never reflected.
            let direct: Vec<_> = map
                .photons
                .iter()
                .filter(|photon| photon.events == 3)
                .collect();
            assert_eq!(direct.len(), 1, "at {degrees} degrees");
            let layers = [
                (1.0, 1.0),
                (1.5, 1.0 - boundary),
                (1.33, 1.0 + boundary),
                (1.0, 1.0),
            ];
            let (offset, left) = through_layers(angle, &layers);
            let error = f64::from(direct[0].position.x) - offset;
            // Spawned rays step off along the normal, by some 10⁻⁶ of the layers' 20 m.
            let tolerance = 1e-6 * (1.0 + offset) + 5e-5 * angle.tan();
            assert!(
                error.abs() < tolerance,
                "priority {priority}, {degrees}: {error}"
            );
            let unaimed = map.ledger.entry(Fate::Unaimed).flux.x;
            let emitted = map.ledger.emitted().flux.x - unaimed;
            let error = f64::from(direct[0].flux.x) / emitted - left;
            assert!(
                error.abs() < 1e-5,
                "priority {priority}, {degrees} degrees: {error:e}"
            );
            assert!(map.ledger.imbalance() < 1e-6);
            // The control: with the boundary at the water's own top, or seen from air.
            let swapped = [
                (1.0, 1.0),
                (1.5, 0.75 + boundary),
                (1.33, 1.25 - boundary),
                (1.0, 1.0),
            ];
            let (wrong, _) = through_layers(angle, &swapped);
            assert!(degrees == 0.0 || (wrong - offset).abs() > 1e-3 * offset);
        }
    }
}
