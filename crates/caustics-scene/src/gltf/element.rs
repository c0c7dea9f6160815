//! Which part of a file a message is about.

use std::fmt;

/// The kinds of numbered parts of a glTF file.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
#[non_exhaustive]
pub enum ElementKind {
    /// A view of binary data.
    Accessor,
    /// An animation.
    Animation,
    /// A block of binary data.
    Buffer,
    /// A part of a buffer.
    BufferView,
    /// A camera.
    Camera,
    /// A punctual light.
    Light,
    /// A material.
    Material,
    /// A mesh.
    Mesh,
    /// A node of the hierarchy.
    Node,
    /// A scene.
    Scene,
}

impl fmt::Display for ElementKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Accessor => "accessor",
            Self::Animation => "animation",
            Self::Buffer => "buffer",
            Self::BufferView => "buffer view",
            Self::Camera => "camera",
            Self::Light => "light",
            Self::Material => "material",
            Self::Mesh => "mesh",
            Self::Node => "node",
            Self::Scene => "scene",
        })
    }
}

/// A numbered part of a glTF file, with its name where it has one. It prints as
/// `mesh 3 "bowl", primitive 1`.
#[derive(Clone, Debug, Eq, Hash, PartialEq)]
#[non_exhaustive]
pub struct Element {
    /// What it is.
    pub kind: ElementKind,
    /// Its number among its kind, from 0.
    pub index: usize,
    /// Its name in the file.
    pub name: Option<String>,
    /// The primitive of a mesh that is meant, from 0.
    pub primitive: Option<u32>,
}

impl Element {
    pub(crate) fn new(kind: ElementKind, index: usize, name: Option<&String>) -> Self {
        Self {
            kind,
            index,
            name: name.cloned(),
            primitive: None,
        }
    }

    /// The same mesh, meaning one of its primitives.
    pub(crate) fn with_primitive(mut self, primitive: u32) -> Self {
        self.primitive = Some(primitive);
        self
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind, self.index)?;
        if let Some(name) = &self.name {
            // With escapes, so that a line stays a line whatever the name.
            write!(f, " {name:?}")?;
        }
        if let Some(primitive) = self.primitive {
            write!(f, ", primitive {primitive}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prints_on_one_line() {
        let name = "two\nlines".to_owned();
        let element = Element::new(ElementKind::Mesh, 3, Some(&name)).with_primitive(1);
        assert_eq!(element.to_string(), r#"mesh 3 "two\nlines", primitive 1"#);
        let element = Element::new(ElementKind::BufferView, 0, None);
        assert_eq!(element.to_string(), "buffer view 0");
    }
}
