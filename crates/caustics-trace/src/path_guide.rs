use std::collections::HashMap;

use glam::Vec3;

/// Set in the hash of a path whose light landed turned over. It is clear on the way.
const TURNED: u32 = 0x8000_0000;

/// The most surfaces on a path that is followed by itself. So many turns fit in a word of a graphics
/// processor, and the light of longer paths is faint.
pub(crate) const MOST_SURFACES: usize = 28;

/// The hash of a path with one more surface at its end (a step of Fowler, Noll and Vo's hash on
/// whole words).
pub(crate) fn extended(path: u32, object: u32, event: u32) -> u32 {
    let word = object
        .wrapping_mul(4)
        .wrapping_add(event)
        .wrapping_add(0x9E37_79B9);
    (path.rotate_left(5) ^ word).wrapping_mul(0x0100_0193) & !TURNED
}

/// The hash of a path that landed, by the axes of its footprint on a receiver with `normal`.
///
/// Where light that one path brings folds over, at a caustic, it lands on both sides of the fold as two
/// sheets that lie on each other, one of them turned over: the determinant of the map from the light to
/// the receiver changes its sign. Both end at the fold.
pub(crate) fn path_landed(path: u32, axes: &[Vec3; 2], normal: Vec3) -> u32 {
    if signed_area(axes, normal) < 0.0 {
        path | TURNED
    } else {
        path
    }
}

/// The area of the parallelogram of two axes in the plane with unit `normal`; below 0 where it is turned
/// over.
pub(crate) fn signed_area(axes: &[Vec3; 2], normal: Vec3) -> f32 {
    axes[0].cross(axes[1]).dot(normal)
}

/// The hash of the same path whose light landed the other side up.
pub(crate) fn turned_over(path: u32) -> u32 {
    path ^ TURNED
}

/// Keeps a photon's branches to those of one path, once that path is known.
///
/// All branches of a photon are a tree of which one path is a few percent where glass reflects light
/// many times inside: whoever asks only whether that path is taken need not follow the others.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathGuide {
    /// For each path that was seen, the one that it goes on from.
    before: HashMap<u32, u32>,
    /// The path that is followed and all that it goes on from; none where all are followed and
    /// remembered.
    followed: Vec<u32>,
}

impl PathGuide {
    /// Follows all branches, and remembers them.
    pub(crate) fn follow_all(&mut self) {
        self.followed.clear();
    }

    /// Follows one path only, if it has been seen and met no more than [`MOST_SURFACES`], wherever it lands.
    pub(crate) fn follow(&mut self, path: u32) -> bool {
        self.followed.clear();
        let mut next = path & !TURNED;
        // A path is not longer than all that were seen; with equal hashes it might lead in a circle.
        for _ in 0..=self.before.len() {
            let Some(&before) = self.before.get(&next) else {
                break;
            };
            if self.followed.len() == MOST_SURFACES {
                break;
            }
            self.followed.push(next);
            if before == 0 {
                return true;
            }
            next = before;
        }
        self.followed.clear();
        false
    }

    /// Whether a branch is followed that goes on from `before` as `path`.
    pub(crate) fn admits(&mut self, path: u32, before: u32) -> bool {
        if self.followed.is_empty() {
            self.before.insert(path, before);
            return true;
        }
        self.followed.contains(&path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_path_of_a_tree_is_followed() {
        let [a, b] = [extended(0, 1, 1), extended(0, 1, 2)];
        let [aa, ab, ba] = [extended(a, 2, 1), extended(a, 2, 2), extended(b, 2, 1)];
        let mut guide = PathGuide::default();
        assert!(!guide.follow(ab));
        for (path, before) in [(a, 0), (b, 0), (aa, a), (ab, a), (ba, b)] {
            assert!(guide.admits(path, before));
        }
        assert!(guide.follow(ab));
        let admitted = [a, b, aa, ab, ba].map(|it| guide.admits(it, 0));
        assert_eq!(admitted, [true, false, false, true, false]);
        assert!(guide.follow(b));
        assert!(guide.admits(b, 0) && !guide.admits(a, 0) && !guide.admits(ba, b));
        assert!(!guide.follow(extended(ab, 3, 1)));
        guide.follow_all();
        assert!(guide.admits(ba, b) && guide.admits(aa, a));
    }

    #[test]
    fn a_circle_of_equal_hashes_ends() {
        let mut guide = PathGuide::default();
        guide.admits(1, 2);
        guide.admits(2, 1);
        assert!(!guide.follow(1));
    }
}
