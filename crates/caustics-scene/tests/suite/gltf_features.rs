//! Every feature of glTF that is modelled, each in a file written for it.

use crate::writer;

use caustics_geometry::TriangleMesh;
use caustics_scene::gltf::{LoadedScene, load_slice};
use caustics_scene::{Light, Projection, World};
use glam::{Vec2, Vec3};
use serde_json::json;
use writer::{F32, TETRAHEDRON, TETRAHEDRON_INDICES, U8, U16, U32, Writer};

fn load(file: &Writer) -> LoadedScene {
    load_slice(&file.glb(), None).unwrap_or_else(|error| panic!("{error}\n{}", file.root))
}

fn world(file: &Writer) -> World {
    let loaded = load(file);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    World::new(&loaded.scene).unwrap()
}

/// Corners of all triangles of a world.
fn corners(world: &World) -> Vec<[Vec3; 3]> {
    world
        .triangles()
        .iter()
        .map(|t| t.map(|v| world.positions()[v as usize]))
        .collect()
}

#[test]
fn transforms_go_down_the_hierarchy() {
    let mut file = Writer::new();
    let mesh = file.mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[0, 1, 2]);
    let leaf = file.node(json!({ "mesh": mesh, "translation": [1, 0, 0] }));
    // A quarter turn about y takes x to -z and z to x.
    let half = 0.5f64.sqrt();
    let middle = file.node(json!({ "children": [leaf], "rotation": [0, half, 0, half] }));
    file.node(json!({
        "children": [middle],
        "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 10, 1]
    }));
    let expected = [
        Vec3::new(0.0, 0.0, 8.0),
        Vec3::new(0.0, 0.0, 6.0),
        Vec3::new(0.0, 2.0, 8.0),
    ];
    let found = corners(&world(&file));
    assert_eq!(found.len(), 1);
    for (found, expected) in found[0].iter().zip(expected) {
        assert!(found.abs_diff_eq(expected, 1e-5), "{found} {expected}");
    }
}

#[test]
fn a_mesh_with_two_nodes_is_kept_once() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    file.node(json!({ "name": "one", "mesh": mesh }));
    file.node(json!({ "name": "two", "mesh": mesh, "translation": [5, 0, 0] }));
    let loaded = load(&file);
    assert_eq!(loaded.scene.meshes().len(), 1);
    assert_eq!(loaded.scene.triangle_count(), 8);
    let world = World::new(&loaded.scene).unwrap();
    assert_eq!(world.objects()[1].name, "two");
    assert_eq!(world.objects()[1].triangles, 4..8);
    assert_eq!(world.objects()[1].bounds.min, Vec3::new(5.0, 0.0, 0.0));
    assert_eq!(world.object_of(3), Some(0));
    assert_eq!(world.object_of(4), Some(1));
    assert_eq!(world.object_of(8), None);
}

#[test]
fn index_types_and_modes_make_the_same_square() {
    let square = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let list = [0u32, 1, 2, 0, 2, 3];
    let strip = [0u32, 1, 3, 2];
    let fan = [0u32, 1, 2, 3];
    for (mode, indices) in [(4, &list[..]), (5, &strip[..]), (6, &fan[..])] {
        for component in [U8, U16, U32, 0] {
            let mut file = Writer::new();
            let mut primitive = json!({ "attributes": {}, "mode": mode });
            if component == 0 {
                let spread: Vec<[f32; 3]> = indices.iter().map(|&i| square[i as usize]).collect();
                primitive["attributes"]["POSITION"] = file.vectors(&spread).into();
            } else {
                let width = match component {
                    U8 => 1,
                    U16 => 2,
                    _ => 4,
                };
                let bytes: Vec<u8> = indices
                    .iter()
                    .flat_map(|i| i.to_le_bytes()[..width].to_vec())
                    .collect();
                let accessor = file.accessor(&bytes, component, "SCALAR", indices.len());
                primitive["indices"] = accessor.into();
                primitive["attributes"]["POSITION"] = file.vectors(&square).into();
            }
            let mesh = file.push("meshes", json!({ "primitives": [primitive] }));
            file.node(json!({ "mesh": mesh }));
            let world = world(&file);
            let mut area = 0.0;
            for [a, b, c] in corners(&world) {
                let cross = (b - a).cross(c - a);
                assert!(
                    cross.z > 0.0,
                    "mode {mode}, component {component}: wound backwards"
                );
                area += 0.5 * cross.z;
            }
            assert_eq!(
                (world.triangles().len(), area),
                (2, 1.0),
                "mode {mode}, {component}"
            );
        }
    }
}

#[test]
fn vertices_that_a_primitive_does_not_use_are_left_out() {
    let mut file = Writer::new();
    let mut positions = vec![[1e9, 1e9, 1e9]; 100];
    positions[40..43].copy_from_slice(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let normals = file.vectors(&[[0.0, 0.0, 2.0]; 100]);
    let mesh = file.mesh(&positions, &[40, 41, 42]);
    file.root["meshes"][mesh]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    file.node(json!({ "mesh": mesh }));
    let world = world(&file);
    assert_eq!(world.positions().len(), 3);
    assert_eq!(world.bounds().max, Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(world.normals(), [Vec3::Z; 3]);
}

#[test]
fn missing_normals_are_flat() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    file.node(json!({ "mesh": mesh }));
    let world = world(&file);
    assert_eq!(world.positions().len(), 12, "no vertex is shared");
    for triangle in 0..4 {
        let flat = world.triangle(triangle).unwrap().unit_normal().unwrap();
        for normal in world.triangle_normals(triangle).unwrap() {
            assert!(normal.abs_diff_eq(flat, 1e-6));
        }
    }
}

#[test]
fn mirrored_bodies_still_wind_outward() {
    for scale in [[1, 1, 1], [-1, 1, 1], [1, -2, 1], [-1, -1, 1], [-3, -1, -2]] {
        let mut file = Writer::new();
        let mesh = file.tetrahedron();
        file.node(json!({ "mesh": mesh, "scale": scale, "translation": [4, 5, 6] }));
        let world = world(&file);
        let mesh = TriangleMesh::new(world.positions().to_vec(), None, world.triangles().to_vec())
            .unwrap();
        assert!(mesh.is_closed());
        let size: i32 = scale.iter().product();
        let expected = size.abs() as f32 / 6.0;
        assert!((mesh.signed_volume() - expected).abs() < 1e-5, "{scale:?}");
        for triangle in 0..4 {
            let flat = world.triangle(triangle).unwrap().unit_normal().unwrap();
            for normal in world.triangle_normals(triangle).unwrap() {
                assert!(normal.dot(flat) > 0.999, "{scale:?}");
            }
        }
    }
}

#[test]
fn sparse_accessors_replace_elements() {
    for with_base in [true, false] {
        let mut file = Writer::new();
        let base = file.vectors(&[[0.0; 3]; 3]);
        let places = file.view(&[1, 2]);
        let values = file.view(&writer::f32_bytes(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
        let accessor = &mut file.root["accessors"][base];
        accessor["sparse"] = json!({
            "count": 2,
            "indices": { "bufferView": places, "componentType": U8 },
            "values": { "bufferView": values }
        });
        if !with_base {
            accessor.as_object_mut().unwrap().remove("bufferView");
        }
        let primitive = json!({ "attributes": { "POSITION": base } });
        let mesh = file.push("meshes", json!({ "primitives": [primitive] }));
        file.node(json!({ "mesh": mesh }));
        assert_eq!(corners(&world(&file)), [[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    }
}

#[test]
fn interleaved_data_is_read_by_its_stride() {
    let mut file = Writer::new();
    // Position, normal, and a tail that the last vertex does not have.
    let mut bytes = Vec::new();
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
        bytes.extend(writer::f32_bytes(&[x, y, 7.0, 0.0, 0.0, 1.0, -1.0, -1.0]));
    }
    bytes.truncate(2 * 32 + 24);
    let view = file.view(&bytes);
    file.root["bufferViews"][view]["byteStride"] = 32.into();
    let mut part = |offset: u32| {
        file.push(
            "accessors",
            json!({
                "bufferView": view, "byteOffset": offset,
                "componentType": F32, "type": "VEC3", "count": 3
            }),
        )
    };
    let attributes = json!({ "POSITION": part(0), "NORMAL": part(12) });
    let mesh = file.push(
        "meshes",
        json!({ "primitives": [{ "attributes": attributes }] }),
    );
    file.node(json!({ "mesh": mesh }));
    let world = world(&file);
    let z = 7.0 * Vec3::Z;
    assert_eq!(corners(&world), [[z, z + Vec3::X, z + Vec3::Y]]);
    assert_eq!(world.normals(), [Vec3::Z; 3]);
}

#[test]
fn cameras_look_along_their_nodes() {
    let mut file = Writer::new();
    let perspective = json!({ "yfov": 0.8, "znear": 0.1, "aspectRatio": 2.0 });
    let first = file.push(
        "cameras",
        json!({ "name": "first", "type": "perspective", "perspective": perspective }),
    );
    let second = file.push(
        "cameras",
        json!({
            "type": "orthographic",
            "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 10 }
        }),
    );
    let half = 0.5f64.sqrt();
    let turned = json!({
        "camera": first, "translation": [1, 2, 3], "rotation": [0, half, 0, half],
        "scale": [5, 5, 5]
    });
    file.node(turned);
    file.node(json!({ "name": "plan", "camera": second }));
    let loaded = load(&file);
    assert!(loaded.warnings.is_empty());
    let [first, second] = loaded.scene.cameras() else {
        panic!("two cameras")
    };
    assert_eq!(
        (first.name.as_str(), second.name.as_str()),
        ("first", "plan")
    );
    assert_eq!(first.projection, Projection::Perspective { yfov: 0.8 });
    assert_eq!(
        second.projection,
        Projection::Orthographic {
            xmag: 3.0,
            ymag: 2.0
        }
    );
    assert_eq!(first.position(), Vec3::new(1.0, 2.0, 3.0));
    assert!(first.forward().abs_diff_eq(Vec3::NEG_X, 1e-6));
    let pixel = first.project([-4.0, 2.0, 3.0], 200, 100).unwrap();
    assert!(pixel.abs_diff_eq(Vec2::new(100.0, 50.0), 1e-3), "{pixel}");
}

#[test]
fn lights_shine_along_their_nodes() {
    let mut file = Writer::new();
    let point = json!({ "type": "point", "color": [1, 0.5, 0], "intensity": 8 });
    let spot = json!({ "innerConeAngle": 0.2, "outerConeAngle": 0.4 });
    let spot = json!({ "type": "spot", "intensity": 2, "spot": spot });
    let sun = json!({ "type": "directional" });
    for light in [point, spot, sun] {
        let light = file.push_light(light);
        let half = 0.5f64.sqrt();
        file.node(json!({
            "translation": [1, 2, 3],
            // A quarter turn about x takes -z to y.
            "rotation": [half, 0, 0, half],
            "scale": [4, 4, 4],
            "extensions": { "KHR_lights_punctual": { "light": light } }
        }));
    }
    let loaded = load(&file);
    assert!(loaded.warnings.is_empty());
    let at = Vec3::new(1.0, 2.0, 3.0);
    let [point, spot, sun] = *loaded.scene.lights() else {
        panic!("three lights")
    };
    assert_eq!(
        point,
        Light::Point {
            position: at,
            intensity: Vec3::new(8.0, 4.0, 0.0)
        }
    );
    let Light::Spot {
        position,
        direction,
        intensity,
        inner_cos,
        outer_cos,
    } = spot
    else {
        panic!("a spot")
    };
    assert_eq!((position, intensity), (at, Vec3::splat(2.0)));
    assert!(direction.abs_diff_eq(Vec3::Y, 1e-6), "{direction}");
    assert_eq!((inner_cos, outer_cos), (0.2f32.cos(), 0.4f32.cos()));
    let Light::Directional {
        direction,
        irradiance,
    } = sun
    else {
        panic!("a sun")
    };
    assert!(direction.abs_diff_eq(Vec3::Y, 1e-6));
    assert_eq!(irradiance, Vec3::ONE);
}

#[test]
fn the_default_scene_or_the_first_or_everything() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    let one = file.node(json!({ "name": "one", "mesh": mesh }));
    let two = file.node(json!({ "name": "two", "mesh": mesh }));
    let names = |file: &Writer| -> Vec<String> {
        load(file)
            .scene
            .instances()
            .iter()
            .map(|instance| instance.name.clone())
            .collect()
    };
    assert_eq!(names(&file), ["one", "two"]);
    file.push("scenes", json!({ "nodes": [one] }));
    file.push("scenes", json!({ "nodes": [two] }));
    assert_eq!(names(&file), ["one"]);
    file.root["scene"] = 1.into();
    assert_eq!(names(&file), ["two"]);
}

#[test]
fn a_file_without_lights_or_cameras_loads_and_the_world_says_so() {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    file.node(json!({ "mesh": mesh }));
    let dark = world(&file);
    assert!(!dark.is_lit() && dark.cameras().is_empty());

    let lamp = file.push(
        "materials",
        json!({
            "emissiveFactor": [1, 1, 1],
            "pbrMetallicRoughness": { "metallicFactor": 0 }
        }),
    );
    file.root["meshes"][mesh]["primitives"][0]["material"] = lamp.into();
    let lit = world(&file);
    assert!(lit.is_lit() && lit.lights().is_empty());
    let emitter = &lit.emitters()[0];
    assert_eq!((emitter.object(), emitter.primitives()), (0, 0..4));
    let area = 1.5 + 0.75f32.sqrt();
    assert!((emitter.area() - area).abs() < 1e-6);

    let empty = Writer::new();
    let empty = World::new(&load(&empty).scene).unwrap();
    assert!(empty.bounds().is_empty() && empty.objects().is_empty());
}

#[test]
fn buffers_in_data_uris_and_beside_the_file() {
    let mut file = Writer::new();
    let mesh = file.mesh(&TETRAHEDRON, &TETRAHEDRON_INDICES);
    file.node(json!({ "mesh": mesh }));
    let uri = format!(
        "data:application/octet-stream;base64,{}",
        writer::base64(&file.bin)
    );
    let inline = load_slice(file.text(Some(&uri)).as_bytes(), None).unwrap();
    assert_eq!(inline.scene.triangle_count(), 4);

    let folder = std::env::temp_dir().join(format!("caustics scene {}", std::process::id()));
    std::fs::create_dir_all(folder.join("sub folder")).unwrap();
    std::fs::write(folder.join("sub folder/dätä.bin"), &file.bin).unwrap();
    let text = file.text(Some("sub%20folder/d%C3%A4t%C3%A4.bin"));
    let path = folder.join("scene.gltf");
    std::fs::write(&path, &text).unwrap();
    let beside = caustics_scene::gltf::load_path(&path).unwrap();
    assert_eq!(beside.scene.triangle_count(), 4);

    // Without a folder, with a missing file, with one that is too short, with one that is none.
    let error = load_slice(text.as_bytes(), None).unwrap_err().to_string();
    assert!(
        error.contains("buffer 0") && error.contains("no folder"),
        "{error}"
    );
    let missing = file.text(Some("no%20such.bin"));
    let error = load_slice(missing.as_bytes(), Some(&folder))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("buffer 0") && error.contains("no such.bin"),
        "{error}"
    );
    std::fs::write(folder.join("short.bin"), [0; 10]).unwrap();
    let short = file.text(Some("short.bin"));
    let error = load_slice(short.as_bytes(), Some(&folder))
        .unwrap_err()
        .to_string();
    assert_eq!(error, "buffer 0 needs 96 bytes, but its data has 10");
    let directory = file.text(Some("sub%20folder"));
    let error = load_slice(directory.as_bytes(), Some(&folder))
        .unwrap_err()
        .to_string();
    assert!(error.contains("not a regular file"), "{error}");
    let error = caustics_scene::gltf::load_path(folder.join("none.glb")).unwrap_err();
    assert!(error.to_string().starts_with("cannot be read: "), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_file_with_a_bit_of_everything() {
    let file = writer::rich_file();
    let loaded = load(&file);
    assert_eq!(loaded.scene.instances().len(), 3);
    assert_eq!(
        (loaded.scene.lights().len(), loaded.scene.cameras().len()),
        (1, 1)
    );
}

/// Triangle counts of scenes that another program has written.
#[test]
fn scene_files_load_whole() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/scenes/");
    for (name, triangles, emitters) in [
        ("p03_cognac", 5_678, 0),
        ("p05_brass_ring", 2_882, 0),
        ("p09_cornell", 32_012, 1),
        ("p10_torus_cube", 16_398, 0),
    ] {
        let loaded = caustics_scene::gltf::load_path(format!("{folder}{name}.glb"))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        let world = World::new(&loaded.scene).unwrap();
        assert_eq!(world.triangles().len(), triangles, "{name}");
        assert_eq!(world.emitters().len(), emitters, "{name}");
        assert_eq!(world.lights().len(), 1 - emitters, "{name}");
        assert_eq!(world.cameras().len(), 1, "{name}");
        assert!(!world.specular_bounds().is_empty(), "{name}");
    }
}
