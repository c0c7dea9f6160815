//! A scene from the parts of a file.

use super::accessor::AccessorReader;
use super::buffers::Buffers;
use super::document::{Document, follow, is_supported};
use super::element::{Element, ElementKind};
use super::error::GltfError;
use super::hierarchy::{PlacedNode, placed_nodes};
use super::material;
use super::options::LoadOptions;
use super::primitive::PrimitiveReader;
use super::warning::{WarningKind, Warnings};
use crate::camera::{Camera, CameraError, Projection};
use crate::light::Light;
use crate::light_check::LightError;
use crate::scene::{Instance, MaterialId, MeshId, Scene, Shape, is_invertible};
use ::gltf::json;
use glam::Vec3;
use json::extensions::scene::khr_lights_punctual::Type as LightType;
use json::validation::Checked;
use std::collections::{HashMap, HashSet};

/// Builds a scene node by node, making meshes and materials when they are first used.
pub(crate) struct Loader<'a> {
    document: &'a Document,
    options: &'a LoadOptions,
    primitives: PrimitiveReader<'a>,
    scene: Scene,
    warnings: Warnings,
    materials: HashMap<Option<usize>, MaterialId>,
    /// For each mesh, its primitives' meshes and materials; those without triangles are left out.
    meshes: HashMap<usize, Vec<(MeshId, MaterialId)>>,
    lights_reported: HashSet<usize>,
}

impl<'a> Loader<'a> {
    pub(crate) fn new(
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        options: &'a LoadOptions,
    ) -> Self {
        Self {
            document,
            options,
            primitives: PrimitiveReader::new(AccessorReader::new(document, buffers)),
            scene: Scene::new(),
            warnings: Warnings::default(),
            materials: HashMap::new(),
            meshes: HashMap::new(),
            lights_reported: HashSet::new(),
        }
    }

    pub(crate) fn load(mut self) -> Result<(Scene, Warnings), GltfError> {
        for node in placed_nodes(self.document)? {
            self.add_node(&node)?;
        }
        for (index, name) in self.document.animations.iter().enumerate() {
            let element = Element::new(ElementKind::Animation, index, name.as_ref());
            self.warnings.push(&element, WarningKind::Animation);
        }
        for name in self
            .document
            .extensions_used
            .iter()
            .filter(|name| !is_supported(name))
        {
            self.warnings.push_extension(name);
        }
        Ok((self.scene, self.warnings))
    }

    fn add_node(&mut self, placed: &PlacedNode) -> Result<(), GltfError> {
        let document = self.document;
        let node = &document.nodes[placed.index];
        let element = document.node_element(placed.index);
        if node.skin.is_some() {
            self.warnings.push(&element, WarningKind::Skin);
        }
        for name in node
            .extensions
            .iter()
            .flat_map(|extensions| extensions.others.keys())
        {
            if !is_supported(name) {
                self.warnings
                    .push(&element, WarningKind::Extension { name: name.clone() });
            }
        }
        if let Some(mesh) = node.mesh {
            self.add_objects(placed, mesh.value(), &element)?;
        }
        if let Some(camera) = node.camera {
            self.add_camera(placed, camera.value(), &element)?;
        }
        let light = node
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            self.add_light(placed, light.light.value(), &element)?;
        }
        Ok(())
    }

    fn add_objects(
        &mut self,
        placed: &PlacedNode,
        mesh: usize,
        node: &Element,
    ) -> Result<(), GltfError> {
        follow(&self.document.meshes, mesh, ElementKind::Mesh, || {
            node.clone()
        })?;
        let parts = self.mesh(mesh)?;
        if parts.is_empty() {
            return Ok(());
        }
        if !is_invertible(&placed.transform) {
            self.warnings.push(node, WarningKind::SingularTransform);
            return Ok(());
        }
        let name = node
            .name
            .clone()
            .or_else(|| self.document.mesh_element(mesh).name);
        let name = name.unwrap_or_else(|| node.to_string());
        for (mesh, material) in parts {
            let instance = Instance::new(name.clone(), Shape::Mesh(mesh), material)
                .with_transform(placed.transform);
            self.scene
                .add_instance(instance)
                .map_err(|source| GltfError::Object {
                    element: node.clone(),
                    source,
                })?;
        }
        Ok(())
    }

    /// The parts of a mesh, made when it is first used.
    fn mesh(&mut self, index: usize) -> Result<Vec<(MeshId, MaterialId)>, GltfError> {
        if let Some(parts) = self.meshes.get(&index) {
            return Ok(parts.clone());
        }
        let mesh = &self.document.meshes[index];
        let element = self.document.mesh_element(index);
        for name in mesh
            .extensions
            .iter()
            .flat_map(|extensions| extensions.others.keys())
        {
            self.warnings
                .push(&element, WarningKind::Extension { name: name.clone() });
        }
        let mut parts = Vec::with_capacity(mesh.primitives.len());
        for (number, primitive) in (0..).zip(&mesh.primitives) {
            let element = element.clone().with_primitive(number);
            let scene = &mut self.scene;
            let add = |mesh| scene.add_mesh(mesh);
            if let Some(mesh) =
                self.primitives
                    .mesh(primitive, &element, &mut self.warnings, add)?
            {
                let material = primitive.material.map(|material| material.value());
                parts.push((mesh, self.material(material, &element)?));
            }
        }
        self.meshes.insert(index, parts.clone());
        Ok(parts)
    }

    /// A material, made when it is first used.
    fn material(&mut self, index: Option<usize>, user: &Element) -> Result<MaterialId, GltfError> {
        if let Some(id) = self.materials.get(&index) {
            return Ok(*id);
        }
        let material = match index {
            Some(index) => {
                let materials = &self.document.materials;
                follow(materials, index, ElementKind::Material, || user.clone())?;
                material::convert(self.document, index, self.options, &mut self.warnings)?
            }
            None => material::default_material(),
        };
        let id = self
            .scene
            .add_material(material)
            .map_err(|source| GltfError::Object {
                element: user.clone(),
                source,
            })?;
        self.materials.insert(index, id);
        Ok(id)
    }

    fn add_camera(
        &mut self,
        placed: &PlacedNode,
        index: usize,
        node: &Element,
    ) -> Result<(), GltfError> {
        let source = follow(&self.document.cameras, index, ElementKind::Camera, || {
            node.clone()
        })?;
        let element = self.document.camera_element(index);
        let projection = projection(source).ok_or_else(|| GltfError::Json {
            place: element.to_string(),
            message: "is neither perspective nor orthographic, or lacks its values".to_owned(),
        })?;
        let name = source.name.clone().or_else(|| node.name.clone());
        let name = name.unwrap_or_else(|| node.to_string());
        let camera = Camera::new(name, placed.transform, projection).map_err(|source| {
            // A pose is the node's, a projection the camera's.
            let at_fault = if source == CameraError::Pose {
                node.clone()
            } else {
                element
            };
            GltfError::Camera {
                element: at_fault,
                source,
            }
        })?;
        self.scene
            .add_camera(camera)
            .map_err(|source| GltfError::Object {
                element: node.clone(),
                source,
            })
    }

    fn add_light(
        &mut self,
        placed: &PlacedNode,
        index: usize,
        node: &Element,
    ) -> Result<(), GltfError> {
        let document = self.document;
        let source = follow(&document.lights, index, ElementKind::Light, || node.clone())?;
        let element = document.light_element(index);
        let first_use = self.lights_reported.insert(index);
        let mut warn = |kind| {
            if first_use {
                self.warnings.push(&element, kind);
            }
        };
        if source.range.is_some() {
            warn(WarningKind::LightRange);
        }
        let position = placed.transform.translation;
        let direction = -placed.transform.matrix3.z_axis;
        let intensity = Vec3::from(source.color) * source.intensity;
        let light = match source.type_ {
            Checked::Valid(LightType::Point) => Light::point(position, intensity),
            Checked::Valid(LightType::Directional) => Light::directional(direction, intensity),
            Checked::Valid(LightType::Spot) => {
                let spot = source.spot.clone().ok_or_else(|| GltfError::Json {
                    place: element.to_string(),
                    message: "is a spot without its angles".to_owned(),
                })?;
                let (mut inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
                // Not allowed, but what some exporters write for a hard edge.
                if inner == outer {
                    warn(WarningKind::HardSpotEdge);
                    inner *= 0.99;
                }
                Light::spot(position, direction, intensity, inner, outer)
            }
            Checked::Invalid => {
                let message = "is neither a point, a spot, nor directional".to_owned();
                return Err(GltfError::Json {
                    place: element.to_string(),
                    message,
                });
            }
        };
        let light = light.map_err(|source| {
            // Where a light is and points to is the node's.
            let of_node = matches!(
                source,
                LightError::Position { .. } | LightError::Direction { .. }
            );
            GltfError::Light {
                element: if of_node { node.clone() } else { element },
                source,
            }
        })?;
        self.scene
            .add_light(light)
            .map_err(|source| GltfError::Object {
                element: node.clone(),
                source,
            })
    }
}

fn projection(camera: &json::Camera) -> Option<Projection> {
    match camera.type_ {
        Checked::Valid(json::camera::Type::Perspective) => {
            camera
                .perspective
                .as_ref()
                .map(|perspective| Projection::Perspective {
                    yfov: perspective.yfov,
                })
        }
        Checked::Valid(json::camera::Type::Orthographic) => {
            camera
                .orthographic
                .as_ref()
                .map(|ortho| Projection::Orthographic {
                    xmag: ortho.xmag,
                    ymag: ortho.ymag,
                })
        }
        Checked::Invalid => None,
    }
}
