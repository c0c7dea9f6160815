//! How the tree lies in memory.

/// An inner node or a leaf, in eight bytes.
///
/// The two lowest bits of `tag` are the axis that an inner node splits, or [`LEAF`](Self::LEAF).
/// The others are the place of the lower child, which the upper one follows; or of a leaf's first
/// block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub(super) struct Node {
    tag: u32,
    /// Bits of the split's coordinate, or how many blocks a leaf has.
    value: u32,
}

impl Node {
    const LEAF: u32 = 3;
    /// The most nodes, and the most blocks, that can be told apart.
    pub(super) const MAX_PLACES: usize = 1 << 30;
    /// A leaf of nothing.
    pub(super) const EMPTY: Self = Self {
        tag: Self::LEAF,
        value: 0,
    };

    pub(super) fn inner(axis: usize, split: f32, lower: usize) -> Self {
        Self {
            tag: (lower as u32) << 2 | axis as u32,
            value: split.to_bits(),
        }
    }

    pub(super) fn leaf(first_block: usize, blocks: usize) -> Self {
        Self {
            tag: (first_block as u32) << 2 | Self::LEAF,
            value: blocks as u32,
        }
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.tag & 3 == Self::LEAF
    }

    /// The axis that an inner node splits.
    #[inline(always)]
    pub(super) fn axis(self) -> usize {
        (self.tag & 3) as usize
    }

    /// Where an inner node splits it, in metres.
    #[inline(always)]
    pub(super) fn split(self) -> f32 {
        f32::from_bits(self.value)
    }

    /// Place of an inner node's lower child.
    #[inline(always)]
    pub(super) fn lower(self) -> usize {
        (self.tag >> 2) as usize
    }

    /// A leaf's blocks.
    #[inline(always)]
    pub(super) fn blocks(self) -> std::ops::Range<usize> {
        let first = (self.tag >> 2) as usize;
        first..first + self.value as usize
    }

    /// The same node where nodes and blocks have moved to later places.
    pub(super) fn shifted(self, nodes: usize, blocks: usize) -> Self {
        let by = if self.is_leaf() { blocks } else { nodes };
        Self {
            tag: self.tag + ((by as u32) << 2),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_remember_what_they_are() {
        assert_eq!(size_of::<Node>(), 8);
        for axis in 0..3 {
            let node = Node::inner(axis, -2.5, Node::MAX_PLACES - 2);
            assert!(!node.is_leaf());
            assert_eq!((node.axis(), node.split()), (axis, -2.5));
            assert_eq!(node.lower(), Node::MAX_PLACES - 2);
        }
        let leaf = Node::leaf(77, 100_000);
        assert!(leaf.is_leaf());
        assert_eq!(leaf.blocks(), 77..100_077);
        assert_eq!(leaf.shifted(5, 3).blocks(), 80..100_080);
        assert_eq!(Node::inner(1, 0.5, 4).shifted(5, 3), Node::inner(1, 0.5, 9));
        assert!(Node::EMPTY.blocks().is_empty());
    }
}
