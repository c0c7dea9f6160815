use bytemuck::{Pod, Zeroable};
use glam::{Mat4, UVec2, Vec4};

use crate::renderer_error::RendererError;

/// Levels of resolution, each with half the pixels a side of the one before.
pub(crate) const LEVELS: usize = 7;

/// Pixels a side of a tile.
pub(crate) const TILE: u32 = 16;

/// Rounds in which tiles are summed whose pairs do not fit together. Mirrors `ROUNDS` in
/// `shaders/splat_place.wgsl`.
pub(crate) const ROUNDS: usize = 4;

/// Pixels a side of the smallest tiles of which it is known what they show. Mirrors the constant of
/// the same name in `shaders/surroundings.wgsl`.
pub(crate) const SURROUNDING_TILE: u32 = 8;

/// Bytes of a `SurroundingTile` of `shaders/surroundings.wgsl`.
pub(crate) const SURROUNDING_BYTES: u64 = 32;

/// The most levels of such tiles: the next has two of them on each side.
const SURROUNDING_LEVELS: usize = 12;

/// The most pixels a side of a view: places of pixels are kept in 16 bits.
const MAX_SIZE: u32 = 1 << 14;

/// Mirror of the struct of the same name in `shaders/splat_view.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SplatView {
    pub(crate) view_projection: [[f32; 4]; 4],
    pub(crate) inverse_view_projection: [[f32; 4]; 4],
    pub(crate) eye: [f32; 4],
    pub(crate) size: [u32; 2],
    pub(crate) normal_encoding: u32,
    pub(crate) has_positions: u32,
    pub(crate) background_depth: f32,
    pub(crate) scale: f32,
    pub(crate) max_anisotropy: f32,
    pub(crate) has_objects: u32,
    pub(crate) integrate_pixels: u32,
    pub(crate) surrounding_levels: u32,
    pub(crate) pad: [u32; 2],
    pub(crate) truncation: [f32; 4],
    pub(crate) levels: [[u32; 4]; 8],
    pub(crate) surroundings: [[u32; 4]; SURROUNDING_LEVELS],
}

/// Mirror of the struct of the same name in `shaders/splat_view.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SplatStep {
    pub(crate) level: u32,
    pub(crate) is_first: u32,
    pub(crate) layers: u32,
    pub(crate) round: u32,
}

/// The levels of a view of `size` pixels: width, height, tiles across, first tile; and the number
/// of all tiles.
///
/// # Errors
/// A size of 0, or more than the limit.
pub(crate) fn levels(size: UVec2, max_texture: u32) -> Result<([[u32; 4]; 8], u32), RendererError> {
    let limit = MAX_SIZE.min(max_texture);
    let padded = padded(size);
    if size.min_element() == 0 || size.max_element() > limit || padded.max_element() > max_texture {
        return Err(RendererError::ViewSize {
            width: size.x,
            height: size.y,
            limit,
        });
    }
    let mut levels = [[0; 4]; 8];
    let (mut level_size, mut tiles) = (size, 0);
    for level in levels.iter_mut().take(LEVELS) {
        let [across, down] = [level_size.x, level_size.y].map(|it| it.div_ceil(TILE));
        *level = [level_size.x, level_size.y, across, tiles];
        tiles += across * down;
        level_size = UVec2::new(level_size.x.div_ceil(2), level_size.y.div_ceil(2));
    }
    Ok((levels, tiles))
}

/// The tiles of which it is known what they show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SurroundingLevels {
    /// Width, height and first tile of each level.
    pub(crate) levels: [[u32; 4]; SURROUNDING_LEVELS],
    /// How many levels there are.
    pub(crate) count: u32,
    /// All tiles of all levels.
    pub(crate) tiles: u32,
}

impl SurroundingLevels {
    /// For a view of `size` pixels, as [`levels`] accepts it.
    pub(crate) fn of(size: UVec2) -> Self {
        let mut all = Self {
            levels: [[0; 4]; SURROUNDING_LEVELS],
            count: 0,
            tiles: 0,
        };
        let mut at = (size + (SURROUNDING_TILE - 1)) / SURROUNDING_TILE;
        for level in &mut all.levels {
            *level = [at.x, at.y, all.tiles, 0];
            all.count += 1;
            all.tiles += at.x * at.y;
            if at.max_element() <= 1 {
                break;
            }
            at = (at + 1) / 2;
        }
        all
    }
}

/// The size of the textures whose mip levels hold all levels of a view.
pub(crate) fn padded(size: UVec2) -> UVec2 {
    let coarsest = 1 << (LEVELS - 1);
    UVec2::new(
        size.x.next_multiple_of(coarsest),
        size.y.next_multiple_of(coarsest),
    )
}

/// The inverse of a view-projection, and the eye: a place in perspective, or minus the direction of
/// view, as homogeneous coordinates.
///
/// `background_depth` tells which end of the depth range is far away.
pub(crate) fn inverse_and_eye(
    view_projection: &Mat4,
    background_depth: f32,
) -> Option<(Mat4, Vec4)> {
    let inverse = view_projection.inverse();
    if !(view_projection.is_finite() && inverse.is_finite()) {
        return None;
    }
    // The point that is projected to no pixel and no depth: along it, only depth changes.
    let axis = inverse.z_axis;
    let largest = axis.abs().max_element();
    let eye = if axis.w.abs() > 1e-6 * largest {
        Vec4::from((axis.truncate() / axis.w, 1.0))
    } else {
        let away = if background_depth >= 0.5 { 1.0 } else { -1.0 };
        Vec4::from((-away * axis.truncate().normalize_or_zero(), 0.0))
    };
    Some((inverse, eye))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use glam::camera::rh::proj::directx as projections;
    use glam::camera::rh::view::look_at_mat4;

    #[test]
    fn levels_halve_and_their_tiles_follow_each_other() {
        let (levels, tiles) = levels(UVec2::new(100, 33), 8192).unwrap();
        assert_eq!(levels[0], [100, 33, 7, 0]);
        assert_eq!(levels[1], [50, 17, 4, 21]);
        assert_eq!(levels[6], [2, 1, 1, 21 + 8 + 2 + 1 + 1 + 1]);
        assert_eq!(tiles, 35);
        assert_eq!(padded(UVec2::new(100, 33)), UVec2::new(128, 64));
    }

    #[test]
    fn surroundings_end_in_one_tile() {
        let found = SurroundingLevels::of(UVec2::new(100, 33));
        assert_eq!(found.levels[0], [13, 5, 0, 0]);
        assert_eq!(found.levels[1], [7, 3, 65, 0]);
        assert_eq!(found.levels[4], [1, 1, 65 + 21 + 8 + 2, 0]);
        assert_eq!((found.count, found.tiles), (5, 97));
        let largest = SurroundingLevels::of(UVec2::splat(MAX_SIZE));
        let last = largest.levels[SURROUNDING_LEVELS - 1];
        assert_eq!((last[0], last[1], last[2] + 1), (1, 1, largest.tiles));
    }

    #[test]
    fn a_size_of_zero_or_beyond_the_limit_is_refused() {
        for size in [UVec2::new(0, 5), UVec2::new(5, 0), UVec2::new(8193, 5)] {
            assert!(matches!(
                levels(size, 8192),
                Err(RendererError::ViewSize { limit: 8192, .. })
            ));
        }
    }

    #[test]
    fn the_eye_is_found_in_the_matrix() {
        let eye = Vec3::new(1.0, 2.0, 3.0);
        let view = look_at_mat4(eye, Vec3::ZERO, Vec3::Y);
        for (projection, background) in [
            (projections::perspective(0.8, 1.5, 0.1, 100.0), 1.0),
            (
                projections::perspective_infinite_reverse(0.8, 1.5, 0.1),
                0.0,
            ),
        ] {
            let (_, found) = inverse_and_eye(&(projection * view), background).unwrap();
            assert!(found.truncate().abs_diff_eq(eye, 1e-4), "{found}");
            assert_eq!(found.w, 1.0);
        }
        for (near, far, background) in [(0.1, 10.0, 1.0), (10.0, 0.1, 0.0)] {
            let projection = projections::orthographic(-2.0, 2.0, -1.0, 1.0, near, far);
            let (_, found) = inverse_and_eye(&(projection * view), background).unwrap();
            assert!(
                found.truncate().abs_diff_eq(eye.normalize(), 1e-4),
                "{found}"
            );
            assert_eq!(found.w, 0.0);
        }
        assert_eq!(inverse_and_eye(&Mat4::ZERO, 1.0), None);
    }
}
