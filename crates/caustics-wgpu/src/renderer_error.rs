use thiserror::Error;

use crate::GpuError;

/// A limit of the device that is too low.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MissingLimit {
    /// Its name in WebGPU.
    pub name: &'static str,
    /// The least that is needed.
    pub required: u64,
    /// What the device offers.
    pub offered: u64,
}

/// What can be wrong with a renderer's construction or a frame.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RendererError {
    /// The device lacks something: all of it is listed.
    #[error("the device lacks {}", describe(features, limits))]
    Missing {
        /// Names of features.
        features: Vec<String>,
        /// Limits that are too low.
        limits: Vec<MissingLimit>,
    },
    /// A view without pixels, or with more than a texture may have.
    #[error("a view of {width} x {height} pixels is not between 1 and {limit} on each side")]
    ViewSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// The most on each side.
        limit: u32,
    },
    /// A view-projection that is not finite or has no inverse.
    #[error("the view-projection of view {view} is not finite or has no inverse")]
    SingularProjection {
        /// Index of the view.
        view: usize,
    },
    /// An option that is not a number above its limit.
    #[error("{name} is {value}, but must be {range}")]
    OptionOutOfRange {
        /// Which option.
        name: &'static str,
        /// Its value.
        value: f32,
        /// What it may be.
        range: &'static str,
    },
    /// A view that the frame does not have.
    #[error("there is no view {view}, the frame has {views}")]
    NoSuchView {
        /// Index that was asked for.
        view: usize,
        /// How many there are.
        views: usize,
    },
    /// A target format that the renderer was not built for, or cannot blend.
    #[error("the renderer was not built to draw into {format}")]
    UnknownTarget {
        /// The format.
        format: String,
    },
    /// The device is lost: build a new one, and a new renderer.
    #[error("the device is lost")]
    DeviceLost,
    /// The device has no memory left.
    #[error("the device is out of memory")]
    OutOfMemory,
    /// The device refused a call: a fault of this crate, or a resource of the host that does not
    /// have the format or the usage that is asked for.
    #[error("the device refused a call: {message}")]
    Device {
        /// What it said.
        message: String,
    },
    /// The GPU was asked for something that it cannot do.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

fn describe(features: &[String], limits: &[MissingLimit]) -> String {
    let features = features.iter().map(|name| format!("the feature {name}"));
    let limits = limits.iter().map(|limit| {
        format!(
            "a {} of {} (it has {})",
            limit.name, limit.required, limit.offered
        )
    });
    features.chain(limits).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_is_missing_is_in_the_message() {
        let limit = |name, required, offered| MissingLimit {
            name,
            required,
            offered,
        };
        let error = RendererError::Missing {
            features: vec!["x".into()],
            limits: vec![limit("a", 8, 4), limit("b", 3, 2)],
        };
        assert_eq!(
            error.to_string(),
            "the device lacks the feature x, a a of 8 (it has 4), a b of 3 (it has 2)"
        );
    }
}
