//! Nearest-neighbour and radius searches against brute force.

use caustics_accel::{
    AccelError, HashGrid, LeftBalancedTree, NearestScratch, PhotonSplits, PhotonTree,
    PhotonTreeOptions,
};
use caustics_geometry::glam::Vec3;
use proptest::prelude::*;

/// The tree over the same points with either kind of splits.
fn photon_trees(positions: &[Vec3]) -> [PhotonTree; 2] {
    [PhotonSplits::Halves, PhotonSplits::VoxelVolume].map(|splits| {
        PhotonTree::with_options(positions, &PhotonTreeOptions { splits }).expect("finite")
    })
}

/// Index and squared distance of every point, nearest first, lower index first among equals.
fn sorted(positions: &[Vec3], point: Vec3) -> Vec<(f32, u32)> {
    let mut all: Vec<(f32, u32)> = (0..)
        .zip(positions)
        .map(|(index, p)| (point.distance_squared(*p), index))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all
}

/// That a structure finds all points within a radius, once.
macro_rules! check_within {
    ($tree:expr, $positions:expr, $point:expr, $radius:expr) => {{
        let (positions, point, radius): (&[Vec3], Vec3, f32) = ($positions, $point, $radius);
        let mut expected = sorted(positions, point);
        expected.retain(|(distance_squared, _)| *distance_squared <= radius * radius);
        let mut inside = Vec::new();
        $tree.within(point, radius, |index, distance_squared| {
            inside.push((distance_squared, index));
        });
        inside.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        assert_eq!(inside, expected, "within {radius} of {point}");
    }};
}

/// Everything that a structure promises, for one query.
macro_rules! check {
    ($tree:expr, $positions:expr, $point:expr, $count:expr, $radius:expr) => {{
        let (positions, point, count, radius): (&[Vec3], Vec3, usize, f32) =
            ($positions, $point, $count, $radius);
        let mut scratch = NearestScratch::new();
        let mut expected = sorted(positions, point);
        expected.retain(|(distance_squared, _)| *distance_squared <= radius * radius);

        check_within!($tree, positions, point, radius);

        let odd: Vec<(f32, u32)> = expected
            .iter()
            .copied()
            .filter(|(_, index)| index % 2 == 1)
            .take(count)
            .collect();
        let found = $tree.nearest_where(point, count, radius, |i| i % 2 == 1, &mut scratch);
        assert_eq!(found.last().map(|n| n.index), odd.last().map(|n| n.1));
        let mut found: Vec<(f32, u32)> = found
            .iter()
            .map(|n| (n.distance_squared, n.index))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        assert_eq!(
            found, odd,
            "{count} odd ones nearest to {point} within {radius}"
        );

        expected.truncate(count);
        let found = $tree.nearest(point, count, radius, &mut scratch);
        assert_eq!(found.last().map(|n| n.index), expected.last().map(|n| n.1));
        let mut found: Vec<(f32, u32)> = found
            .iter()
            .map(|n| (n.distance_squared, n.index))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        assert_eq!(
            found, expected,
            "{count} nearest to {point} within {radius}"
        );
    }};
}

macro_rules! check_all {
    ($positions:expr, $queries:expr) => {{
        let positions: &[Vec3] = $positions;
        let left_balanced = LeftBalancedTree::new(positions).unwrap();
        let photon_trees = photon_trees(positions);
        for (point, count, radius) in $queries {
            check!(left_balanced, positions, point, count, radius);
            for photon_tree in &photon_trees {
                check!(photon_tree, positions, point, count, radius);
            }
            for cells in [0.1, 1.0, 2.0] {
                let size = (radius * cells).clamp(1e-6, 1e6);
                let grid = HashGrid::new(positions, size).unwrap();
                check_within!(grid, positions, point, radius);
            }
        }
    }};
}

/// Coordinates of which many coincide, on a scale and around a centre of their own.
fn cloud() -> impl Strategy<Value = Vec<Vec3>> {
    let coordinate = prop_oneof![(-8_i8..8).prop_map(f32::from), -8.0_f32..8.0];
    let point = prop::array::uniform3(coordinate);
    let points = prop::collection::vec(point, 0..400);
    let flat = prop::array::uniform3(prop::bool::weighted(0.8));
    let scale = prop_oneof![Just(1.0_f32), Just(1e-4), Just(1e4)];
    let centre = prop_oneof![Just(0.0_f32), Just(1000.0)];
    (points, flat, scale, centre).prop_map(|(points, flat, scale, centre)| {
        let axes = Vec3::from_array(flat.map(|kept| f32::from(u8::from(kept))));
        points
            .into_iter()
            .map(|p| Vec3::from_array(p) * axes * scale + centre)
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn searches_agree_with_brute_force(
        positions in cloud(),
        choice in any::<prop::sample::Index>(),
        offset in prop::array::uniform3(-2.0_f32..2.0),
        count in 0_usize..80,
        radius in prop_oneof![0.0_f32..10.0, Just(f32::INFINITY)],
    ) {
        let (centre, scale) = if positions.is_empty() {
            (Vec3::ZERO, 1.0)
        } else {
            let low = positions.iter().copied().reduce(Vec3::min).unwrap();
            let high = positions.iter().copied().reduce(Vec3::max).unwrap();
            (positions[choice.index(positions.len())], ((high - low).max_element() / 16.0).max(1e-6))
        };
        let off = centre + Vec3::from_array(offset) * scale;
        let queries = [(off, count, radius * scale), (centre, count, radius * scale),
            (centre, count, 0.0)];
        check_all!(&positions, queries);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn searches_in_order_find_what_single_ones_find(
        positions in cloud(),
        steps in prop::collection::vec((0_usize..400, prop::array::uniform3(-1.0_f32..1.0)), 1..30),
        step in prop_oneof![Just(0.0_f32), Just(1e-21), Just(1e-3), Just(0.3), Just(20.0)],
        count in prop_oneof![0_usize..4, 4_usize..60],
        radius in prop_oneof![Just(f32::INFINITY), Just(3.0), Just(0.0)],
        nan in 0_usize..60,
    ) {
        let mut queries: Vec<Vec3> = Vec::new();
        for (near, offset) in steps {
            // A little from the last one, or from a photon.
            let from = queries.last().copied().filter(|_| near % 3 > 0);
            let from = from.or_else(|| positions.get(near).copied()).unwrap_or(Vec3::ZERO);
            queries.push(from + Vec3::from_array(offset) * step);
        }
        if let Some(query) = queries.get_mut(nan) {
            *query = Vec3::NAN;
        }
        let by_key = |found: &[caustics_accel::Neighbour]| {
            let mut found = found.to_vec();
            found.sort_by(|a, b| {
                a.distance_squared.total_cmp(&b.distance_squared).then(a.index.cmp(&b.index))
            });
            found
        };
        let (mut scratch, mut other) = (NearestScratch::new(), NearestScratch::new());
        for tree in photon_trees(&positions) {
            let mut visited = 0;
            tree.nearest_of_each(&queries, count, radius, &mut scratch, |place, found| {
                assert_eq!(place, visited);
                visited += 1;
                let single = tree.nearest(queries[place], count, radius, &mut other);
                assert_eq!(by_key(found), by_key(single), "query {place}: {}", queries[place]);
            });
            prop_assert_eq!(visited, queries.len());
        }
    }
}

/// Thousands of points, so that large nodes are divided: crowds around some centres, each in a
/// plane or in one point or spread out.
fn crowds() -> impl Strategy<Value = Vec<Vec3>> {
    let centre = prop::array::uniform3(-8.0_f32..8.0);
    let spread = prop::array::uniform3(prop_oneof![Just(0.0_f32), 1e-4_f32..0.1, 0.1_f32..9.0]);
    let crowd = (centre, spread, 1_usize..2500);
    prop::collection::vec(crowd, 1..5).prop_map(|crowds| {
        let mut points = Vec::new();
        for (centre, spread, count) in crowds {
            points.extend((0..count as u32).map(|i| {
                let at = |factor: u32| (i.wrapping_mul(factor) >> 8) as f32 / (1 << 24) as f32;
                let within = Vec3::new(at(2_654_435_769), at(3_242_174_889), at(1_640_531_527));
                Vec3::from(centre) + within * Vec3::from(spread)
            }));
        }
        points
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn searches_of_crowds_agree_with_brute_force(
        positions in crowds(),
        choice in any::<prop::sample::Index>(),
        offset in prop::array::uniform3(-2.0_f32..2.0),
        count in 1_usize..200,
        radius in prop_oneof![0.0_f32..10.0, Just(f32::INFINITY)],
    ) {
        let photon = positions[choice.index(positions.len())];
        let off = photon + Vec3::from_array(offset);
        for photon_tree in &photon_trees(&positions) {
            for point in [photon, off] {
                check!(photon_tree, &positions, point, count, radius);
            }
        }
    }
}

#[test]
fn a_hundred_thousand_photons_in_one_point() {
    let positions = vec![Vec3::new(0.3, -0.7, 5.0); 100_000];
    let left_balanced = LeftBalancedTree::new(&positions).unwrap();
    let photon_trees = photon_trees(&positions);
    for point in [positions[0], Vec3::ZERO] {
        check!(left_balanced, &positions, point, 50, 10.0);
        for photon_tree in &photon_trees {
            check!(photon_tree, &positions, point, 50, 10.0);
        }
    }
}

#[test]
fn points_that_are_not_finite_are_errors() {
    for splits in [PhotonSplits::Halves, PhotonSplits::VoxelVolume] {
        let options = PhotonTreeOptions { splits };
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let mut positions = vec![[0.5_f32; 3]; 2000];
                positions[1500][axis] = bad;
                let error = PhotonTree::with_options(&positions, &options).unwrap_err();
                assert_eq!(error, AccelError::NonFinitePoint { point: 1500 });
            }
        }
    }
}

#[test]
fn trees_of_no_and_of_one_point() {
    let one = [Vec3::new(1.0, 2.0, 3.0)];
    for tree in photon_trees(&[]) {
        assert!(tree.is_empty());
        check!(tree, &[], Vec3::ZERO, 3, f32::INFINITY);
    }
    for tree in photon_trees(&one) {
        assert_eq!(tree.len(), 1);
        check!(tree, &one, Vec3::ZERO, 3, f32::INFINITY);
        check!(tree, &one, one[0], 1, 0.0);
        check!(tree, &one, Vec3::ZERO, 1, 1.0);
    }
}

/// A quarter of them on a wall, in an eighth of its area, the others on a floor.
fn floor_and_wall(count: u32) -> Vec<Vec3> {
    (0..count)
        .map(|i| {
            let at = |factor: u32| (i.wrapping_mul(factor) >> 8) as f32 / (1 << 24) as f32;
            let (u, v) = (at(2_654_435_769), at(3_242_174_889));
            if i % 4 == 0 {
                Vec3::new(0.0, 0.5 * u, 0.25 * v)
            } else {
                Vec3::new(u, 0.0, v * v)
            }
        })
        .collect()
}

#[test]
fn memory_is_sixteen_bytes_a_point_and_a_little() {
    let [halves, voxels] = photon_trees(&floor_and_wall(100_000));
    let full = 100_000 * 16;
    assert!((full..full * 107 / 100).contains(&halves.memory_bytes()));
    // Buckets that are not full take more, but few are.
    assert!((halves.memory_bytes()..full * 120 / 100).contains(&voxels.memory_bytes()));
}

#[test]
fn photons_on_an_axis_aligned_floor() {
    let positions: Vec<Vec3> = (0..20_000_u32)
        .map(|i| Vec3::new((i % 141) as f32 / 141.0, 0.0, (i / 141) as f32 / 141.0))
        .collect();
    let queries = (0..50).map(|i| {
        let point = Vec3::new(i as f32 / 50.0, if i % 2 == 0 { 0.0 } else { 0.01 }, 0.37);
        (point, 50, 0.1)
    });
    check_all!(&positions, queries);
}

#[test]
fn trees_do_not_depend_on_the_run() {
    let positions: Vec<Vec3> = (0..50_000_u32)
        .map(|i| {
            let hash = i.wrapping_mul(2_654_435_761);
            Vec3::new(
                (hash >> 22) as f32,
                ((hash >> 12) & 1023) as f32,
                (hash & 63) as f32,
            )
        })
        .collect();
    let orders = || {
        photon_trees(&positions).map(|tree| {
            let mut order = Vec::new();
            tree.within(Vec3::splat(30.0), 600.0, |index, _| order.push(index));
            order
        })
    };
    let first = orders();
    assert!(first.iter().all(|order| order.len() > 1000));
    for _ in 0..2 {
        assert_eq!(first, orders());
    }
}

#[test]
fn renumbered_points_keep_their_places() {
    let positions: Vec<Vec3> = (0..3000_u32)
        .map(|i| Vec3::new((i * 37 % 101) as f32, (i * 53 % 89) as f32, 1.0))
        .collect();
    let mut grid = HashGrid::new(&positions, 10.0).unwrap();
    let is_permutation = |mut former: Vec<u32>| {
        former.sort_unstable();
        former.into_iter().eq(0..positions.len() as u32)
    };
    assert!(is_permutation(grid.renumber()));
    for mut tree in photon_trees(&positions) {
        let former = tree.renumber();
        let sorted: Vec<Vec3> = former.iter().map(|&i| positions[i as usize]).collect();
        assert!(is_permutation(former));
        check!(tree, &sorted, Vec3::new(50.0, 40.0, 3.0), 77, 20.0);
    }
}
