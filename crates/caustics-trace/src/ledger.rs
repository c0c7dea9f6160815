use glam::{DVec3, Vec3};

use crate::photon::{Coverage, Photon};

/// What became of a photon's flux.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Fate {
    /// Kept as a photon on a receiver: the caustic.
    Stored,
    /// Turned into heat in a coloured medium or on a metal.
    Absorbed,
    /// Left the scene after at least one specular event.
    Escaped,
    /// Left the scene without meeting anything.
    Missed,
    /// Emitted outside the directions or the rectangles that hold the specular objects; not traced,
    /// because it can make no caustic.
    Unaimed,
    /// Emitted a second time: where the directions to two casters overlap as their light sees them,
    /// photons are aimed at either, and those of one of them stand for the light. Traced, but no
    /// part of the lights' power.
    Overlap,
    /// Met a receiver before anything specular: direct light, which is not a caustic.
    Direct,
    /// Cut off at the maximum depth.
    TooDeep,
    /// Landed with a footprint larger than [`Culling::max_area`](crate::Culling::max_area) or
    /// [`Culling::max_solid_angle`](crate::Culling::max_solid_angle).
    Wide,
    /// Landed outside [`Culling::view`](crate::Culling::view).
    Unseen,
    /// Ended by Russian roulette.
    Roulette,
    /// Lost to a direction or a position that was not a finite number.
    Invalid,
}

impl Fate {
    /// All fates, in the order of the ledger's lines.
    pub const ALL: [Self; 12] = [
        Self::Stored,
        Self::Absorbed,
        Self::Escaped,
        Self::Missed,
        Self::Unaimed,
        Self::Overlap,
        Self::Direct,
        Self::TooDeep,
        Self::Wide,
        Self::Unseen,
        Self::Roulette,
        Self::Invalid,
    ];

    /// A short name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stored => "stored",
            Self::Absorbed => "absorbed",
            Self::Escaped => "escaped",
            Self::Missed => "missed",
            Self::Unaimed => "unaimed",
            Self::Overlap => "overlap",
            Self::Direct => "direct",
            Self::TooDeep => "too deep",
            Self::Wide => "wide",
            Self::Unseen => "unseen",
            Self::Roulette => "roulette",
            Self::Invalid => "invalid",
        }
    }
}

/// One line of the ledger.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LedgerEntry {
    /// How many path ends, or for [`Fate::Absorbed`] how many absorbing events.
    pub count: u64,
    /// Flux, in watts, for each channel.
    pub flux: DVec3,
}

impl LedgerEntry {
    fn add(&mut self, flux: Vec3) {
        self.count += 1;
        self.flux += flux.as_dvec3();
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.flux += other.flux;
    }

    fn retract(&mut self, other: &Self) {
        self.count = self.count.saturating_sub(other.count);
        self.flux -= other.flux;
        if self.count == 0 {
            // What rounding left of a difference of equal sums.
            self.flux = DVec3::ZERO;
        }
    }
}

/// Where the energy went: every watt that the lights emit is booked once.
///
/// `emitted + roulette gain = stored + absorbed + escaped + … + roulette`, for each channel, up to
/// rounding; [`EnergyLedger::imbalance`] says by how much it fails. Roulette ends some paths and
/// strengthens the rest: what it gave is kept beside what it took, and their difference is zero in
/// the mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnergyLedger {
    emitted: LedgerEntry,
    roulette_gain: DVec3,
    fates: [LedgerEntry; Fate::ALL.len()],
    /// Directions, at most two for each event, for which the geometric normal served because the
    /// interpolated one faced away from the ray or would have sent light to the wrong side of the
    /// surface.
    pub normal_fallbacks: u64,
    /// Differentials that were shortened to the limit, at a critical angle or a grazing event.
    pub bounded_differentials: u64,
    /// Footprints that were taken from a neighbour's landing because their differential was longer.
    pub replaced_differentials: u64,
    /// Photons at the ends of a lattice's rows that were divided: each into four parts and a fifth photon, what
    /// they give back to the cell before them.
    pub divided_photons: u64,
    /// What the photons at the edges of sheets of light carry more than their paths brought them, or
    /// less where it is negative, in watts: each stands for the light up to the edge, of which its row
    /// of the lattice may have more or less than a cell. It is part of what is [`Fate::Stored`].
    pub edge_gain: DVec3,
    /// Rays traced, shadow rays not among them.
    pub rays: u64,
}

impl EnergyLedger {
    /// What the lights emitted, and what was emitted a second time ([`Fate::Overlap`]).
    #[must_use]
    pub fn emitted(&self) -> LedgerEntry {
        self.emitted
    }

    /// What ended as `fate`.
    #[must_use]
    pub fn entry(&self, fate: Fate) -> LedgerEntry {
        self.fates[fate as usize]
    }

    /// The flux that surviving paths were given by Russian roulette, in watts.
    #[must_use]
    pub fn roulette_gain(&self) -> DVec3 {
        self.roulette_gain
    }

    /// The flux of all fates together, in watts.
    #[must_use]
    pub fn accounted(&self) -> DVec3 {
        self.fates.iter().map(|entry| entry.flux).sum()
    }

    /// The largest difference of a channel between what came in and what is accounted for,
    /// relative to the brightest channel of what came in; 0 when nothing was emitted.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        let incoming = self.emitted.flux + self.roulette_gain + self.edge_gain;
        let scale = incoming.max_element();
        if scale <= 0.0 {
            return 0.0;
        }
        (incoming - self.accounted()).abs().max_element() / scale
    }

    /// Books a photon's emission.
    pub fn emit(&mut self, flux: Vec3) {
        self.emitted.add(flux);
    }

    /// Books flux that a light sends where no photon is traced, in watts, as emitted and unaimed.
    pub fn emit_unaimed(&mut self, flux: DVec3) {
        self.emitted.flux += flux;
        self.fates[Fate::Unaimed as usize].flux += flux;
    }

    /// Books the end, or for [`Fate::Absorbed`] the loss, of `flux`.
    pub fn book(&mut self, fate: Fate, flux: Vec3) {
        self.fates[fate as usize].add(flux);
    }

    /// Books flux that a surviving path was given.
    pub fn gain(&mut self, flux: Vec3) {
        self.roulette_gain += flux.as_dvec3();
    }

    /// Adds photons at edges to those that are stored, with the flux in watts that all have more.
    pub(crate) fn gain_at_edges(&mut self, photons: u64, flux: DVec3) {
        self.edge_gain += flux;
        let stored = &mut self.fates[Fate::Stored as usize];
        stored.count += photons;
        stored.flux += flux;
    }

    /// Adds flux to photons that are stored, in watts.
    pub(crate) fn strengthen(&mut self, flux: DVec3) {
        self.fates[Fate::Stored as usize].flux += flux;
    }

    /// Books flux anew that was booked as stored.
    pub(crate) fn rebook(&mut self, fate: Fate, flux: Vec3) {
        self.fates[Fate::Stored as usize].retract(&LedgerEntry {
            count: 1,
            flux: flux.as_dvec3(),
        });
        self.book(fate, flux);
    }

    /// Counts as stored just these photons; images of others do not count.
    pub(crate) fn store(&mut self, photons: &[Photon]) {
        self.fates[Fate::Stored as usize] = LedgerEntry::default();
        let is_own = |photon: &&Photon| photon.coverage != Coverage::Reflected;
        for photon in photons.iter().filter(is_own) {
            self.book(Fate::Stored, photon.flux);
        }
    }

    /// What one photon did, as a short list, and back.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (u8, LedgerEntry)> {
        let gain = LedgerEntry {
            count: 0,
            flux: self.roulette_gain,
        };
        let all = [self.emitted, gain].into_iter().chain(self.fates);
        (0u8..)
            .zip(all)
            .filter(|(_, entry)| entry.count > 0 || entry.flux != DVec3::ZERO)
    }

    /// Adds a line of [`lines`](Self::lines).
    pub(crate) fn add_line(&mut self, line: u8, entry: &LedgerEntry) {
        match line {
            0 => self.emitted.merge(entry),
            1 => self.roulette_gain += entry.flux,
            _ => {
                if let Some(fate) = self.fates.get_mut(usize::from(line) - 2) {
                    fate.merge(entry);
                }
            }
        }
    }

    /// Adds a line that was summed elsewhere to that of `fate`.
    pub fn add(&mut self, fate: Fate, entry: &LedgerEntry) {
        self.fates[fate as usize].merge(entry);
    }

    /// Adds what was emitted elsewhere, and the flux that roulette gave there, in watts.
    pub fn add_emitted(&mut self, entry: &LedgerEntry, roulette_gain: DVec3) {
        self.emitted.merge(entry);
        self.roulette_gain += roulette_gain;
    }

    /// Adds another ledger's lines to this one.
    pub fn merge(&mut self, other: &Self) {
        self.emitted.merge(&other.emitted);
        self.roulette_gain += other.roulette_gain;
        for (mine, theirs) in self.fates.iter_mut().zip(&other.fates) {
            mine.merge(theirs);
        }
        self.normal_fallbacks += other.normal_fallbacks;
        self.bounded_differentials += other.bounded_differentials;
        self.replaced_differentials += other.replaced_differentials;
        self.divided_photons += other.divided_photons;
        self.edge_gain += other.edge_gain;
        self.rays += other.rays;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_balances_only_when_everything_is_booked() {
        let mut ledger = EnergyLedger::default();
        ledger.emit(Vec3::new(1.0, 2.0, 4.0));
        ledger.emit_unaimed(DVec3::splat(0.5));
        assert!((ledger.imbalance() - 4.0 / 4.5).abs() < 1e-12);
        ledger.book(Fate::Stored, Vec3::new(0.5, 2.0, 4.0));
        ledger.book(Fate::Absorbed, Vec3::new(0.5, 0.0, 0.0));
        assert_eq!(ledger.imbalance(), 0.0);
        ledger.gain(Vec3::ONE);
        assert!(ledger.imbalance() > 0.1);
        ledger.book(Fate::Roulette, Vec3::ONE);
        assert_eq!(ledger.imbalance(), 0.0);
    }

    #[test]
    fn merging_adds_every_line() {
        let mut one = EnergyLedger::default();
        one.emit(Vec3::ONE);
        one.book(Fate::Missed, Vec3::ONE);
        one.rays = 3;
        let mut two = one.clone();
        two.merge(&one);
        assert_eq!(two.emitted().count, 2);
        assert_eq!(two.entry(Fate::Missed).flux, DVec3::splat(2.0));
        assert_eq!(two.rays, 6);
        assert_eq!(two.imbalance(), 0.0);
    }
}
