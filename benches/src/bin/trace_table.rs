//! Rays per second of the triangle tree and its peers, interleaved in one process.
//!
//! Prints a Markdown table: millions of rays a second on one thread, and the ratio to the first
//! row that was measured in the same rounds.

use std::cell::RefCell;
use std::hint::black_box;
use std::time::Instant;

use caustics_accel::{
    BvhOptions, Instructions, Intersect, KdTreeOptions, KdTreeTraversal, TriangleBvh,
    TriangleKdTree,
};
use caustics_benches::{meshes, rays};
use caustics_geometry::{Hit, Ray};

const ROUNDS: usize = 9;

/// A way to trace a list of rays, which returns the number of hits.
type Tracer<'a> = (&'static str, Box<dyn Fn(&[Ray]) -> usize + 'a>);

fn main() {
    let filter = std::env::args().nth(1).unwrap_or_default();
    let mut ratios: Vec<(&str, &str, Vec<f64>)> = Vec::new();
    for mesh in meshes::all() {
        if !mesh.name.contains(&filter) {
            continue;
        }
        let options = BvhOptions::default();
        let start = Instant::now();
        let bvh = TriangleBvh::new(&mesh.positions, &mesh.triangles, &options).expect("valid");
        let build = start.elapsed();
        println!(
            "{}: {} triangles, built in {:.1} ms, {:.0} bytes a triangle",
            mesh.name,
            mesh.triangles.len(),
            build.as_secs_f64() * 1e3,
            bvh.memory_bytes() as f64 / mesh.triangles.len() as f64
        );
        let portable = BvhOptions {
            instructions: Instructions::Portable,
            ..options
        };
        let portable =
            TriangleBvh::new(&mesh.positions, &mesh.triangles, &portable).expect("valid");
        let start = Instant::now();
        let kd = TriangleKdTree::new(&mesh.positions, &mesh.triangles, &KdTreeOptions::default())
            .expect("valid");
        println!(
            "kd-tree built in {:.1} ms, {:.0} bytes a triangle",
            start.elapsed().as_secs_f64() * 1e3,
            kd.memory_bytes() as f64 / mesh.triangles.len() as f64
        );
        let coherent = rays::coherent(&mesh, 9);
        let incoherent = rays::incoherent(&mesh, &bvh, &coherent);
        #[cfg(feature = "embree")]
        let (embree, robust) = (
            caustics_benches::embree::Embree::new(&mesh, caustics_benches::embree::Mode::Default),
            caustics_benches::embree::Embree::new(&mesh, caustics_benches::embree::Mode::Robust),
        );
        for (kind, rays) in [("coherent", &coherent), ("incoherent", &incoherent)] {
            let mut tracers: Vec<Tracer<'_>> = Vec::with_capacity(8);
            #[cfg(feature = "embree")]
            {
                tracers.push((
                    "Embree",
                    Box::new(|rays| count(rays, |r| embree.closest_hit(r))),
                ));
                tracers.push((
                    "Embree robust",
                    Box::new(|rays| count(rays, |r| robust.closest_hit(r))),
                ));
                tracers.push((
                    "Embree packets",
                    Box::new(|rays| count_all(rays, |r, h| embree.closest_hits(r, h))),
                ));
                tracers.push((
                    "Embree occluded",
                    Box::new(|rays| rays.iter().filter(|r| embree.is_occluded(r)).count()),
                ));
            }
            tracers.push(("ours", Box::new(|rays| count(rays, |r| bvh.closest_hit(r)))));
            tracers.push((
                "kd-tree",
                Box::new(|rays| count(rays, |r| kd.closest_hit(r))),
            ));
            tracers.push((
                "kd-tree restart",
                Box::new(|rays| {
                    let kd = kd.traversed_by(KdTreeTraversal::Restart);
                    count(rays, |r| kd.closest_hit(r))
                }),
            ));
            tracers.push((
                "ours portable",
                Box::new(|rays| count(rays, |r| portable.closest_hit(r))),
            ));
            tracers.push((
                "ours occluded",
                Box::new(|rays| rays.iter().filter(|r| bvh.is_occluded(r)).count()),
            ));
            tracers.push((
                "ours streamed",
                Box::new(|rays| count_all(rays, |r, h| bvh.closest_hits(r, h))),
            ));
            let mut times = vec![Vec::new(); tracers.len()];
            let mut hits = vec![0; tracers.len()];
            for _ in 0..ROUNDS {
                for (i, (_, trace)) in tracers.iter().enumerate() {
                    let start = Instant::now();
                    hits[i] = black_box(trace(rays));
                    times[i].push(start.elapsed().as_secs_f64());
                }
            }
            let quartiles: Vec<f64> = times
                .iter_mut()
                .map(|times| {
                    times.sort_by(f64::total_cmp);
                    times[times.len() / 4]
                })
                .collect();
            for (i, (name, _)) in tracers.iter().enumerate() {
                let ratio = quartiles[0] / quartiles[i];
                println!(
                    "  {kind:10} {name:16} {:6.2} Mrays/s  {ratio:5.2}  {} hits",
                    rays.len() as f64 / quartiles[i] / 1e6,
                    hits[i]
                );
                match ratios.iter_mut().find(|r| r.0 == *name && r.1 == kind) {
                    Some(entry) => entry.2.push(ratio),
                    None => ratios.push((name, kind, vec![ratio])),
                }
            }
        }
    }
    println!("geometric means of the ratios");
    for (name, kind, ratios) in ratios {
        let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
        println!("  {kind:10} {name:16} {mean:.3}");
    }
}

thread_local! {
    /// Kept, because giving a result new memory takes longer than some ways to compute it.
    static HITS: RefCell<Vec<Option<Hit>>> = const { RefCell::new(Vec::new()) };
}

fn count(rays: &[Ray], closest_hit: impl Fn(&Ray) -> Option<Hit>) -> usize {
    rays.iter().filter(|ray| closest_hit(ray).is_some()).count()
}

fn count_all(rays: &[Ray], closest_hits: impl Fn(&[Ray], &mut [Option<Hit>])) -> usize {
    HITS.with_borrow_mut(|hits| {
        hits.resize(rays.len(), None);
        closest_hits(rays, hits);
        hits.iter().flatten().count()
    })
}
