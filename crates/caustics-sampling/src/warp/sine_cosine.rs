use std::f32::consts::FRAC_2_PI;

/// The first digits of a quarter turn: a few times it is exact.
const QUARTER_HIGH: f32 = 1.570_312_5;
const QUARTER_LOW: f32 = 4.838_268e-4;

/// Sine and cosine of an angle between -8 and 8 radians, within 1.5e-7.
///
/// Those of the standard library are the platform's, and differ between platforms in the last
/// digit; a shader's differ far more. These are Taylor's series within an eighth of a turn, in
/// operations that round alike everywhere: photons start alike on any machine.
#[must_use]
pub fn sine_cosine(angle: f32) -> (f32, f32) {
    let quarters = (angle * FRAC_2_PI).round_ties_even();
    let x = (angle - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW;
    let y = x * x;
    let sine_tail = -1.984_127e-4 + y * 2.755_732e-6;
    let sine = x + x * y * (-1.666_666_7e-1 + y * (8.333_334e-3 + y * sine_tail));
    let cosine_tail = -1.388_888_9e-3 + y * (2.480_158_7e-5 - y * 2.755_732e-7);
    let cosine = 1.0 + y * (-0.5 + y * (4.166_666_8e-2 + y * cosine_tail));
    match quarters as i32 & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn it_agrees_with_f64() {
        for step in -80_000..80_000 {
            let angle = step as f32 * 1e-4;
            let (sine, cosine) = sine_cosine(angle);
            let (exact_sine, exact_cosine) = f64::from(angle).sin_cos();
            assert!((f64::from(sine) - exact_sine).abs() < 1.5e-7, "{angle}");
            assert!((f64::from(cosine) - exact_cosine).abs() < 1.5e-7, "{angle}");
        }
    }

    #[test]
    fn no_angle_and_a_quarter_turn() {
        assert_eq!(sine_cosine(0.0), (0.0, 1.0));
        let (sine, cosine) = sine_cosine(FRAC_PI_2);
        assert!(sine == 1.0 && cosine.abs() < 1e-7);
    }
}
