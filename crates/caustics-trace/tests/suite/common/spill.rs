//! A mirror that throws a lamp's light at a ceiling, and how much of it footprints spread into the dark.

use caustics_geometry::TriangleMesh;
use caustics_geometry::shapes::quad;
use caustics_scene::{Light, Material, Scene};
use caustics_trace::PhotonMap;
use caustics_trace::glam::Vec3;

use super::scenes::add_mesh;

/// Where the lamp hangs, close below the ceiling.
pub(crate) const LAMP: Vec3 = Vec3::new(0.0, 2.9, 0.0);

/// The ceiling's height.
pub(crate) const CEILING: f32 = 3.0;

/// A metal mirror under the lamp, in a scene with a white ceiling.
pub(crate) fn under_a_lamp(mirror: TriangleMesh) -> Scene {
    let mut scene = Scene::new();
    let metal = Material::metal("metal", [0.9; 3]);
    add_mesh(&mut scene, "mirror", mirror, metal);
    let corner = Vec3::new(-20.0, CEILING, -20.0);
    let ceiling = quad(corner, 40.0 * Vec3::X, 40.0 * Vec3::Z).expect("a valid ceiling");
    let white = Material::diffuse("white", [0.8; 3]);
    add_mesh(&mut scene, "ceiling", ceiling, white);
    let lamp = Light::point(LAMP, [10.0; 3]).expect("a valid lamp");
    scene.add_light(lamp).expect("a valid lamp");
    scene
}

/// The flux of all photons.
pub(crate) fn flux(map: &PhotonMap) -> f64 {
    map.photons.iter().map(|it| f64::from(it.flux.x)).sum()
}

/// The part of the flux that lies where `is_dark` says that there is none.
pub(crate) fn spilt(map: &PhotonMap, is_dark: impl Fn(Vec3) -> bool) -> f64 {
    let mut beyond = 0.0;
    for photon in &map.photons {
        // The corners of what the photon lights, a tenth of a cell inwards.
        for (u, v) in [(-0.4, -0.4), (-0.4, 0.4), (0.4, -0.4), (0.4, 0.4)] {
            let at = photon.position + u * photon.axes[0] + v * photon.axes[1];
            beyond += 0.25 * f64::from(photon.flux.x) * f64::from(u8::from(is_dark(at)));
        }
    }
    beyond / flux(map)
}
