use caustics_trace::TraceError;
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
    /// More of something than the shaders can number.
    #[error("there are {count} {what}, but the shaders number at most {limit}")]
    TooMany {
        /// What there is too much of, in the plural.
        what: &'static str,
        /// How many there are.
        count: u64,
        /// How many there may be.
        limit: u64,
    },
    /// Something that the CPU can trace and the shaders cannot.
    #[error("the shaders cannot trace {what}")]
    Unsupported {
        /// What they cannot trace.
        what: &'static str,
    },
    /// Options of tracing that are out of range.
    #[error(transparent)]
    Options(#[from] TraceError),
    /// A scene whose primitives are not those that the buffers were made for.
    #[error("the scene has {given} {what}, but the buffers were made for {expected}")]
    SceneChanged {
        /// What there are more or fewer of, in the plural.
        what: &'static str,
        /// How many the scene has.
        given: u64,
        /// How many the buffers hold.
        expected: u64,
    },
    /// Photons that are not among those of a plan, or more than a batch has room for.
    #[error("photons {first}..{end} do not fit {photons} photons in batches of {batch}")]
    PhotonRange {
        /// The first photon.
        first: u32,
        /// The photon after the last.
        end: u32,
        /// How many photons the plan has.
        photons: u32,
        /// How many a batch holds.
        batch: u32,
    },
    /// Counters of another size than the shaders write.
    #[error("the counters are {words} words, not {expected}")]
    CounterSize {
        /// Their number.
        words: usize,
        /// The number that the shaders write.
        expected: usize,
    },
}
