//! The examples of caustics; see the folder of each.
