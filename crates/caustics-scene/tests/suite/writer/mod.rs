//! A small writer of glTF files, for tests.

// Each test file uses a part of it.

use serde_json::{Value, json};

pub(crate) const F32: u32 = 5126;
pub(crate) const U8: u32 = 5121;
pub(crate) const U16: u32 = 5123;
pub(crate) const U32: u32 = 5125;

/// A file in the making: its JSON, and the one buffer that all views are into.
pub(crate) struct Writer {
    pub(crate) root: Value,
    pub(crate) bin: Vec<u8>,
}

impl Writer {
    pub(crate) fn new() -> Self {
        Self {
            root: json!({ "asset": { "version": "2.0" } }),
            bin: Vec::new(),
        }
    }

    /// Appends to one of the file's lists and returns the number of the new part.
    pub(crate) fn push(&mut self, list: &str, part: Value) -> usize {
        let root = self.root.as_object_mut().unwrap();
        let list = root
            .entry(list)
            .or_insert_with(|| json!([]))
            .as_array_mut()
            .unwrap();
        list.push(part);
        list.len() - 1
    }

    /// Appends to the list of punctual lights.
    pub(crate) fn push_light(&mut self, light: Value) -> usize {
        let lights = &mut self.root["extensions"]["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        lights.as_array_mut().unwrap().push(light);
        lights.as_array().unwrap().len() - 1
    }

    /// A view of new bytes in the buffer.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        let offset = self.bin.len();
        self.bin.extend(bytes);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        self.push("bufferViews", view)
    }

    pub(crate) fn accessor(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
    ) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        self.push("accessors", accessor)
    }

    pub(crate) fn vectors(&mut self, vectors: &[[f32; 3]]) -> usize {
        let bytes = f32_bytes(vectors.as_flattened());
        self.accessor(&bytes, F32, "VEC3", vectors.len())
    }

    pub(crate) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices
            .iter()
            .flat_map(|index| index.to_le_bytes())
            .collect();
        self.accessor(&bytes, U32, "SCALAR", indices.len())
    }

    /// A mesh of one primitive, without normals.
    pub(crate) fn mesh(&mut self, positions: &[[f32; 3]], indices: &[u32]) -> usize {
        let positions = self.vectors(positions);
        let indices = self.indices(indices);
        let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// A tetrahedron, closed and winding outward.
    pub(crate) fn tetrahedron(&mut self) -> usize {
        self.mesh(&TETRAHEDRON, &TETRAHEDRON_INDICES)
    }

    pub(crate) fn node(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    /// The JSON text with the buffer's data under this address, if any.
    pub(crate) fn text(&self, uri: Option<&str>) -> String {
        let mut root = self.root.clone();
        if !self.bin.is_empty() && root["buffers"].is_null() {
            let mut buffer = json!({ "byteLength": self.bin.len() });
            if let Some(uri) = uri {
                buffer["uri"] = uri.into();
            }
            root["buffers"] = json!([buffer]);
        }
        root.to_string()
    }

    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut text = self.text(None).into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((12 + 8 + text.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }
}

pub(crate) const TETRAHEDRON: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
pub(crate) const TETRAHEDRON_INDICES: [u32; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

pub(crate) fn f32_bytes(numbers: &[f32]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect()
}

pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = group
            .iter()
            .fold(0u32, |bits, &byte| bits << 8 | u32::from(byte));
        let bits = bits << (8 * (3 - group.len()));
        for digit in 0..4 {
            let value = (bits >> (18 - 6 * digit)) as usize % 64;
            text.push(if digit <= group.len() {
                DIGITS[value].into()
            } else {
                '='
            });
        }
    }
    text
}

/// A file that has a bit of everything: hierarchy, two primitives, sparse and interleaved data,
/// cameras, lights, and all material extensions.
pub(crate) fn rich_file() -> Writer {
    let mut file = Writer::new();
    let glass = file.push(
        "materials",
        json!({
            "name": "glass",
            "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
            "extras": { "priority": 3 },
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1 },
                "KHR_materials_ior": { "ior": 1.4 },
                "KHR_materials_volume": {
                    "thicknessFactor": 1,
                    "attenuationDistance": 2,
                    "attenuationColor": [1, 0.5, 0.25]
                },
                "KHR_materials_dispersion": { "dispersion": 0.4 }
            }
        }),
    );
    let lamp = file.push(
        "materials",
        json!({
            "name": "lamp",
            "emissiveFactor": [1, 0.5, 0],
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 10 } }
        }),
    );
    let positions = file.vectors(&TETRAHEDRON);
    let indices = file.indices(&TETRAHEDRON_INDICES);
    // Positions and normals side by side.
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let interleaved: Vec<f32> = corners
        .iter()
        .flat_map(|c| [c[0], c[1], c[2], 0.0, 0.0, 1.0])
        .collect();
    let view = file.view(&f32_bytes(&interleaved));
    file.root["bufferViews"][view]["byteStride"] = 24.into();
    let part = |offset: u32| {
        json!({
            "bufferView": view, "byteOffset": offset,
            "componentType": F32, "type": "VEC3", "count": 3
        })
    };
    let side_positions = file.push("accessors", part(0));
    let side_normals = file.push("accessors", part(12));
    let sparse = {
        let places = file.view(&[1, 0]);
        let values = file.view(&f32_bytes(&[5.0, 0.0, 0.0]));
        json!({
            "componentType": F32, "type": "VEC3", "count": 4,
            "bufferView": file.root["accessors"][positions]["bufferView"],
            "sparse": {
                "count": 1,
                "indices": { "bufferView": places, "componentType": U16 },
                "values": { "bufferView": values }
            }
        })
    };
    let sparse = file.push("accessors", sparse);
    let mesh = file.push(
        "meshes",
        json!({ "name": "thing", "primitives": [
            { "attributes": { "POSITION": positions }, "indices": indices, "material": glass },
            {
                "attributes": { "POSITION": side_positions, "NORMAL": side_normals },
                "material": lamp
            },
            { "attributes": { "POSITION": sparse }, "indices": indices, "mode": 5 }
        ] }),
    );
    let camera = file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }),
    );
    let light = file.push_light(json!({
        "type": "spot", "intensity": 4, "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.4 }
    }));
    let leaf = file.node(json!({ "name": "leaf", "mesh": mesh, "scale": [1, -1, 2] }));
    let root = file.node(json!({
        "name": "root", "children": [leaf], "translation": [1, 2, 3], "rotation": [0, 1, 0, 1]
    }));
    let eye = file.node(json!({ "name": "eye", "camera": camera, "translation": [0, 0, 9] }));
    let extension = json!({ "KHR_lights_punctual": { "light": light } });
    let lamp = file.node(json!({ "name": "lamp", "extensions": extension }));
    file.push("scenes", json!({ "nodes": [root, eye, lamp] }));
    file.root["scene"] = 0.into();
    file.root["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "KHR_materials_dispersion",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_transmission",
        "KHR_materials_volume"
    ]);
    file
}
