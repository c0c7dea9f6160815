/// How radiance becomes the brightness of a screen.
///
/// ```
/// use caustics_filter::{Display, ToneCurve};
///
/// let plain = Display::default();
/// assert_eq!(plain.encode([0.0, 0.214_041_14, 7.0]), [0, 128, 255]);
/// let darker = Display { exposure_ev: -3.0, ..plain };
/// assert_eq!(darker.encode([8.0 * 0.214_041_14; 3]), [128; 3]);
/// let soft = Display { curve: ToneCurve::Reinhard { white: 4.0 }, ..plain };
/// assert!(soft.encode([2.0; 3])[0] < 255);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Exposure in stops: the picture is multiplied by `2^exposure_ev`.
    pub exposure_ev: f32,
    /// What happens to radiance above one, after exposure.
    pub curve: ToneCurve,
}

/// How an unlimited linear range is fitted to `[0, 1]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ToneCurve {
    /// Nothing is changed up to one; each channel is clamped there.
    #[default]
    Clamp,
    /// Luminance `L` becomes `L (1 + L/white^2) / (1 + L)`; hue is kept, then clamped.
    ///
    /// Reinhard et al., *Photographic Tone Reproduction for Digital Images* (2002), equation 4.
    /// Luminance is that of Rec. 709 primaries.
    Reinhard {
        /// The least luminance shown as full white; above zero.
        white: f32,
    },
}

impl Display {
    /// One linear RGB pixel as 8-bit sRGB (IEC 61966-2-1), rounded to nearest.
    ///
    /// A NaN or anything negative is black, positive infinity white.
    #[must_use]
    pub fn encode(&self, linear: [f32; 3]) -> [u8; 3] {
        let scale = self.exposure_ev.exp2();
        let exposed = linear.map(|value| (value * scale).max(0.0));
        let toned = match self.curve {
            ToneCurve::Clamp => exposed,
            ToneCurve::Reinhard { white } => {
                let [red, green, blue] = exposed.map(|value| value.min(1e18));
                let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
                let gain = (1.0 + luminance / (white * white)) / (1.0 + luminance);
                [red * gain, green * gain, blue * gain]
            }
        };
        toned.map(|value| (255.0 * srgb(value.min(1.0))).round() as u8)
    }
}

/// The sRGB transfer function on `[0, 1]`.
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_levels_of_the_standard() {
        // Linear values whose sRGB code is exactly the level, from the inverse transfer in f64.
        let plain = Display::default();
        for level in 0..=255_u8 {
            let code = f64::from(level) / 255.0;
            let linear = if code <= 0.04045 {
                code / 12.92
            } else {
                ((code + 0.055) / 1.055).powf(2.4)
            };
            assert_eq!(plain.encode([linear as f32; 3]), [level; 3]);
        }
    }

    #[test]
    fn extremes_are_black_or_white() {
        for curve in [ToneCurve::Clamp, ToneCurve::Reinhard { white: 2.0 }] {
            let display = Display {
                exposure_ev: 0.0,
                curve,
            };
            let extremes = [f32::NAN, f32::NEG_INFINITY, -1.0];
            assert_eq!(display.encode(extremes), [0; 3], "{curve:?}");
            assert_eq!(
                display.encode([f32::INFINITY, f32::MAX, 1e20]),
                [255; 3],
                "{curve:?}"
            );
        }
    }

    #[test]
    fn reinhard_reaches_one_at_white_and_keeps_dark_parts() {
        let display = Display {
            exposure_ev: 0.0,
            curve: ToneCurve::Reinhard { white: 4.0 },
        };
        assert_eq!(display.encode([4.0; 3]), [255; 3]);
        assert!(display.encode([3.5; 3])[0] < 255);
        // 0.01 (1 + 0.01/16) / 1.01 = 0.009907, in sRGB 25.2.
        assert_eq!(display.encode([0.01; 3]), [25; 3]);
    }
}
