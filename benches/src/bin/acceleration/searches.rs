//! Times of searches for photons near a point.

use caustics_accel::{HashGrid, LeftBalancedTree, NearestScratch, PhotonTree, PhotonTreeOptions};
#[cfg(feature = "nanoflann-cpp")]
use caustics_benches::nanoflann_cpp::Nanoflann;
use caustics_benches::photons::{pixel_queries, surface_photons};
use caustics_benches::stage::Failure;
use glam::Vec3;
use kiddo::ImmutableKdTree;
use nanoflann::{KdTree, KdTreeParams, L2Simple, MatrixDataset, MatrixLayout};
use rayon::prelude::*;

use crate::arguments::Arguments;
use crate::contest::{Contestant, Time, medians, pool};
use crate::searchers::{Field, KINDS, Payload, Question, Renumbered, reordered};
use crate::tables::{Table, figures};

/// Queries that a thread takes at a time.
const CHUNK: usize = 256;

/// Times of builds and of answers to one question.
struct Column {
    title: String,
    /// For each number of threads.
    times: Vec<Vec<Time>>,
}

fn build_times(photons: &[Vec3], cell: f32, arguments: &Arguments) -> Result<Column, Failure> {
    let rows: Vec<[f32; 3]> = photons.iter().map(Vec3::to_array).collect();
    let flat: Vec<f32> = rows.iter().flatten().copied().collect();
    let dataset = MatrixDataset::new(flat, rows.len(), 3, MatrixLayout::RowMajorPoints)?;
    let mut times = Vec::new();
    for &threads in arguments.threads() {
        times.push(pool(threads)?.install(|| {
            let mut contestants = vec![
                Contestant::new("kiddo", || {
                    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&rows);
                    u64::from(tree.is_ok())
                }),
                #[cfg(feature = "nanoflann-cpp")]
                Contestant::new("nanoflann", || {
                    let _tree = Nanoflann::new(&rows);
                    1
                }),
                Contestant::new("nanoflann crate", || {
                    let tree = KdTree::new(3, &dataset, L2Simple, KdTreeParams::default());
                    u64::from(tree.is_ok())
                }),
            ];
            contestants.extend(KINDS.map(|(splits, name, _)| {
                Contestant::new(name, move || {
                    PhotonTree::with_options(photons, &PhotonTreeOptions { splits })
                        .map_or(0, |tree| tree.len() as u64)
                })
            }));
            contestants.push(Contestant::new("**LeftBalancedTree**", || {
                LeftBalancedTree::new(photons).map_or(0, |tree| tree.len() as u64)
            }));
            contestants.push(Contestant::new("**HashGrid**", || {
                HashGrid::new(photons, cell).map_or(0, |grid| grid.len() as u64)
            }));
            medians(contestants, arguments.patience())
        }));
    }
    Ok(Column {
        title: "build, ms".to_owned(),
        times,
    })
}

pub(crate) fn measure(arguments: &Arguments) -> Result<Vec<(&'static str, String)>, Failure> {
    let sizes: &[(&str, usize)] = &[
        ("searches-100k", 100_000),
        ("searches-1m", 1_000_000),
        ("searches-5m", 5_000_000),
    ];
    let mut tables = Vec::new();
    for &(name, count) in sizes {
        if arguments.is_quick && count > 100_000 {
            continue;
        }
        tables.push((name, of_size(count, arguments)?));
        eprintln!("searched {count} photons");
    }
    Ok(tables)
}

fn of_size(count: usize, arguments: &Arguments) -> Result<String, Failure> {
    let photons = surface_photons(count);
    let queries = pixel_queries(&photons, if arguments.is_quick { 4096 } else { 16_384 });
    let payload: Payload = (0..count).map(|i| [1.0, (i % 7) as f32, 0.5]).collect();
    let rows: Vec<[f32; 3]> = photons.iter().map(Vec3::to_array).collect();
    let flat: Vec<f32> = rows.iter().flatten().copied().collect();
    let dataset = MatrixDataset::new(flat, count, 3, MatrixLayout::RowMajorPoints)?;
    let mut ours = Vec::new();
    for (splits, ..) in KINDS {
        let mut tree = PhotonTree::with_options(&photons, &PhotonTreeOptions { splits })?;
        let payload = reordered(&payload, &tree.renumber());
        ours.push(Renumbered { tree, payload });
    }
    let tree = &ours[0].tree;
    // The mean distance of the 50th and of the 200th nearest photon, and the radii that hold as
    // many photons on average.
    let mut scratch = NearestScratch::new();
    let mut distances = [0.0_f32; 2];
    let mut radii = [0.0_f32; 2];
    for (place, k) in [50, 200].into_iter().enumerate() {
        let mut total = 0.0;
        for &q in &queries {
            let found = tree.nearest(q, k, f32::INFINITY, &mut scratch);
            total += found
                .last()
                .map_or(0.0, |n| f64::from(n.distance_squared).sqrt());
        }
        distances[place] = (total / queries.len() as f64) as f32;
        let mut counted = 0_usize;
        for &q in &queries {
            tree.within(q, distances[place], |_, _| counted += 1);
        }
        let wanted = (k * queries.len()) as f32 / counted as f32;
        radii[place] = distances[place] * wanted.sqrt();
    }
    let grid_of = |radius: f32| -> Result<(HashGrid, Payload), Failure> {
        let mut grid = HashGrid::new(&photons, 2.0 * radius)?;
        let order = grid.renumber();
        let payload = reordered(&payload, &order);
        Ok((grid, payload))
    };
    let field = Field {
        ours,
        classic: LeftBalancedTree::new(&photons)?,
        grids: [grid_of(radii[0])?, grid_of(radii[1])?],
        kiddo: ImmutableKdTree::new_from_slice(&rows).map_err(|error| format!("{error:?}"))?,
        nanoflann: KdTree::new(3, &dataset, L2Simple, KdTreeParams::default())?,
        #[cfg(feature = "nanoflann-cpp")]
        original: Nanoflann::new(&rows),
        payload,
    };
    let ask = |title, count, radius, grid| Question {
        title,
        count,
        radius,
        grid,
    };
    let questions = [
        ask("50 nearest", Some(50), f32::INFINITY, 0),
        ask("200 nearest", Some(200), f32::INFINITY, 0),
        ask("50 nearest, limited", Some(50), 2.0 * distances[0], 0),
        ask("200 nearest, limited", Some(200), 2.0 * distances[1], 0),
        ask("all within r50", None, radii[0], 0),
        ask("all within r200", None, radii[1], 1),
    ];
    let mut columns = vec![build_times(&photons, 2.0 * radii[0], arguments)?];
    for question in questions {
        columns.push(ask_all(&field, question, &queries, arguments)?);
    }
    let mut memory = vec![
        ("**LeftBalancedTree**", field.classic.memory_bytes()),
        ("**HashGrid**", field.grids[0].0.memory_bytes()),
    ];
    memory.extend(
        KINDS
            .iter()
            .zip(&field.ours)
            .map(|(&(_, name, _), ours)| (name, ours.tree.memory_bytes())),
    );
    let bytes_of = |name: &str| {
        let own = memory.iter().find(|of| of.0 == name)?;
        Some(own.1 as f64 / count as f64)
    };
    Ok(table(&columns, queries.len(), bytes_of))
}

/// Asks every structure, after checking that all answers are the same.
fn ask_all(
    field: &Field<'_>,
    question: Question,
    queries: &[Vec3],
    arguments: &Arguments,
) -> Result<Column, Failure> {
    let searchers = field.searchers(question);
    let expected = searchers[0].1(queries);
    for (name, search) in &searchers {
        let found = search(queries);
        // At equal distances, or at the radius to rounding, one photon may stand for another.
        if (found / expected - 1.0).abs() > 1e-4 {
            let title = question.title;
            return Err(format!("{title}: {name} sums to {found} and not to {expected}").into());
        }
    }
    let mut times = Vec::new();
    for &threads in arguments.threads() {
        let pool = pool(threads)?;
        let contestants = searchers.iter().map(|(name, search)| {
            let pool = &pool;
            Contestant::new(name, move || {
                let total: f64 = pool.install(|| queries.par_chunks(CHUNK).map(search).sum());
                total as u64
            })
        });
        times.push(medians(contestants.collect(), arguments.patience()));
    }
    Ok(Column {
        title: question.title.to_owned(),
        times,
    })
}

/// Builds in milliseconds; searches in thousands a second and relative to kiddo on one thread;
/// bytes a photon.
fn table(columns: &[Column], queries: usize, bytes_of: impl Fn(&str) -> Option<f64>) -> String {
    let mut header = vec!["1 / 2 threads".to_owned()];
    header.extend(columns.iter().map(|column| column.title.clone()));
    header.push("bytes a photon".to_owned());
    let mut table = Table::new(&header);
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in columns.iter().flat_map(|column| &column.times[0]) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    for name in names {
        let mut cells = vec![name.to_owned()];
        for (place, column) in columns.iter().enumerate() {
            let seconds_of = |times: &[Time], name: &str| {
                times.iter().find(|time| time.0 == name).map(|time| time.1)
            };
            let all: Vec<f64> = column
                .times
                .iter()
                .filter_map(|times| seconds_of(times, name))
                .collect();
            let Some(&first) = all.first() else {
                cells.push(String::new());
                continue;
            };
            let shown: Vec<String> = all
                .iter()
                .map(|seconds| {
                    figures(if place == 0 {
                        seconds * 1e3
                    } else {
                        queries as f64 / seconds / 1e3
                    })
                })
                .collect();
            let ratio = seconds_of(&column.times[0], "kiddo").map_or(1.0, |kiddo| kiddo / first);
            cells.push(format!("{} (**{}**)", shown.join(" / "), figures(ratio)));
        }
        cells.push(bytes_of(name).map_or_else(String::new, figures));
        table.row(&cells);
    }
    table.finish()
}
