//! The tracer's shaders, one for each hierarchy and number of parameters.

use crate::pass_layout::Slot;
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};

/// Photons of one workgroup. Mirrors `WORKGROUP_SIZE` in `shaders/tracer.wgsl`.
pub(crate) const WORKGROUP_SIZE: u32 = 64;

/// Photons or records of one workgroup of [`MARK`] and of [`DIVIDERS`]. Mirrors the constant in
/// `shaders/edge_rows.wgsl`.
pub(crate) const EDGE_WORKGROUP_SIZE: u32 = 64;

/// Words that link a record. Mirrors the constant in `shaders/photon_links.wgsl`.
pub(crate) const LINK_WORDS: u32 = 3;

/// The parts of a divided photon, likewise.
pub(crate) const PARTS: u32 = 4;

/// The records of a divided photon, likewise: its parts, and what they give back.
pub(crate) const RECORDS_OF_DIVIDED: u32 = PARTS + 1;

/// Which hierarchy rays traverse. Both give the same hits.
///
/// Chosen by measurement on a software adapter (8 invocations in lockstep), as the speed of tracing
/// 10,000 photons, relative to a loop over binary nodes with every test of a leaf in it; the forms ran
/// in turn in one process, on `p01_sphere`, `p03_cognac` and `p06_wave_plane` of the tests' scenes:
///
/// | form | speed |
/// | --- | --- |
/// | binary, all tests in the loop, entry distances on the stack | 1, 1, 1 |
/// | binary, spheres and exact edges apart, nodes alone on the stack ([`Binary`](Self::Binary)) | 2.18, 2.15, 1.48 |
/// | wide, leaves in the loop over nodes | 2.72, 2.40, 1.77 |
/// | wide, leaves after a loop over nodes ([`Wide`](Self::Wide)) | 2.71, 2.67, 2.00 |
///
/// On top of the last, pushing children unsorted made 0.87 to 0.99 of its speed, and an invocation that begins another photon when it is done
/// with one 0.64 to 1.01, the less coherent its photons were. `docs/gpu.md` has both hierarchies on
/// all scenes. What a GPU prefers is not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Hierarchy {
    /// Two children a node, 32 bytes each, in full precision.
    Binary,
    /// Four children a node, 64 bytes for all, with boxes in 255 steps along each axis.
    #[default]
    Wide,
}

impl Hierarchy {
    /// All hierarchies.
    pub const ALL: [Self; 2] = [Self::Binary, Self::Wide];
}

/// The pieces of a shader that traces rays: how many parameters a ray has and how its hits are found,
/// all that takes it from light to receiver, and what is done with it.
macro_rules! pieces {
    ($parameters:literal, $nodes:literal, $traverse:literal, $($last:literal),+) => {
        &[
            shader_piece!($parameters),
            FOOTPRINT_RECORD,
            shader_piece!("trace_params"),
            shader_piece!("scene"),
            shader_piece!("scene_bindings"),
            shader_piece!($nodes),
            shader_piece!("rounding"),
            shader_piece!("vector"),
            shader_piece!("double_float"),
            shader_piece!("random"),
            shader_piece!("wide_integer"),
            shader_piece!("sobol"),
            shader_piece!("halton"),
            shader_piece!("grid"),
            shader_piece!("lattice"),
            shader_piece!("point_set"),
            shader_piece!("guide"),
            shader_piece!("warp"),
            shader_piece!("warp_inverse"),
            shader_piece!("ray"),
            shader_piece!("watertight"),
            shader_piece!("sphere"),
            shader_piece!("leaf_test"),
            shader_piece!($traverse),
            shader_piece!("spawn"),
            shader_piece!("surface"),
            shader_piece!("optics"),
            shader_piece!("media"),
            shader_piece!("scatter"),
            shader_piece!("differential"),
            shader_piece!("emission"),
            shader_piece!("area_emission"),
            shader_piece!("sky_emission"),
            shader_piece!("overlap"),
            shader_piece!("ledger_lines"),
            shader_piece!("photon_links"),
            shader_piece!("sheet"),
            shader_piece!("photon_turns"),
            shader_piece!("photon_store"),
            shader_piece!("boundary"),
            shader_piece!("tracer"),
            $(shader_piece!($last)),+
        ]
    };
}

/// Those that trace photons.
macro_rules! tracer_pieces {
    ($parameters:literal, $nodes:literal, $traverse:literal) => {
        pieces!($parameters, $nodes, $traverse, "ledger", "trace_photons")
    };
}

/// Those that divide photons at edges.
macro_rules! divider_pieces {
    ($nodes:literal, $traverse:literal) => {
        pieces!(
            "parameters_2",
            $nodes,
            $traverse,
            "probe_ledger",
            "probe",
            "neighbours",
            "photon_beside",
            "edge_rows",
            "edge_parts",
            "give_back",
            "narrow_sheets",
            "divide_photons"
        )
    };
}

/// For lights without area, whose rays have two parameters, and for area lights and skies, whose rays
/// have four.
pub(crate) const BINARY: [Shader; 2] = [
    Shader {
        label: "tracer of 2 parameters, binary",
        pieces: tracer_pieces!("parameters_2", "binary_nodes", "traverse"),
    },
    Shader {
        label: "tracer of 4 parameters, binary",
        pieces: tracer_pieces!("parameters_4", "binary_nodes", "traverse"),
    },
];

/// Likewise.
pub(crate) const WIDE: [Shader; 2] = [
    Shader {
        label: "tracer of 2 parameters",
        pieces: tracer_pieces!("parameters_2", "wide_nodes", "traverse_wide"),
    },
    Shader {
        label: "tracer of 4 parameters",
        pieces: tracer_pieces!("parameters_4", "wide_nodes", "traverse_wide"),
    },
];

/// Finds what [`DIVIDERS`] divide. Binds what the tracer binds.
pub(crate) const MARK: Shader = Shader {
    label: "mark_edges",
    pieces: &[
        FOOTPRINT_RECORD,
        shader_piece!("trace_params"),
        shader_piece!("vector"),
        shader_piece!("rounding"),
        shader_piece!("grid"),
        shader_piece!("lattice"),
        shader_piece!("ledger_lines"),
        shader_piece!("photon_links"),
        shader_piece!("sheet"),
        shader_piece!("photon_turns"),
        shader_piece!("photon_store"),
        shader_piece!("neighbours"),
        shader_piece!("photon_beside"),
        shader_piece!("edge_rows"),
        shader_piece!("mark_edges"),
    ],
};

/// Divide photons at the edges of sheets of light, by either hierarchy. Bind what the tracer binds.
pub(crate) const DIVIDERS: [Shader; 2] = [
    Shader {
        label: "divide_photons, binary",
        pieces: divider_pieces!("binary_nodes", "traverse"),
    },
    Shader {
        label: "divide_photons",
        pieces: divider_pieces!("wide_nodes", "traverse_wide"),
    },
];

/// What the shader binds, in the order of its bindings.
pub(crate) const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Write,
    Slot::Write,
    Slot::Write,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TraceCounters;
    use crate::gpu_scene::{
        Body, LEAF_BIT, NO_PRIMITIVE, Node, SPHERE_BIT, Triangle, Vertex, WideNode,
    };
    use crate::scene_hierarchy::MAX_WAITING;
    use crate::shader::{ShaderPiece, assert_layout, reflection};
    use crate::trace_params::{Emitter, MAX_EMITTERS, NO_CASTER, TraceParams};
    use caustics_scene::Environment;
    use caustics_trace::ProjectionMap;

    #[test]
    fn every_variant_is_valid_and_agrees_with_rust() {
        let all = BINARY.into_iter().chain(WIDE);
        for (shader, parameters) in all.zip([2, 4, 2, 4]) {
            let (module, _) = reflection::validated(&shader).unwrap_or_else(|it| panic!("{it}"));
            let slots: Vec<(u32, Slot)> = (0..).zip(SLOTS).collect();
            assert_eq!(reflection::buffers(&module), slots);
            let size = reflection::workgroup_size(&module, "trace_photons");
            assert_eq!(size, [WORKGROUP_SIZE, 1, 1]);
            let constant = |name| reflection::constant(&module, name);
            assert_eq!(constant("PARAMETERS"), parameters);
            assert_eq!(constant("MAX_EMITTERS"), MAX_EMITTERS as u32);
            assert_eq!(constant("NO_BOUNDARIES"), TraceParams::NO_BOUNDARIES);
            assert_eq!(
                constant("BOUNDARY_WORDS"),
                crate::trace_plan::BOUNDARY_WORDS
            );
            assert_eq!(constant("MAX_WAITING"), MAX_WAITING);
            assert_eq!(constant("LEAF_BIT"), LEAF_BIT);
            assert_eq!(constant("SPHERE_BIT"), SPHERE_BIT);
            assert_eq!(constant("NO_PRIMITIVE"), NO_PRIMITIVE);
            assert_eq!(constant("COUNTERS"), TraceCounters::WORDS as u32);
            assert_eq!(constant("BODY_RECEIVER"), Body::RECEIVER);
            assert_eq!(constant("BODY_DIELECTRIC"), Body::DIELECTRIC);
            assert_eq!(constant("BODY_METAL"), Body::METAL);
            assert_eq!(constant("EMITTER_SPHERE"), Emitter::SPHERE);
            assert_eq!(constant("EMITTER_CONE"), Emitter::CONE);
            assert_eq!(constant("EMITTER_RECTANGLE"), Emitter::RECTANGLE);
            assert_eq!(constant("EMITTER_AREA"), Emitter::AREA);
            assert_eq!(constant("EMITTER_SKY"), Emitter::SKY);
            assert_eq!(constant("SKY_PARTS"), Environment::PARTS);
            assert_eq!(constant("SURFACE_OBJECT"), Emitter::SURFACE_OBJECT);
            assert_eq!(constant("SURFACE_RECTANGLE"), Emitter::SURFACE_RECTANGLE);
            assert_eq!(constant("SURFACE_DISC"), Emitter::SURFACE_DISC);
            assert_eq!(constant("SURFACE_CAP"), Emitter::SURFACE_CAP);
            assert_eq!(constant("SURFACE_TRIANGLE"), Emitter::SURFACE_TRIANGLE);
            assert_eq!(constant("NO_CASTER"), NO_CASTER);
            assert_eq!(constant("NO_MAP"), Emitter::NO_MAP);
            assert_eq!(
                constant("FLAG_NEIGHBOURS_ONLY"),
                TraceParams::NEIGHBOURS_ONLY
            );
            assert_eq!(constant("MAP_RESOLUTION"), ProjectionMap::RESOLUTION);
        }
    }

    #[test]
    fn shaders_of_edges_are_valid_and_agree_with_rust() {
        for shader in DIVIDERS {
            let (module, _) = reflection::validated(&shader).unwrap_or_else(|it| panic!("{it}"));
            let slots: Vec<(u32, Slot)> = (0..).zip(SLOTS).collect();
            assert_eq!(reflection::buffers(&module), slots);
            let size = reflection::workgroup_size(&module, "divide_photons");
            assert_eq!(size, [EDGE_WORKGROUP_SIZE, 1, 1]);
            let constant = |name| reflection::constant(&module, name);
            assert_eq!(constant("LINK_WORDS"), LINK_WORDS);
            assert_eq!(constant("PARTS"), PARTS);
            assert_eq!(constant("RECORDS_OF_DIVIDED"), RECORDS_OF_DIVIDED);
            assert_eq!(constant("LINK_PLACE"), !constant("LINK_DIVIDED"));
            // A path's turns leave the flag of a divided record free.
            let turns = constant("TURN_FIRST") + constant("TURN_SURFACES");
            assert_eq!(1 << turns, constant("LINK_DIVIDED"));
        }
        let (module, _) = reflection::validated(&MARK).unwrap_or_else(|it| panic!("{it}"));
        for (place, slot) in reflection::buffers(&module) {
            assert_eq!(slot, SLOTS[place as usize], "{place}");
        }
        let size = reflection::workgroup_size(&module, "mark_edges");
        assert_eq!(size, [EDGE_WORKGROUP_SIZE, 1, 1]);
    }

    #[test]
    fn structs_are_laid_out_as_in_rust() {
        let (module, _) = reflection::validated(&WIDE[0]).unwrap();
        assert_layout!(
            &module,
            Node {
                low,
                first,
                high,
                is_leaf
            }
        );
        assert_layout!(
            &module,
            WideNode {
                origin,
                exponents,
                low,
                unused_a,
                high,
                unused_b,
                children
            }
        );
        assert_layout!(
            &module,
            Vertex {
                position,
                normal_x,
                normal_y,
                normal_z,
                unused_a,
                unused_b
            }
        );
        assert_layout!(&module, Triangle { a, b, c, body });
        assert_layout!(
            &module,
            Body {
                color,
                kind,
                channel_ior,
                ior,
                center,
                radius,
                object,
                priority,
                disperses,
                caster
            }
        );
        assert_layout!(
            &module,
            Emitter {
                kind,
                first,
                count,
                points,
                place,
                generator,
                share,
                media,
                origin,
                solid_angle,
                tangent,
                height,
                bitangent,
                inner_cosine,
                axis,
                outer_cosine,
                intensity,
                area,
                spot_axis,
                side,
                target_center,
                target_radius,
                first_primitive,
                primitive_count,
                first_cumulative,
                media_count,
                basis,
                rows,
                stream,
                caster,
                first_of_light,
                first_span,
                span_count,
                first_map,
                surface,
                radius,
                sky_first,
                sky_width,
                sky_height,
                first_density,
                density_cells,
                unused_a,
                unused_b,
            }
        );
        assert_layout!(
            &module,
            TraceParams {
                zero,
                first,
                count,
                batch_first,
                emitter_count,
                sequence,
                seed_low,
                seed_high,
                max_depth,
                branching,
                min_weight,
                flux_scale,
                first_link,
                root,
                flags,
                slots,
                first_edge,
                first_boundary,
                unused_b,
                unused_c,
                emitters,
            }
        );
    }

    #[test]
    fn counters_lie_where_rust_reads_them() {
        let (module, _) = reflection::validated(&WIDE[0]).unwrap();
        let words = [
            ("COUNTER_STORED", TraceCounters::STORED),
            ("COUNTER_LINES", TraceCounters::LINES),
            ("COUNTER_RAYS", TraceCounters::RAYS),
            ("COUNTER_FALLBACKS", TraceCounters::FALLBACKS),
            ("COUNTER_BOUNDED", TraceCounters::BOUNDED),
            ("COUNTER_REPLACED", TraceCounters::REPLACED),
            ("COUNTER_DIVIDED", TraceCounters::DIVIDED),
            ("COUNTER_EDGES", TraceCounters::EDGES),
            ("COUNTER_EDGE_GROUPS", TraceCounters::EDGE_GROUPS),
            ("COUNTER_SUMS", TraceCounters::SUMS),
            ("FATE_CROWDED", TraceCounters::CROWDED),
            ("LINE_EMITTED", TraceCounters::EMITTED),
            ("LINE_ROULETTE_GAIN", TraceCounters::ROULETTE_GAIN),
        ];
        for (name, word) in words {
            assert_eq!(reflection::constant(&module, name), word as u32, "{name}");
        }
        for (line, fate) in TraceCounters::FATES.into_iter().enumerate() {
            let name = format!("FATE_{}", fate.name().to_uppercase().replace(' ', "_"));
            assert_eq!(reflection::constant(&module, &name), line as u32);
        }
        let sums = TraceCounters::WORDS - TraceCounters::SUMS;
        assert_eq!(sums as u32, 6 * reflection::constant(&module, "LINES"));
    }

    /// The variant for area lights with a piece after the others.
    fn with_piece(source: &'static str) -> Shader {
        let mut pieces = WIDE[1].pieces.to_vec();
        pieces.push(ShaderPiece {
            name: "last",
            source,
        });
        Shader {
            label: "changed",
            pieces: pieces.leak(),
        }
    }

    #[test]
    fn a_broken_variant_is_rejected() {
        assert!(reflection::validated(&with_piece("fn whole() -> u32 { return 1u; }\n")).is_ok());
        for broken in [
            "fn wrong_type() -> u32 { return trace.min_weight; }\n",
            "fn no_such_member() -> f32 { return trace.max_weight; }\n",
            "const SPHERE_BIT: u32 = 1u;\n",
            "fn writes_the_scene() { wide_nodes[0].exponents = 1u; }\n",
        ] {
            assert!(
                reflection::validated(&with_piece(broken)).is_err(),
                "{broken}"
            );
        }
    }

    #[test]
    fn a_layout_that_differs_is_seen() {
        let moved = "struct Moved { a: f32, position: vec3<f32> }\n\
                     fn first_of(it: Moved) -> f32 { return it.a; }\n";
        let (module, _) = reflection::validated(&with_piece(moved)).unwrap();
        let (members, size) = reflection::layout(&module, "Moved");
        assert_eq!(members[1], ("position".to_owned(), 16));
        assert_eq!(size, 32);
    }
}
