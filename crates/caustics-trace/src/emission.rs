use caustics_geometry::Ray;
use caustics_sampling::PointSet;
use caustics_sampling::warp::DensityTable;
use glam::{Vec2, Vec3};

use crate::differential::RayDifferential;

/// A photon as it leaves its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission<const N: usize> {
    /// Where it starts and goes; the direction is a unit vector.
    pub ray: Ray,
    /// Its flux in watts, for each channel.
    pub flux: Vec3,
    /// The displacement of its neighbours, one sample spacing away in each parameter.
    pub differential: RayDifferential<N>,
}

/// A point of the unit cube from which a photon is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionSample {
    /// Chooses the direction or, for a directional light, the place.
    pub point: Vec2,
    /// The edges of the cell that `point` stands for.
    pub spacing: [Vec2; 2],
    /// Chooses the place on an area light.
    pub place: Vec2,
    /// Photons that share the domain's flux.
    pub count: u32,
    /// The size of its cell, relative to an equal share of the domain: 1 where points are evenly spread.
    pub weight: f32,
}

impl EmissionSample {
    /// Number `index` of a set, for a light with an area or a sky.
    #[must_use]
    pub fn of(points: &PointSet, index: u32) -> Self {
        Self {
            point: Vec2::new(points.sample(index, 0), points.sample(index, 1)),
            place: Vec2::new(points.sample(index, 2), points.sample(index, 3)),
            ..Self::without_place(points, index)
        }
    }

    /// Number `index` of a set, for a light without an area.
    pub(crate) fn without_place(points: &PointSet, index: u32) -> Self {
        Self {
            point: points.point(index),
            spacing: points.spacing(index),
            place: Vec2::ZERO,
            count: points.count(),
            weight: 1.0,
        }
    }

    /// The same sample where points are as dense as a table says.
    #[must_use]
    pub fn guided(&self, density: &DensityTable) -> Self {
        let warped = density.sample(self.point);
        Self {
            point: warped.value,
            spacing: self
                .spacing
                .map(|edge| edge.x * warped.d_du + edge.y * warped.d_dv),
            weight: self.weight * (1.0 / warped.pdf),
            ..*self
        }
    }

    /// Its part of the domain's flux.
    #[must_use]
    pub fn share(&self) -> f32 {
        (1.0 / self.count as f32) * self.weight
    }
}

/// The differential of a ray that depends on its direction's parameters first and then on its
/// position's, as far as it has them.
pub(crate) fn differential<const N: usize>(
    positions: &[Vec3],
    directions: &[Vec3],
) -> RayDifferential<N> {
    let mut result = RayDifferential::ZERO;
    for (slot, &change) in result.direction.iter_mut().zip(directions) {
        *slot = change;
    }
    for (slot, &moved) in result
        .position
        .iter_mut()
        .skip(directions.len())
        .zip(positions)
    {
        *slot = moved;
    }
    result
}
