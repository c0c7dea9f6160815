use glam::Vec3;

use crate::edges::PARTS;
use crate::photon::Photon;

/// The value of the default footprint's Gaussian at its middle, times the axis.
const PEAK: f32 = 0.725_34;

/// In place of that Gaussian, (1 - x² / 256)^128 of the distance x in standard deviations of 0.55 axes: a
/// graphics processor raises to powers in the same bits. 1 / 256 with the distance in axes.
const CUT: f32 = 0.012_913_223;

/// A part keeps at least so much of its flux.
const LEAST_KEPT: f32 = 0.3;

/// Where the flux that parts give back lands, in axes of the photon before them, and how wide, likewise.
const SHIFT: f32 = 0.1;
const WIDTH: f32 = 0.6;

/// Lets the parts of a divided photon give back what its place has too much of, and returns it as a photon
/// in the middle of the cell before them in their row, `inner`; `unit` spans that cell along lattice axis
/// `axis`, towards the parts.
///
/// Side by side, footprints as wide as their cells sum to even light. Where narrow ones follow on a wide
/// one they do not: it reaches far over the narrow ones' light, and they do not reach as far over its own,
/// so that there is a quarter too little before them and as much too much on them. The sum of all at the
/// middle of a part, 1 where they are even, says how much. Parts keep the inverse of its square: less than
/// the sum alone says, as what is beside them gives back, too. The power is chosen by measurement, of six from
/// 1 to 3, and the error depends little on it. Parts that would have to gain stay as they are.
pub(crate) fn give_back(
    parts: &mut [Photon; PARTS],
    inner: Vec3,
    unit: Vec3,
    axis: usize,
) -> Photon {
    let kept = parts.map(|part| {
        let mut sum = kernel(inner, unit, part.position);
        for other in &*parts {
            sum += kernel(other.position, other.axes[axis], part.position);
        }
        (1.0 / (sum * sum)).clamp(LEAST_KEPT, 1.0)
    });
    let mut back = parts[0];
    back.flux = Vec3::ZERO;
    for (part, kept) in parts.iter_mut().zip(kept) {
        let flux = kept * part.flux;
        back.flux += part.flux - flux;
        part.flux = flux;
    }
    back.position = inner + SHIFT * unit;
    back.axes[axis] = WIDTH * unit;
    back
}

/// How much of even light a footprint with this middle and `axis` has along it at a place.
fn kernel(middle: Vec3, axis: Vec3, place: Vec3) -> f32 {
    let squared = axis.length_squared();
    if squared == 0.0 {
        return 0.0;
    }
    // By a reciprocal, since processors that divide so are not to differ.
    let distance = (place - middle).dot(axis) * (1.0 / squared);
    let mut power = (1.0 - CUT * distance * distance).max(0.0);
    for _ in 0..7 {
        power *= power;
    }
    PEAK * power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A photon of even light with its middle there, as wide as that.
    fn photon(middle: f32, width: f32) -> Photon {
        Photon {
            flux: width * Vec3::ONE,
            ..Photon::landed(middle * Vec3::X, [width * Vec3::X, Vec3::Z])
        }
    }

    /// How far from 1 the light of photons is at most between -1.5 and half of the parts.
    fn unevenness(photons: &[Photon]) -> f32 {
        let light = |x: f32| {
            let part = |photon: &Photon| {
                let width = photon.axes[0].length();
                let away = (x - photon.position.x) / (0.55 * width);
                photon.flux.x / width * PEAK * (-0.5 * away * away).exp()
            };
            photons.iter().map(part).sum::<f32>()
        };
        (0..200)
            .map(|step| (light(0.01 * step as f32 - 1.5) - 1.0).abs())
            .fold(0.0, f32::max)
    }

    #[test]
    fn parts_beside_wide_cells_make_more_even_light_and_lose_none() {
        for sign in [1.0, -1.0] {
            let mut parts = [(0.25, 0.5), (0.625, 0.25), (0.8125, 0.125), (0.9375, 0.125)]
                .map(|(middle, width)| photon(middle, width));
            let mut all: Vec<_> = (0..6).map(|it| photon(-0.5 - it as f32, 1.0)).collect();
            // The axes of a row that leads towards smaller coordinates point the other way.
            for photon in all.iter_mut().chain(&mut parts) {
                photon.axes[0] *= sign;
            }
            let inner = all[0];
            let mut plain = all.clone();
            plain.extend(parts);
            let flux = |photons: &[Photon]| photons.iter().map(|it| it.flux.x).sum::<f32>();

            let unit = sign * inner.axes[0];
            let back = give_back(&mut parts, inner.position, unit, 0);
            all.extend(parts);
            all.push(back);
            assert!((flux(&all) - flux(&plain)).abs() < 1e-5);
            let (with, without) = (unevenness(&all), unevenness(&plain));
            assert!(
                without > 0.12 && with < 0.6 * without,
                "{with} for {without}"
            );
            assert!(back.flux.x > 0.1 && back.position.x < 0.0 && back.position.x > -0.5);
        }
    }

    #[test]
    fn parts_as_wide_as_their_neighbours_keep_their_light() {
        let mut parts = [0.5, 1.5, 2.5, 3.5].map(|middle| photon(middle, 1.0));
        let back = give_back(&mut parts, -0.5 * Vec3::X, Vec3::X, 0);
        assert!(back.flux.x < 0.03, "{}", back.flux);
        // A focus has no width to weigh.
        let mut parts = [photon(0.5, 0.0); 4];
        let back = give_back(&mut parts, 0.5 * Vec3::X, Vec3::ZERO, 0);
        assert!(back.flux.is_finite() && parts.iter().all(|it| it.flux.is_finite()));
    }
}
