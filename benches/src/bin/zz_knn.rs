use caustics_accel::{NearestScratch, PhotonTree};
use caustics_benches::photons::{pixel_queries, surface_photons};
fn main() {
    let k: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let limit: f32 = std::env::args().nth(2).unwrap().parse().unwrap();
    let photons = surface_photons(1_000_000);
    let queries = pixel_queries(&photons, 20_000);
    let tree = PhotonTree::new(&photons).unwrap();
    let mut scratch = NearestScratch::new();
    let mut best = f64::INFINITY;
    for _ in 0..30 {
        let s = std::time::Instant::now();
        let mut n = 0.0;
        for &q in &queries {
            n += tree
                .nearest(q, k, limit, &mut scratch)
                .last()
                .map_or(0.0, |n| n.distance_squared);
        }
        best = best.min(s.elapsed().as_secs_f64());
        std::hint::black_box(n);
    }
    println!("{k} {limit}: {:.1} kq/s", 20.0 / best);
}
