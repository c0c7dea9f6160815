//! The hierarchy of up to four children a node, made from the binary one.

use glam::Vec3;

use crate::gpu_scene::{LEAF_BIT, NO_PRIMITIVE, Node, WideNode};

/// Children of a node.
const WIDTH: usize = 4;

/// The nodes, the root first, and for each of them the binary nodes that its children are;
/// [`NO_PRIMITIVE`] where there is none.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideHierarchy {
    pub(crate) nodes: Vec<WideNode>,
    pub(crate) sources: Vec<[u32; WIDTH]>,
}

impl WideHierarchy {
    /// Of a binary hierarchy whose root is node 0. A node's children are found by opening the largest
    /// of them until there are four.
    pub(crate) fn new(binary: &[Node]) -> Self {
        let mut wide = Self::default();
        let mut waiting = Vec::new();
        if !binary.is_empty() {
            wide.push();
            waiting.push((0, 0));
        }
        while let Some((node, root)) = waiting.pop() {
            for (place, source) in opened(binary, root).into_iter().enumerate() {
                let described = &binary[source as usize];
                wide.sources[node][place] = source;
                wide.nodes[node].children[place] = if described.is_leaf != 0 {
                    described.first | LEAF_BIT
                } else {
                    let child = wide.push();
                    waiting.push((child, source));
                    child as u32
                };
            }
            wide.nodes[node].set_boxes(binary, &wide.sources[node]);
        }
        wide
    }

    fn push(&mut self) -> usize {
        self.nodes.push(WideNode {
            children: [NO_PRIMITIVE; WIDTH],
            ..WideNode::default()
        });
        self.sources.push([NO_PRIMITIVE; WIDTH]);
        self.nodes.len() - 1
    }

    /// The most nodes that wait while one is visited: the siblings of it and of all above it.
    pub(crate) fn most_waiting(&self) -> u32 {
        let mut most = 0;
        let mut waiting = vec![(0u32, 0u32)];
        while let Some((node, before)) = waiting.pop() {
            let Some(node) = self.nodes.get(node as usize) else {
                continue;
            };
            let children = node.children.iter().filter(|it| **it != NO_PRIMITIVE);
            let after = before + (children.clone().count() as u32).saturating_sub(1);
            most = most.max(after);
            let inner = children.filter(|it| **it & LEAF_BIT == 0);
            waiting.extend(inner.map(|&child| (child, after)));
        }
        most
    }
}

/// The up to four binary nodes that stand for a node.
fn opened(binary: &[Node], root: u32) -> Vec<u32> {
    let mut children = vec![root];
    while children.len() < WIDTH {
        let inner = (0..children.len()).filter(|&it| binary[children[it] as usize].is_leaf == 0);
        let area = |&it: &usize| area(&binary[children[it] as usize]);
        let largest = inner.max_by(|a, b| area(a).total_cmp(&area(b)));
        let Some(largest) = largest else { break };
        let first = binary[children[largest] as usize].first;
        children[largest] = first;
        children.push(first + 1);
    }
    children
}

/// Half the surface of a node's box.
fn area(node: &Node) -> f32 {
    let size = Vec3::from(node.high) - Vec3::from(node.low);
    size.x * size.y + size.y * size.z + size.z * size.x
}

impl WideNode {
    /// Sets the boxes from those of the binary nodes that are its children, each at most a step wider
    /// on every side.
    fn set_boxes(&mut self, binary: &[Node], sources: &[u32; WIDTH]) {
        let boxes = sources.map(|source| {
            let node = binary.get(source as usize)?;
            Some((Vec3::from(node.low), Vec3::from(node.high)))
        });
        let (low, high) = boxes
            .iter()
            .flatten()
            .fold((Vec3::splat(f32::MAX), Vec3::splat(f32::MIN)), |all, it| {
                (all.0.min(it.0), all.1.max(it.1))
            });
        self.origin = low.to_array();
        self.exponents = 0;
        (self.low, self.high) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            // The least power of two of which 254 are as long; one more is for rounding.
            let bits = ((high[axis] - low[axis]) / 254.0).to_bits();
            let exponent = (bits.wrapping_add(0x7f_ffff) >> 23).max(1);
            // The power's reciprocal.
            let steps = f32::from_bits(254u32.saturating_sub(exponent) << 23);
            self.exponents |= exponent << (8 * axis);
            for (child, corners) in boxes.iter().enumerate() {
                let Some((from, to)) = corners else { continue };
                // Casts saturate.
                let from = ((from[axis] - low[axis]) * steps).floor() as u8;
                let to = ((to[axis] - low[axis]) * steps).ceil() as u8;
                self.low[axis] |= u32::from(from) << (8 * child);
                self.high[axis] |= u32::from(to) << (8 * child);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A binary tree over boxes of many sizes along a line, each inner node halving its range.
    fn tree(leaves: u32) -> Vec<Node> {
        let mut nodes = vec![Node::default()];
        let mut waiting = vec![(0usize, 0, leaves)];
        let mut order = Vec::new();
        while let Some((index, start, end)) = waiting.pop() {
            order.push(index);
            if end - start == 1 {
                let at = start as f32;
                let size = 0.01 + (at * 0.7).sin().abs();
                nodes[index] = Node {
                    low: [at - size, -3.0 * at, 1e-3 * at],
                    high: [at + size, -3.0 * at + size, 1e-3 * at],
                    first: start,
                    is_leaf: 1,
                };
                continue;
            }
            let first = nodes.len();
            nodes[index].first = first as u32;
            nodes.extend([Node::default(); 2]);
            let middle = (start + end) / 2;
            waiting.push((first, start, middle));
            waiting.push((first + 1, middle, end));
        }
        for index in order.into_iter().rev() {
            if nodes[index].is_leaf == 0 {
                let first = nodes[index].first as usize;
                let [left, right] = [nodes[first], nodes[first + 1]];
                nodes[index].low = Vec3::from(left.low).min(right.low.into()).to_array();
                nodes[index].high = Vec3::from(left.high).max(right.high.into()).to_array();
            }
        }
        nodes
    }

    #[test]
    fn every_primitive_is_in_one_place_and_in_the_boxes_above_it() {
        let binary = tree(1000);
        let wide = WideHierarchy::new(&binary);
        let mut found = Vec::new();
        for (node, sources) in wide.nodes.iter().zip(&wide.sources) {
            for (child, &source) in sources.iter().enumerate() {
                assert_eq!(source == NO_PRIMITIVE, node.children[child] == NO_PRIMITIVE);
                let Some(inner) = binary.get(source as usize) else {
                    continue;
                };
                if node.children[child] & LEAF_BIT != 0 {
                    found.push(node.children[child] ^ LEAF_BIT);
                }
                for axis in 0..3 {
                    let byte = |word: u32| f64::from(word >> (8 * child) & 255);
                    let exponent = (node.exponents >> (8 * axis) & 255) as i32 - 127;
                    let at = |word| f64::from(node.origin[axis]) + byte(word) * 2f64.powi(exponent);
                    let (low, high) = (at(node.low[axis]), at(node.high[axis]));
                    let (from, to) = (f64::from(inner.low[axis]), f64::from(inner.high[axis]));
                    let step = 2f64.powi(exponent);
                    // Half a rounding of the difference, well inside the margin of every box.
                    let slack = 6e-8 * (to - f64::from(node.origin[axis])).abs();
                    assert!(
                        low <= from + slack && to <= high + slack,
                        "{low} {from} {to} {high}"
                    );
                    assert!(from - low <= step + slack && high - to <= step + slack);
                }
            }
        }
        found.sort_unstable();
        assert_eq!(found, (0..1000).collect::<Vec<_>>());
        // A third of the inner nodes, or little more.
        assert!(wide.nodes.len() < 450, "{}", wide.nodes.len());
        assert!((9..=20).contains(&wide.most_waiting()));
    }

    #[test]
    fn one_primitive_has_a_node_and_none_has_none() {
        assert!(WideHierarchy::new(&[]).nodes.is_empty());
        assert_eq!(WideHierarchy::new(&[]).most_waiting(), 0);
        let wide = WideHierarchy::new(&tree(1));
        assert_eq!(wide.nodes.len(), 1);
        assert_eq!(
            wide.nodes[0].children,
            [LEAF_BIT, NO_PRIMITIVE, NO_PRIMITIVE, NO_PRIMITIVE]
        );
    }
}
