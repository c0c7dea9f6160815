//! The bytes of buffers and views.

use super::document::{Document, follow};
use super::element::ElementKind;
use super::error::GltfError;
use super::uri::{self, Address};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::{fs, io};

/// The bytes of all buffers of a file.
#[derive(Debug)]
pub(crate) struct Buffers<'a> {
    document: &'a Document,
    data: Vec<Data<'a>>,
    total_bytes: u64,
}

#[derive(Clone, Debug)]
enum Data<'a> {
    /// In the file itself.
    Inside(&'a [u8]),
    /// From a data URI or another file.
    Outside(Rc<Vec<u8>>),
}

impl Data<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Data::Inside(bytes) => bytes,
            Data::Outside(bytes) => bytes,
        }
    }
}

impl<'a> Buffers<'a> {
    /// Gathers all buffers. `bin` is the binary chunk of the file, and `base` the folder that
    /// relative paths start from.
    pub(crate) fn load(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        base: Option<&Path>,
    ) -> Result<Self, GltfError> {
        let mut files = HashMap::new();
        let mut total_bytes = bin.map_or(0, |bin| bin.len() as u64);
        let mut data = Vec::with_capacity(document.buffers.len());
        for (index, buffer) in document.buffers.iter().enumerate() {
            let element = || document.buffer_element(index);
            let unreachable = |problem| GltfError::BufferAddress {
                element: element(),
                problem,
            };
            let found = match (&buffer.uri, bin) {
                (None, Some(bin)) if index == 0 => Data::Inside(bin),
                (None, _) => {
                    return Err(unreachable(
                        "has no URI, nor does the file have data for it",
                    ));
                }
                (Some(uri), _) => match uri::parse(uri).map_err(unreachable)? {
                    Address::Data(bytes) => {
                        total_bytes += bytes.len() as u64;
                        Data::Outside(Rc::new(bytes))
                    }
                    Address::Path(path) => {
                        let base = base.ok_or_else(|| {
                            unreachable("is in another file, and no folder is known for it")
                        })?;
                        let path = base.join(path);
                        let bytes = read_once(&mut files, &path).map_err(|source| {
                            GltfError::BufferFile {
                                element: element(),
                                path,
                                source,
                            }
                        })?;
                        Data::Outside(bytes)
                    }
                },
            };
            let available = found.bytes().len() as u64;
            if buffer.byte_length.0 > available {
                return Err(GltfError::OutOfBounds {
                    element: element(),
                    needed: buffer.byte_length.0,
                    container: "its data".to_owned(),
                    available,
                });
            }
            data.push(found);
        }
        total_bytes += files.values().map(|bytes| bytes.len() as u64).sum::<u64>();
        Ok(Self {
            document,
            data,
            total_bytes,
        })
    }

    /// All bytes there are, each counted once however many buffers hold it.
    pub(crate) fn total_bytes(&self) -> u64 {
        self.total_bytes
    }

    /// The bytes of a view.
    pub(crate) fn view(
        &self,
        index: usize,
        from: impl FnOnce() -> super::Element,
    ) -> Result<&[u8], GltfError> {
        let document = self.document;
        let view = follow(&document.buffer_views, index, ElementKind::BufferView, from)?;
        let element = || document.view_element(index);
        let buffer = view.buffer.value();
        let length = follow(&document.buffers, buffer, ElementKind::Buffer, element)?
            .byte_length
            .0;
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        // Checked against the buffer's own length, which may be shorter than its data.
        let end = start
            .checked_add(view.byte_length.0)
            .filter(|end| *end <= length);
        end.and_then(|end| self.data[buffer].bytes().get(start as usize..end as usize))
            .ok_or_else(|| GltfError::OutOfBounds {
                element: element(),
                needed: start.saturating_add(view.byte_length.0),
                container: document.buffer_element(buffer).to_string(),
                available: length,
            })
    }
}

/// Reads a file, unless it has been read before.
fn read_once(files: &mut HashMap<PathBuf, Rc<Vec<u8>>>, path: &Path) -> io::Result<Rc<Vec<u8>>> {
    if let Some(bytes) = files.get(path) {
        return Ok(Rc::clone(bytes));
    }
    // A device or a pipe may never end.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is not a regular file",
        ));
    }
    let bytes = Rc::new(fs::read(path)?);
    files.insert(path.to_owned(), Rc::clone(&bytes));
    Ok(bytes)
}
