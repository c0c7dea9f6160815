//! What was measured, as it is kept in a CSV file.

use caustics_benches::fields::Fields;
use caustics_benches::score::Conditions;
use caustics_benches::stage::Failure;

/// How a picture was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Way {
    Cpu,
    Tiles,
    Quads,
    HalfFloats,
}

impl Way {
    pub(crate) const ALL: [Self; 4] = [Self::Cpu, Self::Tiles, Self::Quads, Self::HalfFloats];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Cpu => "CPU",
            Self::Tiles => "tiles",
            Self::Quads => "quads",
            Self::HalfFloats => "quads in half floats",
        }
    }
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) photons: u32,
    pub(crate) way: Way,
    /// Landings.
    pub(crate) stored: u64,
    /// Seconds of tracing, of splatting, and of splatting nothing.
    pub(crate) trace: f64,
    pub(crate) splat: f64,
    pub(crate) empty: f64,
    /// Seconds of sorting footprints for a gather, and of asking for its light.
    pub(crate) build: f64,
    pub(crate) gather: f64,
    pub(crate) energy: f64,
    pub(crate) relative_mse: f64,
    pub(crate) trimmed: f64,
    pub(crate) flip: Option<f64>,
    /// The sum of the differences from the CPU's picture over its sum, where no edge is.
    pub(crate) off: f64,
    pub(crate) passes: u32,
    pub(crate) dispatches: u32,
    pub(crate) draws: u32,
    /// Millions of bytes that a splat moves, at least.
    pub(crate) moved: f64,
    pub(crate) adapter: String,
    pub(crate) conditions: Conditions,
}

const HEADER: &str = "scene,photons,way,stored,trace_seconds,splat_seconds,empty_seconds,\
build_seconds,gather_seconds,energy_ratio,relmse,relmse_trim1,flip_ldr,off,passes,dispatches,\
draws,moved_mb,adapter,threads,machine,date,commit";

impl Row {
    fn line(&self) -> String {
        let flip = self.flip.map_or_else(String::new, |it| format!("{it:.5}"));
        let Conditions {
            threads,
            machine,
            date,
            commit,
        } = &self.conditions;
        format!(
            "{},{},{},{},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.6e},{:.6e},{flip},{:.3e},{},{},{},\
             {:.2},{},{threads},{machine},{date},{commit}",
            self.scene,
            self.photons,
            self.way.name(),
            self.stored,
            self.trace,
            self.splat,
            self.empty,
            self.build,
            self.gather,
            self.energy,
            self.relative_mse,
            self.trimmed,
            self.off,
            self.passes,
            self.dispatches,
            self.draws,
            self.moved,
            self.adapter.replace(',', ";"),
        )
    }

    fn parse(line: &str) -> Result<Self, Failure> {
        let fields = Fields::of(line, HEADER)?;
        let way = Way::ALL.into_iter().find(|it| it.name() == fields.text(2));
        Ok(Self {
            scene: fields.text(0).to_owned(),
            photons: fields.number(1)?,
            way: way.ok_or_else(|| format!("no way {}", fields.text(2)))?,
            stored: fields.number(3)?,
            trace: fields.number(4)?,
            splat: fields.number(5)?,
            empty: fields.number(6)?,
            build: fields.number(7)?,
            gather: fields.number(8)?,
            energy: fields.number(9)?,
            relative_mse: fields.number(10)?,
            trimmed: fields.number(11)?,
            flip: fields.number(12).ok(),
            off: fields.number(13)?,
            passes: fields.number(14)?,
            dispatches: fields.number(15)?,
            draws: fields.number(16)?,
            moved: fields.number(17)?,
            adapter: fields.text(18).to_owned(),
            conditions: Conditions {
                threads: fields.number(19)?,
                machine: fields.text(20).to_owned(),
                date: fields.text(21).to_owned(),
                commit: fields.text(22).to_owned(),
            },
        })
    }
}

pub(crate) fn to_csv(rows: &[Row]) -> String {
    let lines = rows.iter().map(Row::line);
    let mut csv = vec![HEADER.to_owned()];
    csv.extend(lines);
    csv.push(String::new());
    csv.join("\n")
}

pub(crate) fn from_csv(csv: &str) -> Result<Vec<Row>, Failure> {
    let mut lines = csv.lines();
    if lines.next() != Some(HEADER) {
        return Err("the rows have other columns".into());
    }
    lines.map(Row::parse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_the_file() {
        let row = Row {
            scene: "s".to_owned(),
            photons: 7,
            way: Way::HalfFloats,
            stored: 9,
            trace: 0.5,
            splat: 0.25,
            empty: 0.125,
            build: 1.5,
            gather: 2.5,
            energy: 1.0,
            relative_mse: 0.25,
            trimmed: 0.125,
            flip: None,
            off: 0.5,
            passes: 1,
            dispatches: 2,
            draws: 3,
            moved: 4.5,
            adapter: "a".to_owned(),
            conditions: Conditions {
                threads: 2,
                machine: "m".to_owned(),
                date: "d".to_owned(),
                commit: "c".to_owned(),
            },
        };
        let rows = [
            row.clone(),
            Row {
                flip: Some(0.5),
                ..row
            },
        ];
        assert_eq!(from_csv(&to_csv(&rows)).unwrap(), rows);
        assert!(from_csv("a\n").is_err());
        assert!(from_csv(&format!("{HEADER}\n1,2")).is_err());
    }
}
