//! Scenes made by code, for a first picture without a file.

mod spline;

use crate::camera::Camera;
use crate::light::Light;
use crate::material::Material;
use crate::scene::{Instance, Scene, Shape};
use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::{ProfilePoint, quad, revolution_with_normals};
use glam::{Vec2, Vec3};
use spline::Spline;
use std::f32::consts::PI;

/// Segments around the axis. A chord then lies 13 micrometres inside its arc at most.
const SEGMENTS: u32 = 128;

/// Thickness of the bowl's wall, in metres.
const WALL: f32 = 0.0015;

/// How far the liquid reaches into the wall, in metres. Far more than a chord's sag, so that the
/// two bodies overlap all around, and less than the wall.
const OVERLAP: f32 = 0.0005;

/// Height of the liquid's surface above the floor, in metres.
const LEVEL: f32 = 0.067;

/// The glass's outside from the bottom of the axis to the rim: distance from the axis and height, in
/// metres. The foot stands on a ring just clear of the floor.
const OUTSIDE: [[f32; 2]; 18] = [
    [0.0, 0.0022],
    [0.0120, 0.0018],
    [0.0240, 0.0009],
    [0.0300, 0.0004],
    [0.0330, 0.0009],
    [0.0340, 0.0020],
    [0.0328, 0.0030],
    [0.0290, 0.0036],
    [0.0180, 0.0052],
    [0.0090, 0.0098],
    [0.0052, 0.0180],
    [0.0050, 0.0270],
    [0.0090, 0.0350],
    [0.0200, 0.0425],
    [0.0335, 0.0550],
    [0.0415, 0.0740],
    [0.0385, 0.0990],
    [0.0305, 0.1230],
];

/// The first point of [`OUTSIDE`] that has the inside of the bowl behind it.
const BOWL: usize = 13;

/// Height of the inside's lowest point, in metres.
const INNER_BOTTOM: f32 = 0.0412;

/// A cognac glass, a third full, on a pale floor, lit by a spot from the left and behind: it throws
/// its caustic forward to the right.
///
/// The glass stands 0.124 m high at the origin. Glass and liquid are closed bodies, named `glass`
/// (ior 1.5, priority 1) and `cognac` (ior 1.36, amber, priority 0); the liquid overlaps the glass's
/// wall a little, where the priorities decide in favour of the glass. The floor is the plane y = 0.
/// The one camera is meant for pictures of 4:3.
///
/// # Panics
/// Never: nothing here depends on anything outside, and a test runs it.
#[must_use]
pub fn cognac_glass() -> Scene {
    build().unwrap_or_else(|error| unreachable!("the constants above make a scene: {error}"))
}

fn build() -> Result<Scene, Box<dyn std::error::Error>> {
    let (glass_mesh, liquid_mesh) = bodies()?;
    let mut scene = Scene::new();
    let floor = scene.add_material(Material::diffuse("floor", [0.80, 0.78, 0.74]))?;
    let glass = scene.add_material(Material::dielectric("glass", 1.5).with_priority(1))?;
    // 3 cm of it let through 89 % of red, 52 % of green, and 11 % of blue.
    let cognac = Material::dielectric("cognac", 1.36).with_attenuation([4.0, 22.0, 75.0]);
    let cognac = scene.add_material(cognac)?;

    let floor_mesh = quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])?;
    for (name, mesh, material) in [
        ("floor", floor_mesh, floor),
        ("glass", glass_mesh, glass),
        ("cognac", liquid_mesh, cognac),
    ] {
        let mesh = scene.add_mesh(mesh);
        scene.add_instance(Instance::new(name, Shape::Mesh(mesh), material))?;
    }

    let lamp = Vec3::new(-0.46, 0.36, -0.20);
    let aim = Vec3::new(0.06, 0.03, 0.03);
    scene.add_light(Light::spot(lamp, aim - lamp, [1.3, 1.27, 1.2], 0.22, 0.45)?)?;
    let eye = [0.12, 0.31, 0.46];
    scene.add_camera(Camera::look_at(
        "camera",
        eye,
        [0.060, 0.042, 0.014],
        Vec3::Y,
        0.41,
    )?)?;
    Ok(scene)
}

/// The meshes of the glass and of what is in it.
fn bodies() -> Result<(TriangleMesh, TriangleMesh), Box<dyn std::error::Error>> {
    // Both curves leave the axis level, and end along the wall at the rim.
    let points = OUTSIDE.map(Vec2::from);
    let along_rim = points[points.len() - 1] - points[points.len() - 2];
    let outside = Spline::through(&points, Vec2::X, along_rim);
    let into_wall = |point: usize| {
        let (position, tangent) = outside.at_knot(point);
        position - WALL * right_of(tangent)
    };
    let mut inner_points = vec![Vec2::new(0.0, INNER_BOTTOM)];
    inner_points.extend((BOWL..points.len()).map(into_wall));
    let inside = Spline::through(&inner_points, Vec2::X, along_rim);

    let glass = revolution_with_normals(&glass_profile(&outside, &inside), SEGMENTS)?;
    let liquid = revolution_with_normals(&liquid_profile(&inside), SEGMENTS)?;
    Ok((glass, liquid))
}

/// Up the outside, over the rim in a half circle, and down the inside.
fn glass_profile(outside: &Spline, inside: &Spline) -> Vec<ProfilePoint> {
    const STEPS_TO_A_KNOT: usize = 10;
    const STEPS_OF_RIM: usize = 12;
    let surface = |(position, tangent)| ProfilePoint {
        position,
        normal: right_of(tangent),
    };
    let reversed = |(position, tangent): (Vec2, Vec2)| surface((position, -tangent));
    let mut profile: Vec<ProfilePoint> = outside.walk(STEPS_TO_A_KNOT).map(surface).collect();
    let mut down: Vec<ProfilePoint> = inside.walk(STEPS_TO_A_KNOT).map(reversed).collect();
    down.reverse();

    let (from, to) = (profile[profile.len() - 1].position, down[0].position);
    let (middle, radius) = (0.5 * (from + to), 0.5 * (from - to));
    for step in 1..STEPS_OF_RIM {
        let turn = Vec2::from_angle(PI * step as f32 / STEPS_OF_RIM as f32);
        let arm = turn.rotate(radius);
        profile.push(ProfilePoint {
            position: middle + arm,
            normal: arm.normalize(),
        });
    }
    profile.extend(down);
    level_ends(&mut profile);
    profile
}

/// Along the inside of the bowl, but a little into the wall, up to the level, and back to the axis.
fn liquid_profile(inside: &Spline) -> Vec<ProfilePoint> {
    const STEPS_TO_A_KNOT: usize = 10;
    let grown = |(position, tangent): (Vec2, Vec2)| {
        let normal = right_of(tangent);
        ProfilePoint {
            position: position + OVERLAP * normal,
            normal,
        }
    };
    let wall: Vec<ProfilePoint> = inside.walk(STEPS_TO_A_KNOT).map(grown).collect();
    let below = wall.partition_point(|point| point.position.y < LEVEL);
    let mut profile = wall[..below].to_vec();
    if let (Some(last), Some(next)) = (profile.last().copied(), wall.get(below)) {
        let part = (LEVEL - last.position.y) / (next.position.y - last.position.y);
        let edge = Vec2::new(last.position.lerp(next.position, part).x, LEVEL);
        let normal = last.normal.lerp(next.normal, part).normalize();
        // The level meets the wall at a sharp edge: one point, two normals.
        profile.push(ProfilePoint {
            position: edge,
            normal,
        });
        profile.push(ProfilePoint {
            position: edge,
            normal: Vec2::Y,
        });
    }
    profile.push(ProfilePoint {
        position: Vec2::new(0.0, LEVEL),
        normal: Vec2::Y,
    });
    level_ends(&mut profile);
    profile
}

/// Puts both ends exactly on the axis, with normals along it, which rounding may have missed.
fn level_ends(profile: &mut [ProfilePoint]) {
    for point in [0, profile.len() - 1] {
        let ProfilePoint { position, normal } = &mut profile[point];
        position.x = 0.0;
        *normal = Vec2::new(0.0, normal.y.signum());
    }
}

/// The unit vector to the right of a direction: outward, for a profile that goes up the outside.
fn right_of(direction: Vec2) -> Vec2 {
    -direction.perp().normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_closed_and_wind_outward() {
        let (glass, liquid) = bodies().unwrap();
        for mesh in [&glass, &liquid] {
            assert!(mesh.is_closed());
            assert_eq!(mesh.removed_degenerate(), 0);
        }
        // About 45 ml of glass and 65 ml of cognac.
        assert!(
            (20e-6..80e-6).contains(&glass.signed_volume()),
            "{}",
            glass.signed_volume()
        );
        assert!(
            (30e-6..110e-6).contains(&liquid.signed_volume()),
            "{}",
            liquid.signed_volume()
        );
        assert!((glass.bounds().max.y - 0.123).abs() < 2e-3);
        assert!(glass.bounds().min.y > 0.0, "the foot is clear of the floor");
    }

    #[test]
    fn normals_agree_with_the_winding() {
        let (glass, liquid) = bodies().unwrap();
        for mesh in [&glass, &liquid] {
            for (index, corners) in mesh.triangles().iter().enumerate() {
                let flat = mesh.triangle(index).and_then(|t| t.unit_normal()).unwrap();
                for &corner in corners {
                    let cosine = flat.dot(mesh.normals()[corner as usize]);
                    assert!(cosine > 0.9, "triangle {index}: {cosine}");
                }
            }
        }
    }

    #[test]
    fn the_wall_is_of_even_thickness_and_the_liquid_ends_inside_it() {
        let points = OUTSIDE.map(Vec2::from);
        let along_rim = points[points.len() - 1] - points[points.len() - 2];
        let outside = Spline::through(&points, Vec2::X, along_rim);
        let mut inner_points = vec![Vec2::new(0.0, INNER_BOTTOM)];
        inner_points.extend((BOWL..points.len()).map(|point| {
            let (position, tangent) = outside.at_knot(point);
            position - WALL * right_of(tangent)
        }));
        let inside = Spline::through(&inner_points, Vec2::X, along_rim);
        let outer: Vec<Vec2> = outside.walk(200).map(|(position, _)| position).collect();
        let inner: Vec<Vec2> = inside.walk(200).map(|(position, _)| position).collect();
        let distance = |point: Vec2, curve: &[Vec2]| {
            curve
                .iter()
                .map(|other| point.distance(*other))
                .fold(f32::INFINITY, f32::min)
        };
        for &point in inner.iter().filter(|point| point.y > 0.045) {
            let wall = distance(point, &outer);
            assert!(
                (0.75 * WALL..1.25 * WALL).contains(&wall),
                "{point}: {wall}"
            );
        }
        for point in liquid_profile(&inside)
            .iter()
            .filter(|point| point.position.y < LEVEL)
        {
            let depth = distance(point.position, &inner);
            assert!(
                (0.9 * OVERLAP..1.1 * OVERLAP).contains(&depth),
                "{point:?}: {depth}"
            );
            assert!(
                distance(point.position, &outer) > 0.5 * OVERLAP,
                "{point:?}"
            );
        }
    }

    #[test]
    fn the_camera_frames_the_glass_and_its_caustic() {
        let scene = cognac_glass();
        let camera = &scene.cameras()[0];
        let (width, height) = (1024, 768);
        let in_frame = |point: Vec3| {
            let pixel = camera.project(point, width, height).unwrap();
            (0.0..1024.0).contains(&pixel.x) && (0.0..768.0).contains(&pixel.y)
        };
        for mesh in &scene.meshes()[1..] {
            assert!(mesh.positions().iter().all(|&point| in_frame(point)));
        }
        // Where light through the middle of the liquid would go on to: the caustic lies this side.
        let Light::Spot { position, .. } = scene.lights()[0] else {
            unreachable!()
        };
        let middle = Vec3::new(0.0, 0.055, 0.0);
        let shadow = position + (middle - position) * (position.y / (position.y - middle.y));
        assert!(in_frame(shadow), "{shadow}");
    }
}
