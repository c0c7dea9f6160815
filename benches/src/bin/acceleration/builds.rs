//! Builds and refits.

use caustics_accel::{
    BvhOptions, BvhPreset, KdTreeOptions, KdTreeSplit, TriangleBvh, TriangleKdTree,
};
#[cfg(feature = "embree")]
use caustics_benches::embree::{Embree, Mode};
use caustics_benches::meshes::{self, Mesh};
use caustics_benches::peers::{self, Obvhs};
use caustics_benches::stage::Failure;
use obvhs::BvhBuildParams;

use crate::arguments::Arguments;
use crate::contest::{Contestant, Time, medians, pool};
use crate::tables::{Table, figures};

fn bvh_of(mesh: &Mesh, preset: BvhPreset) -> TriangleBvh {
    let options = BvhOptions {
        preset,
        ..BvhOptions::default()
    };
    TriangleBvh::new(&mesh.positions, &mesh.triangles, &options).expect("a valid mesh")
}

fn kd_of(mesh: &Mesh, split: KdTreeSplit) -> TriangleKdTree {
    let options = KdTreeOptions {
        split,
        ..KdTreeOptions::default()
    };
    TriangleKdTree::new(&mesh.positions, &mesh.triangles, &options).expect("a valid mesh")
}

/// What a mesh becomes when it is bent.
fn bent(mesh: &Mesh) -> Mesh {
    let mut bent = mesh.clone();
    for p in &mut bent.positions {
        p.y += 0.05 * (3.0 * p.x).sin();
    }
    bent
}

fn builders(mesh: &Mesh, #[allow(unused)] threads: usize) -> Vec<Contestant<'_>> {
    let ours = |name, preset| Contestant::new(name, move || bvh_of(mesh, preset).len() as u64);
    let kd = |name, split| Contestant::new(name, move || kd_of(mesh, split).len() as u64);
    let bare = |name, parameters: fn() -> BvhBuildParams| {
        Contestant::new(name, move || {
            let _tree = Obvhs::with_parameters(mesh, parameters());
            0
        })
    };
    vec![
        bare("obvhs fastest", BvhBuildParams::fastest_build),
        bare("obvhs fast", BvhBuildParams::fast_build),
        bare("obvhs medium", BvhBuildParams::medium_build),
        #[cfg(feature = "embree")]
        Contestant::new("Embree", move || {
            let _scene = Embree::with_threads(mesh, Mode::Default, threads);
            0
        }),
        Contestant::new("parry3d", move || {
            let _mesh = peers::Parry::new(mesh);
            0
        }),
        Contestant::new("bvh", move || {
            let _tree = peers::BvhCrate::new(mesh);
            0
        }),
        ours("**TriangleBvh, fastest build**", BvhPreset::FastestBuild),
        ours("**TriangleBvh, fast build**", BvhPreset::FastBuild),
        ours("**TriangleBvh, balanced**", BvhPreset::Balanced),
        ours("**TriangleBvh, fast trace**", BvhPreset::FastTrace),
        kd("**TriangleKdTree**", KdTreeSplit::SurfaceArea),
        kd(
            "**TriangleKdTree, spatial median**",
            KdTreeSplit::SpatialMedian,
        ),
    ]
}

/// Refits to two shapes in turns.
fn refitter<'a, T: 'a>(
    name: &'static str,
    mut tree: T,
    shapes: &'a [Mesh; 2],
    refit: impl Fn(&mut T, &Mesh) + 'a,
) -> Contestant<'a> {
    let mut turn = 0;
    Contestant::new(name, move || {
        turn += 1;
        refit(&mut tree, &shapes[turn % 2]);
        0
    })
}

fn refitters(shapes: &[Mesh; 2]) -> Vec<Contestant<'_>> {
    let as_built = Obvhs::new(&shapes[0]);
    let mut ordered = Obvhs::new(&shapes[0]);
    ordered.order_nodes();
    let ours = bvh_of(&shapes[0], BvhPreset::Balanced);
    vec![
        refitter("obvhs, refitted", as_built, shapes, Obvhs::refit),
        refitter("obvhs, ordered and refitted", ordered, shapes, Obvhs::refit),
        refitter("**TriangleBvh, refitted**", ours, shapes, |tree, shape| {
            let refitted = tree.refit(&shape.positions, &shape.triangles);
            refitted.expect("the same triangles");
        }),
    ]
}

pub(crate) fn measure(arguments: &Arguments) -> Result<Vec<(&'static str, String)>, Failure> {
    let mut meshes = meshes::tabled();
    if arguments.is_quick {
        meshes.truncate(3);
    }
    let threads = arguments.threads();
    // By mesh, then by number of threads.
    let mut times: Vec<Vec<Vec<Time>>> = Vec::new();
    for mesh in &meshes {
        let shapes = [mesh.clone(), bent(mesh)];
        let mut of_mesh = Vec::new();
        for &threads in threads {
            // Inside the pool, so that the libraries that use rayon find it.
            let found = pool(threads)?.install(|| {
                let mut found = medians(builders(mesh, threads), arguments.patience());
                found.extend(medians(refitters(&shapes), arguments.patience()));
                found
            });
            of_mesh.push(found);
        }
        times.push(of_mesh);
        eprintln!("built {}", mesh.name);
    }
    let mut header = vec!["ms".to_owned()];
    header.extend(meshes.iter().map(|mesh| mesh.name.to_owned()));
    let mut table = Table::new(&header);
    for row in 0..times[0][0].len() {
        let mut cells = vec![times[0][0][row].0.to_owned()];
        for of_mesh in &times {
            let by_threads = of_mesh.iter().map(|found| figures(found[row].1 * 1e3));
            cells.push(by_threads.collect::<Vec<_>>().join(" / "));
        }
        table.row(&cells);
    }
    Ok(vec![("builds", table.finish())])
}
