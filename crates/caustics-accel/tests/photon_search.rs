//! Nearest-neighbour and radius searches against brute force.

use caustics_accel::{HashGrid, LeftBalancedTree, NearestScratch, PhotonTree};
use caustics_geometry::glam::Vec3;
use proptest::prelude::*;

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
        let photon_tree = PhotonTree::new(positions).unwrap();
        for (point, count, radius) in $queries {
            check!(left_balanced, positions, point, count, radius);
            check!(photon_tree, positions, point, count, radius);
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
        let tree = PhotonTree::new(&positions).unwrap();
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

#[test]
fn a_hundred_thousand_photons_in_one_point() {
    let positions = vec![Vec3::new(0.3, -0.7, 5.0); 100_000];
    let left_balanced = LeftBalancedTree::new(&positions).unwrap();
    let photon_tree = PhotonTree::new(&positions).unwrap();
    for point in [positions[0], Vec3::ZERO] {
        check!(left_balanced, &positions, point, 50, 10.0);
        check!(photon_tree, &positions, point, 50, 10.0);
    }
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
    let mut orders = Vec::new();
    for _ in 0..3 {
        let tree = PhotonTree::new(&positions).unwrap();
        let mut order = Vec::new();
        tree.within(Vec3::splat(30.0), 600.0, |index, _| order.push(index));
        orders.push(order);
    }
    assert!(orders[0].len() > 1000);
    assert_eq!(orders[0], orders[1]);
    assert_eq!(orders[0], orders[2]);
}

#[test]
fn renumbered_points_keep_their_places() {
    let positions: Vec<Vec3> = (0..1000_u32)
        .map(|i| Vec3::new((i * 37 % 101) as f32, (i * 53 % 89) as f32, 1.0))
        .collect();
    let mut tree = PhotonTree::new(&positions).unwrap();
    let mut grid = HashGrid::new(&positions, 10.0).unwrap();
    for former in [tree.renumber(), grid.renumber()] {
        let mut all = former.clone();
        all.sort_unstable();
        assert!(all.iter().copied().eq(0..1000));
    }
    let sorted: Vec<Vec3> = PhotonTree::new(&positions)
        .unwrap()
        .renumber()
        .iter()
        .map(|&i| positions[i as usize])
        .collect();
    check!(tree, &sorted, Vec3::new(50.0, 40.0, 3.0), 77, 20.0);
}
