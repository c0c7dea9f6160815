use std::ops::Range;

use glam::Vec3;

use crate::density::Density;
use crate::footprint_kernel::FootprintKernel;
use crate::gate::Gate;
use crate::gbuffer::Texel;
use crate::parallel;

/// Points in space or directions, each coordinate in a list of its own, so that loops over many
/// use vector instructions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
}

impl Columns {
    pub(crate) fn zero(count: usize) -> Self {
        Self {
            x: vec![0.0; count],
            y: vec![0.0; count],
            z: vec![0.0; count],
        }
    }

    /// What is made of each of some items, by tasks of `task` of them.
    pub(crate) fn of<T: Sync>(items: &[T], task: usize, make: impl Fn(&T) -> Vec3 + Sync) -> Self {
        let mut columns = Self::zero(items.len());
        let tasks = items.chunks(task).zip(columns.chunks_mut(task));
        parallel::each(tasks.collect(), |(items, mut part)| {
            for (index, item) in items.iter().enumerate() {
                part.set(index, make(item));
            }
        });
        columns
    }

    pub(crate) fn get(&self, index: usize) -> Vec3 {
        Vec3::new(self.x[index], self.y[index], self.z[index])
    }

    pub(crate) fn is_zero(&self) -> bool {
        let is_zero = |list: &[f32]| list.iter().all(|&it| it == 0.0);
        is_zero(&self.x) && is_zero(&self.y) && is_zero(&self.z)
    }

    /// A part of each list.
    pub(crate) fn part(&self, range: Range<usize>) -> [&[f32]; 3] {
        [&self.x, &self.y, &self.z].map(|list| &list[range.clone()])
    }

    /// Between a row of `width` from `first` on and the next one, `down` of the way to that.
    pub(crate) fn blend_rows(&self, first: usize, width: usize, down: f32, blend: &mut Self) {
        let above = self.part(first..first + width);
        let below = self.part(first + width..first + 2 * width);
        let lists = [&mut blend.x, &mut blend.y, &mut blend.z];
        for ((list, above), below) in lists.into_iter().zip(above).zip(below) {
            for (value, (above, below)) in list.iter_mut().zip(above.iter().zip(below)) {
                *value = (1.0 - down) * above + down * below;
            }
        }
    }

    /// The lists in pieces of `size`, in order.
    pub(crate) fn chunks_mut(&mut self, size: usize) -> impl Iterator<Item = ColumnsMut<'_>> {
        let zip = self
            .x
            .chunks_mut(size)
            .zip(self.y.chunks_mut(size))
            .zip(self.z.chunks_mut(size));
        zip.map(|((x, y), z)| ColumnsMut { x, y, z })
    }
}

/// A part of [`Columns`].
pub(crate) struct ColumnsMut<'a> {
    pub(crate) x: &'a mut [f32],
    pub(crate) y: &'a mut [f32],
    pub(crate) z: &'a mut [f32],
}

impl ColumnsMut<'_> {
    /// `count` from `first` on.
    pub(crate) fn part(&mut self, first: usize, count: usize) -> ColumnsMut<'_> {
        ColumnsMut {
            x: &mut self.x[first..first + count],
            y: &mut self.y[first..first + count],
            z: &mut self.z[first..first + count],
        }
    }

    pub(crate) fn set(&mut self, index: usize, value: Vec3) {
        [self.x[index], self.y[index], self.z[index]] = value.to_array();
    }

    /// Adds, from `begin` on, two values between each of a range of others and its next one: a quarter
    /// of the way from either.
    pub(crate) fn add_between(&mut self, begin: usize, others: &Columns, range: Range<usize>) {
        let next = others.part(range.start + 1..range.end + 1);
        let lists = [&mut *self.x, &mut *self.y, &mut *self.z];
        for ((list, one), other) in lists.into_iter().zip(others.part(range)).zip(next) {
            let (pairs, _) = list[begin..].as_chunks_mut::<2>();
            for (pair, (one, other)) in pairs.iter_mut().zip(one.iter().zip(other)) {
                pair[0] += 0.75 * one + 0.25 * other;
                pair[1] += 0.25 * one + 0.75 * other;
            }
        }
    }

    pub(crate) fn add(&mut self, index: usize, value: Vec3) {
        self.x[index] += value.x;
        self.y[index] += value.y;
        self.z[index] += value.z;
    }
}

/// Positions, normals and objects of texels; a pixel without one has a zero normal and is never lit.
#[derive(Clone, Debug, Default)]
pub(crate) struct TexelColumns {
    position: Columns,
    normal: Columns,
    object: Vec<u32>,
}

impl TexelColumns {
    /// Of all texels, by tasks of `task` of them.
    pub(crate) fn new(texels: &[Option<Texel>], task: usize) -> Self {
        let mut columns = Self {
            position: Columns::zero(texels.len()),
            normal: Columns::zero(texels.len()),
            object: vec![0; texels.len()],
        };
        let tasks = texels
            .chunks(task)
            .zip(columns.position.chunks_mut(task))
            .zip(columns.normal.chunks_mut(task))
            .zip(columns.object.chunks_mut(task));
        parallel::each(
            tasks.collect(),
            |(((texels, mut position), mut normal), object)| {
                for (index, texel) in texels.iter().enumerate() {
                    if let Some(texel) = texel {
                        position.set(index, texel.position);
                        normal.set(index, texel.normal);
                        object[index] = texel.object;
                    }
                }
            },
        );
        columns
    }

    /// Adds a photon's light to the irradiance of `count` texels from `first` on; that of the
    /// first is at `target`. Where they are not `mixed`, all that are in reach are the receiver's.
    #[expect(
        clippy::too_many_arguments,
        reason = "one loop over one row, used in one place"
    )]
    pub(crate) fn light(
        &self,
        density: &Density,
        gate: &Gate,
        is_mixed: bool,
        first: usize,
        count: usize,
        irradiance: &mut ColumnsMut<'_>,
        target: usize,
    ) {
        // One loop for each kernel, so that none asks in its midst which one it is.
        macro_rules! with {
            ($shape:expr) => {{
                let mut known = density.lighting().kernel;
                known.shape = $shape;
                let kernel = |u, v| known.density(u, v);
                if is_mixed {
                    let is_own = |object| object == density.object;
                    self.light_by(
                        density, gate, first, count, irradiance, target, kernel, is_own,
                    );
                } else {
                    self.light_by(
                        density,
                        gate,
                        first,
                        count,
                        irradiance,
                        target,
                        kernel,
                        |_| true,
                    );
                }
            }};
        }
        match density.lighting().kernel.shape {
            FootprintKernel::Gaussian => with!(FootprintKernel::Gaussian),
            FootprintKernel::Ellipse => with!(FootprintKernel::Ellipse),
            FootprintKernel::Disc => with!(FootprintKernel::Disc),
            FootprintKernel::Tent => with!(FootprintKernel::Tent),
        }
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "the same as `light`, and its kernel"
    )]
    #[inline]
    fn light_by(
        &self,
        density: &Density,
        gate: &Gate,
        first: usize,
        count: usize,
        irradiance: &mut ColumnsMut<'_>,
        target: usize,
        kernel: impl Fn(f32, f32) -> f32,
        is_own: impl Fn(u32) -> bool,
    ) {
        let read = first..first + count;
        let write = target..target + count;
        let (px, py, pz) = (
            &self.position.x[read.clone()],
            &self.position.y[read.clone()],
            &self.position.z[read.clone()],
        );
        let (nx, ny, nz) = (
            &self.normal.x[read.clone()],
            &self.normal.y[read.clone()],
            &self.normal.z[read.clone()],
        );
        let object = &self.object[read];
        let red = &mut irradiance.x[write.clone()];
        let green = &mut irradiance.y[write.clone()];
        let blue = &mut irradiance.z[write];
        let lighting = density.lighting();
        let (center, normal, incoming) = (density.center, density.normal, density.incoming);
        let (gu, gv, strength) = (
            *lighting.u_gradient,
            *lighting.v_gradient,
            *lighting.strength,
        );
        for i in 0..count {
            let (dx, dy, dz) = (px[i] - center.x, py[i] - center.y, pz[i] - center.z);
            let u = dx * gu.x + dy * gu.y + dz * gu.z;
            let v = dx * gv.x + dy * gv.y + dz * gv.z;
            let off = dx * normal.x + dy * normal.y + dz * normal.z;
            let alike = nx[i] * normal.x + ny[i] * normal.y + nz[i] * normal.z;
            let cosine = -(nx[i] * incoming.x + ny[i] * incoming.y + nz[i] * incoming.z);
            let is_lit = gate.admits_at(off, alike, is_own(object[i]));
            let weight = kernel(u, v) * cosine.max(0.0);
            let weight = if is_lit { weight } else { 0.0 };
            red[i] += strength.x * weight;
            green[i] += strength.y * weight;
            blue[i] += strength.z * weight;
        }
    }
}
