//! The JSON of a file, read part by part so that messages can name the part.

use super::element::{Element, ElementKind};
use super::error::GltfError;
use ::gltf::json;
use json::extensions::scene::khr_lights_punctual::Light;
use serde_json::{Map, Value, from_value};

/// The extensions that are understood.
const SUPPORTED_EXTENSIONS: [&str; 6] = [
    "KHR_lights_punctual",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
];

/// Whether an extension is understood.
pub(crate) fn is_supported(extension: &str) -> bool {
    SUPPORTED_EXTENSIONS.contains(&extension)
}

/// The parts of a file that a scene is made from.
#[derive(Debug, Default)]
pub(crate) struct Document {
    pub(crate) accessors: Vec<json::Accessor>,
    pub(crate) buffers: Vec<json::Buffer>,
    pub(crate) buffer_views: Vec<json::buffer::View>,
    pub(crate) cameras: Vec<json::Camera>,
    pub(crate) lights: Vec<Light>,
    pub(crate) materials: Vec<json::Material>,
    pub(crate) meshes: Vec<json::Mesh>,
    pub(crate) nodes: Vec<json::Node>,
    pub(crate) scenes: Vec<json::Scene>,
    pub(crate) default_scene: Option<usize>,
    pub(crate) extensions_used: Vec<String>,
    /// Names of the animations, which are not read further.
    pub(crate) animations: Vec<Option<String>>,
}

impl Document {
    /// Reads the JSON text of a file.
    pub(crate) fn parse(text: &[u8]) -> Result<Self, GltfError> {
        // Some writers pad the JSON chunk with zeros instead of spaces.
        let end = text
            .iter()
            .rposition(|&byte| byte != 0)
            .map_or(0, |last| last + 1);
        let root: Value = serde_json::from_slice(&text[..end])
            .map_err(|error| json_error("JSON", &error.to_string()))?;
        let Value::Object(mut root) = root else {
            return Err(json_error("JSON", "is not an object"));
        };
        check_version(root.get("asset"))?;
        for name in take_strings(&mut root, "extensionsRequired")? {
            if !is_supported(&name) {
                return Err(GltfError::RequiredExtension { name });
            }
        }
        Ok(Self {
            accessors: take_list(&mut root, "accessors", ElementKind::Accessor, from_value)?,
            buffers: take_list(&mut root, "buffers", ElementKind::Buffer, from_value)?,
            buffer_views: take_list(
                &mut root,
                "bufferViews",
                ElementKind::BufferView,
                from_value,
            )?,
            cameras: take_list(&mut root, "cameras", ElementKind::Camera, from_value)?,
            lights: take_lights(&mut root)?,
            materials: take_list(&mut root, "materials", ElementKind::Material, from_value)?,
            meshes: take_list(&mut root, "meshes", ElementKind::Mesh, from_value)?,
            nodes: take_list(&mut root, "nodes", ElementKind::Node, from_value)?,
            scenes: take_list(&mut root, "scenes", ElementKind::Scene, from_value)?,
            default_scene: root
                .remove("scene")
                .map(from_value)
                .transpose()
                .map_err(|error| json_error("scene", &error.to_string()))?,
            extensions_used: take_strings(&mut root, "extensionsUsed")?,
            animations: animation_names(&root),
        })
    }

    pub(crate) fn accessor_element(&self, index: usize) -> Element {
        let name = self
            .accessors
            .get(index)
            .and_then(|accessor| accessor.name.as_ref());
        Element::new(ElementKind::Accessor, index, name)
    }

    pub(crate) fn buffer_element(&self, index: usize) -> Element {
        let name = self
            .buffers
            .get(index)
            .and_then(|buffer| buffer.name.as_ref());
        Element::new(ElementKind::Buffer, index, name)
    }

    pub(crate) fn view_element(&self, index: usize) -> Element {
        let name = self
            .buffer_views
            .get(index)
            .and_then(|view| view.name.as_ref());
        Element::new(ElementKind::BufferView, index, name)
    }

    pub(crate) fn camera_element(&self, index: usize) -> Element {
        let name = self
            .cameras
            .get(index)
            .and_then(|camera| camera.name.as_ref());
        Element::new(ElementKind::Camera, index, name)
    }

    pub(crate) fn light_element(&self, index: usize) -> Element {
        let name = self.lights.get(index).and_then(|light| light.name.as_ref());
        Element::new(ElementKind::Light, index, name)
    }

    pub(crate) fn material_element(&self, index: usize) -> Element {
        let name = self
            .materials
            .get(index)
            .and_then(|material| material.name.as_ref());
        Element::new(ElementKind::Material, index, name)
    }

    pub(crate) fn mesh_element(&self, index: usize) -> Element {
        let name = self.meshes.get(index).and_then(|mesh| mesh.name.as_ref());
        Element::new(ElementKind::Mesh, index, name)
    }

    pub(crate) fn node_element(&self, index: usize) -> Element {
        let name = self.nodes.get(index).and_then(|node| node.name.as_ref());
        Element::new(ElementKind::Node, index, name)
    }

    pub(crate) fn scene_element(&self, index: usize) -> Element {
        let name = self.scenes.get(index).and_then(|scene| scene.name.as_ref());
        Element::new(ElementKind::Scene, index, name)
    }
}

/// What a reference leads to, or the error that it leads nowhere.
pub(crate) fn follow<T>(
    list: &[T],
    index: usize,
    target: ElementKind,
    from: impl FnOnce() -> Element,
) -> Result<&T, GltfError> {
    list.get(index).ok_or_else(|| GltfError::Reference {
        element: from(),
        target,
        index,
        count: list.len(),
    })
}

fn check_version(asset: Option<&Value>) -> Result<(), GltfError> {
    let asset = asset.ok_or_else(|| json_error("asset", "is missing"))?;
    let version = |key| asset.get(key).and_then(Value::as_str);
    let found = version("version").ok_or_else(|| json_error("asset", "has no version"))?;
    // Minor versions are compatible, unless a file says that it needs a later one.
    let needed = version("minVersion").unwrap_or("2.0");
    if found.split('.').next() != Some("2") {
        return Err(GltfError::Version {
            version: found.to_owned(),
        });
    }
    if needed != "2.0" {
        return Err(GltfError::Version {
            version: needed.to_owned(),
        });
    }
    Ok(())
}

fn take_list<T>(
    object: &mut Map<String, Value>,
    key: &str,
    kind: ElementKind,
    read: impl Fn(Value) -> serde_json::Result<T>,
) -> Result<Vec<T>, GltfError> {
    let values = match object.remove(key) {
        None => return Ok(Vec::new()),
        Some(Value::Array(values)) => values,
        Some(_) => return Err(json_error(key, "is not an array")),
    };
    let mut list = Vec::with_capacity(values.len());
    for (index, value) in values.into_iter().enumerate() {
        let name = value.get("name").and_then(Value::as_str).map(str::to_owned);
        let item = read(value).map_err(|error| {
            let element = Element::new(kind, index, name.as_ref());
            json_error(&element.to_string(), &error.to_string())
        })?;
        list.push(item);
    }
    Ok(list)
}

fn take_lights(root: &mut Map<String, Value>) -> Result<Vec<Light>, GltfError> {
    let extension = root
        .get_mut("extensions")
        .and_then(|extensions| extensions.get_mut("KHR_lights_punctual"));
    match extension {
        None => Ok(Vec::new()),
        Some(Value::Object(object)) => take_list(object, "lights", ElementKind::Light, from_value),
        Some(_) => Err(json_error("KHR_lights_punctual", "is not an object")),
    }
}

fn take_strings(root: &mut Map<String, Value>, key: &str) -> Result<Vec<String>, GltfError> {
    let value = root.remove(key).unwrap_or(Value::Array(Vec::new()));
    from_value(value).map_err(|error| json_error(key, &error.to_string()))
}

fn animation_names(root: &Map<String, Value>) -> Vec<Option<String>> {
    let animations = root.get("animations").and_then(Value::as_array);
    let name = |value: &Value| value.get("name").and_then(Value::as_str).map(str::to_owned);
    animations.map_or_else(Vec::new, |list| list.iter().map(name).collect())
}

fn json_error(place: &str, message: &str) -> GltfError {
    // Messages may quote the file's own text.
    let message = message
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    GltfError::Json {
        place: place.to_owned(),
        message,
    }
}
