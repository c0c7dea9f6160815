//! The closing table, for people and for programs.

use std::fmt;

use caustics::Caustics;
use caustics::prelude::*;
use caustics::trace::LedgerEntry;
use serde_json::{Map, Value, json};

use crate::arguments::Arguments;

/// Wall-clock time of each stage, in seconds.
#[derive(Clone, Copy)]
pub(crate) struct Seconds {
    pub load: f64,
    pub build: f64,
    pub trace: f64,
    pub render: f64,
    pub write: f64,
}

impl Seconds {
    fn stages(&self) -> [(&'static str, f64); 5] {
        [
            ("load", self.load),
            ("build", self.build),
            ("trace", self.trace),
            ("render", self.render),
            ("write", self.write),
        ]
    }
}

/// What there is to say when a picture is done.
pub(crate) struct Report<'a> {
    name: &'a str,
    arguments: &'a Arguments,
    caustics: &'a Caustics,
    picture: &'a Picture,
    seconds: Seconds,
}

impl<'a> Report<'a> {
    pub(crate) fn new(
        name: &'a str,
        arguments: &'a Arguments,
        caustics: &'a Caustics,
        picture: &'a Picture,
        seconds: Seconds,
    ) -> Self {
        Self {
            name,
            arguments,
            caustics,
            picture,
            seconds,
        }
    }

    fn photon_rays_per_second(&self) -> f64 {
        self.caustics.map().ledger.rays as f64 / self.seconds.trace.max(1e-9)
    }

    fn eye_rays_per_second(&self) -> f64 {
        self.picture.rays as f64 / self.seconds.render.max(1e-9)
    }

    pub(crate) fn to_json(&self) -> String {
        let ledger = &self.caustics.map().ledger;
        let entry =
            |entry: LedgerEntry| json!({ "count": entry.count, "watts": entry.flux.to_array() });
        let fates: Map<String, Value> = Fate::ALL
            .iter()
            .map(|&fate| (fate.name().replace(' ', "_"), entry(ledger.entry(fate))))
            .collect();
        let seconds: Map<String, Value> = self
            .seconds
            .stages()
            .iter()
            .map(|&(stage, seconds)| (stage.to_owned(), json!(seconds)))
            .collect();
        let value = json!({
            "scene": self.name,
            "estimate": self.arguments.caustics.estimate.name(),
            "width": self.picture.direct.width(),
            "height": self.picture.direct.height(),
            "samples": self.arguments.picture.samples,
            "seed": self.arguments.caustics.trace.seed,
            "triangles": self.caustics.world().triangles().len(),
            "photons_emitted": ledger.emitted().count,
            "photons_stored": self.caustics.map().photons.len(),
            "energy": {
                "emitted": entry(ledger.emitted()),
                "roulette_gain": ledger.roulette_gain().to_array(),
                "edge_gain": ledger.edge_gain.to_array(),
                "fates": fates,
                "imbalance": ledger.imbalance(),
            },
            "normal_fallbacks": ledger.normal_fallbacks,
            "bounded_differentials": ledger.bounded_differentials,
            "replaced_differentials": ledger.replaced_differentials,
            "divided_photons": ledger.divided_photons,
            "seconds": seconds,
            "photon_rays": ledger.rays,
            "photon_rays_per_second": self.photon_rays_per_second(),
            "eye_rays": self.picture.rays,
            "eye_rays_per_second": self.eye_rays_per_second(),
        });
        format!("{value:#}\n")
    }
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ledger = &self.caustics.map().ledger;
        writeln!(f, "{}", self.name)?;
        writeln!(
            f,
            "  triangles        {:>12}",
            self.caustics.world().triangles().len()
        )?;
        writeln!(f, "  photons emitted  {:>12}", ledger.emitted().count)?;
        writeln!(
            f,
            "  photons stored   {:>12}",
            self.caustics.map().photons.len()
        )?;
        writeln!(f, "  energy                  count          watts    share")?;
        let total = ledger.emitted().flux.element_sum().max(f64::MIN_POSITIVE);
        let mut line = |name: &str, entry: LedgerEntry| {
            let watts = entry.flux.element_sum() / 3.0;
            let share = 100.0 * entry.flux.element_sum() / total;
            writeln!(
                f,
                "    {name:<12} {:>14} {watts:>14.6} {share:>7.3} %",
                entry.count
            )
        };
        line("emitted", ledger.emitted())?;
        for fate in Fate::ALL {
            let entry = ledger.entry(fate);
            if entry.count > 0 || entry.flux.element_sum() > 0.0 {
                line(fate.name(), entry)?;
            }
        }
        writeln!(f, "    in and out differ by {:.1e}", ledger.imbalance())?;
        write!(f, "  seconds         ")?;
        for (stage, seconds) in self.seconds.stages() {
            write!(f, " {stage} {seconds:.3}")?;
        }
        writeln!(f)?;
        writeln!(
            f,
            "  rays per second  {:.2e} photon, {:.2e} eye",
            self.photon_rays_per_second(),
            self.eye_rays_per_second()
        )
    }
}
