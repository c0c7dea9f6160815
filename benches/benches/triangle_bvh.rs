//! Rays against triangles: ours, obvhs used bare, parry3d, `bvh`, and with the feature `embree`
//! Embree 3. Each peer's answers are compared with ours before it is timed.

use std::hint::black_box;
use std::time::Duration;

use caustics_accel::{BvhOptions, BvhPreset, Intersect, TriangleBvh};
use caustics_benches::meshes::{self, Mesh};
use caustics_benches::{peers, rays};
use caustics_geometry::Ray;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};

/// Rays in a set: 2 to twice this power.
const LOG2_SIDE: u32 = 7;

/// Nearly all rays must agree: the peers' tests are not watertight.
fn check(name: &str, rays: &[Ray], bvh: &TriangleBvh, peer: impl Fn(&Ray) -> Option<f32>) {
    let agree = |ray: &&Ray| match (bvh.closest_hit(ray), peer(ray)) {
        (Some(hit), Some(t)) => (hit.t - t).abs() <= 1e-4 * hit.t.max(0.01),
        (None, None) => true,
        _ => false,
    };
    let agreeing = rays.iter().filter(agree).count();
    assert!(
        agreeing * 1000 >= rays.len() * 995,
        "{name}: {agreeing} of {} agree",
        rays.len()
    );
}

fn time<T>(
    group: &mut BenchmarkGroup<'_, criterion::measurement::WallTime>,
    name: &str,
    rays: &[Ray],
    trace: impl Fn(&Ray) -> T,
) {
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            for ray in rays {
                black_box(trace(ray));
            }
        });
    });
}

fn trace(criterion: &mut Criterion, mesh: &Mesh) {
    let bvh = TriangleBvh::new(&mesh.positions, &mesh.triangles, &BvhOptions::default())
        .expect("a valid mesh");
    let obvhs = peers::Obvhs::new(mesh);
    let parry = peers::Parry::new(mesh);
    let other = peers::BvhCrate::new(mesh);
    #[cfg(feature = "embree")]
    let embree = {
        use caustics_benches::embree::{Embree, Mode};
        [
            Embree::new(mesh, Mode::Default),
            Embree::new(mesh, Mode::Robust),
        ]
    };
    let coherent = rays::coherent(mesh, LOG2_SIDE);
    let incoherent = rays::incoherent(mesh, &bvh, &coherent);
    for (kind, rays) in [("coherent", &coherent), ("incoherent", &incoherent)] {
        check("obvhs", rays, &bvh, |ray| obvhs.closest_hit(ray));
        check("parry3d", rays, &bvh, |ray| parry.closest_hit(ray));
        check("bvh", rays, &bvh, |ray| other.closest_hit(ray));
        let mut group = criterion.benchmark_group(format!("closest hit/{}/{kind}", mesh.name));
        group.throughput(Throughput::Elements(rays.len() as u64));
        time(&mut group, "ours", rays, |ray| bvh.closest_hit(ray));
        let mut hits = vec![None; rays.len()];
        group.bench_function("ours streamed", |bencher| {
            bencher.iter(|| bvh.closest_hits(rays, &mut hits));
        });
        time(&mut group, "obvhs", rays, |ray| obvhs.closest_hit(ray));
        time(&mut group, "parry3d", rays, |ray| parry.closest_hit(ray));
        time(&mut group, "bvh", rays, |ray| other.closest_hit(ray));
        #[cfg(feature = "embree")]
        {
            check("Embree", rays, &bvh, |ray| {
                embree[0].closest_hit(ray).map(|hit| hit.t)
            });
            time(&mut group, "Embree", rays, |ray| embree[0].closest_hit(ray));
            time(&mut group, "Embree robust", rays, |ray| {
                embree[1].closest_hit(ray)
            });
            group.bench_function("Embree packets", |bencher| {
                bencher.iter(|| embree[0].closest_hits(rays, &mut hits));
            });
        }
        group.finish();

        let mut group = criterion.benchmark_group(format!("any hit/{}/{kind}", mesh.name));
        group.throughput(Throughput::Elements(rays.len() as u64));
        time(&mut group, "ours", rays, |ray| bvh.is_occluded(ray));
        #[cfg(feature = "embree")]
        time(&mut group, "Embree", rays, |ray| embree[0].is_occluded(ray));
        group.finish();
    }
}

fn build(criterion: &mut Criterion, mesh: &Mesh) {
    let mut group = criterion.benchmark_group(format!("build/{}", mesh.name));
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    for (name, preset) in [
        ("ours fastest build", BvhPreset::FastestBuild),
        ("ours fast build", BvhPreset::FastBuild),
        ("ours balanced", BvhPreset::Balanced),
    ] {
        let options = BvhOptions {
            preset,
            ..BvhOptions::default()
        };
        group.bench_function(name, |bencher| {
            bencher.iter(|| TriangleBvh::new(&mesh.positions, &mesh.triangles, &options));
        });
    }
    group.bench_function("obvhs fast", |bencher| {
        bencher.iter(|| peers::Obvhs::new(mesh));
    });
    #[cfg(feature = "embree")]
    group.bench_function("Embree", |bencher| {
        use caustics_benches::embree::{Embree, Mode};
        bencher.iter(|| Embree::new(mesh, Mode::Default));
    });
    group.finish();
}

fn all(criterion: &mut Criterion) {
    for mesh in meshes::all() {
        trace(criterion, &mesh);
        build(criterion, &mesh);
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
