//! How the tree lies in memory.

use bytemuck::Zeroable;

use crate::simd::{Row, WIDTH};

/// An inner node: the bounding boxes of up to eight children, one to a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// For each axis the lower and the upper bounds. An unused lane has an empty box, which no ray
    /// meets.
    pub(crate) bounds: [[Row; 2]; 3],
    pub(crate) children: [Child; WIDTH],
}

impl Node {
    pub(crate) const EMPTY: Self = Self {
        bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        children: [Child::EMPTY; WIDTH],
    };

    pub(crate) fn set(&mut self, lane: usize, low: [f32; 3], high: [f32; 3], child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0][lane] = low[axis];
            self.bounds[axis][1][lane] = high[axis];
        }
        self.children[lane] = child;
    }
}

/// Where a child is: a node, or a run of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Zeroable)]
#[repr(transparent)]
pub(crate) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const COUNT_BITS: u32 = 3;
    /// The most blocks in one leaf.
    pub(crate) const MAX_BLOCKS: usize = (1 << Self::COUNT_BITS) - 1;
    /// The most blocks in a tree, and more than the nodes above them.
    pub(crate) const MAX_BLOCK: usize = 1 << (31 - Self::COUNT_BITS);

    /// A leaf without blocks.
    pub(crate) const EMPTY: Self = Self(Self::LEAF);

    pub(crate) fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub(crate) fn leaf(first_block: usize, blocks: usize) -> Self {
        Self(Self::LEAF | ((first_block as u32) << Self::COUNT_BITS) | blocks as u32)
    }

    /// The same child where nodes and blocks have moved to later places.
    pub(crate) fn shifted(self, nodes: usize, blocks: usize) -> Self {
        if self == Self::EMPTY {
            self
        } else if self.is_leaf() {
            Self(self.0 + ((blocks as u32) << Self::COUNT_BITS))
        } else {
            Self(self.0 + nodes as u32)
        }
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Index of the node, if this is none of a leaf.
    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }

    /// The leaf's blocks.
    #[inline(always)]
    pub(crate) fn blocks(self) -> std::ops::Range<usize> {
        let first = ((self.0 & !Self::LEAF) >> Self::COUNT_BITS) as usize;
        first..first + (self.0 as usize & Self::MAX_BLOCKS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_fill_whole_cache_lines() {
        assert_eq!(size_of::<Node>(), 256);
    }

    #[test]
    fn children_remember_what_they_are() {
        assert_eq!(Child::node(77).index(), 77);
        assert!(!Child::node(77).is_leaf());
        let last = Child::MAX_BLOCK - 1;
        for (first, blocks) in [(0, 1), (12_345, 7), (last, 3)] {
            let leaf = Child::leaf(first, blocks);
            assert!(leaf.is_leaf());
            assert_eq!(leaf.blocks(), first..first + blocks);
        }
        assert!(Child::EMPTY.blocks().is_empty());
        assert_eq!(Child::node(7).shifted(3, 5), Child::node(10));
        assert_eq!(Child::leaf(7, 2).shifted(3, 5), Child::leaf(12, 2));
        assert_eq!(Child::EMPTY.shifted(3, 5), Child::EMPTY);
    }
}
