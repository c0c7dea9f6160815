//! The binary container, GLB.

use super::error::GltfError;

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BIN: &[u8; 4] = b"BIN\0";

/// A file's JSON text and its own binary data, if any.
#[derive(Debug, PartialEq)]
pub(crate) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) bin: Option<&'a [u8]>,
}

/// Takes a file apart. What does not begin as a GLB is taken as JSON.
pub(crate) fn split(bytes: &[u8]) -> Result<Container<'_>, GltfError> {
    let Some(mut rest) = bytes.strip_prefix(MAGIC) else {
        return Ok(Container {
            json: bytes,
            bin: None,
        });
    };
    let version = take_u32(&mut rest, "header")?;
    if version != 2 {
        return Err(GltfError::Version {
            version: version.to_string(),
        });
    }
    let length = u64::from(take_u32(&mut rest, "header")?);
    let available = bytes.len() as u64;
    if length > available {
        return Err(GltfError::Truncated {
            part: "the file",
            needed: length,
            available,
        });
    }
    // What follows the stated length is not part of the file. A length shorter than the header
    // leaves nothing.
    let header = (bytes.len() - rest.len()) as u64;
    rest = &rest[..length.saturating_sub(header) as usize];

    let (kind, json) = take_chunk(&mut rest)?;
    if &kind != JSON {
        return Err(GltfError::MissingJson);
    }
    // Chunks of other kinds are to be ignored.
    while !rest.is_empty() {
        let (kind, data) = take_chunk(&mut rest)?;
        if &kind == BIN {
            return Ok(Container {
                json,
                bin: Some(data),
            });
        }
    }
    Ok(Container { json, bin: None })
}

fn take_chunk<'a>(rest: &mut &'a [u8]) -> Result<([u8; 4], &'a [u8]), GltfError> {
    let length = take_u32(rest, "chunk header")?;
    let kind = take_u32(rest, "chunk header")?.to_le_bytes();
    let part = match &kind {
        JSON => "the JSON chunk",
        BIN => "the binary chunk",
        _ => "a chunk",
    };
    let (data, after) = rest
        .split_at_checked(length as usize)
        .ok_or(GltfError::Truncated {
            part,
            needed: u64::from(length),
            available: rest.len() as u64,
        })?;
    *rest = after;
    Ok((kind, data))
}

fn take_u32(rest: &mut &[u8], part: &'static str) -> Result<u32, GltfError> {
    let (number, after) = rest.split_first_chunk::<4>().ok_or(GltfError::Truncated {
        part,
        needed: 4,
        available: rest.len() as u64,
    })?;
    *rest = after;
    Ok(u32::from_le_bytes(*number))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(length: u32, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend(length.to_le_bytes());
        for (kind, data) in chunks {
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(*kind);
            bytes.extend(*data);
        }
        bytes
    }

    #[test]
    fn chunks_of_other_kinds_are_skipped() {
        let bytes = glb(
            12 + 8 + 4 + 8 + 3 + 8 + 2,
            &[(JSON, b"{}  "), (b"XTRA", b"abc"), (BIN, b"de")],
        );
        let container = split(&bytes).unwrap();
        assert_eq!(
            container,
            Container {
                json: b"{}  ",
                bin: Some(b"de")
            }
        );
    }

    #[test]
    fn the_stated_length_counts() {
        let bytes = glb(12 + 8 + 2, &[(JSON, b"{}"), (BIN, b"de")]);
        assert_eq!(split(&bytes).unwrap().bin, None);
        for length in [0, 3, 11, 12, 21, 1000, u32::MAX] {
            let bytes = glb(length, &[(JSON, b"{}")]);
            assert!(
                matches!(split(&bytes), Err(GltfError::Truncated { .. })),
                "{length}"
            );
        }
    }

    #[test]
    fn text_is_left_whole() {
        assert_eq!(
            split(b"{}").unwrap(),
            Container {
                json: b"{}",
                bin: None
            }
        );
        assert_eq!(
            split(b"").unwrap(),
            Container {
                json: b"",
                bin: None
            }
        );
    }

    #[test]
    fn other_files_are_refused() {
        assert!(matches!(
            split(b"glTF\x01\0\0\0\0\0\0\0"),
            Err(GltfError::Version { .. })
        ));
        let bytes = glb(12 + 8 + 2, &[(BIN, b"{}")]);
        assert!(matches!(split(&bytes), Err(GltfError::MissingJson)));
    }
}
