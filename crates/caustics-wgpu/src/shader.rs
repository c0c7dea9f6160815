//! Shaders from pieces of WGSL, one file a concept.

/// A file of WGSL.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaderPiece {
    /// The file's name without its ending.
    pub(crate) name: &'static str,
    pub(crate) source: &'static str,
}

/// The piece in `shaders/` of this name, without the ending.
macro_rules! shader_piece {
    ($name:literal) => {
        $crate::shader::ShaderPiece {
            name: $name,
            source: include_str!(concat!("shaders/", $name, ".wgsl")),
        }
    };
}
pub(crate) use shader_piece;

/// The pieces of one shader module, in order. No piece may declare what another declares.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shader {
    /// Its name in error messages and debuggers.
    pub(crate) label: &'static str,
    pub(crate) pieces: &'static [ShaderPiece],
}

impl Shader {
    /// The pieces one after the other.
    pub(crate) fn source(&self) -> String {
        let mut source = String::new();
        for piece in self.pieces {
            source.push_str("// ");
            source.push_str(piece.name);
            source.push_str(".wgsl\n");
            source.push_str(piece.source);
        }
        source
    }

    /// Compiles the shader. The device reports errors in it to its error scope.
    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.label),
            source: wgpu::ShaderSource::Wgsl(self.source().into()),
        })
    }
}

/// The footprint record, which tracing writes and everything else reads.
pub(crate) const FOOTPRINT_RECORD: ShaderPiece = shader_piece!("footprint_record");

#[cfg(test)]
pub(crate) mod reflection {
    //! What naga knows of a shader, to compare with Rust.

    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

    use super::Shader;
    use crate::pass_layout::Slot;

    /// Parses and validates, or says where in which piece it fails.
    pub(crate) fn validated(shader: &Shader) -> Result<(naga::Module, ModuleInfo), String> {
        let source = shader.source();
        let module = naga::front::wgsl::parse_str(&source)
            .map_err(|error| error.emit_to_string_with_path(&source, shader.label))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .map_err(|error| error.emit_to_string_with_path(&source, shader.label))?;
        Ok((module, info))
    }

    /// The offset of each member of a struct, and its size.
    pub(crate) fn layout(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
        let (_, found) = module
            .types
            .iter()
            .find(|(_, it)| it.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("the shader has no struct {name}"));
        let naga::TypeInner::Struct { members, span } = &found.inner else {
            panic!("{name} is not a struct");
        };
        let offsets = members
            .iter()
            .map(|member| (member.name.clone().unwrap_or_default(), member.offset));
        (offsets.collect(), *span)
    }

    /// The value of a `const` of type u32.
    pub(crate) fn constant(module: &naga::Module, name: &str) -> u32 {
        let (_, found) = module
            .constants
            .iter()
            .find(|(_, it)| it.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("the shader has no constant {name}"));
        match module.global_expressions[found.init] {
            naga::Expression::Literal(naga::Literal::U32(value)) => value,
            ref other => panic!("{name} is {other:?}"),
        }
    }

    /// The workgroup's size along each axis.
    pub(crate) fn workgroup_size(module: &naga::Module, entry_point: &str) -> [u32; 3] {
        let mut all = module.entry_points.iter();
        all.find(|it| it.name == entry_point)
            .unwrap_or_else(|| panic!("the shader has no entry point {entry_point}"))
            .workgroup_size
    }

    /// The slots that the shader's buffers are bound to, all of group 0, in order.
    pub(crate) fn buffers(module: &naga::Module) -> Vec<(u32, Slot)> {
        let mut found = Vec::new();
        for (_, variable) in module.global_variables.iter() {
            let Some(binding) = &variable.binding else {
                continue;
            };
            assert_eq!(binding.group, 0, "{:?}", variable.name);
            let slot = match variable.space {
                naga::AddressSpace::Uniform => Slot::Uniform,
                naga::AddressSpace::Storage { access }
                    if access.contains(naga::StorageAccess::STORE) =>
                {
                    Slot::Write
                }
                naga::AddressSpace::Storage { .. } => Slot::Read,
                other => panic!("{:?} is in {other:?}", variable.name),
            };
            found.push((binding.binding, slot));
        }
        found.sort_by_key(|(binding, _)| *binding);
        found
    }
}

/// Asserts that a WGSL struct has the members of the Rust one, at the same offsets, and its size.
#[cfg(test)]
macro_rules! assert_layout {
    ($module:expr, $name:ident { $($field:ident),* $(,)? }) => {{
        let expected = vec![$((stringify!($field).to_owned(), std::mem::offset_of!($name, $field) as u32)),*];
        assert_eq!(
            $crate::shader::reflection::layout($module, stringify!($name)),
            (expected, size_of::<$name>() as u32)
        );
    }};
}
#[cfg(test)]
pub(crate) use assert_layout;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FootprintRecord;

    #[test]
    fn the_footprint_record_is_laid_out_as_in_rust() {
        let shader = Shader {
            label: "record",
            pieces: &[FOOTPRINT_RECORD],
        };
        let (module, _) = reflection::validated(&shader).unwrap();
        assert_layout!(
            &module,
            FootprintRecord {
                position,
                flux_r,
                axis_u,
                flux_g,
                axis_v,
                flux_b,
                incoming,
                object,
                normal,
                photon,
            }
        );
    }

    #[test]
    fn broken_shaders_are_rejected() {
        let broken = ShaderPiece {
            name: "broken",
            source: "fn f() -> f32 { return 1u; }",
        };
        let shader = Shader {
            label: "broken",
            pieces: Vec::leak(vec![FOOTPRINT_RECORD, broken]),
        };
        assert!(reflection::validated(&shader).is_err());
    }
}
