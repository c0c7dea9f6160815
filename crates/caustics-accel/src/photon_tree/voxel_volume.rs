//! Splits by the voxel volume heuristic: what queries have to look at in a cell is proportional to
//! its volume, grown by the search radius, times the points in it (Wald, Günther and Slusallek,
//! *Balancing Considered Harmful*, 2004).

use caustics_geometry::glam::Vec3A;

#[cfg(feature = "parallel")]
use super::PARALLEL_POINTS;
use super::point::{Point, bounds, widest_axis};
use super::{BUCKET, Bucket, Split};

/// Up to so many points are halved as they are: what the heuristic is good for, to keep floors from
/// walls and crowds from voids, is done by then, and buckets stay full.
const SMALL: usize = 1024;

/// Below so many levels points are halved, so that the stack of a search is deep enough for any.
const LEVELS: usize = 32;

/// Points by which cuts are compared, at most half as many more.
const SAMPLES: usize = 512;

/// Places along each axis between which points may be cut apart.
const PLACES: usize = 32;

/// Photons that a search is expected to be after, for its radius.
const WANTED: f32 = 50.0;

/// Sorts points into buckets.
pub(super) fn build(points: &mut [Point]) -> (Vec<Split>, Vec<Bucket>) {
    if points.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let mut shape = Shape::default();
    shape.divide(points, 0);
    // How much more than needed was allocated depends on the number of threads.
    shape.splits.shrink_to_fit();
    let mut buckets = vec![Bucket::EMPTY; shape.sizes.len()];
    let mut rest = &*points;
    for (bucket, &size) in buckets.iter_mut().zip(&shape.sizes) {
        let (own, others) = rest.split_at(usize::from(size));
        bucket.fill(own);
        rest = others;
    }
    (shape.splits, buckets)
}

/// Nodes of a subtree and numbers of points in its buckets. Both say nothing about where they lie,
/// so that subtrees are put together by putting them one behind the other.
#[derive(Default)]
struct Shape {
    splits: Vec<Split>,
    sizes: Vec<u8>,
}

impl Shape {
    /// Returns the least and the greatest coordinates.
    fn divide(&mut self, points: &mut [Point], level: usize) -> (Vec3A, Vec3A) {
        let count = points.len();
        let (low, high) = bounds(points);
        if count <= BUCKET {
            self.sizes.push(count as u8);
            return (low, high);
        }
        let cut = (count > SMALL && level < LEVELS)
            .then(|| Cut::best(points, low, high))
            .flatten()
            .map(|cut| (cut.axis, cut.partition(points)))
            // That the sample is divided does not say that enough of the others are.
            .filter(|&(_, left)| left >= BUCKET && count - left >= BUCKET);
        let (axis, left_count) = cut.unwrap_or_else(|| {
            let axis = widest_axis(high - low);
            let left_count = count.div_ceil(BUCKET).div_ceil(2) * BUCKET;
            points
                .select_nth_unstable_by(left_count, |a, b| a.along(axis).total_cmp(&b.along(axis)));
            (axis, left_count)
        });
        let (left, right) = points.split_at_mut(left_count);
        let (root, first) = (self.splits.len(), self.sizes.len());
        self.splits.push(Split::EMPTY);
        let split = |left_buckets, left: (Vec3A, Vec3A), right: (Vec3A, Vec3A)| {
            Split::new(axis, left_buckets, left.1[axis], right.0[axis])
        };
        #[cfg(feature = "parallel")]
        if count > PARALLEL_POINTS {
            let mut behind = Self::default();
            let (left, right) = rayon::join(
                || self.divide(left, level + 1),
                || behind.divide(right, level + 1),
            );
            self.splits[root] = split(self.sizes.len() - first, left, right);
            self.splits.append(&mut behind.splits);
            self.sizes.append(&mut behind.sizes);
            return (low, high);
        }
        let left = self.divide(left, level + 1);
        let left_buckets = self.sizes.len() - first;
        let right = self.divide(right, level + 1);
        self.splits[root] = split(left_buckets, left, right);
        (low, high)
    }
}

/// Where points are cut apart.
struct Cut {
    axis: usize,
    places: Places,
    /// The first place on the right.
    right: usize,
}

/// Places of equal length along an axis.
#[derive(Clone, Copy)]
struct Places {
    low: f32,
    in_a_metre: f32,
}

impl Places {
    /// The coordinate in units of a place; NaN where the extent is too large or too small for an
    /// `f32`.
    #[inline(always)]
    fn along(self, coordinate: f32) -> f32 {
        (coordinate - self.low) * self.in_a_metre
    }

    /// The place, of NaN the first.
    #[inline(always)]
    fn place(self, coordinate: f32) -> usize {
        (self.along(coordinate) as usize).min(PLACES - 1)
    }
}

impl Cut {
    /// The cut with the least cost by a sample of the points, if there is any.
    fn best(points: &[Point], low: Vec3A, high: Vec3A) -> Option<Self> {
        let extent = (high - low).to_array();
        let places: [Places; 3] = std::array::from_fn(|axis| Places {
            low: low[axis],
            in_a_metre: PLACES as f32 / extent[axis],
        });
        let mut counts = [[0_u32; PLACES]; 3];
        for point in points.iter().step_by((points.len() / SAMPLES).max(1)) {
            for axis in 0..3 {
                counts[axis][places[axis].place(point.along(axis))] += 1;
            }
        }
        let samples: u32 = counts[0].iter().sum();
        // Of the circle that holds as many as wanted, were the points spread over the largest side
        // of their box: photons lie on surfaces.
        let [x, y, z] = extent;
        let side = (x * y).max(y * z).max(z * x);
        let radius = (WANTED / std::f32::consts::PI * side / points.len() as f32).sqrt();
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3].map(|other| extent[other] + 2.0 * radius);
            let mut left = 0;
            for right in 1..PLACES {
                left += counts[axis][right - 1];
                let length = extent[axis] * (right as f32 / PLACES as f32);
                let cost = a
                    * b
                    * ((length + 2.0 * radius) * left as f32
                        + (extent[axis] - length + 2.0 * radius) * (samples - left) as f32);
                if left > 0 && left < samples && cost < least {
                    least = cost;
                    best = Some(Self {
                        axis,
                        places: places[axis],
                        right,
                    });
                }
            }
        }
        best
    }

    /// Puts the points on the left first and returns how many they are.
    fn partition(&self, points: &mut [Point]) -> usize {
        let mut left = 0;
        let limit = self.right as f32;
        for place in 0..points.len() {
            // NaN is on the left, as by its place.
            let is_right = self.places.along(points[place].along(self.axis)) >= limit;
            // Swapped in any case: nobody foresees on which side a point is.
            points.swap(left, place);
            left += usize::from(!is_right);
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use crate::{PhotonSplits, PhotonTree, PhotonTreeOptions};

    use super::{BUCKET, LEVELS};

    /// The most splits on one path.
    fn depth(tree: &PhotonTree) -> usize {
        let mut deepest = 0;
        let mut waiting = vec![(tree.root(), 0)];
        while let Some((subtree, above)) = waiting.pop() {
            deepest = deepest.max(above);
            if subtree.buckets > 1 {
                let (left, right) = subtree.children(&tree.splits[subtree.split as usize]);
                waiting.extend([(left, above + 1), (right, above + 1)]);
            }
        }
        deepest
    }

    fn tree(positions: &[[f32; 3]]) -> PhotonTree {
        let options = PhotonTreeOptions {
            splits: PhotonSplits::VoxelVolume,
        };
        let tree = PhotonTree::with_options(positions, &options).unwrap();
        assert!(tree.is_valid());
        tree
    }

    #[test]
    fn a_wall_is_cut_off_from_a_floor() {
        // A thousand on the wall x = 0, three thousand on the floor y = 0.
        let wall = (0..1000_u32).map(|i| [0.0, (i % 31 + 1) as f32, (i / 31) as f32]);
        let floor = (0..3000_u32).map(|i| [(i % 53 + 2) as f32, 0.0, (i / 53) as f32]);
        let positions: Vec<[f32; 3]> = wall.chain(floor).collect();
        let root = tree(&positions).splits[0];
        // Either coordinate tells them apart, and halves along z, the longest side, would not.
        assert!(
            (root.axis() == 0 && (root.left, root.right) == (0.0, 2.0))
                || (root.axis() == 1 && (root.left, root.right) == (0.0, 1.0)),
            "{root:?}"
        );
        assert!(
            PhotonTree::with_options(
                &positions,
                &PhotonTreeOptions {
                    splits: PhotonSplits::Halves
                }
            )
            .is_ok_and(|halved| halved.splits[0].axis() == 2)
        );
    }

    #[test]
    fn lopsided_trees_are_no_deeper_than_the_stack() {
        // Each octave as full as the others, so that every cut takes off a few of many.
        let octaves: Vec<[f32; 3]> = (0..40_000)
            .map(|i| [((i as f32 / 40_000.0 - 0.5) * 240.0).exp2(), 0.0, 0.0])
            .collect();
        let depth = depth(&tree(&octaves));
        assert!(depth <= LEVELS + 12, "{depth} levels");
        assert!(depth > 12, "{depth} levels");
    }

    #[test]
    fn extents_beyond_single_precision_are_halved() {
        let far: Vec<[f32; 3]> = (0..3000)
            .map(|i| {
                [
                    if i % 2 == 0 { f32::MAX } else { f32::MIN },
                    i as f32 * 1e-42,
                    0.0,
                ]
            })
            .collect();
        assert!(tree(&far).buckets.len() <= far.len() / (BUCKET / 2));
        assert_eq!(tree(&[]).buckets.len(), 0);
        assert_eq!(tree(&[[1.0; 3]]).buckets.len(), 1);
    }
}
