use crate::ledger::{EnergyLedger, LedgerEntry};
use crate::photon::Photon;
use crate::traced::Traced;

/// The golden section of 2^32: its multiples, modulo that, spread evenly at any count.
const GOLDEN: u32 = 0x9E37_79B9;

/// Photons of consecutive points.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunk {
    pub(crate) records: Vec<Record>,
    pub(crate) photons: Vec<Photon>,
    /// For each photon, what its path met.
    pub(crate) paths: Vec<u32>,
    pub(crate) bookings: Vec<Booking>,
}

/// What is remembered of one emitted photon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    /// Of its point.
    pub(crate) number: u32,
    /// Where its stored photons end, in its chunk.
    pub(crate) photons_end: u32,
    /// Where its bookings end.
    pub(crate) bookings_end: u32,
    pub(crate) touched: u32,
    pub(crate) passed: u64,
    pub(crate) rays: u32,
    pub(crate) fallbacks: u16,
    pub(crate) bounded: u16,
}

/// A line of one photon's ledger.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Booking {
    pub(crate) line: u8,
    pub(crate) count: u32,
    pub(crate) flux: glam::Vec3,
}

/// Which of the photons of a pair are traced anew.
#[derive(Clone, Copy)]
pub(crate) struct Stale {
    /// Casters that count as moved, a bit each.
    pub(crate) touched: u32,
    /// Blocks of space in which something changed.
    pub(crate) passed: u64,
    /// Those whose turn it is: their distance from the first in the golden order.
    pub(crate) first: u32,
    pub(crate) turns: u64,
    /// Those that reached no caster.
    pub(crate) unmet: bool,
    pub(crate) all: bool,
}

impl Stale {
    pub(crate) const NONE: Self = Self {
        touched: 0,
        passed: 0,
        first: 0,
        turns: 0,
        unmet: false,
        all: false,
    };

    pub(crate) fn holds(&self, record: &Record) -> bool {
        let turn = record.number.wrapping_mul(GOLDEN).wrapping_sub(self.first);
        self.all
            || record.touched & self.touched != 0
            || record.passed & self.passed != 0
            || (self.unmet && record.touched == 0)
            || u64::from(turn) < self.turns
    }
}

impl Chunk {
    /// Chunks in their order as one.
    pub(crate) fn joined(chunks: &[Self]) -> Traced {
        let mut all = Traced {
            photons: Vec::new(),
            paths: Vec::new(),
            starts: Vec::new(),
            ledger: EnergyLedger::default(),
        };
        for chunk in chunks {
            let mut start = all.photons.len();
            let base = start;
            for record in &chunk.records {
                all.starts.push(start);
                start = base + record.photons_end as usize;
            }
            all.photons.extend_from_slice(&chunk.photons);
            all.paths.extend_from_slice(&chunk.paths);
            chunk.book(&mut all.ledger);
        }
        all
    }

    /// Takes over a photon of another chunk.
    pub(crate) fn keep(&mut self, old: &Self, index: usize) {
        let starts = index.checked_sub(1).map_or((0, 0), |it| {
            let before = &old.records[it];
            (before.photons_end, before.bookings_end)
        });
        let record = &old.records[index];
        let photons = starts.0 as usize..record.photons_end as usize;
        self.photons
            .extend_from_slice(&old.photons[photons.clone()]);
        self.paths.extend_from_slice(&old.paths[photons]);
        self.bookings
            .extend_from_slice(&old.bookings[starts.1 as usize..record.bookings_end as usize]);
        self.records.push(Record {
            photons_end: self.photons.len() as u32,
            bookings_end: self.bookings.len() as u32,
            ..*record
        });
    }

    /// Remembers a photon that has just been traced.
    pub(crate) fn note(&mut self, number: u32, touched: u32, passed: u64, ledger: &EnergyLedger) {
        self.bookings
            .extend(ledger.lines().map(|(line, entry)| Booking {
                line,
                count: entry.count as u32,
                flux: entry.flux.as_vec3(),
            }));
        let small = |count: u64| u16::try_from(count).unwrap_or(u16::MAX);
        self.records.push(Record {
            number,
            photons_end: self.photons.len() as u32,
            bookings_end: self.bookings.len() as u32,
            touched,
            passed,
            rays: ledger.rays as u32,
            fallbacks: small(ledger.normal_fallbacks),
            bounded: small(ledger.bounded_differentials),
        });
    }

    pub(crate) fn book(&self, ledger: &mut EnergyLedger) {
        for booking in &self.bookings {
            let entry = LedgerEntry {
                count: u64::from(booking.count),
                flux: booking.flux.as_dvec3(),
            };
            ledger.add_line(booking.line, &entry);
        }
        for record in &self.records {
            ledger.rays += u64::from(record.rays);
            ledger.normal_fallbacks += u64::from(record.fallbacks);
            ledger.bounded_differentials += u64::from(record.bounded);
        }
    }
}
