//! Lights that grow: soft caustics against many point lights, and against a reference.

use std::fmt::Write as _;

use caustics::filter::{Image, relative_mse};
use caustics::prelude::*;
use caustics::sampling::{PointSet, Sequence};
use caustics::scene::Environment;
use caustics::trace::{Fate, trace_photons};
use caustics_benches::stage::{Failure, Stage};
use glam::Vec3;

use crate::view::{View, balls, camera_over};

const PHOTONS: u32 = 1 << 17;

/// Point lights that stand for an area, each with so many photons.
const PLACES: u32 = 256;
const PHOTONS_EACH: u32 = 16_384;

const SIZE: u32 = 256;
const CENTER: Vec3 = Vec3::new(0.0, 0.8, 0.0);
/// Photons of the picture under a sky that others are held against.
const TRUE_SKY: u32 = 1 << 21;

const BALL: f32 = 0.5;
const LAMP: Vec3 = Vec3::new(0.0, 5.0, 0.0);

/// The flux of all lamps, in W.
const FLUX: f32 = 100.0;

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Lights that grow\n\n\
        A glass ball of 0.5 m under a disc of growing radius, 4.2 m above it, with the same flux: \
        {PHOTONS} photons, against {PLACES} point lights spread over the disc, with \
        {PHOTONS_EACH} photons each and as much flux to the ball as the disc's part there sends it \
        (evenly instead of by the cosine: a difference of up to 1 % across the ball). *Energy* is the \
        sum of one picture over that of the other, *flux* the same of what lands.\n\n\
        | radius in metres | relMSE | energy | flux | brightest pixel, W/(sr m²) |\n\
        | --: | --: | --: | --: | --: |\n"
    );
    let camera = camera_over(Vec3::ZERO)?;
    for radius in [0.01f32, 0.1, 0.3, 0.8] {
        let area = std::f32::consts::PI * radius * radius;
        let radiance = FLUX / (std::f32::consts::PI * area);
        let disc = Light::disc(LAMP, [0.0, -1.0, 0.0], radius, [radiance; 3])?;
        let view = View::new(&balls(&[CENTER], BALL, &[disc])?, &camera, SIZE)?;
        let options = TraceOptions {
            photons: PHOTONS,
            ..TraceOptions::default()
        };
        let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
        let soft = view.caustics(&map.photons)?;
        let soft_flux = map.ledger.entry(Fate::Stored).flux.x;

        let mut points = Vec::new();
        let places = PointSet::new(Sequence::Halton, PLACES, 0);
        for index in 0..PLACES {
            let place = disc
                .point_on(places.point(index))
                .ok_or("a disc has an area")?;
            let from_ball = place.position - CENTER;
            // As much to the whole ball as a cosine about its middle brings.
            let sine = BALL / from_ball.length();
            let cosine = from_ball.normalize().y * 0.5 * (1.0 + (1.0 - sine * sine).sqrt());
            let intensity = radiance * area * cosine / PLACES as f32;
            points.push(Light::point(place.position, [intensity; 3])?);
        }
        let view = View::new(&balls(&[CENTER], BALL, &points)?, &camera, SIZE)?;
        let options = TraceOptions {
            photons: PLACES * PHOTONS_EACH,
            ..TraceOptions::default()
        };
        let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
        let many = view.caustics(&map.photons)?;
        let brightest = soft.pixels().iter().map(|it| it[0]).fold(0.0, f32::max);
        writeln!(
            text,
            "| {radius} | {:.5} | {:.4} | {:.4} | {brightest:.2} |",
            relative_mse(&soft, &many)?,
            soft.mean() / many.mean(),
            soft_flux / map.ledger.entry(Fate::Stored).flux.x
        )?;
        eprintln!("  {radius}");
    }
    writeln!(
        text,
        "\nThe emissive quad of `p09_cornell` against its reference, as the object that it is and as a \
        `Light::Rectangle` just below it:\n\n\
        | photons | relMSE, object | relMSE, rectangle | energy, object | energy, rectangle |\n\
        | --: | --: | --: | --: | --: |"
    )?;
    let stage = Stage::load("p09_cornell")?;
    let (object, rectangle) = cornell()?;
    for photons in [1u32 << 14, 1 << 16, 1 << 18] {
        let mut errors = Vec::new();
        for scene in [&object, &rectangle] {
            let view = View::new(scene, &stage.camera, stage.reference.width())?;
            let options = TraceOptions {
                photons,
                ..TraceOptions::default()
            };
            let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
            let image = view.caustics(&map.photons)?;
            let energy = image.mean() / stage.reference.mean();
            errors.push((relative_mse(&image, &stage.reference)?, energy));
        }
        writeln!(
            text,
            "| {photons} | {:.5} | {:.5} | {:.4} | {:.4} |",
            errors[0].0, errors[1].0, errors[0].1, errors[1].1
        )?;
    }
    writeln!(
        text,
        "\nThe ball under a sky whose one bright spot of 5 by 5 degrees has half of its light, against \
        {TRUE_SKY} photons:\n\n\
        | photons | relMSE | energy |\n| --: | --: | --: |"
    )?;
    let mut scene = balls(&[CENTER], BALL, &[])?;
    scene.set_environment(Some(sky()?));
    let view = View::new(&scene, &camera, SIZE)?;
    let pictured = |photons: u32| -> Result<Image, Failure> {
        let options = TraceOptions {
            photons,
            ..TraceOptions::default()
        };
        let map = trace_photons(&view.world, &view.rays, &options, &|_| {})?;
        view.caustics(&map.photons)
    };
    let truth = pictured(TRUE_SKY)?;
    for photons in [1u32 << 14, 1 << 16, 1 << 18] {
        let image = pictured(photons)?;
        writeln!(
            text,
            "| {photons} | {:.5} | {:.4} |",
            relative_mse(&image, &truth)?,
            image.mean() / truth.mean()
        )?;
    }
    Ok(text)
}

/// Even light from everywhere, and as much again from one spot.
fn sky() -> Result<Environment, Failure> {
    let (width, height) = (72u32, 36u32);
    let mut pixels = vec![[1.0; 3]; (width * height) as usize];
    let row = 10;
    let edge = |row: u32| (std::f32::consts::PI * row as f32 / height as f32).cos();
    let angle = std::f32::consts::TAU / width as f32 * (edge(row) - edge(row + 1));
    pixels[(row * width + 40) as usize] = [4.0 * std::f32::consts::PI / angle; 3];
    Ok(Environment::new(width, height, pixels)?)
}

/// The Cornell box as it is, and with a rectangle of the same radiance in place of its emissive quad.
fn cornell() -> Result<(Scene, Scene), Failure> {
    let file = caustics_benches::stage::scene_folder().join("p09_cornell.glb");
    let scene = caustics::scene::gltf::load_path(file)?.scene;
    let world = World::new(&scene)?;
    let light = world.emitters().first().ok_or("no emissive object")?;
    let range = light.primitives();
    let triangles = &world.triangles()[range.start as usize..range.end as usize];
    let [a, b, c] = triangles
        .first()
        .ok_or("the light is no mesh")?
        .map(|vertex| world.positions()[vertex as usize]);
    // The corner of the right angle, and from there the two edges in the order that keeps the side.
    let right = [(a, b, c), (b, c, a), (c, a, b)]
        .into_iter()
        .min_by(|x, y| {
            let bend = |(p, q, r): &(Vec3, Vec3, Vec3)| (*q - *p).dot(*r - *p).abs();
            bend(x).total_cmp(&bend(y))
        })
        .ok_or("a triangle has corners")?;
    let edges = [right.1 - right.0, right.2 - right.0];
    let normal = edges[0].cross(edges[1]).normalize();
    let mut other = Scene::new();
    let mut materials = Vec::new();
    for material in scene.materials() {
        materials.push(other.add_material(material.clone().with_emission([0.0; 3]))?);
    }
    let mut meshes = Vec::new();
    for mesh in scene.meshes() {
        meshes.push(other.add_mesh(mesh.clone()));
    }
    for instance in scene.instances() {
        let mut copy = instance.clone();
        copy.material = materials[instance.material.index()];
        if let Shape::Mesh(mesh) = instance.shape {
            copy.shape = Shape::Mesh(meshes[mesh.index()]);
        }
        other.add_instance(copy)?;
    }
    let corner = right.0 + 1e-3 * normal;
    other.add_light(Light::rectangle(corner, edges, light.radiance())?)?;
    Ok((scene, other))
}
