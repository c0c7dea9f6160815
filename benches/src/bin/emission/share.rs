//! What a weak light's caustic, or a small caster's, gets beside a strong one.

use std::fmt::Write as _;

use caustics::filter::{Image, relative_mse};
use caustics::prelude::*;
use caustics::trace::{EmissionBatch, EmissionPlan, LightSource, trace_plan};
use caustics_benches::stage::Failure;
use glam::Vec3;

use crate::view::{View, balls, camera_over};

const PHOTONS: u32 = 1 << 16;
const TRUE_PHOTONS: u32 = 1 << 20;
const SIZE: u32 = 256;

const FLOORS: [f32; 6] = [0.0, 0.05, 0.1, 0.25, 0.5, 1.0];

/// How many times its least error a strong caustic may have for the sake of weak ones.
const DEAREST: f64 = 1.25;

/// Lattices at different places, over which errors are averaged.
const SEEDS: u64 = 4;

/// The middles of balls so far apart that no lamp's caustic reaches another's floor.
fn centers(count: u8) -> Vec<Vec3> {
    (0..count)
        .map(|index| Vec3::new(30.0 * f32::from(index), 0.8, 0.0))
        .collect()
}

fn lamp(over: Vec3, intensity: f32) -> Result<Light, Failure> {
    let position = over + Vec3::new(0.5, 2.5, 0.3);
    Ok(Light::spot(
        position,
        over - position,
        [intensity; 3],
        0.3,
        0.4,
    )?)
}

/// Two pictures of a scene, each of one caustic, and what they are held against.
struct Pair {
    views: [View; 2],
    truths: [Image; 2],
    /// Which of the two caustics photons make.
    is_second: fn(&EmissionBatch) -> bool,
}

impl Pair {
    /// Balls, each under a lamp of its own, the first of which is a thousand times as bright as the
    /// others. The second caustic is that of the last.
    fn of_lamps(count: u8) -> Result<Self, Failure> {
        let centers = centers(count);
        let mut lamps = Vec::new();
        for (index, center) in centers.iter().enumerate() {
            lamps.push(lamp(*center, if index == 0 { 1000.0 } else { 1.0 })?);
        }
        let all = balls(&centers, 0.5, &lamps)?;
        let at = |index: usize| -> Result<(View, Image), Failure> {
            let camera = camera_over(centers[index].with_y(0.0))?;
            let view = View::new(&all, &camera, SIZE)?;
            let alone = balls(&centers, 0.5, &[lamps[index]])?;
            let alone = View::new(&alone, &camera, SIZE)?;
            let truth = view.caustics(&traced(&alone, TRUE_PHOTONS, 1.0, 0)?.1)?;
            Ok((view, truth))
        };
        let ((one, first), (other, second)) = (at(0)?, at(centers.len() - 1)?);
        Ok(Self {
            views: [one, other],
            truths: [first, second],
            is_second: |batch| batch.emitter().source() == LightSource::Light { index: 1 },
        })
    }

    /// A large ball and a small one farther off under one lamp.
    fn of_casters() -> Result<Self, Failure> {
        let mut scene = balls(&centers(1), 0.5, &[])?;
        let glass = scene.add_material(Material::dielectric("other glass", 1.5))?;
        let small = Shape::Sphere {
            center: Vec3::new(1.6, 0.35, -0.4),
            radius: 0.15,
        };
        scene.add_instance(Instance::new("small ball", small, glass))?;
        scene.add_light(Light::point([-0.6, 3.0, 0.4], [30.0; 3])?)?;
        let at = |target: Vec3| -> Result<(View, Image), Failure> {
            let eye = target + Vec3::new(0.0, 1.2, 1.3);
            let camera = Camera::look_at("camera", eye, target, [0.0, 1.0, 0.0], 0.6)?;
            let view = View::new(&scene, &camera, SIZE)?;
            let truth = view.caustics(&traced(&view, TRUE_PHOTONS, 1.0, 0)?.1)?;
            Ok((view, truth))
        };
        let ((one, first), (other, second)) = (
            at(Vec3::new(0.15, 0.0, -0.1))?,
            at(Vec3::new(1.85, 0.0, -0.5))?,
        );
        Ok(Self {
            views: [one, other],
            truths: [first, second],
            is_second: |batch| batch.emitter().caster() == Some(1),
        })
    }

    /// Writes a table; returns both errors for each floor.
    fn table(&self, text: &mut String, names: [&str; 2]) -> Result<Vec<[f64; 2]>, Failure> {
        let [one, other] = names;
        writeln!(
            text,
            "| floor | photons, {one} | photons, {other} | relMSE, {one} | relMSE, {other} |\n\
            | --: | --: | --: | --: | --: |"
        )?;
        let mut found = Vec::new();
        for floor in FLOORS {
            let mut errors = [0.0; 2];
            let mut counts = [0; 2];
            for seed in 0..SEEDS {
                let (plan, photons) = traced(&self.views[0], PHOTONS, floor, seed)?;
                counts = [0; 2];
                for batch in plan.batches() {
                    let is_first = batch.emitter().source() == LightSource::Light { index: 0 };
                    if (self.is_second)(batch) {
                        counts[1] += batch.count();
                    } else if is_first {
                        counts[0] += batch.count();
                    }
                }
                for ((view, truth), sum) in self.views.iter().zip(&self.truths).zip(&mut errors) {
                    *sum += relative_mse(&view.caustics(&photons)?, truth)? / SEEDS as f64;
                }
            }
            writeln!(
                text,
                "| {floor} | {} | {} | {:.5} | {:.5} |",
                counts[0], counts[1], errors[0], errors[1]
            )?;
            found.push(errors);
        }
        Ok(found)
    }
}

fn traced(
    view: &View,
    photons: u32,
    floor: f32,
    seed: u64,
) -> Result<(EmissionPlan, Vec<Photon>), Failure> {
    let options = TraceOptions {
        photons,
        share_floor: floor,
        seed,
        ..TraceOptions::default()
    };
    let plan = EmissionPlan::new(&view.world, &view.rays, &options)?;
    let map = trace_plan(&view.world, &view.rays, &plan, &options, &|_| {})?;
    Ok((plan, map.photons))
}

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## A strong light beside a weak one\n\n\
        Two glass balls, each under a spot light of its own, one a thousand times as bright as the \
        other; {PHOTONS} photons. relMSE of each caustic to {TRUE_PHOTONS} photons of its light \
        alone, by the floor of the shares (`TraceOptions::share_floor`; the default is {}), the mean \
        of {SEEDS} seeds.\n\n",
        TraceOptions::default().share_floor
    );
    let mut all = Vec::new();
    all.push(Pair::of_lamps(2)?.table(&mut text, ["strong", "weak"])?);
    eprintln!("  two lamps");
    writeln!(
        text,
        "\nThe same with nine weak lamps, each over a ball; one of them:\n"
    )?;
    all.push(Pair::of_lamps(10)?.table(&mut text, ["strong", "one weak"])?);
    eprintln!("  ten lamps");
    writeln!(
        text,
        "\nA ball of 0.5 m and one of 0.15 m farther off under one lamp, as many photons; relMSE \
        around each caustic to {TRUE_PHOTONS} photons shared equally:\n"
    )?;
    all.push(Pair::of_casters()?.table(&mut text, ["large", "small"])?);
    writeln!(
        text,
        "\nWhat a floor costs and brings in the worst of the three: how many times the error of the \
        strong one is that of its best floor, and that of the weak one is that of its own:\n\n\
        | floor | strong | weak |\n| --: | --: | --: |"
    )?;
    let mut chosen = 0.0;
    for (index, floor) in FLOORS.into_iter().enumerate() {
        let worst = [0, 1].map(|which| {
            let ratio = |errors: &Vec<[f64; 2]>| {
                let best = errors
                    .iter()
                    .map(|it| it[which])
                    .fold(f64::INFINITY, f64::min);
                errors[index][which] / best
            };
            all.iter().map(ratio).fold(0.0, f64::max)
        });
        writeln!(text, "| {floor} | {:.2} | {:.2} |", worst[0], worst[1])?;
        if worst[0] <= DEAREST {
            chosen = floor;
        }
    }
    writeln!(
        text,
        "\n{chosen} is the largest of these floors that costs the strong caustic at most a quarter of \
        its quality anywhere; the default follows it."
    )?;
    Ok(text)
}
