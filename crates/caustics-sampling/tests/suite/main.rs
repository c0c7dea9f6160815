//! Tests of sequences, warps and shares.
//!
//! One program, which takes less time to build than one for each file.

mod density_table;
mod lattices;
mod sequences;
mod shares;
mod warps;
