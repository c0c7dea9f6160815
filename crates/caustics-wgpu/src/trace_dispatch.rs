//! A batch of photons as dispatches, each of emitters of one kind.

use std::ops::Range;

use crate::GpuError;
use crate::photon_buffers::PhotonBuffers;
use crate::scene_buffers::SceneBuffers;
use crate::sky_tables::{same_size, sky_size};
use crate::trace_params::{Emitter, MAX_EMITTERS, TraceParams};
use crate::trace_plan::{PlannedEmitter, TracePlan};

/// Consecutive photons of emitters that are all of one kind.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dispatch {
    pub(crate) photons: Range<u32>,
    pub(crate) emitters: Range<usize>,
    pub(crate) dimensions: u32,
}

/// The fewest dispatches for a range of photons. Those of one light stay together, since each emitter
/// asks what the light's earlier ones cover.
pub(crate) fn dispatches_of(emitters: &[PlannedEmitter], photons: &Range<u32>) -> Vec<Dispatch> {
    let mut all: Vec<Dispatch> = Vec::new();
    let mut index = 0;
    for light in emitters.chunk_by(|a, b| a.mirror.first_of_light == b.mirror.first_of_light) {
        let of_light = index..index + light.len();
        index = of_light.end;
        let [first, last] = [&light[0].mirror, &light[light.len() - 1].mirror];
        let start = first.first.max(photons.start);
        let end = (last.first + last.count).min(photons.end);
        if start >= end {
            continue;
        }
        let dimensions = light[0].dimensions;
        match all.last_mut() {
            Some(before)
                if before.dimensions == dimensions
                    && before.photons.end == start
                    && before.emitters.end == of_light.start
                    && of_light.end - before.emitters.start <= MAX_EMITTERS =>
            {
                before.photons.end = end;
                before.emitters.end = of_light.end;
            }
            _ => all.push(Dispatch {
                photons: start..end,
                emitters: of_light,
                dimensions,
            }),
        }
    }
    all
}

/// What a dispatch is told, but for what it has in common with the others of its batch. A plan whose
/// environment is of another size than the scene's is refused.
pub(crate) fn params(
    scene: &SceneBuffers,
    plan: &TracePlan,
    part: &Dispatch,
    into: &PhotonBuffers,
) -> Result<TraceParams, GpuError> {
    let checks = plan.checks_footprints(part.dimensions);
    let mut params = TraceParams {
        zero: 0,
        first: part.photons.start,
        count: part.photons.len() as u32,
        batch_first: 0,
        emitter_count: part.emitters.len() as u32,
        sequence: plan.sequence(),
        seed_low: plan.options.seed as u32,
        seed_high: (plan.options.seed >> 32) as u32,
        max_depth: plan.options.max_depth,
        branching: plan.branching(),
        min_weight: plan.options.min_weight,
        flux_scale: plan.flux_scale,
        first_link: into.scratch.slots,
        root: scene.root,
        flags: if checks { TraceParams::CHECKS } else { 0 },
        slots: 0,
        first_edge: into.scratch.first_edge,
        first_boundary: plan.first_boundary,
        unused_b: 0,
        unused_c: 0,
        emitters: [Emitter::default(); MAX_EMITTERS],
    };
    let emitters = &plan.emitters[part.emitters.clone()];
    for (slot, emitter) in params.emitters.iter_mut().zip(emitters) {
        *slot = emitter.mirror;
        slot.first_of_light -= part.emitters.start as u32;
        if slot.kind == Emitter::SKY {
            let size = [slot.sky_width, slot.sky_height];
            same_size(size, sky_size(scene.environment.as_ref()))?;
            slot.sky_first = scene.counts.triangles as u32;
        }
    }
    Ok(params)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_of_one_kind_share_a_dispatch() {
        let emitter = |first, count, first_of_light, dimensions| PlannedEmitter {
            mirror: Emitter {
                first,
                count,
                first_of_light,
                ..Emitter::default()
            },
            dimensions,
        };
        // Two emitters of one light, one of which has no photons; others of one each.
        let emitters = vec![
            emitter(0, 0, 0, 2),
            emitter(0, 10, 0, 2),
            emitter(10, 5, 2, 2),
            emitter(15, 7, 3, 4),
            emitter(22, 3, 4, 2),
        ];
        let expected = |photons, emitters, dimensions| Dispatch {
            photons,
            emitters,
            dimensions,
        };
        assert_eq!(
            dispatches_of(&emitters, &(0..25)),
            [
                expected(0..15, 0..3, 2),
                expected(15..22, 3..4, 4),
                expected(22..25, 4..5, 2)
            ]
        );
        assert_eq!(
            dispatches_of(&emitters, &(12..17)),
            [expected(12..15, 2..3, 2), expected(15..17, 3..4, 4)]
        );
        assert_eq!(dispatches_of(&emitters, &(4..9)), [expected(4..9, 0..2, 2)]);
        assert_eq!(dispatches_of(&emitters, &(5..5)), []);
        let many: Vec<_> = (0..130).map(|first| emitter(first, 1, first, 2)).collect();
        assert_eq!(dispatches_of(&many, &(0..130)).len(), 3);
    }
}
