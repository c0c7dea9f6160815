use thiserror::Error;

/// What can be wrong with what the GPU is asked for.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GpuError {
    /// A buffer that the device cannot bind whole.
    #[error("{what} need {bytes} bytes, but the device binds at most {limit}")]
    BufferTooLarge {
        /// What the buffer holds, in the plural.
        what: &'static str,
        /// Its size, in bytes.
        bytes: u64,
        /// The device's `max_storage_buffer_binding_size`, in bytes.
        limit: u64,
    },
}
