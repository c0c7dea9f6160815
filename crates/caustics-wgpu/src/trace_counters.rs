use caustics_trace::{EnergyLedger, Fate, LedgerEntry};
use glam::DVec3;

use crate::tracer_shaders::RECORDS_OF_DIVIDED;
use crate::{GpuError, TracePlan};

/// What the tracer's counters say, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceCounters {
    /// Records in the buffer.
    pub stored: u32,
    /// Where the energy went, as the CPU's tracer keeps it, with what was lost for want of room as
    /// [`crowded`](Self::crowded) says.
    pub ledger: EnergyLedger,
    /// Parts of photons that were lost because the buffer of records was full or because a photon
    /// had too many branches at once.
    pub crowded: LedgerEntry,
}

impl TraceCounters {
    /// Words of the buffer of counters. Mirrors `COUNTERS` in `shaders/ledger.wgsl`.
    pub const WORDS: usize = 114;

    pub(crate) const STORED: usize = 0;
    pub(crate) const LINES: usize = 2;
    pub(crate) const RAYS: usize = 17;
    pub(crate) const FALLBACKS: usize = 18;
    pub(crate) const BOUNDED: usize = 19;
    pub(crate) const REPLACED: usize = 20;
    pub(crate) const DIVIDED: usize = 21;
    pub(crate) const EDGES: usize = 22;
    pub(crate) const EDGE_GROUPS: usize = 23;
    pub(crate) const SUMS: usize = 24;

    /// The fates in the order of the shader's lines, which further ones follow.
    pub(crate) const FATES: [Fate; 10] = [
        Fate::Stored,
        Fate::Absorbed,
        Fate::Escaped,
        Fate::Missed,
        Fate::Unaimed,
        Fate::Overlap,
        Fate::Direct,
        Fate::TooDeep,
        Fate::Roulette,
        Fate::Invalid,
    ];
    pub(crate) const CROWDED: usize = 10;
    pub(crate) const EMITTED: usize = 11;
    pub(crate) const ROULETTE_GAIN: usize = 12;
    pub(crate) const SILHOUETTE_GAIN: usize = 13;
    pub(crate) const SILHOUETTE_LOSS: usize = 14;

    /// Reads the words of [`PhotonBuffers::counters`](crate::PhotonBuffers::counters) after photons
    /// of `plan` were traced: all of them, or the light that its other photons carry counts as
    /// unaimed.
    ///
    /// # Errors
    /// [`GpuError::CounterSize`] where they are not as many as the shader writes.
    pub fn new(words: &[u32], plan: &TracePlan) -> Result<Self, GpuError> {
        if words.len() < Self::WORDS {
            return Err(GpuError::CounterSize {
                words: words.len(),
                expected: Self::WORDS,
            });
        }
        let unit = f64::from(plan.flux_scale).recip();
        let entry = |line: usize| {
            let sum = |channel: usize| {
                let place = Self::SUMS + 2 * (3 * line + channel);
                let [low, high] = [words[place], words[place + 1]].map(f64::from);
                (high * 4_294_967_296.0 + low) * unit
            };
            LedgerEntry {
                count: u64::from(words[Self::LINES + line]),
                flux: DVec3::new(sum(0), sum(1), sum(2)),
            }
        };
        let mut ledger = EnergyLedger::default();
        for (line, fate) in Self::FATES.into_iter().enumerate() {
            ledger.add(fate, &entry(line));
        }
        let emitted = entry(Self::EMITTED);
        ledger.add_emitted(&emitted, entry(Self::ROULETTE_GAIN).flux);
        // Light of directions that two emitters cover is emitted once.
        let overlap = ledger.entry(Fate::Overlap).flux;
        ledger.emit_unaimed(plan.power() - (emitted.flux - overlap));
        let gain = entry(Self::SILHOUETTE_GAIN).flux - entry(Self::SILHOUETTE_LOSS).flux;
        ledger.edge_gain = gain;
        ledger.divided_photons = u64::from(words[Self::DIVIDED]);
        ledger.add(
            Fate::Stored,
            &LedgerEntry {
                count: u64::from(RECORDS_OF_DIVIDED - 1) * ledger.divided_photons,
                flux: gain,
            },
        );
        ledger.rays = u64::from(words[Self::RAYS]);
        ledger.normal_fallbacks = u64::from(words[Self::FALLBACKS]);
        ledger.bounded_differentials = u64::from(words[Self::BOUNDED]);
        ledger.replaced_differentials = u64::from(words[Self::REPLACED]);
        Ok(Self {
            stored: words[Self::STORED],
            ledger,
            crowded: entry(Self::CROWDED),
        })
    }
}
