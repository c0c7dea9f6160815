//! What the trees over triangles have in common: the triangles they accept, eight of them in a
//! block, and the watertight test of a ray against a block.

mod block;
mod input;
mod leaf_test;
mod query;
mod row_test;

pub(crate) use block::Block;
pub(crate) use input::{MAX_COORDINATE, can_be_hit, corners_of, validate};
pub(crate) use leaf_test::{Closest, ShearedRay, axes_of};
pub(crate) use query::{WIDEN, is_usable, lower_end};
pub(crate) use row_test::{ClosestRow, ShearedRow};
