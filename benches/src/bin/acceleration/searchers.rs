//! All that finds photons, made to answer the same questions.

use std::num::NonZeroUsize;

use caustics_accel::{HashGrid, LeftBalancedTree, NearestScratch, PhotonSplits, PhotonTree};
#[cfg(feature = "nanoflann-cpp")]
use caustics_benches::nanoflann_cpp::{FoundList, Nanoflann};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nanoflann::{KdTree, L2Simple, MatrixDataset, SearchParameters};

/// What belongs to a photon: flux in three colours.
pub(crate) type Payload = Vec<[f32; 3]>;

/// A way to answer queries, which returns the sum of what belongs to the photons found: what a
/// radiance estimate reads.
pub(crate) type Searcher<'a> = (&'static str, Box<dyn Fn(&[Vec3]) -> f64 + Sync + 'a>);

/// Our trees by where they split: the rows' names of single searches and of those in order.
pub(crate) const KINDS: [(PhotonSplits, &str, &str); 2] = [
    (
        PhotonSplits::Halves,
        "**PhotonTree**",
        "**PhotonTree, in order**",
    ),
    (
        PhotonSplits::VoxelVolume,
        "**PhotonTree, by volume**",
        "**PhotonTree, by volume, in order**",
    ),
];

/// A photon tree, and what belongs to the photons in its order.
pub(crate) struct Renumbered {
    pub(crate) tree: PhotonTree,
    pub(crate) payload: Payload,
}

/// Photons and everything that finds them, and what belongs to them in each one's order.
pub(crate) struct Field<'a> {
    /// In the order of [`KINDS`].
    pub(crate) ours: Vec<Renumbered>,
    pub(crate) classic: LeftBalancedTree,
    pub(crate) grids: [(HashGrid, Payload); 2],
    pub(crate) kiddo: ImmutableKdTree<f32, 3>,
    pub(crate) nanoflann: KdTree<'a, f32, MatrixDataset<f32>, L2Simple>,
    #[cfg(feature = "nanoflann-cpp")]
    pub(crate) original: Nanoflann<'a>,
    pub(crate) payload: Payload,
}

fn sum(payload: &[[f32; 3]], index: u32) -> f64 {
    let [r, g, b] = payload[index as usize];
    f64::from(r + g + b)
}

pub(crate) fn reordered(payload: &Payload, order: &[u32]) -> Payload {
    order.iter().map(|&i| payload[i as usize]).collect()
}

/// A question: how many photons at most, or all, within what radius.
#[derive(Clone, Copy)]
pub(crate) struct Question {
    pub(crate) title: &'static str,
    pub(crate) count: Option<usize>,
    pub(crate) radius: f32,
    /// Which of the grids has cells of a size for it.
    pub(crate) grid: usize,
}

impl Field<'_> {
    pub(crate) fn searchers(&self, question: Question) -> Vec<Searcher<'_>> {
        let Question { count, radius, .. } = question;
        let mut searchers: Vec<Searcher<'_>> = Vec::new();
        if let Some(count) = count {
            let wanted = NonZeroUsize::new(count).expect("positive");
            searchers.push((
                "kiddo",
                Box::new(move |queries| {
                    let total = queries.iter().map(|q| {
                        let point = q.to_array();
                        let query = self
                            .kiddo
                            .query(&point)
                            .nearest_n::<SquaredEuclidean<f32>>(wanted);
                        let found = if radius.is_finite() {
                            query.within(radius * radius).unsorted().execute()
                        } else {
                            query.unsorted().execute()
                        };
                        found
                            .iter()
                            .map(|n| sum(&self.payload, n.item))
                            .sum::<f64>()
                    });
                    total.sum()
                }),
            ));
            if radius.is_infinite() {
                #[cfg(feature = "nanoflann-cpp")]
                searchers.push((
                    "nanoflann",
                    Box::new(move |queries| {
                        let (mut indices, mut distances) = (Vec::new(), Vec::new());
                        let total = queries.iter().map(|q| {
                            let point = q.to_array();
                            self.original
                                .nearest(point, count, &mut indices, &mut distances);
                            let found = indices.iter();
                            found.map(|&index| sum(&self.payload, index)).sum::<f64>()
                        });
                        total.sum()
                    }),
                ));
                searchers.push((
                    "nanoflann crate",
                    Box::new(move |queries| {
                        let total = queries.iter().map(|q| {
                            let found = self.nanoflann.knn_search(&q.to_array(), count);
                            let found = found.expect("a valid query");
                            found
                                .iter()
                                .map(|n| sum(&self.payload, n.index as u32))
                                .sum::<f64>()
                        });
                        total.sum()
                    }),
                ));
            }
            for (Renumbered { tree, payload }, (_, single, in_order)) in self.ours.iter().zip(KINDS)
            {
                searchers.push((
                    single,
                    Box::new(move |queries| {
                        let mut scratch = NearestScratch::new();
                        let total = queries.iter().map(|&q| {
                            let found = tree.nearest(q, count, radius, &mut scratch);
                            found.iter().map(|n| sum(payload, n.index)).sum::<f64>()
                        });
                        total.sum()
                    }),
                ));
                searchers.push((
                    in_order,
                    Box::new(move |queries| {
                        let mut scratch = NearestScratch::new();
                        let mut total = 0.0;
                        tree.nearest_of_each(queries, count, radius, &mut scratch, |_, found| {
                            total += found.iter().map(|n| sum(payload, n.index)).sum::<f64>();
                        });
                        total
                    }),
                ));
            }
            searchers.push((
                "**LeftBalancedTree**",
                Box::new(move |queries| {
                    let mut scratch = NearestScratch::new();
                    let total = queries.iter().map(|&q| {
                        let found = self.classic.nearest(q, count, radius, &mut scratch);
                        found
                            .iter()
                            .map(|n| sum(&self.payload, n.index))
                            .sum::<f64>()
                    });
                    total.sum()
                }),
            ));
            return searchers;
        }
        searchers.push((
            "kiddo",
            Box::new(move |queries| {
                let total = queries.iter().map(|q| {
                    let point = q.to_array();
                    let query = self
                        .kiddo
                        .query(&point)
                        .within::<SquaredEuclidean<f32>>(radius * radius);
                    let found = query.unsorted().execute();
                    found
                        .iter()
                        .map(|n| sum(&self.payload, n.item))
                        .sum::<f64>()
                });
                total.sum()
            }),
        ));
        let parameters = SearchParameters {
            sorted: false,
            ..SearchParameters::default()
        };
        #[cfg(feature = "nanoflann-cpp")]
        searchers.push((
            "nanoflann",
            Box::new(move |queries| {
                let mut list = FoundList::new();
                let total = queries.iter().map(|q| {
                    let found = self.original.within(q.to_array(), radius, &mut list);
                    let found = found.iter().map(|found| found.index);
                    found.map(|index| sum(&self.payload, index)).sum::<f64>()
                });
                total.sum()
            }),
        ));
        searchers.push((
            "nanoflann crate",
            Box::new(move |queries| {
                let total = queries.iter().map(|q| {
                    let found = self.nanoflann.radius_search_with_params(
                        &q.to_array(),
                        radius * radius,
                        parameters,
                    );
                    let found = found.expect("a valid query");
                    found
                        .iter()
                        .map(|n| sum(&self.payload, n.index as u32))
                        .sum::<f64>()
                });
                total.sum()
            }),
        ));
        for (Renumbered { tree, payload }, (_, single, _)) in self.ours.iter().zip(KINDS) {
            searchers.push((
                single,
                Box::new(move |queries| {
                    let total = queries.iter().map(|&q| {
                        tree.fold_within(q, radius, 0.0, |total, index, _| {
                            total + sum(payload, index)
                        })
                    });
                    total.sum()
                }),
            ));
        }
        searchers.push((
            "**LeftBalancedTree**",
            Box::new(move |queries| {
                let mut total = 0.0;
                for &q in queries {
                    self.classic
                        .within(q, radius, |index, _| total += sum(&self.payload, index));
                }
                total
            }),
        ));
        let (grid, payload) = &self.grids[question.grid];
        searchers.push((
            "**HashGrid**",
            Box::new(move |queries| {
                let mut total = 0.0;
                for &q in queries {
                    grid.within(q, radius, |index, _| total += sum(payload, index));
                }
                total
            }),
        ));
        searchers
    }
}
