//! What pictures by their nearest photons take, by where the photon tree splits.

use caustics::CausticsOptions;
use caustics::accel::{NearestScratch, PhotonSplits, PhotonTree, PhotonTreeOptions};
use caustics::glam::Vec3;
use caustics::render::{Estimate, NearestEstimate, NearestOptions};
use caustics::trace::{Photon, trace_photons};
use caustics_benches::receivers::{Receiver, receivers};
use caustics_benches::stage::{Failure, SCENES, Stage};
use rayon::prelude::*;

use crate::arguments::Arguments;
use crate::contest::{Contestant, medians, pool};
use crate::tables::{Table, figures, geometric_mean};

/// Photons that are traced, and how many of them each receiver looks for: few, as the estimate does
/// unless it is told, and many of many.
const SIZES: [(u32, usize); 3] = [(262_144, 50), (2_000_000, 50), (2_000_000, 200)];

/// Pictures take as much longer than what others compare, and want as many rounds.
const PATIENCE: u32 = 6;

/// Receivers that a thread takes at a time.
const CHUNK: usize = 512;

/// The rows' names of building a tree and of the searches of a whole picture in it.
const KINDS: [(PhotonSplits, &str, &str); 2] = [
    (PhotonSplits::Halves, "halves build", "halves search"),
    (PhotonSplits::VoxelVolume, "volume build", "volume search"),
];

pub(crate) fn measure(arguments: &Arguments) -> Result<Vec<(&'static str, String)>, Failure> {
    let mut table = Table::new(
        &[
            "photons traced, looked for",
            "halves: build, ms",
            "searches, ms",
            "by volume: build, ms",
            "searches, ms",
            "build and searches, times as fast",
        ]
        .map(str::to_owned),
    );
    let (scenes, sizes) = if arguments.is_quick {
        (&SCENES[..1], &SIZES[..1])
    } else {
        (&SCENES[..], &SIZES[..])
    };
    let mut ratios = vec![Vec::new(); sizes.len()];
    for scene in scenes {
        let stage = Stage::load(scene)?;
        let receivers = receivers(&stage, stage.reference.width(), stage.reference.height());
        let mut photons: (u32, Vec<Photon>) = (0, Vec::new());
        for (&(traced, count), ratios) in sizes.iter().zip(&mut ratios) {
            if photons.0 != traced {
                let mut options = CausticsOptions::for_estimate(Estimate::Nearest);
                options.trace.photons = traced;
                let map = trace_photons(&stage.world, &stage.intersector, &options.trace, &|_| {})?;
                photons = (traced, map.photons);
            }
            let [halves, volume] = seconds_of(&photons.1, &receivers, count, arguments)?;
            let ratio = (halves[0] + halves[1]) / (volume[0] + volume[1]);
            ratios.push(ratio);
            let mut cells = vec![format!("{scene} {traced}, {count}")];
            cells.extend(
                [halves, volume]
                    .into_iter()
                    .flatten()
                    .map(|s| figures(s * 1e3)),
            );
            cells.push(format!("**{}**", figures(ratio)));
            table.row(&cells);
        }
        eprintln!("pictures of {scene}");
    }
    for (&(traced, count), ratios) in sizes.iter().zip(&ratios) {
        let mean = figures(geometric_mean(ratios));
        let mut cells = vec![format!("**mean {traced}, {count}**")];
        cells.extend(std::iter::repeat_n(String::new(), 4));
        cells.push(format!("**{mean}**"));
        table.row(&cells);
    }
    Ok(vec![("pictures", table.finish())])
}

/// Seconds that each kind of tree takes to be built and to be searched for every receiver, on all
/// threads.
fn seconds_of(
    photons: &[Photon],
    receivers: &[Receiver],
    count: usize,
    arguments: &Arguments,
) -> Result<[[f64; 2]; 2], Failure> {
    let reach = NearestEstimate::new(photons, &NearestOptions::default())?.max_radius();
    let positions: Vec<Vec3> = photons.iter().map(|photon| photon.position).collect();
    let mut trees = Vec::new();
    for (splits, ..) in KINDS {
        trees.push(PhotonTree::with_options(
            &positions,
            &PhotonTreeOptions { splits },
        )?);
    }
    let sum = |tree: &PhotonTree, scratch: &mut NearestScratch, receiver: &Receiver| {
        let accept = |index: u32| receiver.accepts(&photons[index as usize], reach);
        let found = tree.nearest_where(receiver.position, count, reach, accept, scratch);
        // What it found, in whatever order.
        found
            .iter()
            .fold(0_u64, |sum, n| sum.wrapping_add(u64::from(n.index) + 1))
    };
    let picture = |tree: &PhotonTree| -> u64 {
        receivers
            .par_iter()
            .with_min_len(CHUNK)
            .map_init(NearestScratch::new, |scratch, receiver| {
                sum(tree, scratch, receiver)
            })
            .reduce(|| 0, u64::wrapping_add)
    };
    let threads = arguments.threads().iter().copied().max().unwrap_or(1);
    pool(threads)?.install(|| {
        if picture(&trees[0]) != picture(&trees[1]) {
            return Err("both trees have to find the same photons".into());
        }
        let mut contestants = Vec::new();
        for ((splits, build, search), tree) in KINDS.into_iter().zip(&trees) {
            let positions = &positions;
            contestants.push(Contestant::new(build, move || {
                PhotonTree::with_options(positions, &PhotonTreeOptions { splits })
                    .map_or(0, |tree| tree.len() as u64)
            }));
            let picture = &picture;
            contestants.push(Contestant::new(search, move || picture(tree)));
        }
        let times = medians(contestants, PATIENCE * arguments.patience());
        let seconds = |name: &str| {
            let time = times.iter().find(|time| time.0 == name);
            time.map_or(f64::NAN, |time| time.1)
        };
        Ok(KINDS.map(|(_, build, search)| [seconds(build), seconds(search)]))
    })
}
