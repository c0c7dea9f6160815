//! Lines in panels, as SVG.

use std::fmt::Write as _;
use std::fs;

use crate::stage::Failure;

const COLUMNS: usize = 2;
const PANEL: [f64; 2] = [470.0, 310.0];
/// Left, top, right and bottom of a panel's frame.
const MARGIN: [f64; 4] = [62.0, 30.0, 16.0, 44.0];
const ENTRY_WIDTH: f64 = 230.0;
const ENTRY_HEIGHT: f64 = 18.0;

/// Colours that stay apart for most eyes (Okabe and Ito 2008).
const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9", "#000000",
];

/// A line of a panel.
#[derive(Clone, Debug)]
pub struct Line {
    /// Which of the chart's names it has.
    pub name: usize,
    /// From left to right.
    pub points: Vec<[f64; 2]>,
    /// Whether it is what others are to be held against.
    pub is_dashed: bool,
}

/// Lines with axes of their own.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above the panel.
    pub title: String,
    /// What is along the axes, with units.
    pub labels: [&'static str; 2],
    /// Whether an axis is of powers of ten.
    pub powers: [bool; 2],
    /// In the order in which they are drawn.
    pub lines: Vec<Line>,
}

/// Writes panels under a legend to a file beside the pages of the documentation.
///
/// # Errors
/// If the file cannot be written.
pub fn write(file: &str, names: &[&str], panels: &[Panel]) -> Result<(), Failure> {
    let width = COLUMNS as f64 * PANEL[0];
    let per_row = (width / ENTRY_WIDTH) as usize;
    let legend = 12.0 + ENTRY_HEIGHT * names.len().div_ceil(per_row) as f64;
    let height = legend + panels.len().div_ceil(COLUMNS) as f64 * PANEL[1];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
    );
    for (index, name) in names.iter().enumerate() {
        let x = 20.0 + ENTRY_WIDTH * (index % per_row) as f64;
        let y = 16.0 + ENTRY_HEIGHT * (index / per_row) as f64;
        writeln!(
            svg,
            "<path d=\"M{x} {y}h24\" stroke=\"{}\" stroke-width=\"2\"{}/>\
             <text x=\"{}\" y=\"{}\">{name}</text>",
            color(index),
            dashes(
                panels
                    .iter()
                    .flat_map(|it| &it.lines)
                    .all(|it| it.is_dashed || it.name != index)
            ),
            x + 30.0,
            y + 4.0,
        )?;
    }
    for (index, panel) in panels.iter().enumerate() {
        let left = (index % COLUMNS) as f64 * PANEL[0];
        let top = legend + (index / COLUMNS) as f64 * PANEL[1];
        draw(&mut svg, [left, top], panel)?;
    }
    svg.push_str("</svg>\n");
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/");
    fs::write(format!("{folder}{file}"), svg)?;
    Ok(())
}

/// As an attribute.
fn dashes(is_dashed: bool) -> &'static str {
    if is_dashed {
        " stroke-dasharray=\"5 4\""
    } else {
        ""
    }
}

fn color(name: usize) -> &'static str {
    COLORS[name % COLORS.len()]
}

/// A range of values and its place on the page.
struct Axis {
    has_powers: bool,
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn around(values: impl Iterator<Item = f64>, has_powers: bool, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|it| it.is_finite() && (!has_powers || *it > 0.0)) {
            let value = if has_powers { value.log10() } else { value };
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if has_powers {
            low = low.floor();
            high = high.ceil().max(low + 1.0);
        } else {
            // From zero on, unless that leaves most of the panel empty.
            if low < 0.5 * high {
                low = low.min(0.0);
            }
            high = high.max(low + 1e-9);
        }
        Self {
            has_powers,
            low,
            high,
            from,
            to,
        }
    }

    /// Values that are too small for powers lie on the axis.
    fn at(&self, value: f64) -> f64 {
        let value = if self.has_powers {
            value.max(1e-300).log10()
        } else {
            value
        };
        let part = (value - self.low) / (self.high - self.low);
        self.from + part.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Values that get a line, with their names.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.has_powers {
            let step = ((self.high - self.low) as usize) / 8 + 1;
            return (self.low as i32..=self.high as i32)
                .step_by(step)
                .map(|decade| (10f64.powi(decade), power(decade)))
                .collect();
        }
        let rough = (self.high - self.low) / 5.0;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .map(|it| it * decade)
            .find(|it| *it >= rough)
            .unwrap_or(rough);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.low / step).ceil() as i32;
        (first..)
            .map(|number| f64::from(number) * step)
            .take_while(|value| *value <= self.high + 1e-9 * step)
            .map(|value| (value, format!("{value:.digits$}")))
            .collect()
    }
}

fn power(decade: i32) -> String {
    match decade {
        0..=4 => format!("{}", 10i32.pow(decade.unsigned_abs())),
        -3..=-1 => format!("{:.*}", decade.unsigned_abs() as usize, 10f64.powi(decade)),
        _ => format!("1e{decade}"),
    }
}

fn draw(svg: &mut String, [left, top]: [f64; 2], panel: &Panel) -> Result<(), Failure> {
    let (from_x, to_x) = (left + MARGIN[0], left + PANEL[0] - MARGIN[2]);
    let (to_y, from_y) = (top + MARGIN[1], top + PANEL[1] - MARGIN[3]);
    let along = |axis: usize| {
        panel
            .lines
            .iter()
            .flat_map(move |it| it.points.iter().map(move |at| at[axis]))
    };
    let x = Axis::around(along(0), panel.powers[0], from_x, to_x);
    let y = Axis::around(along(1), panel.powers[1], from_y, to_y);
    for (value, name) in x.ticks() {
        let at = x.at(value);
        writeln!(
            svg,
            "<path d=\"M{at:.1} {from_y:.1}V{to_y:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            from_y + 16.0,
        )?;
    }
    for (value, name) in y.ticks() {
        let at = y.at(value);
        writeln!(
            svg,
            "<path d=\"M{from_x:.1} {at:.1}H{to_x:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            from_x - 5.0,
            at + 4.0,
        )?;
    }
    writeln!(
        svg,
        "<text x=\"{from_x}\" y=\"{}\" font-weight=\"bold\" font-size=\"13\">{}</text>\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        to_y - 8.0,
        panel.title,
        0.5 * (from_x + to_x),
        from_y + 34.0,
        panel.labels[0],
        left + 14.0,
        0.5 * (from_y + to_y),
        panel.labels[1],
    )?;
    for line in &panel.lines {
        let color = color(line.name);
        let dashes = dashes(line.is_dashed);
        write!(
            svg,
            "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"1.6\"{dashes} points=\""
        )?;
        for at in &line.points {
            write!(svg, "{:.1},{:.1} ", x.at(at[0]), y.at(at[1]))?;
        }
        svg.push_str("\"/>\n");
        if line.is_dashed || line.points.len() > 30 {
            continue;
        }
        for at in &line.points {
            writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{color}\"/>",
                x.at(at[0]),
                y.at(at[1])
            )?;
        }
    }
    Ok(())
}
