//! Files that say what cannot be: an error or a warning that names it.

use crate::gltf_robustness::survive;
use crate::writer;

use caustics_scene::gltf::{AccessorProblem, GltfError, WarningKind, load_slice};
use serde_json::{Value, json};
use writer::{F32, TETRAHEDRON, TETRAHEDRON_INDICES, U16, Writer};

/// A file of one tetrahedron, to break.
fn tetrahedron() -> Writer {
    let mut file = Writer::new();
    let mesh = file.tetrahedron();
    file.root["meshes"][mesh]["name"] = "body".into();
    file.node(json!({ "name": "n", "mesh": mesh }));
    file
}

fn error_of(file: &Writer) -> String {
    survive(&file.glb()).unwrap_err()
}

#[test]
fn references_out_of_range_name_both_ends() {
    let mut file = tetrahedron();
    file.root["nodes"][0]["mesh"] = 7.into();
    assert_eq!(
        error_of(&file),
        "node 0 \"n\" refers to mesh 7, but there are 1"
    );
    for (key, kind) in [("camera", "camera"), ("children", "node")] {
        let mut file = tetrahedron();
        file.root["nodes"][0][key] = if key == "children" {
            json!([5])
        } else {
            json!(5)
        };
        assert!(error_of(&file).starts_with(&format!("node 0 \"n\" refers to {kind} 5")));
    }
    let mut file = tetrahedron();
    let primitive = &mut file.root["meshes"][0]["primitives"][0];
    primitive["material"] = 3.into();
    let expected = "mesh 0 \"body\", primitive 0 refers to material 3, but there are 0";
    assert_eq!(error_of(&file), expected);
    file.root["meshes"][0]["primitives"][0]["indices"] = 9.into();
    let expected = "mesh 0 \"body\", primitive 0 refers to accessor 9, but there are 2";
    assert_eq!(error_of(&file), expected);
    let mut file = tetrahedron();
    file.root["accessors"][0]["bufferView"] = 8.into();
    assert_eq!(
        error_of(&file),
        "accessor 0 refers to buffer view 8, but there are 2"
    );
    let mut file = tetrahedron();
    file.root["bufferViews"][0]["buffer"] = 2.into();
    assert_eq!(
        error_of(&file),
        "buffer view 0 refers to buffer 2, but there are 1"
    );
    let mut file = tetrahedron();
    file.root["scene"] = 0.into();
    assert_eq!(error_of(&file), "the default scene is 0, but there are 0");
    file.push("scenes", json!({ "nodes": [4] }));
    assert_eq!(error_of(&file), "scene 0 refers to node 4, but there are 1");
}

#[test]
fn vertex_indices_out_of_range() {
    let mut file = Writer::new();
    let mesh = file.mesh(&TETRAHEDRON, &[0, 1, 2, 0, 1, 4]);
    file.node(json!({ "mesh": mesh }));
    let expected = "mesh 0, primitive 0: index 5 is vertex 4, but there are 4";
    assert_eq!(error_of(&file), expected);
}

#[test]
fn data_out_of_bounds() {
    let mut file = tetrahedron();
    file.root["accessors"][0]["count"] = 5.into();
    assert_eq!(
        error_of(&file),
        "accessor 0 needs 60 bytes, but buffer view 0 has 48"
    );
    let mut file = tetrahedron();
    file.root["accessors"][0]["byteOffset"] = u64::MAX.into();
    assert!(error_of(&file).starts_with("accessor 0 needs 18446744073709551615 bytes"));
    let mut file = tetrahedron();
    file.root["bufferViews"][0]["byteLength"] = u64::MAX.into();
    assert!(error_of(&file).starts_with("buffer view 0 needs 18446744073709551615 bytes"));
    let mut file = tetrahedron();
    file.root["bufferViews"][0]["byteOffset"] = u64::MAX.into();
    assert!(error_of(&file).starts_with("buffer view 0 needs"));
    let mut file = tetrahedron();
    file.root["bufferViews"][0]["byteStride"] = 8.into();
    assert_eq!(
        error_of(&file),
        "accessor 0: elements of 12 bytes every 8 bytes overlap"
    );
    let mut file = tetrahedron();
    file.root["buffers"] = json!([{ "byteLength": 1000 }]);
    assert_eq!(
        error_of(&file),
        "buffer 0 needs 1000 bytes, but its data has 96"
    );
    let mut file = tetrahedron();
    file.root["buffers"] = json!([{ "byteLength": 96 }, { "byteLength": 1 }]);
    assert!(error_of(&file).starts_with("buffer 1: has no URI"));
}

#[test]
fn types_that_do_not_fit() {
    let mut file = tetrahedron();
    file.root["accessors"][0]["componentType"] = U16.into();
    let expected = "accessor 0 is VEC3 of u16, but positions must be vectors of 3 floats";
    assert_eq!(error_of(&file), expected);
    file.root["accessors"][0]["componentType"] = F32.into();
    file.root["accessors"][1]["normalized"] = true.into();
    let expected = "accessor 1 is SCALAR of normalized u32, but indices must be unsigned integers";
    assert_eq!(error_of(&file), expected);
    let mut file = tetrahedron();
    file.root["accessors"][1]["componentType"] = F32.into();
    assert!(error_of(&file).contains("indices must be unsigned integers"));
    let mut file = tetrahedron();
    file.root["accessors"][0]["type"] = "VEC5".into();
    assert!(error_of(&file).contains("accessor 0 is unknown of f32"));
    let mut file = tetrahedron();
    file.root["meshes"][0]["primitives"][0]["mode"] = 7.into();
    assert!(error_of(&file).contains("primitive 0: has a mode that does not exist"));
}

#[test]
fn counts_that_no_file_can_justify() {
    for count in [1u64 << 20, 1 << 40, u64::MAX] {
        let mut file = tetrahedron();
        let accessor = file.root["accessors"][0].as_object_mut().unwrap();
        accessor.remove("bufferView");
        accessor.insert("count".into(), count.into());
        let error = load_slice(&file.glb(), None).unwrap_err();
        let problem = match error {
            GltfError::Accessor { problem, .. } => problem,
            other => panic!("{count}: {other}"),
        };
        assert!(
            matches!(problem, AccessorProblem::Count { .. }),
            "{count}: {problem}"
        );
    }
}

#[test]
fn small_files_cannot_ask_for_much_by_repetition() {
    // Many primitives of the same million indices: the file is honest about each, but not in sum.
    let mut file = Writer::new();
    let indices = file.accessor(&[0; 1 << 20], writer::U8, "SCALAR", 1 << 20);
    let mut primitives = Vec::new();
    for _ in 0..1000 {
        let positions = file.vectors(&TETRAHEDRON);
        primitives.push(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    }
    let mesh = file.push("meshes", json!({ "primitives": primitives }));
    file.node(json!({ "mesh": mesh }));
    let error = error_of(&file);
    assert!(
        error.contains("triangles, more than it has bytes"),
        "{error}"
    );

    // Many accessors of the same million floats.
    let mut file = Writer::new();
    let view = file.view(&vec![0; 12 << 16]);
    let mut primitives = Vec::new();
    for _ in 0..1000 {
        let accessor =
            json!({ "bufferView": view, "componentType": F32, "type": "VEC3", "count": 1 << 16 });
        let positions = file.push("accessors", accessor);
        let indices = file.accessor(&[0, 1, 2], writer::U8, "SCALAR", 3);
        primitives.push(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    }
    let mesh = file.push("meshes", json!({ "primitives": primitives }));
    file.node(json!({ "mesh": mesh }));
    let error = error_of(&file);
    assert!(error.contains("bytes of vertex data"), "{error}");
}

#[test]
fn sparse_data_that_makes_no_sense() {
    let sparse = |places: [u8; 2], count: u64| {
        let mut file = tetrahedron();
        let indices = file.view(&places);
        let values = file.view(&[0; 24]);
        file.root["accessors"][0]["sparse"] = json!({
            "count": count,
            "indices": { "bufferView": indices, "componentType": writer::U8 },
            "values": { "bufferView": values }
        });
        survive(&file.glb())
    };
    assert_eq!(sparse([0, 1], 2), Ok(()));
    let message = |result: Result<(), String>| result.unwrap_err();
    let expected = "accessor 0: sparse index 1 is element 9, but there are 4";
    assert_eq!(message(sparse([0, 9], 2)), expected);
    let expected = "accessor 0: sparse indices do not increase at 1";
    assert_eq!(message(sparse([1, 1], 2)), expected);
    assert_eq!(message(sparse([2, 1], 2)), expected);
    assert_eq!(
        message(sparse([0, 1], 5)),
        "accessor 0: 5 sparse elements of 4"
    );
    assert!(message(sparse([0, 1], 3)).contains("needs 3 bytes"));
    assert!(message(sparse([0, 1], u64::MAX)).contains("sparse elements"));
}

#[test]
fn numbers_that_are_not_finite() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut positions = TETRAHEDRON;
        positions[2][1] = bad;
        let mut file = Writer::new();
        let mesh = file.mesh(&positions, &TETRAHEDRON_INDICES);
        file.node(json!({ "mesh": mesh }));
        assert_eq!(error_of(&file), "accessor 0: element 2 is not finite");
    }
    let mut file = tetrahedron();
    file.root["nodes"][0]["translation"] = json!([1e300, 0, 0]);
    let expected = "node 0 \"n\": translation, rotation, or scale is not finite";
    assert_eq!(error_of(&file), expected);
    let mut file = tetrahedron();
    file.root["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
    assert_eq!(error_of(&file), "node 0 \"n\": rotation has no direction");
    let mut file = tetrahedron();
    file.root["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    assert_eq!(
        error_of(&file),
        "node 0 \"n\": matrix does not have the last row 0 0 0 1"
    );
    let mut file = tetrahedron();
    file.root["nodes"][0]["scale"] = json!([1e30, 1e30, 1e30]);
    let error = error_of(&file);
    assert!(
        error.contains("object \"n\" is too large or too far away"),
        "{error}"
    );
}

#[test]
fn faces_without_area_are_left_out_with_a_warning() {
    let mut file = Writer::new();
    let line = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let mesh = file.mesh(&line, &[0, 1, 2, 0, 1, 3, 1, 1, 3]);
    let nothing = file.mesh(&line, &[0, 1, 2]);
    file.node(json!({ "mesh": mesh }));
    file.node(json!({ "mesh": nothing }));
    let loaded = load_slice(&file.glb(), None).unwrap();
    let kinds: Vec<&WarningKind> = loaded
        .warnings
        .iter()
        .map(|warning| &warning.kind)
        .collect();
    let expected = [
        &WarningKind::DegenerateTriangles { count: 2 },
        &WarningKind::DegenerateTriangles { count: 1 },
        &WarningKind::NoTriangles,
    ];
    assert_eq!(kinds, expected);
    assert_eq!(loaded.scene.triangle_count(), 1);
}

#[test]
fn normals_that_do_not_fit() {
    let mut file = tetrahedron();
    let few = file.vectors(&[[0.0, 0.0, 1.0]; 3]);
    let attributes = |file: &mut Writer, normals: usize| {
        file.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    };
    attributes(&mut file, few);
    assert_eq!(
        error_of(&file),
        "mesh 0 \"body\", primitive 0 has 4 positions and 3 normals"
    );
    let zero = file.vectors(&[[0.0, 0.0, 1.0], [0.0; 3], [0.0, 0.0, 1.0], [0.0; 3]]);
    attributes(&mut file, zero);
    let loaded = load_slice(&file.glb(), None).unwrap();
    assert_eq!(
        loaded.warnings[0].kind,
        WarningKind::ZeroNormals { count: 2 }
    );
}

#[test]
fn hierarchies_that_are_no_trees() {
    let hierarchy = |children: &[&[usize]], roots: &[usize]| {
        let mut file = Writer::new();
        for list in children {
            file.node(if list.is_empty() {
                json!({})
            } else {
                json!({ "children": list })
            });
        }
        file.push("scenes", json!({ "nodes": roots }));
        survive(&file.glb())
    };
    assert_eq!(hierarchy(&[&[1], &[2], &[]], &[0]), Ok(()));
    let message = |result: Result<(), String>| result.unwrap_err();
    assert_eq!(
        message(hierarchy(&[&[0]], &[0])),
        "node 0 is its own ancestor"
    );
    assert_eq!(
        message(hierarchy(&[&[], &[2], &[3], &[1]], &[0])),
        "node 1 is its own ancestor"
    );
    let expected = "node 2 is a child of node 0 and again of node 1";
    assert_eq!(message(hierarchy(&[&[2], &[2], &[]], &[0, 1])), expected);
    let expected = "node 1 is a child of node 0 and again of node 0";
    assert_eq!(message(hierarchy(&[&[1, 1], &[]], &[0])), expected);
    let expected = "scene 0 lists node 1 as a root, but it is a child of node 0";
    assert_eq!(message(hierarchy(&[&[1], &[]], &[1])), expected);
    let expected = "scene 0 lists node 0 as a root, but it has listed it before";
    assert_eq!(message(hierarchy(&[&[]], &[0, 0])), expected);
}

#[test]
fn hierarchies_of_any_depth() {
    let mut file = Writer::new();
    let depth = 100_000;
    let nodes: Vec<Value> = (1..=depth)
        .map(|next| {
            if next < depth {
                json!({ "children": [next] })
            } else {
                json!({})
            }
        })
        .collect();
    file.root["nodes"] = nodes.into();
    assert_eq!(survive(&file.glb()), Ok(()));
    let nested = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(survive(nested.as_bytes()).is_err());
}

#[test]
fn versions_and_extensions() {
    let text = |asset: &str| format!("{{\"asset\": {asset}}}");
    assert_eq!(survive(text(r#"{"version": "2.7"}"#).as_bytes()), Ok(()));
    for asset in [
        r#"{"version": "1.0"}"#,
        r#"{"version": "2.1", "minVersion": "2.1"}"#,
    ] {
        let error = survive(text(asset).as_bytes()).unwrap_err();
        assert!(error.contains("is not supported, only 2.0"), "{error}");
    }
    for text in [
        "{}",
        r#"{"asset": {}}"#,
        r#"{"asset": 2}"#,
        "[]",
        "2",
        "",
        "nothing",
        "\0\0",
    ] {
        assert!(survive(text.as_bytes()).is_err(), "{text:?}");
    }
    let mut file = tetrahedron();
    file.root["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    assert_eq!(survive(&file.glb()), Ok(()));
    file.root["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    let expected =
        "the file requires the extension \"KHR_draco_mesh_compression\", which is not supported";
    assert_eq!(error_of(&file), expected);
    file.root["extensionsRequired"] = json!(["KHR_materials_ior"]);
    assert_eq!(survive(&file.glb()), Ok(()));
}

#[test]
fn lights_and_cameras_that_make_no_sense() {
    for (light, message) in [
        (
            json!({ "name": "l", "type": "point", "intensity": -1 }),
            "intensity -1",
        ),
        (json!({ "name": "l", "type": "laser" }), "neither a point"),
        (json!({ "name": "l", "type": "spot" }), "without its angles"),
        (
            json!({ "name": "l", "type": "spot", "spot": { "innerConeAngle": 1 } }),
            "cone angles 1",
        ),
        (
            json!({ "name": "l", "type": "spot", "spot": { "outerConeAngle": 3 } }),
            "cone angles 0",
        ),
        (json!({ "name": "l", "intensity": 1 }), "missing field"),
    ] {
        let mut file = Writer::new();
        let light = file.push_light(light);
        file.node(json!({ "extensions": { "KHR_lights_punctual": { "light": light } } }));
        let error = error_of(&file);
        assert!(
            error.starts_with("light 0 \"l\": ") && error.contains(message),
            "{error}"
        );
    }
    for (camera, message) in [
        (
            json!({ "name": "c", "type": "perspective" }),
            "lacks its values",
        ),
        (
            json!({ "name": "c", "type": "fisheye" }),
            "neither perspective",
        ),
        (
            json!({ "name": "c", "type": "perspective", "perspective": { "yfov": 4, "znear": 1 } }),
            "field of view 4",
        ),
        (
            json!({ "name": "c", "type": "orthographic",
                "orthographic": { "xmag": 1, "ymag": 0, "znear": 0, "zfar": 1 } }),
            "magnification 0",
        ),
    ] {
        let mut file = Writer::new();
        let camera = file.push("cameras", camera);
        file.node(json!({ "camera": camera }));
        let error = error_of(&file);
        assert!(
            error.starts_with("camera 0 \"c\": ") && error.contains(message),
            "{error}"
        );
    }
    let mut file = Writer::new();
    let perspective = json!({ "yfov": 1, "znear": 1 });
    let camera = file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": perspective }),
    );
    file.node(json!({ "camera": camera, "scale": [1, 1, 0] }));
    assert!(error_of(&file).starts_with("node 0: the camera's transform"));
}
