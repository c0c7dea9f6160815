use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::ImageError;

/// Why bytes are no picture that can be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes are not of the format, are cut short, or use a part of it that is not supported.
    #[error("{reason}")]
    Malformed {
        /// What the decoder says.
        reason: String,
    },
    /// No layer has the channels R, G and B.
    #[error("no layer has channels R, G and B; there are: {channels}")]
    NoColor {
        /// Names of the channels that are there.
        channels: String,
    },
    /// The picture is empty or too large.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Why an image cannot be turned into a file's bytes.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The encoder refuses the picture.
    #[error("{reason}")]
    Refused {
        /// What the encoder says.
        reason: String,
    },
}

/// Why a picture file cannot be read or written; the message starts with the path.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FileError {
    /// The file cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file's contents are not a picture that can be read.
    #[error("{}: {source}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: DecodeError,
    },
    /// The picture cannot be encoded.
    #[error("{}: {source}", path.display())]
    Encode {
        /// The file that would have been written.
        path: PathBuf,
        /// What is wrong with the picture.
        source: EncodeError,
    },
}
