//! Error against seconds, one panel a scene, as SVG.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use caustics::render::Estimate;
use caustics_benches::score::{PeerRow, Row};

use crate::metric::Metric;

const COLUMNS: usize = 2;
const PANEL: [f64; 2] = [470.0, 320.0];
/// Left, top, right and bottom of a panel's frame.
const MARGIN: [f64; 4] = [58.0, 30.0, 14.0, 42.0];
const LEGEND: f64 = 74.0;

/// Colours that stay apart for most eyes (Okabe and Ito 2008); the default's is the strongest.
const COLORS: [(Estimate, &str); 5] = [
    (Estimate::Nearest, "#0072b2"),
    (Estimate::HaltonDisc, "#56b4e9"),
    (Estimate::HaltonEllipse, "#009e73"),
    (Estimate::GridEllipse, "#e69f00"),
    (Estimate::GridGaussian, "#d50000"),
];

/// One chart.
pub(crate) fn chart(rows: &[Row], peers: &[PeerRow], metric: Metric) -> String {
    let scenes: BTreeSet<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    let peer_names: Vec<&str> = peers
        .iter()
        .map(|row| row.peer.as_str())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let width = COLUMNS as f64 * PANEL[0];
    let height = LEGEND + scenes.len().div_ceil(COLUMNS) as f64 * PANEL[1];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
    );
    legend(&mut svg, &peer_names);
    for (index, scene) in scenes.into_iter().enumerate() {
        let origin = [
            (index % COLUMNS) as f64 * PANEL[0],
            LEGEND + (index / COLUMNS) as f64 * PANEL[1],
        ];
        panel(&mut svg, origin, scene, rows, peers, &peer_names, metric);
    }
    svg.push_str("</svg>\n");
    svg
}

fn legend(svg: &mut String, peer_names: &[&str]) {
    for (index, (estimate, color)) in COLORS.into_iter().enumerate() {
        let x = 20.0 + 185.0 * index as f64;
        let bold = if estimate == Estimate::default() {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let _ = writeln!(
            svg,
            "<path d=\"M{x} 16h24\" stroke=\"{color}\" stroke-width=\"{}\"/>\
             <circle cx=\"{}\" cy=\"16\" r=\"3\" fill=\"{color}\"/>\
             <text x=\"{}\" y=\"20\"{bold}>{}</text>",
            line_width(estimate),
            x + 12.0,
            x + 30.0,
            estimate.name(),
        );
    }
    for (index, name) in peer_names.iter().enumerate() {
        let (x, y) = (
            20.0 + 185.0 * (index % 5) as f64,
            38.0 + 18.0 * (index / 5) as f64,
        );
        marker(svg, [x + 12.0, y], index);
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" fill=\"#444\">{name}</text>",
            x + 30.0,
            y + 4.0
        );
    }
}

fn line_width(estimate: Estimate) -> f64 {
    if estimate == Estimate::default() {
        2.4
    } else {
        1.4
    }
}

/// A range of whole decades and its place on the page.
struct Axis {
    low: i32,
    high: i32,
    from: f64,
    to: f64,
}

impl Axis {
    fn around(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| *value > 0.0 && value.is_finite()) {
            low = low.min(value.log10());
            high = high.max(value.log10());
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let low = low.floor() as i32;
        Self {
            low,
            high: (high.ceil() as i32).max(low + 1),
            from,
            to,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let part = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + part.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// The decades that get a line, about eight at most.
    fn decades(&self) -> impl Iterator<Item = i32> {
        let step = (self.high - self.low) / 9 + 1;
        (self.low..=self.high).step_by(step as usize)
    }
}

fn panel(
    svg: &mut String,
    origin: [f64; 2],
    scene: &str,
    rows: &[Row],
    peers: &[PeerRow],
    peer_names: &[&str],
    metric: Metric,
) {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.scene == scene).collect();
    let peers: Vec<&PeerRow> = peers.iter().filter(|row| row.scene == scene).collect();
    let left = origin[0] + MARGIN[0];
    let right = origin[0] + PANEL[0] - MARGIN[2];
    let top = origin[1] + MARGIN[1];
    let bottom = origin[1] + PANEL[1] - MARGIN[3];
    let seconds = rows
        .iter()
        .map(|row| row.seconds())
        .chain(peers.iter().map(|peer| peer.seconds));
    let x = Axis::around(seconds, left, right);
    let errors = rows
        .iter()
        .map(|row| metric.of(row))
        .chain(peers.iter().map(|peer| metric.of_peer(peer)));
    // What is off by more than ten times everything has lost: it stays at the upper edge.
    let y = Axis::around(errors.map(|error| error.min(10.0)), bottom, top);
    grid(svg, &x, &y);
    let _ = writeln!(
        svg,
        "<text x=\"{left}\" y=\"{}\" font-weight=\"bold\" font-size=\"13\">{scene}</text>\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">seconds, trace and estimate</text>\
         <text transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        top - 8.0,
        0.5 * (left + right),
        bottom + 32.0,
        origin[0] + 16.0,
        0.5 * (top + bottom),
        metric.name(),
    );
    for (index, name) in peer_names.iter().enumerate() {
        let mut of_one: Vec<&&PeerRow> = peers.iter().filter(|row| row.peer == *name).collect();
        of_one.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let points: Vec<[f64; 2]> = of_one
            .iter()
            .map(|row| [x.at(row.seconds), y.at(metric.of_peer(row))])
            .collect();
        polyline(svg, &points, "#aaa", 0.8);
        for point in points {
            marker(svg, point, index);
        }
    }
    for (estimate, color) in COLORS {
        let mut of_one: Vec<&&Row> = rows
            .iter()
            .filter(|row| row.estimate == estimate.name())
            .collect();
        of_one.sort_by_key(|row| row.photons);
        let points: Vec<[f64; 2]> = of_one
            .iter()
            .map(|row| [x.at(row.seconds()), y.at(metric.of(row))])
            .collect();
        polyline(svg, &points, color, line_width(estimate));
        for [cx, cy] in points {
            let _ = writeln!(
                svg,
                "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3\" fill=\"{color}\"/>"
            );
        }
    }
}

fn grid(svg: &mut String, x: &Axis, y: &Axis) {
    for decade in x.decades() {
        let at = x.at(10f64.powi(decade));
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            y.from,
            y.to,
            y.from + 16.0,
            power(decade),
        );
    }
    for decade in y.decades() {
        let at = y.at(10f64.powi(decade));
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {at:.1}H{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            x.from,
            x.to,
            x.from - 5.0,
            at + 4.0,
            power(decade),
        );
    }
}

fn power(decade: i32) -> String {
    match decade {
        0..=3 => format!("{}", 10i32.pow(decade as u32)),
        -3..=-1 => format!("{:.*}", decade.unsigned_abs() as usize, 10f64.powi(decade)),
        _ => format!("1e{decade}"),
    }
}

fn polyline(svg: &mut String, points: &[[f64; 2]], color: &str, width: f64) {
    let _ = write!(
        svg,
        "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" points=\""
    );
    for [x, y] in points {
        let _ = write!(svg, "{x:.1},{y:.1} ");
    }
    svg.push_str("\"/>\n");
}

/// The mark of a renderer, by its number.
fn marker(svg: &mut String, [x, y]: [f64; 2], number: usize) {
    let outline = match number % 10 {
        0 => "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z",
        1 => "M-3.5 -3.5h7v7h-7z",
        2 => "M0 -4.5L4.5 3.5H-4.5z",
        3 => "M0 4.5L4.5 -3.5H-4.5z",
        4 => "M0 -5L5 0L0 5L-5 0z",
        5 => "M-4 -4L4 4M-4 4L4 -4",
        6 => "M-5 0H5M0 -5V5",
        7 => "M-4.5 0L3.5 -4.5V4.5z",
        8 => "M4.5 0L-3.5 -4.5V4.5z",
        _ => "M-4 -4L4 4M-4 4L4 -4M-5 0H5M0 -5V5",
    };
    let _ = writeln!(
        svg,
        "<path transform=\"translate({x:.1} {y:.1})\" d=\"{outline}\" fill=\"white\" \
         fill-opacity=\"0.6\" stroke=\"#444\" stroke-width=\"1.2\"/>",
    );
}
