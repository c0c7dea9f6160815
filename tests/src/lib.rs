//! Shared code of this package.
