//! Small scenes made in code, and how to trace a single photon through them.

use caustics_accel::{BvhOptions, Intersect};
use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::{cuboid, quad};
use caustics_sampling::{PointSet, Sequence};
use caustics_scene::{Instance, Light, Material, Scene, SceneIntersector, Shape, World};
use caustics_trace::glam::{Affine3A, Vec3};
use caustics_trace::{
    Aim, Branching, Casters, EmissionSample, Emitter, PhotonMap, TraceOptions, trace_photons,
};

pub(crate) fn add_mesh(scene: &mut Scene, name: &str, mesh: TriangleMesh, material: Material) {
    let shape = Shape::Mesh(scene.add_mesh(mesh));
    let material = scene.add_material(material).expect("a valid material");
    scene
        .add_instance(Instance::new(name, shape, material))
        .expect("a valid instance");
}

pub(crate) fn add_sphere(scene: &mut Scene, center: Vec3, radius: f32, material: Material) {
    let material = scene.add_material(material).expect("a valid material");
    let shape = Shape::Sphere { center, radius };
    scene
        .add_instance(Instance::new("sphere", shape, material))
        .expect("a valid instance");
}

/// A solid box between two corners.
pub(crate) fn add_box(scene: &mut Scene, name: &str, from: Vec3, to: Vec3, material: Material) {
    let place = Affine3A::from_translation(0.5 * (from + to));
    let mesh = cuboid(to - from)
        .expect("a valid box")
        .transformed(&place)
        .expect("a finite box");
    add_mesh(scene, name, mesh, material);
}

/// A white floor of this half width at a height, its front upwards.
pub(crate) fn add_floor(scene: &mut Scene, height: f32, half: f32) {
    let corner = Vec3::new(-half, height, half);
    let mesh = quad(corner, 2.0 * half * Vec3::X, -2.0 * half * Vec3::Z).expect("a valid floor");
    add_mesh(scene, "floor", mesh, Material::diffuse("white", [0.8; 3]));
}

/// A glass ball of half a metre over a floor, a lamp above.
pub(crate) fn ball_over_floor() -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, -0.6, 4.0);
    let glass = Material::dielectric("glass", 1.5);
    add_sphere(&mut scene, Vec3::ZERO, 0.5, glass);
    let lamp = Light::point([0.0, 3.0, 0.0], [10.0; 3]).expect("a valid lamp");
    scene.add_light(lamp).expect("a valid lamp");
    scene
}

pub(crate) fn flattened(scene: &Scene) -> (World, SceneIntersector) {
    let world = World::new(scene).expect("a small world");
    let intersector = world
        .intersector(&BvhOptions::default())
        .expect("a small tree");
    (world, intersector)
}

/// One photon, in all its branches and without roulette, from the middle of whatever the only
/// light shines at.
pub(crate) const ONE_PHOTON: fn() -> TraceOptions = || TraceOptions {
    photons: 1,
    branching: Branching::SplitAll,
    min_weight: 0.0,
    max_depth: 12,
    aim: Aim::Everywhere,
    sequence: Sequence::Grid,
    ..TraceOptions::default()
};

/// A spot light whose only photon, in the middle of its cone, goes along `direction`. The cone is
/// as wide as the spacing of photons, in radians, that the differentials are for.
pub(crate) fn single_ray(origin: Vec3, direction: Vec3, spacing: f32) -> Light {
    // A cone of half angle a has the solid angle pi a², of which the spacing is the root.
    let outer = spacing / std::f32::consts::PI.sqrt();
    Light::spot(origin, direction, [1.0; 3], 0.5 * outer, outer).expect("a valid light")
}

/// What becomes of the photon that a light sends along its axis.
pub(crate) fn trace_one(scene: &Scene, tracer: &impl Intersect, light: Light) -> PhotonMap {
    let mut scene = scene.clone();
    scene.add_light(light).expect("a valid light");
    let world = World::new(&scene).expect("a small world");
    trace_photons(&world, tracer, &ONE_PHOTON(), &|_| {}).expect("valid options")
}

/// The spacing of photons, in radians: about as small as a spot light can be, so that few
/// differentials meet their bound.
pub(crate) const SPACING: f32 = 2e-3;

/// The changes of direction, for one spacing each, of the neighbours of a light's only ray.
pub(crate) fn initial_turns(scene: &Scene, origin: Vec3, onwards: Vec3) -> [Vec3; 2] {
    let mut scene = scene.clone();
    scene
        .add_light(single_ray(origin, onwards, SPACING))
        .expect("a valid light");
    let world = World::new(&scene).expect("a small world");
    let emitters = Emitter::all(&world, &Casters::default(), Aim::Everywhere);
    let sample = EmissionSample::of(&PointSet::new(Sequence::Grid, 1, 0), 0);
    let emission = emitters[0]
        .emit::<2>(&world, &sample)
        .expect("the axis is in the cone");
    assert!((emission.ray.direction - onwards.normalize()).length() < 1e-6);
    emission.differential.direction
}
