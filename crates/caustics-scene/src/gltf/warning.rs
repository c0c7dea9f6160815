//! What a file has that a scene cannot show.

use super::element::Element;
use std::fmt;

/// Something in a file that is not modelled, so that the picture may differ from what the file's
/// author saw. It prints as one line.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Warning {
    /// The part of the file that has it; `None` for the file as a whole.
    pub element: Option<Element>,
    /// What it is.
    pub kind: WarningKind,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(element) = &self.element {
            write!(f, "{element}: ")?;
        }
        write!(f, "{}", self.kind)
    }
}

/// What is not modelled, and what is done instead.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum WarningKind {
    /// A texture; its factor is used alone.
    Texture {
        /// Which of the material's textures.
        slot: &'static str,
    },
    /// A transmissive surface that is rough, and would refract into a lobe; it is Lambertian instead.
    Roughness {
        /// The roughness.
        roughness: f32,
    },
    /// A receiver with gloss; it is Lambertian, since
    /// [`LoadOptions::glossy_receivers`](super::LoadOptions::glossy_receivers) is off.
    Gloss {
        /// How metallic.
        metallic: f32,
        /// How rough.
        roughness: f32,
    },
    /// A surface that lets only part of the light in; it is Lambertian instead.
    PartialTransmission {
        /// Which part.
        transmission: f32,
    },
    /// A transmissive material that is metallic too; it is a clear dielectric.
    MetallicDielectric {
        /// How metallic.
        metallic: f32,
    },
    /// A transmissive material with a base colour; it is not tinted.
    TintedDielectric,
    /// A transmissive material without a volume; it bounds a solid body all the same.
    ThinWalled,
    /// An index of refraction of 0, which stands for an infinite one; it is 1.5 instead.
    ZeroIor,
    /// Alpha blending or masking; the surface is opaque.
    Alpha {
        /// The mode's name.
        mode: &'static str,
    },
    /// A priority in a material's extras that is not a 32-bit integer; it is 0.
    Priority,
    /// Colours of vertices; the material's is used.
    VertexColors,
    /// Morph targets; the mesh keeps its base shape.
    MorphTargets,
    /// A skin; the mesh keeps its bind pose.
    Skin,
    /// An animation; everything stays as placed.
    Animation,
    /// Points or lines; left out.
    PrimitiveMode {
        /// The mode's name.
        mode: &'static str,
    },
    /// A primitive without positions; left out.
    NoPositions,
    /// A primitive without a triangle that has an area; left out.
    NoTriangles,
    /// Triangles of zero area; left out.
    DegenerateTriangles {
        /// How many.
        count: usize,
    },
    /// Indices that do not suffice for a last triangle; left out.
    IncompleteTriangle {
        /// How many.
        indices: usize,
    },
    /// Vertex normals of zero length; computed instead.
    ZeroNormals {
        /// How many.
        count: usize,
    },
    /// A transform that flattens the node's mesh; left out.
    SingularTransform,
    /// A distance at which a light ends; it reaches on, falling with the square of the distance.
    LightRange,
    /// A spot light without a soft edge; it gets a narrow one.
    HardSpotEdge,
    /// An optional extension that is not known; without effect.
    Extension {
        /// Its name.
        name: String,
    },
}

impl fmt::Display for WarningKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Texture { slot } => write!(f, "{slot} is ignored, its factor used alone"),
            Self::Roughness { roughness } => {
                write!(
                    f,
                    "roughness {roughness} is not modelled, taken as Lambertian"
                )
            }
            Self::Gloss {
                metallic,
                roughness,
            } => write!(
                f,
                "metallic {metallic} and roughness {roughness} are left out, taken as Lambertian"
            ),
            Self::PartialTransmission { transmission } => {
                write!(
                    f,
                    "transmission {transmission} is not modelled, taken as Lambertian"
                )
            }
            Self::MetallicDielectric { metallic } => {
                write!(f, "metallic {metallic} is ignored where transmission is 1")
            }
            Self::TintedDielectric => f.write_str("base colour is ignored where transmission is 1"),
            Self::ThinWalled => {
                f.write_str("thin-walled transmission is not modelled, taken as a solid body")
            }
            Self::ZeroIor => f.write_str("infinite index of refraction is not modelled, 1.5 taken"),
            Self::Alpha { mode } => write!(f, "alpha mode {mode} is ignored, taken as opaque"),
            Self::Priority => f.write_str("priority in extras is not a 32-bit integer, 0 taken"),
            Self::VertexColors => f.write_str("vertex colours are ignored"),
            Self::MorphTargets => f.write_str("morph targets are ignored"),
            Self::Skin => f.write_str("skin is ignored, bind pose shown"),
            Self::Animation => f.write_str("animation is ignored"),
            Self::PrimitiveMode { mode } => write!(f, "{mode} are left out"),
            Self::NoPositions => f.write_str("left out, since it has no positions"),
            Self::NoTriangles => f.write_str("left out, since it has no triangles"),
            Self::DegenerateTriangles { count } => {
                write!(f, "{count} triangles of zero area are left out")
            }
            Self::IncompleteTriangle { indices } => {
                write!(f, "{indices} indices at the end make no triangle")
            }
            Self::ZeroNormals { count } => {
                write!(f, "{count} normals of zero length are computed instead")
            }
            Self::SingularTransform => {
                f.write_str("mesh is left out, since the transform flattens it")
            }
            Self::LightRange => f.write_str("range is ignored"),
            Self::HardSpotEdge => f.write_str("spot has no soft edge, a narrow one taken"),
            Self::Extension { name } => write!(f, "extension {name:?} is ignored"),
        }
    }
}

/// Warnings in the order in which they arise, each once.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
}

impl Warnings {
    /// Notes what is not modelled about a part of the file. Callers visit each part once.
    pub(crate) fn push(&mut self, element: &Element, kind: WarningKind) {
        self.list.push(Warning {
            element: Some(element.clone()),
            kind,
        });
    }

    /// Notes an extension in use that nothing else has reported.
    pub(crate) fn push_extension(&mut self, name: &str) {
        let reported = self.list.iter().any(
            |warning| matches!(&warning.kind, WarningKind::Extension { name: other } if other == name),
        );
        if !reported {
            let kind = WarningKind::Extension {
                name: name.to_owned(),
            };
            self.list.push(Warning {
                element: None,
                kind,
            });
        }
    }

    pub(crate) fn into_vec(self) -> Vec<Warning> {
        self.list
    }
}
