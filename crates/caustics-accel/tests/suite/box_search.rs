//! Searches among boxes against brute force.

use caustics_accel::{AccelError, BoxTree};
use caustics_geometry::Aabb;
use caustics_geometry::glam::Vec3;
use proptest::prelude::*;

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// What the tree finds, as sorted indices of the boxes it was built from.
fn found(tree: &BoxTree, order: &[u32], query: &Aabb) -> Vec<u32> {
    let mut indices = Vec::new();
    tree.for_each_overlapping(query, |place| indices.push(order[place]));
    indices.sort_unstable();
    indices
}

fn check(boxes: &[Aabb], queries: &[Aabb]) {
    let (tree, order) = BoxTree::new(boxes).expect("finite boxes");
    let mut all = order.clone();
    all.sort_unstable();
    assert!(all.into_iter().eq(0..boxes.len() as u32));
    for query in queries {
        let expected: Vec<u32> = (0..)
            .zip(boxes)
            .filter(|(_, bounds)| overlap(bounds, query))
            .map(|(index, _)| index)
            .collect();
        assert_eq!(found(&tree, &order, query), expected, "{query:?}");
    }
}

/// Boxes of sizes from a thousandth to a thousand, some without extent along an axis.
fn any_box() -> impl Strategy<Value = Aabb> {
    let extent = prop_oneof![1 => Just(0.0f32), 4 => (-3.0f32..3.0).prop_map(|e| 10.0f32.powf(e))];
    let corner = prop::array::uniform3(-10.0f32..10.0);
    (corner, prop::array::uniform3(extent)).prop_map(|(corner, extent)| {
        let corner = Vec3::from(corner);
        Aabb::new(corner, corner + Vec3::from(extent))
    })
}

proptest! {
    #[test]
    fn finds_all_boxes_that_overlap_and_no_others(
        boxes in prop::collection::vec(any_box(), 0..200),
        queries in prop::collection::vec(any_box(), 10),
    ) {
        check(&boxes, &queries);
        // Corners lie on the boxes' own bounds.
        let corners: Vec<Aabb> = boxes.iter().map(|b| Aabb { min: b.max, max: b.max }).collect();
        check(&boxes, &corners);
    }
}

#[test]
fn many_equal_boxes_are_all_found_and_take_no_longer_than_others() {
    let boxes = vec![Aabb::new(Vec3::ZERO, Vec3::ONE); 100_000];
    let (tree, order) = BoxTree::new(&boxes).unwrap();
    let inside = Aabb::new(Vec3::splat(0.5), Vec3::splat(0.5));
    assert!(found(&tree, &order, &inside).into_iter().eq(0..100_000));
    let outside = Aabb::new(Vec3::splat(1.5), Vec3::splat(1.5));
    assert_eq!(found(&tree, &order, &outside), []);
}

#[test]
fn a_query_without_end_finds_all_and_one_that_is_no_number_nothing() {
    for count in [0, 1, 2, 9] {
        let boxes = vec![Aabb::new(Vec3::ZERO, Vec3::ONE); count];
        let (tree, order) = BoxTree::new(&boxes).unwrap();
        assert_eq!(tree.len(), count);
        assert_eq!(tree.is_empty(), count == 0);
        let endless = Aabb {
            min: Vec3::NEG_INFINITY,
            max: Vec3::INFINITY,
        };
        assert_eq!(found(&tree, &order, &endless).len(), count);
        let nowhere = Aabb {
            min: Vec3::NAN,
            max: Vec3::NAN,
        };
        assert_eq!(found(&tree, &order, &nowhere), []);
    }
}

#[test]
fn boxes_that_are_none_are_errors() {
    let good = Aabb::new(Vec3::ZERO, Vec3::ONE);
    for bad in [
        Aabb::EMPTY,
        Aabb {
            min: Vec3::NAN,
            max: Vec3::ONE,
        },
    ] {
        let result = BoxTree::new(&[good, bad]);
        assert_eq!(result.err(), Some(AccelError::InvalidBox { index: 1 }));
    }
}
