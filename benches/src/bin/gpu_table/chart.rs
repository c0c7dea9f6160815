//! Errors of all ways, scene by scene, as SVG.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::rows::{Row, Way};

const SIZE: [f64; 2] = [940.0, 420.0];
/// Left, top, right and bottom of the frame.
const FRAME: [f64; 4] = [62.0, 52.0, 926.0, 350.0];

/// Colours that stay apart for most eyes (Okabe and Ito 2008).
const COLORS: [(Way, &str); 4] = [
    (Way::Cpu, "#000000"),
    (Way::Tiles, "#d50000"),
    (Way::Quads, "#0072b2"),
    (Way::HalfFloats, "#e69f00"),
];

/// relMSE against the scene; the fewest photons as rings, more as discs.
pub(crate) fn chart(rows: &[Row]) -> String {
    let scenes: Vec<&str> = rows
        .iter()
        .map(|row| row.scene.as_str())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let counts: BTreeSet<u32> = rows.iter().map(|row| row.photons).collect();
    let [width, height] = SIZE;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
    );
    for (index, (way, color)) in COLORS.into_iter().enumerate() {
        let x = 70.0 + 130.0 * index as f64;
        let _ = writeln!(
            svg,
            "<circle cx=\"{x}\" cy=\"18\" r=\"4\" fill=\"{color}\"/>\
             <text x=\"{}\" y=\"22\">{}</text>",
            x + 9.0,
            way.name(),
        );
    }
    for (index, count) in counts.iter().enumerate() {
        let x = 640.0 + 140.0 * index as f64;
        let fill = if index == 0 { "white" } else { "#666" };
        let _ = writeln!(
            svg,
            "<circle cx=\"{x}\" cy=\"18\" r=\"4\" fill=\"{fill}\" stroke=\"#666\"/>\
             <text x=\"{}\" y=\"22\">{count} photons</text>",
            x + 9.0,
        );
    }
    let errors = rows.iter().map(|row| row.relative_mse.log10());
    let low = errors.clone().fold(0.0, f64::min).floor();
    let high = errors
        .fold(f64::NEG_INFINITY, f64::max)
        .ceil()
        .max(low + 1.0);
    let [left, top, right, bottom] = FRAME;
    let y = |value: f64| bottom - (value - low) / (high - low) * (bottom - top);
    for decade in low as i32..=high as i32 {
        let at = y(f64::from(decade));
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>",
            left - 6.0,
            at + 4.0,
        );
    }
    let _ = writeln!(
        svg,
        "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">relMSE</text>",
        0.5 * (top + bottom),
    );
    let step = (right - left) / scenes.len().max(1) as f64;
    for (index, scene) in scenes.iter().enumerate() {
        let middle = left + (index as f64 + 0.5) * step;
        let _ = writeln!(
            svg,
            "<text transform=\"translate({middle:.1} {}) rotate(-18)\" text-anchor=\"end\">{scene}\
             </text>",
            bottom + 18.0,
        );
        for row in rows.iter().filter(|row| row.scene == *scene) {
            let place = Way::ALL.iter().position(|&it| it == row.way).unwrap_or(0);
            let x = middle + (place as f64 - 1.5) * 0.18 * step;
            let at = y(row.relative_mse.log10());
            let color = COLORS[place].1;
            let is_first = counts.first() == Some(&row.photons);
            let fill = if is_first { "white" } else { color };
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{at:.1}\" r=\"4\" fill=\"{fill}\" stroke=\"{color}\"/>",
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}
