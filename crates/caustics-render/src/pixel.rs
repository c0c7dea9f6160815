use caustics_sampling::CounterRng;
use glam::Vec2;

/// The fractional parts of these multiples fill the unit square evenly at every count: the
/// two-dimensional analogue of the golden ratio (Roberts, *The Unreasonable Effectiveness of
/// Quasirandom Sequences*, 2018).
const STEP: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// The points of a pixel, in 0..1 on both axes, through which its eye rays go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelSamples {
    next: Vec2,
    left: u32,
}

impl PixelSamples {
    /// `count` points, shifted differently in each pixel; a single point is the pixel's centre.
    pub(crate) fn new(count: u32, rng: &mut CounterRng) -> Self {
        let next = if count == 1 {
            Vec2::splat(0.5)
        } else {
            rng.next_vec2()
        };
        Self { next, left: count }
    }
}

impl Iterator for PixelSamples {
    type Item = Vec2;

    fn next(&mut self) -> Option<Vec2> {
        self.left = self.left.checked_sub(1)?;
        let point = self.next;
        self.next = (self.next + STEP).fract();
        Some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_is_the_centre_and_many_fill_the_pixel() {
        let mut rng = CounterRng::new(1, 2);
        assert_eq!(
            PixelSamples::new(1, &mut rng).collect::<Vec<_>>(),
            [Vec2::splat(0.5)]
        );
        let mut cells = [0; 16];
        for point in PixelSamples::new(256, &mut rng) {
            assert!(point.cmpge(Vec2::ZERO).all() && point.cmplt(Vec2::ONE).all());
            cells[(point.x * 4.0) as usize + 4 * (point.y * 4.0) as usize] += 1;
        }
        assert!(
            cells.iter().all(|&count| (13..=19).contains(&count)),
            "{cells:?}"
        );
    }
}
