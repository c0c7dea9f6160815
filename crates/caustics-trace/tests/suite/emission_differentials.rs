//! What a light says about a photon's neighbours against the rays that it sends for samples nearby.

use crate::common;

use caustics_geometry::shapes::quad;
use caustics_scene::{Light, Material, Scene, World};
use caustics_trace::glam::{DVec3, Vec2, Vec3};
use caustics_trace::{Aim, Casters, EmissionSample, Emitter};
use common::relative_error;
use common::scenes::{add_floor, add_mesh, add_sphere};
use proptest::prelude::*;

fn world(light: Option<Light>) -> World {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 3.0);
    add_sphere(
        &mut scene,
        Vec3::ZERO,
        0.5,
        Material::dielectric("glass", 1.5),
    );
    match light {
        Some(light) => scene.add_light(light).expect("a valid light"),
        None => {
            let panel = quad([0.3, 2.0, -0.2], Vec3::X, Vec3::Z).expect("a valid panel");
            let lamp = Material::diffuse("panel", [0.0; 3]).with_emission([1.0; 3]);
            add_mesh(&mut scene, "panel", panel, lamp);
        }
    }
    World::new(&scene).expect("a small world")
}

fn light() -> impl Strategy<Value = Light> {
    let above =
        || prop::array::uniform3(-0.5f32..0.5).prop_map(|it| Vec3::from(it) + 3.0 * Vec3::Y);
    prop_oneof![
        above().prop_map(|position| Light::point(position, [1.0; 3])),
        (above(), 0.3f32..1.5).prop_map(|(at, outer)| Light::spot(
            at,
            -at,
            [1.0; 3],
            0.5 * outer,
            outer
        )),
        above().prop_map(|towards| Light::directional(-towards, [1.0; 3])),
    ]
    .prop_map(|light| light.expect("a valid light"))
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        max_global_rejects: 100_000,
        ..ProptestConfig::with_cases(5_000)
    })]

    #[test]
    fn neighbours_leave_as_the_differential_says(
        light in light(),
        aim in prop_oneof![Just(Aim::Everywhere), Just(Aim::Casters)],
        point in (0.03f32..0.97, 0.03f32..0.97),
        edges in prop::array::uniform4(-1.0f32..1.0),
    ) {
        const STEP: f32 = 4e-3;
        let world = world(Some(light));
        let emitters = Emitter::all(&world, &Casters::of(&world), aim);
        let point = Vec2::new(point.0, point.1);
        // Maps of the square have creases along its diagonals and the cross through its middle.
        let off = point - Vec2::splat(0.5);
        let creases = [off.x, off.y, off.x + off.y, off.x - off.y, 0.5 - off.abs().element_sum()];
        prop_assume!(creases.iter().all(|it| it.abs() > 4.0 * STEP));
        let spacing = [Vec2::new(edges[0], edges[1]), Vec2::new(edges[2], edges[3])];
        prop_assume!(spacing.iter().all(|edge| edge.length() > 0.1));
        let sample = EmissionSample { point, spacing, place: Vec2::splat(0.5), count: 1000, weight: 1.0 };
        let at = |point: Vec2| emitters[0].emit::<2>(&world, &EmissionSample { point, ..sample });
        prop_assume!(at(point).is_some());
        let emission = at(point).expect("just checked");
        for (parameter, edge) in spacing.into_iter().enumerate() {
            let step = STEP * edge;
            let around = [point + step, point - step, point + 2.0 * step, point - 2.0 * step];
            let [Some(after), Some(before), Some(farther), Some(rear)] = around.map(at) else {
                continue;
            };
            let slope = |value: fn(&caustics_trace::Emission<2>) -> Vec3| -> DVec3 {
                let difference = |a, b| (value(a) - value(b)).as_dvec3() / f64::from(2.0 * STEP);
                (4.0 * difference(&after, &before) - 0.5 * difference(&farther, &rear)) / 3.0
            };
            let turned = slope(|it| it.ray.direction);
            let moved = slope(|it| it.ray.origin);
            // The difference of two f32 numbers, of up to 6 m or of unit length, over the step.
            let rounding = 4.0 * f64::from(f32::EPSILON / STEP);
            let differential = &emission.differential;
            let (exact, found, other, rounding) = if moved == DVec3::ZERO {
                (turned, differential.direction, differential.position, rounding)
            } else {
                (moved, differential.position, differential.direction, 6.0 * rounding)
            };
            let tolerance = 1e-3 + rounding / exact.length();
            let error = relative_error(found[parameter], exact);
            prop_assert!(error < tolerance, "{error:e}");
            prop_assert_eq!(other[parameter], Vec3::ZERO);
            // The control: of the other parameter it would be wrong.
            let swapped = relative_error(found[1 - parameter], exact);
            let alike = (spacing[0] - spacing[1]).length() < 0.2;
            prop_assert!(alike || swapped > tolerance);
        }
    }

    /// One photon's parallelogram is its share of the domain: the flux is that per share.
    #[test]
    fn spacing_and_flux_agree(
        light in light(),
        aim in prop_oneof![Just(Aim::Everywhere), Just(Aim::Casters)],
        point in (0.03f32..0.97, 0.03f32..0.97),
        rows in 2u32..50,
    ) {
        let world = world(Some(light));
        let emitters = Emitter::all(&world, &Casters::of(&world), aim);
        let edge = 1.0 / rows as f32;
        let sample = EmissionSample {
            point: Vec2::new(point.0, point.1),
            spacing: [Vec2::new(edge, 0.0), Vec2::new(0.0, edge)],
            place: Vec2::splat(0.5),
            count: rows * rows,
            weight: 1.0,
        };
        let emission = emitters[0].emit::<2>(&world, &sample);
        prop_assume!(emission.is_some());
        let emission = emission.expect("just checked");
        let differential = &emission.differential;
        let [a, b] = match light {
            Light::Directional { .. } => differential.position,
            _ => differential.direction,
        };
        let share = a.cross(b).length();
        let density = match light {
            Light::Directional { irradiance, .. } => irradiance,
            _ => light.intensity_towards(emission.ray.direction),
        };
        let error = emission.flux.x / (density.x * share) - 1.0;
        prop_assert!(error.abs() < 1e-4, "{error:e}");
    }

    /// An area light has four parameters; their derivatives are finite and not zero.
    #[test]
    fn photons_of_an_area_light_have_four_neighbours(
        point in (0.0f32..1.0, 0.0f32..1.0),
        place in (0.0f32..1.0, 0.0f32..1.0),
        aim in prop_oneof![Just(Aim::Everywhere), Just(Aim::Casters)],
    ) {
        let world = world(None);
        let emitters = Emitter::all(&world, &Casters::of(&world), aim);
        let sample = EmissionSample {
            point: Vec2::new(point.0, point.1),
            spacing: [Vec2::new(0.1, 0.0), Vec2::new(0.0, 0.1)],
            place: Vec2::new(place.0, place.1),
            count: 100,
            weight: 1.0,
        };
        let emission = emitters[0].emit::<4>(&world, &sample);
        prop_assume!(emission.is_some());
        let RayChanges { moved, turned } = RayChanges::of(&emission.expect("just checked"));
        prop_assert_eq!((moved, turned), (2, 2));
    }
}

/// How many derivatives of position and of direction are not zero.
struct RayChanges {
    moved: usize,
    turned: usize,
}

impl RayChanges {
    fn of(emission: &caustics_trace::Emission<4>) -> Self {
        let count = |changes: &[Vec3; 4]| {
            changes
                .iter()
                .filter(|it| it.is_finite() && **it != Vec3::ZERO)
                .count()
        };
        let differential = &emission.differential;
        Self {
            moved: count(&differential.position),
            turned: count(&differential.direction),
        }
    }
}
