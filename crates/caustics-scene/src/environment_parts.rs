use glam::Vec3;

/// A row of an [`Environment`](crate::Environment), with its part of the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EnvironmentRow {
    /// The cosine of the angle from +Y at which it begins.
    pub top: f32,
    /// The cosine of the angle from +Y at which it ends.
    pub bottom: f32,
    /// Of each of its texels, in steradians.
    pub solid_angle: f32,
    /// Of [`Environment::PARTS`](crate::Environment::PARTS) samples, those on the rows up to and
    /// including this one.
    pub end: u32,
}

/// A texel of an [`Environment`](crate::Environment), with its part of its row's samples.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EnvironmentTexel {
    /// Radiance from there, in W/(sr m^2).
    pub radiance: Vec3,
    /// Of [`Environment::PARTS`](crate::Environment::PARTS) samples on the row, those on the texels
    /// up to and including this one.
    pub end: u32,
}

/// What samples fall on: a row or a texel.
pub(crate) trait Sampled {
    /// Parts up to and including this one.
    fn end(&self) -> u32;
}

impl Sampled for EnvironmentRow {
    fn end(&self) -> u32 {
        self.end
    }
}

impl Sampled for EnvironmentTexel {
    fn end(&self) -> u32 {
        self.end
    }
}

/// What a number falls on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) index: usize,
    /// How far along it, in [0, 1).
    pub(crate) along: f32,
    /// Its part of all samples.
    pub(crate) part: f32,
}

/// All parts: as many as leave the end of the last a number of 32 bits. They are whole, so that
/// what a number falls on, and how far along, is the same in a shader that has no f64.
pub(crate) const PARTS: u32 = 1 << 31;

/// Where the parts of each of these weights end, in proportion to them. What has any weight has at
/// least one part, however dim beside the others: no light is lost. Nothing has parts where all
/// weights are zero.
pub(crate) fn ends(weights: &[f64]) -> impl Iterator<Item = u32> {
    let total: f64 = weights.iter().sum();
    let lit = weights.iter().filter(|&&it| it > 0.0).count() as u32;
    let shared = f64::from(PARTS.saturating_sub(lit));
    let mut least = 0;
    let mut sum = 0.0;
    weights.iter().map(move |&weight| {
        least += u32::from(weight > 0.0);
        sum += weight;
        if total > 0.0 {
            least + (sum / total * shared).round() as u32
        } else {
            0
        }
    })
}

/// What a number in [0, 1) falls on when all lie side by side, each as long as its part.
pub(crate) fn chosen<T: Sampled>(all: &[T], number: f32) -> Chosen {
    // `max` turns a NaN into 0. The product is exact, and rounded down.
    let number = number.max(0.0).min(1.0f32.next_down());
    let at = (number * PARTS as f32) as u32;
    let index = all
        .partition_point(|it| it.end() <= at)
        .min(all.len().saturating_sub(1));
    let start = index.checked_sub(1).map_or(0, |it| all[it].end());
    let parts = all.get(index).map_or(0, |it| it.end() - start);
    let along = if parts > 0 {
        (at - start) as f32 / parts as f32
    } else {
        0.5
    };
    Chosen {
        index,
        along: along.min(1.0f32.next_down()),
        part: parts as f32 / PARTS as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(weights: &[f64]) -> Vec<EnvironmentTexel> {
        let texel = |end| EnvironmentTexel {
            radiance: Vec3::ONE,
            end,
        };
        ends(weights).map(texel).collect()
    }

    #[test]
    fn parts_are_in_proportion_and_sum_to_all() {
        let parts = row(&[1.0, 0.0, 2.0, 1.0, 0.0]);
        let ends: Vec<u32> = parts.iter().map(|it| it.end).collect();
        let quarter = PARTS / 4;
        assert_eq!(ends[4], PARTS);
        assert_eq!((ends[0], ends[3]), (ends[1], ends[4]));
        for (end, exact) in ends.iter().zip([1, 1, 3, 4]) {
            assert!(end.abs_diff(exact * quarter) <= 1, "{ends:?}");
        }
    }

    #[test]
    fn the_dimmest_has_a_part() {
        let mut weights = vec![1e-30; 1000];
        weights[500] = 1e30;
        let parts = row(&weights);
        assert_eq!(parts[499].end, 500);
        assert_eq!(parts[500].end, PARTS - 499);
        assert_eq!(parts[999].end, PARTS);
    }

    #[test]
    fn numbers_fall_on_what_lies_there() {
        let parts = row(&[1.0, 0.0, 2.0, 1.0, 0.0]);
        for (number, index, along) in [
            (0.0, 0, 0.0),
            (0.125, 0, 0.5),
            // What has no weight is never chosen.
            (0.25, 2, 0.0),
            (0.5, 2, 0.5),
            (0.875, 3, 0.5),
            (-1.0, 0, 0.0),
            (f32::NAN, 0, 0.0),
        ] {
            let found = chosen(&parts, number);
            assert_eq!(found.index, index, "{number}");
            assert!((found.along - along).abs() < 1e-6, "{number}: {found:?}");
        }
        assert_eq!(chosen(&parts, 0.3).part, 0.5);
        let last = chosen(&parts, 7.0);
        assert!(last.index == 3 && last.along < 1.0 && last.along > 0.999_999);
    }

    #[test]
    fn of_nothing_nothing_is_chosen() {
        let black = row(&[0.0, 0.0]);
        assert_eq!(black[1].end, 0);
        assert_eq!(chosen(&black, 0.7).part, 0.0);
        assert_eq!(chosen::<EnvironmentTexel>(&[], 0.7).part, 0.0);
    }
}
