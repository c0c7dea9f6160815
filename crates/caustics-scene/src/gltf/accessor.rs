//! Typed data in buffers.

use super::buffers::Buffers;
use super::document::{Document, follow};
use super::element::{Element, ElementKind};
use super::error::{AccessorProblem, GltfError};
use ::gltf::json;
use glam::Vec3;
use json::accessor::{ComponentType, IndexComponentType, Type, sparse::Sparse};
use json::validation::Checked;
use std::cell::Cell;

/// Bytes that the accessors of any file may have together, however short it is, and how many times
/// they may have all of its bytes beyond that. Accessors may overlap, be read several times, and be
/// zeros without data, but not without limit: a short file must not be able to fill the memory.
const FREE_BYTES: u64 = 1 << 22;
const REUSE: u64 = 16;

/// Reads accessors, checking every offset and count.
#[derive(Debug)]
pub(crate) struct AccessorReader<'a> {
    pub(crate) document: &'a Document,
    pub(crate) buffers: &'a Buffers<'a>,
    bytes_read: Cell<u64>,
}

impl<'a> AccessorReader<'a> {
    pub(crate) fn new(document: &'a Document, buffers: &'a Buffers<'a>) -> Self {
        Self {
            document,
            buffers,
            bytes_read: Cell::new(0),
        }
    }

    /// Vectors of three finite floats. `usage` says what they are, in the plural.
    pub(crate) fn vectors(
        &self,
        index: usize,
        usage: &'static str,
        from: impl FnOnce() -> Element,
    ) -> Result<Vec<Vec3>, GltfError> {
        let accessor = follow(&self.document.accessors, index, ElementKind::Accessor, from)?;
        let (component, kind) = (component_type(accessor), element_type(accessor));
        if (component, kind) != (Some(ComponentType::F32), Some(Type::Vec3)) {
            return Err(self.wrong_type(index, usage, "vectors of 3 floats"));
        }
        let vectors = self.elements(index, accessor, 12, |bytes| {
            let number = |start: usize| {
                bytes[start..]
                    .first_chunk()
                    .map_or(f32::NAN, |four| f32::from_le_bytes(*four))
            };
            Vec3::new(number(0), number(4), number(8))
        })?;
        match vectors.iter().position(|vector| !vector.is_finite()) {
            Some(place) => Err(self.problem(index, AccessorProblem::NotFinite { index: place })),
            None => Ok(vectors),
        }
    }

    /// Unsigned integers.
    pub(crate) fn indices(
        &self,
        index: usize,
        from: impl FnOnce() -> Element,
    ) -> Result<Vec<u32>, GltfError> {
        let accessor = follow(&self.document.accessors, index, ElementKind::Accessor, from)?;
        let component = component_type(accessor).filter(|component| {
            use ComponentType::{U8, U16, U32};
            matches!(component, U8 | U16 | U32) && element_type(accessor) == Some(Type::Scalar)
        });
        let Some(component) = component.filter(|_| !accessor.normalized) else {
            return Err(self.wrong_type(index, "indices", "unsigned integers"));
        };
        self.elements(index, accessor, component.size(), unsigned)
    }

    /// The elements of an accessor, `size` bytes each.
    fn elements<T: Copy>(
        &self,
        index: usize,
        accessor: &json::Accessor,
        size: usize,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, GltfError> {
        let count = self.check_count(index, accessor.count.0, size)?;
        let mut elements = if let Some(view) = accessor.buffer_view {
            let view = view.value();
            let bytes = self
                .buffers
                .view(view, || self.document.accessor_element(index))?;
            let stride = self.document.buffer_views[view]
                .byte_stride
                .map_or(size, |s| s.0);
            if stride < size {
                return Err(self.problem(index, AccessorProblem::Stride { stride, size }));
            }
            let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
            let span = Span {
                view,
                offset,
                count,
                stride,
                size,
            };
            let bytes = self.span(index, bytes, &span)?;
            // The last element need not be followed by a whole stride.
            bytes
                .chunks(stride)
                .map(|element| decode(&element[..size]))
                .collect()
        } else {
            vec![decode(&[0; 12][..size]); count]
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(index, sparse, size, &decode, &mut elements)?;
        }
        Ok(elements)
    }

    /// Counts the bytes of an accessor among all that have been read.
    fn check_count(&self, index: usize, count: u64, size: usize) -> Result<usize, GltfError> {
        let limit = FREE_BYTES.saturating_add(self.buffers.total_bytes().saturating_mul(REUSE));
        let bytes = count
            .saturating_mul(size as u64)
            .saturating_add(self.bytes_read.get());
        match usize::try_from(count) {
            Ok(count) if bytes <= limit => {
                self.bytes_read.set(bytes);
                Ok(count)
            }
            _ => Err(self.problem(
                index,
                AccessorProblem::Count {
                    count,
                    bytes,
                    limit,
                },
            )),
        }
    }

    /// Puts the elements of a sparse accessor in their places.
    fn replace<T>(
        &self,
        index: usize,
        sparse: &Sparse,
        size: usize,
        decode: impl Fn(&[u8]) -> T,
        elements: &mut [T],
    ) -> Result<(), GltfError> {
        let element = || self.document.accessor_element(index);
        let count = sparse.count.0;
        if count > elements.len() as u64 {
            let problem = AccessorProblem::SparseCount {
                sparse: count,
                count: elements.len() as u64,
            };
            return Err(self.problem(index, problem));
        }
        let count = count as usize;
        let Checked::Valid(IndexComponentType(component)) = sparse.indices.component_type else {
            return Err(self.wrong_type(index, "sparse indices", "unsigned integers"));
        };
        let tight = |view: usize, offset, size| Span {
            view,
            offset,
            count,
            stride: size,
            size,
        };
        let view = sparse.indices.buffer_view.value();
        let span = tight(view, sparse.indices.byte_offset.0, component.size());
        let places = self.span(index, self.buffers.view(view, element)?, &span)?;
        let view = sparse.values.buffer_view.value();
        let span = tight(view, sparse.values.byte_offset.0, size);
        let values = self.span(index, self.buffers.view(view, element)?, &span)?;

        let mut least = 0;
        let pairs = places
            .chunks_exact(component.size())
            .zip(values.chunks_exact(size));
        for (position, (place, value)) in pairs.enumerate() {
            let place = unsigned(place);
            if (place as usize) < least {
                return Err(self.problem(index, AccessorProblem::SparseOrder { position }));
            }
            least = place as usize + 1;
            let count = elements.len();
            let slot = elements.get_mut(place as usize).ok_or_else(|| {
                let problem = AccessorProblem::SparseIndex {
                    position,
                    index: place,
                    count,
                };
                self.problem(index, problem)
            })?;
            *slot = decode(value);
        }
        Ok(())
    }

    /// The bytes of a span of elements in a view, from the first byte of the first to the last byte
    /// of the last.
    fn span<'b>(&self, index: usize, bytes: &'b [u8], span: &Span) -> Result<&'b [u8], GltfError> {
        if span.count == 0 {
            return Ok(&[]);
        }
        // What saturates is more than any view has.
        let end = (span.count as u64 - 1)
            .saturating_mul(span.stride as u64)
            .saturating_add(span.size as u64)
            .saturating_add(span.offset);
        if end > bytes.len() as u64 {
            return Err(GltfError::OutOfBounds {
                element: self.document.accessor_element(index),
                needed: end,
                container: self.document.view_element(span.view).to_string(),
                available: bytes.len() as u64,
            });
        }
        Ok(&bytes[span.offset as usize..end as usize])
    }

    fn problem(&self, index: usize, problem: AccessorProblem) -> GltfError {
        GltfError::Accessor {
            element: self.document.accessor_element(index),
            problem,
        }
    }

    fn wrong_type(&self, index: usize, usage: &'static str, expected: &'static str) -> GltfError {
        let accessor = &self.document.accessors[index];
        let describe = |part: Option<String>| part.unwrap_or_else(|| "unknown".to_owned());
        let kind = describe(element_type(accessor).map(|kind| format!("{kind:?}").to_uppercase()));
        let component = describe(component_type(accessor).map(|c| format!("{c:?}").to_lowercase()));
        let normalized = if accessor.normalized {
            " normalized"
        } else {
            ""
        };
        GltfError::AccessorType {
            element: self.document.accessor_element(index),
            found: format!("{kind} of{normalized} {component}"),
            usage,
            expected,
        }
    }
}

/// Where elements lie in a view.
struct Span {
    view: usize,
    offset: u64,
    count: usize,
    stride: usize,
    size: usize,
}

fn component_type(accessor: &json::Accessor) -> Option<ComponentType> {
    match accessor.component_type {
        Checked::Valid(component) => Some(component.0),
        Checked::Invalid => None,
    }
}

fn element_type(accessor: &json::Accessor) -> Option<Type> {
    match accessor.type_ {
        Checked::Valid(kind) => Some(kind),
        Checked::Invalid => None,
    }
}

/// A little-endian number of 1, 2, or 4 bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |number, &byte| number << 8 | u32::from(byte))
}
