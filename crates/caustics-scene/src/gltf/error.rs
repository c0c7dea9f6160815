//! Why a file cannot be loaded.

use super::element::{Element, ElementKind};
use crate::camera::CameraError;
use crate::light_check::LightError;
use crate::material::MaterialError;
use crate::scene::SceneError;
use caustics_geometry::MeshError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// Why a glTF file cannot be loaded. Messages are one line, and name the part of the file that is
/// wrong, but not the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GltfError {
    /// The file itself cannot be read.
    #[error("cannot be read: {source}")]
    Read {
        /// What the system says.
        source: io::Error,
    },
    /// A binary file that ends before one of its parts does.
    #[error("{part} needs {needed} bytes, but the file has only {available} left")]
    Truncated {
        /// Which part.
        part: &'static str,
        /// How many bytes it should have.
        needed: u64,
        /// How many there are.
        available: u64,
    },
    /// A binary file without a JSON chunk in the first place.
    #[error("the first chunk is not JSON")]
    MissingJson,
    /// Another version of glTF than 2.
    #[error("glTF version {version:?} is not supported, only 2.0")]
    Version {
        /// The version that the file has or asks for.
        version: String,
    },
    /// Text that is not JSON, or JSON that is not glTF.
    #[error("{place}: {message}")]
    Json {
        /// Which part of the file.
        place: String,
        /// What is wrong.
        message: String,
    },
    /// An extension that the file cannot be understood without.
    #[error("the file requires the extension {name:?}, which is not supported")]
    RequiredExtension {
        /// The extension's name.
        name: String,
    },
    /// A reference to something that is not there.
    #[error("{element} refers to {target} {index}, but there are {count}")]
    Reference {
        /// What refers.
        element: Element,
        /// What kind of thing it refers to.
        target: ElementKind,
        /// Which one.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A default scene that is not there.
    #[error("the default scene is {index}, but there are {count}")]
    DefaultScene {
        /// The number of the scene.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A buffer's file that cannot be read.
    #[error("{element}: cannot read {}: {source}", path.display())]
    BufferFile {
        /// The buffer.
        element: Element,
        /// Its file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A buffer whose address cannot be followed.
    #[error("{element}: {problem}")]
    BufferAddress {
        /// The buffer.
        element: Element,
        /// Why not.
        problem: &'static str,
    },
    /// Data that would lie outside what contains it.
    #[error("{element} needs {needed} bytes, but {container} has {available}")]
    OutOfBounds {
        /// The buffer, view, or accessor.
        element: Element,
        /// How many bytes it needs, or `u64::MAX` for more than that.
        needed: u64,
        /// What contains it.
        container: String,
        /// How many bytes that has.
        available: u64,
    },
    /// An accessor of another type than its use asks for.
    #[error("{element} is {found}, but {usage} must be {expected}")]
    AccessorType {
        /// The accessor.
        element: Element,
        /// Its type.
        found: String,
        /// What it is used for.
        usage: &'static str,
        /// The types that are possible.
        expected: &'static str,
    },
    /// An accessor that makes no sense.
    #[error("{element}: {problem}")]
    Accessor {
        /// The accessor.
        element: Element,
        /// What is wrong.
        problem: AccessorProblem,
    },
    /// Vertex attributes of different counts.
    #[error("{element} has {positions} positions and {normals} normals")]
    NormalCount {
        /// The mesh and primitive.
        element: Element,
        /// How many positions.
        positions: usize,
        /// How many normals.
        normals: usize,
    },
    /// An index beyond the vertices.
    #[error("{element}: index {position} is vertex {vertex}, but there are {vertices}")]
    VertexIndex {
        /// The mesh and primitive.
        element: Element,
        /// Where in the list of indices.
        position: usize,
        /// The index.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More triangles than the file's bytes can account for.
    #[error("{element} would bring the file to {count} triangles, more than it has bytes")]
    TooManyTriangles {
        /// The mesh and primitive.
        element: Element,
        /// How many triangles there would be.
        count: u64,
    },
    /// A mesh that cannot be.
    #[error("{element}: {source}")]
    Mesh {
        /// The mesh and primitive.
        element: Element,
        /// What is wrong.
        source: MeshError,
    },
    /// A material with a value out of range.
    #[error("{element}: {source}")]
    Material {
        /// The material.
        element: Element,
        /// What is wrong.
        source: MaterialError,
    },
    /// A light with a value out of range.
    #[error("{element}: {source}")]
    Light {
        /// The light.
        element: Element,
        /// What is wrong.
        source: LightError,
    },
    /// A camera with a value out of range.
    #[error("{element}: {source}")]
    Camera {
        /// The camera.
        element: Element,
        /// What is wrong.
        source: CameraError,
    },
    /// An object that the scene refuses.
    #[error("{element}: {source}")]
    Object {
        /// The node.
        element: Element,
        /// What is wrong.
        source: SceneError,
    },
    /// A number out of its range.
    #[error("{element}: {quantity} {value} is not {expected}")]
    Value {
        /// What has it.
        element: Element,
        /// What it is the value of.
        quantity: &'static str,
        /// The value.
        value: f32,
        /// What it should be.
        expected: &'static str,
    },
    /// A transform that is not finite, not affine, or has no rotation.
    #[error("{element}: {problem}")]
    Transform {
        /// The node.
        element: Element,
        /// What is wrong.
        problem: &'static str,
    },
    /// A node that is its own ancestor.
    #[error("{element} is its own ancestor")]
    Cycle {
        /// The node.
        element: Element,
    },
    /// A node that is the child of two nodes, or twice of one.
    #[error("{element} is a child of node {first} and again of node {second}")]
    SeveralParents {
        /// The node.
        element: Element,
        /// One parent.
        first: usize,
        /// The other, or the same.
        second: usize,
    },
    /// A scene's root node that is also the child of a node, or listed twice.
    #[error("{element} lists node {node} as a root, but {reason}")]
    NotARoot {
        /// The scene.
        element: Element,
        /// The node.
        node: usize,
        /// Why it cannot be one.
        reason: String,
    },
}

/// What can be wrong with an accessor by itself.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AccessorProblem {
    /// Elements that overlap.
    #[error("elements of {size} bytes every {stride} bytes overlap")]
    Stride {
        /// From the start of one to the start of the next, in bytes.
        stride: usize,
        /// Length of one, in bytes.
        size: usize,
    },
    /// More elements than the file's bytes can account for.
    #[error(
        "{count} elements bring the file to {bytes} bytes of vertex data, \
         more than the {limit} that a file of this size may have"
    )]
    Count {
        /// How many elements the accessor has.
        count: u64,
        /// How many bytes all accessors read so far have together.
        bytes: u64,
        /// How many are accepted.
        limit: u64,
    },
    /// More replaced elements than elements.
    #[error("{sparse} sparse elements of {count}")]
    SparseCount {
        /// How many are replaced.
        sparse: u64,
        /// How many there are.
        count: u64,
    },
    /// A replaced element that is not there.
    #[error("sparse index {position} is element {index}, but there are {count}")]
    SparseIndex {
        /// Where in the list of sparse indices.
        position: usize,
        /// The index.
        index: u32,
        /// How many elements there are.
        count: usize,
    },
    /// Sparse indices that do not increase.
    #[error("sparse indices do not increase at {position}")]
    SparseOrder {
        /// Where in the list of sparse indices.
        position: usize,
    },
    /// A number that is not finite.
    #[error("element {index} is not finite")]
    NotFinite {
        /// The element.
        index: usize,
    },
}
