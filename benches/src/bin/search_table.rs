//! Photon searches per second of our structures and their peers, interleaved in one process.
//!
//! `search_table [photons] [queries]`; one thread unless `RAYON_NUM_THREADS` says otherwise, which
//! only the builds heed.

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Instant;

use caustics_accel::{HashGrid, LeftBalancedTree, NearestScratch, PhotonTree};
use caustics_benches::photons::{pixel_queries, surface_photons};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nanoflann::{KdTree, KdTreeParams, L2Simple, MatrixDataset, MatrixLayout, SearchParameters};

const ROUNDS: usize = 5;

/// The sum of what belongs to the photons found: what a radiance estimate reads.
type Sum = f64;
type Search<'a> = (&'static str, Box<dyn FnMut(&[Vec3]) -> Sum + 'a>);

fn timed<T>(name: &str, build: impl Fn() -> T) -> T {
    let mut times = Vec::new();
    let mut result = None;
    for _ in 0..3 {
        drop(result.take());
        let start = Instant::now();
        result = Some(build());
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    println!("  build {name:20} {:8.1} ms", times[1]);
    result.expect("three rounds")
}

fn run(title: &str, queries: &[Vec3], mut searches: Vec<Search<'_>>) {
    let mut times = vec![Vec::new(); searches.len()];
    let mut sums = vec![0.0; searches.len()];
    for _ in 0..ROUNDS {
        for (i, (_, search)) in searches.iter_mut().enumerate() {
            let start = Instant::now();
            sums[i] = black_box(search(queries));
            times[i].push(start.elapsed().as_secs_f64());
        }
    }
    println!("{title}");
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let kiddo = median(&mut times[0]);
    for (i, (name, _)) in searches.iter().enumerate() {
        let error = (sums[i] / sums[0] - 1.0).abs();
        assert!(
            error < 1e-4,
            "{name} sums to {} and not to {}",
            sums[i],
            sums[0]
        );
        let time = median(&mut times[i]);
        println!(
            "  {name:20} {:8.1} kqueries/s {:6.2}",
            queries.len() as f64 / time / 1e3,
            kiddo / time
        );
    }
}

fn main() {
    let argument = |i: usize, default: usize| {
        std::env::args()
            .nth(i)
            .map_or(default, |text| text.parse().expect("a number"))
    };
    let photons = surface_photons(argument(1, 1_000_000));
    let queries = pixel_queries(&photons, argument(2, 20_000));
    let payload: Vec<[f32; 3]> = (0..photons.len())
        .map(|i| [1.0, (i % 7) as f32, 0.5])
        .collect();
    let rows: Vec<[f32; 3]> = photons.iter().map(Vec3::to_array).collect();
    println!("{} photons, {} queries", photons.len(), queries.len());

    let mut ours = timed("PhotonTree", || PhotonTree::new(&photons).expect("valid"));
    let classic = timed("LeftBalancedTree", || {
        LeftBalancedTree::new(&photons).expect("valid")
    });
    let kiddo: ImmutableKdTree<f32, 3> = timed("kiddo", || {
        ImmutableKdTree::new_from_slice(&rows).expect("valid")
    });
    let flat: Vec<f32> = rows.iter().flatten().copied().collect();
    let dataset =
        MatrixDataset::new(flat, rows.len(), 3, MatrixLayout::RowMajorPoints).expect("valid");
    let nanoflann = timed("nanoflann", || {
        KdTree::new(3, &dataset, L2Simple, KdTreeParams::default()).expect("valid")
    });
    let order = ours.renumber();
    let sorted: Vec<[f32; 3]> = order.iter().map(|&i| payload[i as usize]).collect();
    println!(
        "  bytes a photon: {:.1}, classic {:.1}",
        ours.memory_bytes() as f64 / photons.len() as f64,
        classic.memory_bytes() as f64 / photons.len() as f64
    );
    let sum = |payload: &[[f32; 3]], index: u32| {
        let [r, g, b] = payload[index as usize];
        f64::from(r + g + b)
    };

    let mut scratch = NearestScratch::new();
    let mut radii = [0.0_f32; 2];
    for (radius, k) in radii.iter_mut().zip([50, 200]) {
        let all: f64 = queries
            .iter()
            .map(|&q| {
                let found = ours.nearest(q, k, f32::INFINITY, &mut scratch);
                found
                    .last()
                    .map_or(0.0, |n| f64::from(n.distance_squared).sqrt())
            })
            .sum();
        *radius = (all / queries.len() as f64) as f32;
    }
    for (k, radius) in [(50, radii[0]), (200, radii[1])] {
        for limit in [f32::INFINITY, 2.0 * radius] {
            let wanted = NonZeroUsize::new(k).expect("positive");
            let (mut scratch_a, mut scratch_b) = (NearestScratch::new(), NearestScratch::new());
            let mut searches: Vec<Search<'_>> = vec![
                (
                    "kiddo",
                    Box::new(|queries| {
                        let mut total = 0.0;
                        for q in queries {
                            let point = q.to_array();
                            let query = kiddo
                                .query(&point)
                                .nearest_n::<SquaredEuclidean<f32>>(wanted);
                            let found = if limit.is_finite() {
                                query.within(limit * limit).unsorted().execute()
                            } else {
                                query.unsorted().execute()
                            };
                            total += found.iter().map(|n| sum(&payload, n.item)).sum::<f64>();
                        }
                        total
                    }),
                ),
                (
                    "PhotonTree",
                    Box::new(|queries| {
                        let mut total = 0.0;
                        for &q in queries {
                            let found = ours.nearest(q, k, limit, &mut scratch_a);
                            total += found.iter().map(|n| sum(&sorted, n.index)).sum::<f64>();
                        }
                        total
                    }),
                ),
                (
                    "LeftBalancedTree",
                    Box::new(|queries| {
                        let mut total = 0.0;
                        for &q in queries {
                            let found = classic.nearest(q, k, limit, &mut scratch_b);
                            total += found.iter().map(|n| sum(&payload, n.index)).sum::<f64>();
                        }
                        total
                    }),
                ),
            ];
            if limit.is_infinite() {
                searches.push((
                    "nanoflann",
                    Box::new(|queries| {
                        let mut total = 0.0;
                        for q in queries {
                            let found = nanoflann.knn_search(&q.to_array(), k).expect("valid");
                            total += found
                                .iter()
                                .map(|n| sum(&payload, n.index as u32))
                                .sum::<f64>();
                        }
                        total
                    }),
                ));
            }
            run(&format!("{k} nearest within {limit}"), &queries, searches);
        }
        // The radius whose disc holds k photons on average.
        let mut counted = 0_usize;
        for &q in &queries {
            ours.within(q, radius, |_, _| counted += 1);
        }
        let radius = radius * (k as f32 * queries.len() as f32 / counted as f32).sqrt();
        let mut grid = timed("HashGrid", || {
            HashGrid::new(&photons, 2.0 * radius).expect("valid")
        });
        let grid_order = grid.renumber();
        let grid_sorted: Vec<[f32; 3]> = grid_order.iter().map(|&i| payload[i as usize]).collect();
        println!(
            "  bytes a photon: {:.1}",
            grid.memory_bytes() as f64 / photons.len() as f64
        );
        let searches: Vec<Search<'_>> = vec![
            (
                "kiddo",
                Box::new(|queries| {
                    let mut total = 0.0;
                    for q in queries {
                        let point = q.to_array();
                        let query = kiddo
                            .query(&point)
                            .within::<SquaredEuclidean<f32>>(radius * radius);
                        let found = query.unsorted().execute();
                        total += found.iter().map(|n| sum(&payload, n.item)).sum::<f64>();
                    }
                    total
                }),
            ),
            (
                "PhotonTree",
                Box::new(|queries| {
                    let mut total = 0.0;
                    for &q in queries {
                        ours.within(q, radius, |index, _| total += sum(&sorted, index));
                    }
                    total
                }),
            ),
            (
                "HashGrid",
                Box::new(|queries| {
                    let mut total = 0.0;
                    for &q in queries {
                        grid.within(q, radius, |index, _| total += sum(&grid_sorted, index));
                    }
                    total
                }),
            ),
            (
                "LeftBalancedTree",
                Box::new(|queries| {
                    let mut total = 0.0;
                    for &q in queries {
                        classic.within(q, radius, |index, _| total += sum(&payload, index));
                    }
                    total
                }),
            ),
            (
                "nanoflann",
                Box::new(|queries| {
                    let mut total = 0.0;
                    let parameters = SearchParameters {
                        sorted: false,
                        ..SearchParameters::default()
                    };
                    for q in queries {
                        let found = nanoflann
                            .radius_search_with_params(&q.to_array(), radius * radius, parameters)
                            .expect("valid");
                        total += found
                            .iter()
                            .map(|n| sum(&payload, n.index as u32))
                            .sum::<f64>();
                    }
                    total
                }),
            ),
        ];
        run(
            &format!("all within {radius}, about {k}"),
            &queries,
            searches,
        );
    }
}
