//! Rays against triangles.

use std::cell::RefCell;

use caustics_accel::{
    BvhOptions, Intersect, KdTreeOptions, KdTreeTraversal, TriangleBvh, TriangleKdTree,
};
#[cfg(feature = "embree")]
use caustics_benches::embree::{Embree, Mode};
use caustics_benches::meshes::{self, Mesh};
use caustics_benches::stage::Failure;
use caustics_benches::{peers, rays};
use caustics_geometry::{Hit, Ray};
use rayon::prelude::*;

use crate::arguments::Arguments;
use crate::contest::{Contestant, Time, medians, pool};
use crate::tables::{Table, figures, geometric_mean};

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

const KINDS: [&str; 2] = ["coherent", "incoherent"];

/// Traces rays and returns the number of hits.
type Trace<'a> = Box<dyn Fn(&[Ray]) -> u64 + Sync + 'a>;

/// A way to trace rays, by name.
type Tracer<'a> = (&'static str, Trace<'a>);

/// Everything that traces one mesh.
struct Field {
    bvh: TriangleBvh,
    kd: TriangleKdTree,
    #[cfg(feature = "embree")]
    embree: Embree,
    #[cfg(feature = "embree")]
    robust: Embree,
    obvhs: peers::Obvhs,
    parry: peers::Parry,
    other: peers::BvhCrate,
}

impl Field {
    fn new(mesh: &Mesh) -> Result<Self, Failure> {
        let Mesh {
            positions,
            triangles,
            ..
        } = mesh;
        Ok(Self {
            bvh: TriangleBvh::new(positions, triangles, &BvhOptions::default())?,
            kd: TriangleKdTree::new(positions, triangles, &KdTreeOptions::default())?,
            #[cfg(feature = "embree")]
            embree: Embree::new(mesh, Mode::Default),
            #[cfg(feature = "embree")]
            robust: Embree::new(mesh, Mode::Robust),
            obvhs: peers::Obvhs::new(mesh),
            parry: peers::Parry::new(mesh),
            other: peers::BvhCrate::new(mesh),
        })
    }

    /// Refuses to time what does not agree with our closest hits: nearly all rays must, since the
    /// peers' tests are not watertight.
    fn check(&self, mesh: &str, rays: &[Ray]) -> Result<(), Failure> {
        let sample: Vec<&Ray> = rays.iter().step_by(16).collect();
        let agree = |name: &str, peer: &dyn Fn(&Ray) -> Option<f32>| {
            let agreeing = sample
                .iter()
                .filter(|ray| match (self.bvh.closest_hit(ray), peer(ray)) {
                    (Some(hit), Some(t)) => (hit.t - t).abs() <= 1e-4 * hit.t.max(0.01),
                    (None, None) => true,
                    _ => false,
                })
                .count();
            if agreeing * 1000 < sample.len() * 995 {
                return Err(format!(
                    "{name} agrees on {agreeing} of {} rays on {mesh}",
                    sample.len()
                ));
            }
            Ok(())
        };
        let restart = self.kd.traversed_by(KdTreeTraversal::Restart);
        agree("kd-tree", &|ray| self.kd.closest_hit(ray).map(|hit| hit.t))?;
        agree("kd-restart", &|ray| {
            restart.closest_hit(ray).map(|hit| hit.t)
        })?;
        agree("obvhs", &|ray| self.obvhs.closest_hit(ray))?;
        agree("parry3d", &|ray| self.parry.closest_hit(ray))?;
        agree("bvh", &|ray| self.other.closest_hit(ray))?;
        #[cfg(feature = "embree")]
        {
            agree("Embree", &|ray| {
                self.embree.closest_hit(ray).map(|hit| hit.t)
            })?;
            agree("Embree robust", &|ray| {
                self.robust.closest_hit(ray).map(|hit| hit.t)
            })?;
        }
        // Of occlusion only yes or no can be compared.
        let stopped = |name: &str, peer: &dyn Fn(&Ray) -> bool| {
            let wrong = sample
                .iter()
                .filter(|ray| peer(ray) != self.bvh.is_occluded(ray))
                .count();
            if wrong * 1000 > sample.len() * 5 {
                return Err(format!(
                    "{name} is wrong about {wrong} occluded rays on {mesh}"
                ));
            }
            Ok(())
        };
        stopped("kd-tree", &|ray| self.kd.is_occluded(ray))?;
        stopped("obvhs", &|ray| self.obvhs.is_occluded(ray))?;
        #[cfg(feature = "embree")]
        stopped("Embree", &|ray| self.embree.is_occluded(ray))?;
        // Streams are to return the very same.
        let mut hits = vec![None; rays.len()];
        self.bvh.closest_hits(rays, &mut hits);
        let differ = rays
            .iter()
            .zip(&hits)
            .any(|(ray, hit)| self.bvh.closest_hit(ray) != *hit);
        if differ {
            return Err(format!("streams differ on {mesh}").into());
        }
        Ok(())
    }

    fn closest(&self) -> Vec<Tracer<'_>> {
        let restart = self.kd.traversed_by(KdTreeTraversal::Restart);
        vec![
            #[cfg(feature = "embree")]
            ("Embree", each(|ray| self.embree.closest_hit(ray).is_some())),
            #[cfg(feature = "embree")]
            (
                "Embree robust",
                each(|ray| self.robust.closest_hit(ray).is_some()),
            ),
            #[cfg(feature = "embree")]
            (
                "Embree packets of 8",
                all(|rays, hits| self.embree.closest_hits(rays, hits)),
            ),
            ("obvhs", each(|ray| self.obvhs.closest_hit(ray).is_some())),
            ("parry3d", each(|ray| self.parry.closest_hit(ray).is_some())),
            ("bvh", each(|ray| self.other.closest_hit(ray).is_some())),
            (
                "**TriangleBvh**",
                each(|ray| self.bvh.closest_hit(ray).is_some()),
            ),
            (
                "**TriangleBvh, streams**",
                all(|rays, hits| self.bvh.closest_hits(rays, hits)),
            ),
            (
                "**TriangleKdTree, short stack**",
                each(|ray| self.kd.closest_hit(ray).is_some()),
            ),
            (
                "**TriangleKdTree, restart**",
                each(move |ray| restart.closest_hit(ray).is_some()),
            ),
        ]
    }

    fn any(&self) -> Vec<Tracer<'_>> {
        let restart = self.kd.traversed_by(KdTreeTraversal::Restart);
        vec![
            #[cfg(feature = "embree")]
            ("Embree", each(|ray| self.embree.is_occluded(ray))),
            #[cfg(feature = "embree")]
            ("Embree robust", each(|ray| self.robust.is_occluded(ray))),
            ("obvhs", each(|ray| self.obvhs.is_occluded(ray))),
            ("**TriangleBvh**", each(|ray| self.bvh.is_occluded(ray))),
            (
                "**TriangleKdTree, short stack**",
                each(|ray| self.kd.is_occluded(ray)),
            ),
            (
                "**TriangleKdTree, restart**",
                each(move |ray| restart.is_occluded(ray)),
            ),
        ]
    }
}

/// One ray after the other.
fn each<'a>(is_hit: impl Fn(&Ray) -> bool + Sync + 'a) -> Trace<'a> {
    Box::new(move |rays| rays.iter().filter(|ray| is_hit(ray)).count() as u64)
}

thread_local! {
    /// Kept: giving results new memory takes longer than some ways to compute them.
    static HITS: RefCell<Vec<Option<Hit>>> = const { RefCell::new(Vec::new()) };
}

/// Many rays at once.
fn all<'a>(trace: impl Fn(&[Ray], &mut [Option<Hit>]) + Sync + 'a) -> Trace<'a> {
    Box::new(move |rays| {
        HITS.with_borrow_mut(|hits| {
            hits.resize(rays.len(), None);
            trace(rays, hits);
            hits.iter().flatten().count() as u64
        })
    })
}

/// Seconds by mesh, kind of rays, and contestant.
type Times = Vec<[Vec<Time>; 2]>;

pub(crate) fn measure(arguments: &Arguments) -> Result<Vec<(&'static str, String)>, Failure> {
    let mut meshes = meshes::tabled();
    let mut log2_side = 9;
    if arguments.is_quick {
        meshes.truncate(2);
        log2_side = 8;
    }
    let threads = arguments.threads();
    // By question, then by number of threads.
    let mut times: [Vec<Times>; 2] = std::array::from_fn(|_| vec![Vec::new(); threads.len()]);
    for mesh in &meshes {
        let field = Field::new(mesh)?;
        let coherent = rays::coherent(mesh, log2_side);
        let incoherent = rays::incoherent(mesh, &field.bvh, &coherent);
        let sets = [coherent, incoherent];
        for rays in &sets {
            field.check(mesh.name, rays)?;
        }
        for (place, &threads) in threads.iter().enumerate() {
            let pool = pool(threads)?;
            for (question, times) in times.iter_mut().enumerate() {
                times[place].push([0, 1].map(|kind: usize| {
                    let rays = &sets[kind];
                    let tracers = if question == 0 {
                        field.closest()
                    } else {
                        field.any()
                    };
                    let contestants = tracers.into_iter().map(|(name, trace)| {
                        let pool = &pool;
                        Contestant::new(name, move || {
                            pool.install(|| rays.par_chunks(CHUNK).map(&trace).sum())
                        })
                    });
                    let mut found = medians(contestants.collect(), arguments.patience());
                    for (_, seconds) in &mut found {
                        *seconds /= rays.len() as f64;
                    }
                    found
                }));
            }
        }
        eprintln!("traced {}", mesh.name);
    }
    let names = [
        ["closest-hit-1", "closest-hit-2"],
        ["any-hit-1", "any-hit-2"],
    ];
    let mut tables = Vec::new();
    for (names, times) in names.iter().zip(&times) {
        for (name, times) in names.iter().zip(times) {
            tables.push((*name, table(&meshes, times)));
        }
    }
    Ok(tables)
}

/// The first row in millions of rays a second, the others relative to it.
fn table(meshes: &[Mesh], times: &Times) -> String {
    let mut header = vec![String::new()];
    for kind in KINDS {
        header.extend(meshes.iter().map(|mesh| format!("{kind} {}", mesh.name)));
        header.push(format!("**{kind} mean**"));
    }
    let mut table = Table::new(&header);
    let seconds = |mesh: usize, kind: usize, row: usize| times[mesh][kind][row].1;
    for (row, &(name, _)) in times[0][0].iter().enumerate() {
        if row == 0 {
            let mut cells = vec![format!("{name}, Mrays/s")];
            for kind in 0..KINDS.len() {
                let speeds: Vec<f64> = (0..meshes.len())
                    .map(|mesh| 1e-6 / seconds(mesh, kind, 0))
                    .collect();
                cells.extend(speeds.iter().map(|&speed| figures(speed)));
                cells.push(figures(geometric_mean(&speeds)));
            }
            table.row(&cells);
        }
        let mut cells = vec![name.to_owned()];
        for kind in 0..KINDS.len() {
            let ratios: Vec<f64> = (0..meshes.len())
                .map(|mesh| seconds(mesh, kind, 0) / seconds(mesh, kind, row))
                .collect();
            cells.extend(ratios.iter().map(|&ratio| figures(ratio)));
            cells.push(format!("**{}**", figures(geometric_mean(&ratios))));
        }
        table.row(&cells);
    }
    table.finish()
}
