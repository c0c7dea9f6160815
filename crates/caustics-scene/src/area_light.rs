//! Objects that emit light.

use glam::Vec3;
use std::f32::consts::PI;
use std::ops::Range;

/// An emissive object of a [`World`](crate::World): every triangle or sphere of it emits the same
/// radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    object: u32,
    primitives: Range<u32>,
    radiance: Vec3,
    double_sided: bool,
    area: f32,
    /// Fraction of the area up to and including each primitive; the last is exactly 1.
    cumulative: Vec<f32>,
}

impl AreaLight {
    /// The light of an object whose primitives have these areas; `None` where they sum to nothing.
    pub(crate) fn new(
        object: u32,
        first_primitive: u32,
        areas: &[f64],
        radiance: Vec3,
        double_sided: bool,
    ) -> Option<Self> {
        // In f64: the areas of a million triangles, added one by one in f32, would lose the light
        // of those that come last.
        let total: f64 = areas.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut sum = 0.0;
        let mut cumulative: Vec<f32> = areas
            .iter()
            .map(|area| {
                sum += area;
                (sum / total) as f32
            })
            .collect();
        *cumulative.last_mut()? = 1.0;
        let primitives = first_primitive..first_primitive + areas.len() as u32;
        Some(Self {
            object,
            primitives,
            radiance,
            double_sided,
            area: total as f32,
            cumulative,
        })
    }

    /// Which object of the world it is.
    #[must_use]
    pub fn object(&self) -> u32 {
        self.object
    }

    /// The primitives that emit, by the world's numbers: all of the object's triangles, or its
    /// sphere.
    #[must_use]
    pub fn primitives(&self) -> Range<u32> {
        self.primitives.clone()
    }

    /// Radiance in W/(sr m^2), RGB, from every point and in every direction of an emitting side.
    #[must_use]
    pub fn radiance(&self) -> Vec3 {
        self.radiance
    }

    /// Whether the back emits as the front does.
    #[must_use]
    pub fn double_sided(&self) -> bool {
        self.double_sided
    }

    /// Surface area in m^2, counting each point once.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.area
    }

    /// All the flux that it sends out, RGB, in W: `pi * area * radiance`, for each side that emits.
    #[must_use]
    pub fn power(&self) -> Vec3 {
        let sides = if self.double_sided { 2.0 } else { 1.0 };
        sides * PI * self.area * self.radiance
    }

    /// The fraction of the area up to and including each primitive, in the order of
    /// [`primitives`](Self::primitives), ending at 1.
    #[must_use]
    pub fn cumulative_area(&self) -> &[f32] {
        &self.cumulative
    }

    /// The primitive that a number in [0, 1) falls on when they lie side by side, each as long as
    /// its share of the area, and how far along it, from 0 to 1. Numbers outside are clamped.
    ///
    /// Evenly spread numbers thus give primitives in proportion to their areas, and the second value
    /// is evenly spread again.
    #[must_use]
    pub fn choose(&self, number: f32) -> (u32, f32) {
        // `max` turns a NaN into 0.
        let number = number.max(0.0).min(1.0f32.next_down());
        let index = self.cumulative.partition_point(|&end| end <= number);
        let start = if index == 0 {
            0.0
        } else {
            self.cumulative[index - 1]
        };
        let along = (number - start) / (self.cumulative[index] - start);
        (
            self.primitives.start + index as u32,
            along.min(1.0f32.next_down()),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(areas: &[f64]) -> AreaLight {
        AreaLight::new(3, 10, areas, Vec3::new(1.0, 2.0, 0.0), false).unwrap()
    }

    #[test]
    fn primitives_are_chosen_by_area() {
        let light = light(&[1.0, 0.0, 2.0, 1.0]);
        assert_eq!(light.cumulative_area(), [0.25, 0.25, 0.75, 1.0]);
        assert_eq!(light.choose(0.0), (10, 0.0));
        assert_eq!(light.choose(0.125), (10, 0.5));
        // The primitive without area is never chosen.
        assert_eq!(light.choose(0.25), (12, 0.0));
        assert_eq!(light.choose(0.5), (12, 0.5));
        assert_eq!(light.choose(0.875), (13, 0.5));
    }

    #[test]
    fn numbers_out_of_range_are_clamped() {
        let light = light(&[1.0, 1.0]);
        assert_eq!(light.choose(-3.0), (10, 0.0));
        assert_eq!(light.choose(f32::NAN), (10, 0.0));
        let (last, along) = light.choose(7.0);
        assert!(last == 11 && along < 1.0 && along > 0.999);
    }

    #[test]
    fn power_counts_the_sides_that_emit() {
        let one = light(&[0.5, 1.5]);
        assert_eq!(one.area(), 2.0);
        assert_eq!(one.power(), PI * 2.0 * Vec3::new(1.0, 2.0, 0.0));
        let both = AreaLight::new(3, 10, &[0.5, 1.5], one.radiance(), true).unwrap();
        assert_eq!(both.power(), 2.0 * one.power());
    }

    #[test]
    fn many_small_areas_add_up() {
        let mut areas = vec![1.0];
        areas.resize(1_000_001, 1e-8);
        let light = light(&areas);
        assert!((light.area() - 1.01).abs() < 1e-6);
        // The small ones together are chosen by their hundredth.
        assert_eq!(light.choose(0.9900).0, 10);
        assert!(light.choose(0.9902).0 > 10);
    }

    #[test]
    fn no_area_is_no_light() {
        assert_eq!(AreaLight::new(0, 0, &[], Vec3::ONE, false), None);
        assert_eq!(AreaLight::new(0, 0, &[0.0, 0.0], Vec3::ONE, false), None);
    }
}
