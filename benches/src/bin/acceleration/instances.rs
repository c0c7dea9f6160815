//! Many instances of a mesh against all of them flattened into one.

use std::sync::Arc;
use std::time::Instant;

use caustics_accel::{BvhInstance, BvhOptions, InstanceBvh, Instructions, Intersect, TriangleBvh};
use caustics_benches::meshes::{self, Mesh};
use caustics_benches::random::Random;
use caustics_benches::rays;
use caustics_benches::stage::Failure;
use caustics_geometry::Ray;
use glam::{Affine3A, Quat, Vec3};

use crate::arguments::Arguments;
use crate::contest::{Contestant, medians};
use crate::tables::{Table, figures};

/// Spheres of 1280 triangles, turned, in a loose cube.
fn places(side: u32) -> Vec<Affine3A> {
    let mut random = Random::new(5);
    (0..side * side * side)
        .map(|i| {
            let cell = Vec3::new(
                (i % side) as f32,
                (i / side % side) as f32,
                (i / side / side) as f32,
            );
            let turn = Quat::from_axis_angle(random.direction(), random.uniform());
            let at = 2.5 * cell + 0.4 * random.direction();
            Affine3A::from_rotation_translation(turn, at)
        })
        .collect()
}

fn hits(tree: &impl Intersect, rays: &[Ray]) -> u64 {
    rays.iter()
        .filter(|ray| tree.closest_hit(ray).is_some())
        .count() as u64
}

pub(crate) fn measure(arguments: &Arguments) -> Result<Vec<(&'static str, String)>, Failure> {
    let mut table = Table::new(
        &[
            "instances",
            "coherent",
            "incoherent",
            "coherent streams",
            "a new upper level, ms",
            "a new flattened tree, ms",
            "bytes a triangle",
            "flattened",
        ]
        .map(str::to_owned),
    );
    let ball = meshes::icosphere("ball", 3);
    let options = BvhOptions::default();
    let mesh = Arc::new(TriangleBvh::new(
        &ball.positions,
        &ball.triangles,
        &options,
    )?);
    for side in [4, 10] {
        if arguments.is_quick && side > 4 {
            continue;
        }
        let places = places(side);
        let mut flat = Mesh {
            name: "flattened",
            positions: Vec::new(),
            triangles: Vec::new(),
        };
        for place in &places {
            let first = flat.positions.len() as u32;
            let placed = ball.positions.iter().map(|p| place.transform_point3(*p));
            flat.positions.extend(placed);
            let triangles = ball
                .triangles
                .iter()
                .map(|t| t.map(|vertex| vertex + first));
            flat.triangles.extend(triangles);
        }
        let start = Instant::now();
        let whole = TriangleBvh::new(&flat.positions, &flat.triangles, &options)?;
        let flat_ms = start.elapsed().as_secs_f64() * 1e3;
        let instances = places.iter().map(|&transform| BvhInstance {
            mesh: Arc::clone(&mesh),
            transform,
        });
        let mut ours = InstanceBvh::new(instances.collect(), Instructions::Detect)?;
        let start = Instant::now();
        for &place in places.iter().take(10) {
            ours.set_transforms(&[(0, place), (0, places[0])])?;
        }
        let level_ms = start.elapsed().as_secs_f64() * 1e2;
        let coherent = rays::coherent(&flat, 8);
        let incoherent = rays::incoherent(&flat, &whole, &coherent);
        let mut cells = vec![format!("{} of {}", places.len(), ball.triangles.len())];
        for rays in [&coherent, &incoherent] {
            if let Some(ray) = rays
                .iter()
                .find(|r| ours.closest_hit(r) != whole.closest_hit(r))
            {
                return Err(format!("instances differ from the flattened mesh at {ray:?}").into());
            }
            let times = medians(
                vec![
                    Contestant::new("flattened", || hits(&whole, rays)),
                    Contestant::new("instances", || hits(&ours, rays)),
                ],
                arguments.patience(),
            );
            cells.push(figures(times[0].1 / times[1].1));
        }
        let mut hits = vec![None; coherent.len()];
        ours.closest_hits(&coherent, &mut hits);
        let single = coherent.iter().map(|ray| ours.closest_hit(ray));
        if !single.eq(hits.iter().copied()) {
            return Err("streams through instances differ from single rays".into());
        }
        let mut of_whole = hits.clone();
        let times = medians(
            vec![
                Contestant::new("flattened", || {
                    whole.closest_hits(&coherent, &mut of_whole);
                    of_whole.iter().flatten().count() as u64
                }),
                Contestant::new("instances", || {
                    ours.closest_hits(&coherent, &mut hits);
                    hits.iter().flatten().count() as u64
                }),
            ],
            arguments.patience(),
        );
        cells.push(figures(times[0].1 / times[1].1));
        let triangles = flat.triangles.len() as f64;
        cells.push(figures(level_ms));
        cells.push(figures(flat_ms));
        cells.push(figures(
            (ours.memory_bytes() + mesh.memory_bytes()) as f64 / triangles,
        ));
        cells.push(figures(whole.memory_bytes() as f64 / triangles));
        table.row(&cells);
    }
    Ok(vec![("instances", table.finish())])
}
