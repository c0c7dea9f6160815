//! The same structures on any number of threads.

use crate::common;

use caustics_accel::{
    BvhOptions, BvhPreset, KdTreeOptions, LeftBalancedTree, PhotonSplits, PhotonTree,
    PhotonTreeOptions, TriangleBvh, TriangleKdTree,
};
use caustics_geometry::glam::Vec3;
use common::icosphere;

/// What something looks like when it is made on so many threads.
fn on<T: std::fmt::Debug>(threads: usize, make: impl FnOnce() -> T + Send) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(|| format!("{:?}", make()))
}

fn assert_same<T: std::fmt::Debug>(make: impl Fn() -> T + Send + Sync) {
    let expected = on(1, &make);
    for threads in [2, 3, 8] {
        assert!(on(threads, &make) == expected, "{threads} threads");
    }
}

#[test]
fn trees_over_triangles_do_not_depend_on_threads() {
    // Large enough to be divided more than once.
    let (positions, triangles) = icosphere(5, Vec3::ZERO);
    for preset in [
        BvhPreset::FastestBuild,
        BvhPreset::FastBuild,
        BvhPreset::Balanced,
        BvhPreset::FastTrace,
    ] {
        let options = BvhOptions {
            preset,
            ..BvhOptions::default()
        };
        assert_same(|| TriangleBvh::new(&positions, &triangles, &options));
    }
    assert_same(|| TriangleKdTree::new(&positions, &triangles, &KdTreeOptions::default()));
    let bent: Vec<Vec3> = positions
        .iter()
        .map(|p| *p + 0.1 * Vec3::new(p.y.sin(), p.z.sin(), p.x.sin()))
        .collect();
    assert_same(|| {
        let mut tree = TriangleBvh::new(&positions, &triangles, &BvhOptions::default())?;
        tree.refit(&bent, &triangles)?;
        Ok::<_, caustics_accel::AccelError>(tree)
    });
}

#[test]
fn trees_over_photons_do_not_depend_on_threads() {
    let photons: Vec<Vec3> = (0..100_000_u32)
        .map(|i| {
            let a = i as f32;
            // Many alike, and many in a plane.
            Vec3::new((a * 0.37).sin(), 0.0, (a * 0.011).cos()) * f32::from(u8::from(i % 7 != 0))
        })
        .collect();
    for splits in [PhotonSplits::Halves, PhotonSplits::VoxelVolume] {
        assert_same(|| PhotonTree::with_options(&photons, &PhotonTreeOptions { splits }));
    }
    assert_same(|| LeftBalancedTree::new(&photons));
}
