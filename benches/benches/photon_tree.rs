//! Photon searches: ours, kiddo and nanoflann. Each peer's answers are compared with ours before
//! it is timed.

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Duration;

use caustics_accel::{HashGrid, LeftBalancedTree, NearestScratch, PhotonTree};
use caustics_benches::photons::{pixel_queries, surface_photons};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nanoflann::{KdTree, KdTreeParams, L2Simple, MatrixDataset, MatrixLayout};

const QUERIES: usize = 4096;

fn searches(criterion: &mut Criterion, photons: &[Vec3]) {
    let millions = photons.len() as f32 / 1e6;
    let queries = pixel_queries(photons, QUERIES);
    let rows: Vec<[f32; 3]> = photons.iter().map(Vec3::to_array).collect();
    let tree = PhotonTree::new(photons).expect("finite");
    let classic = LeftBalancedTree::new(photons).expect("finite");
    let kiddo: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&rows).expect("finite");
    let flat = rows.iter().flatten().copied().collect();
    let data = MatrixDataset::new(flat, rows.len(), 3, MatrixLayout::RowMajorPoints).expect("rows");
    let nanoflann = KdTree::new(3, &data, L2Simple, KdTreeParams::default()).expect("finite");
    let mut scratch = NearestScratch::new();

    for count in [50, 200] {
        let wanted = NonZeroUsize::new(count).expect("positive");
        let kiddo_nearest = |q: &Vec3| {
            let point = q.to_array();
            kiddo
                .query(&point)
                .nearest_n::<SquaredEuclidean<f32>>(wanted)
                .unsorted()
                .execute()
        };
        let mut radius = 0.0;
        for q in &queries {
            let found = tree.nearest(*q, count, f32::INFINITY, &mut scratch);
            let farthest = found.last().map_or(0.0, |n| n.distance_squared);
            let theirs = kiddo_nearest(q)
                .iter()
                .map(|n| n.distance)
                .fold(0.0, f32::max);
            assert!((farthest - theirs).abs() <= 1e-5 * farthest, "kiddo at {q}");
            let theirs = nanoflann.knn_search(&q.to_array(), count).expect("a query");
            let theirs = theirs.iter().map(|n| n.distance).fold(0.0, f32::max);
            assert!(
                (farthest - theirs).abs() <= 1e-5 * farthest,
                "nanoflann at {q}"
            );
            radius += farthest.sqrt() / queries.len() as f32;
        }
        let mut group = criterion.benchmark_group(format!("{count} nearest of {millions}M"));
        group.throughput(Throughput::Elements(queries.len() as u64));
        group.bench_function("PhotonTree", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(tree.nearest(*q, count, f32::INFINITY, &mut scratch));
                }
            });
        });
        group.bench_function("PhotonTree, limited", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(tree.nearest(*q, count, 2.0 * radius, &mut scratch));
                }
            });
        });
        group.bench_function("LeftBalancedTree", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(classic.nearest(*q, count, f32::INFINITY, &mut scratch));
                }
            });
        });
        group.bench_function("kiddo", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(kiddo_nearest(q));
                }
            });
        });
        group.bench_function("nanoflann", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(nanoflann.knn_search(&q.to_array(), count).expect("a query"));
                }
            });
        });
        group.finish();

        let grid = HashGrid::new(photons, 2.0 * radius).expect("finite");
        let kiddo_within = |q: &Vec3| {
            let point = q.to_array();
            let query = kiddo
                .query(&point)
                .within::<SquaredEuclidean<f32>>(radius * radius);
            query.unsorted().execute()
        };
        for q in &queries {
            let (mut ours, mut gridded) = (0, 0);
            tree.within(*q, radius, |_, _| ours += 1);
            grid.within(*q, radius, |_, _| gridded += 1);
            assert_eq!(ours, gridded, "hash grid at {q}");
            assert!(kiddo_within(q).len().abs_diff(ours) <= 1, "kiddo at {q}");
        }
        let mut group = criterion.benchmark_group(format!("radius of {count} in {millions}M"));
        group.throughput(Throughput::Elements(queries.len() as u64));
        group.bench_function("PhotonTree", |bencher| {
            bencher.iter(|| {
                let mut sum = 0.0;
                for q in &queries {
                    tree.within(*q, radius, |_, distance_squared| sum += distance_squared);
                }
                sum
            });
        });
        group.bench_function("HashGrid", |bencher| {
            bencher.iter(|| {
                let mut sum = 0.0;
                for q in &queries {
                    grid.within(*q, radius, |_, distance_squared| sum += distance_squared);
                }
                sum
            });
        });
        group.bench_function("kiddo", |bencher| {
            bencher.iter(|| {
                for q in &queries {
                    black_box(kiddo_within(q));
                }
            });
        });
        group.finish();
    }

    let mut group = criterion.benchmark_group(format!("build of {millions}M"));
    group.throughput(Throughput::Elements(photons.len() as u64));
    group.bench_function("PhotonTree", |bencher| {
        bencher.iter(|| PhotonTree::new(photons));
    });
    group.bench_function("LeftBalancedTree", |bencher| {
        bencher.iter(|| LeftBalancedTree::new(photons));
    });
    group.bench_function("HashGrid", |bencher| {
        bencher.iter(|| HashGrid::new(photons, 0.01));
    });
    group.bench_function("kiddo", |bencher| {
        bencher.iter(|| ImmutableKdTree::<f32, 3>::new_from_slice(&rows).expect("finite"));
    });
    group.finish();
}

fn all(criterion: &mut Criterion) {
    for count in [100_000, 1_000_000] {
        searches(criterion, &surface_photons(count));
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    targets = all
}
criterion_main!(benches);
