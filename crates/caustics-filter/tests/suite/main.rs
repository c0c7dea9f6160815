//! Tests of metrics and image files.
//!
//! One program, which takes less time to build than one for each file.

#[cfg(feature = "exr")]
mod exr_files;
mod metric_properties;
#[cfg(feature = "png")]
mod png_files;
