//! The same seed gives the same bytes on any number of threads.

use caustics::prelude::*;
use caustics_filter::encode_exr;
use caustics_tests::{TestError, gallery};
use rayon::ThreadPoolBuilder;

/// Both parts of a picture as files, made on this many threads.
fn files(name: &str, seed: u64, threads: usize) -> Result<[Vec<u8>; 2], TestError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| {
        let scene = gallery::load(name)?;
        let trace = TraceOptions {
            photons: 30_000,
            seed,
            branching: Branching::SplitFirst,
            ..TraceOptions::default()
        };
        let options = CausticsOptions {
            trace,
            ..CausticsOptions::default()
        };
        let caustics = Caustics::new(&scene, &options)?;
        let options = PictureOptions {
            width: 64,
            height: 48,
            samples: 2,
            seed,
            ..PictureOptions::default()
        };
        let picture = caustics.render(&scene.cameras()[0], &options)?;
        Ok([encode_exr(&picture.direct)?, encode_exr(&picture.caustics)?])
    })
}

#[test]
fn threads_do_not_change_a_bit() -> Result<(), TestError> {
    for name in [
        "p03_cognac",
        "p06_wave_plane",
        "p09_cornell",
        "p10_torus_cube",
    ] {
        let one = files(name, 7, 1)?;
        for threads in [2, 8] {
            assert!(
                files(name, 7, threads)? == one,
                "{name} on {threads} threads"
            );
        }
        // Files that are the same whatever is asked for would pass as well.
        let other = files(name, 8, 2)?;
        assert!(
            other[0] != one[0] && other[1] != one[1],
            "{name} with another seed"
        );
    }
    Ok(())
}
