//! The part of a triangle that lies within a box.

/// How far the leaf test may see a triangle from where it is, as a part of its extent along each
/// axis: the test rounds each vertex's distance from the ray's origin by a factor of up to
/// (1 + 2^-24)^5. What grows with the distance of the place that is hit is left to the traversal.
const SLACK: f64 = 8.0 / (1_u64 << 24) as f64;

/// A box between two corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    pub(super) fn union(&self, other: &Self) -> Self {
        let mut all = *self;
        for axis in 0..3 {
            all.low[axis] = all.low[axis].min(other.low[axis]);
            all.high[axis] = all.high[axis].max(other.high[axis]);
        }
        all
    }

    /// Both parts of the box, cut at a plane.
    pub(super) fn cut(&self, axis: usize, split: f32) -> (Self, Self) {
        let (mut lower, mut upper) = (*self, *self);
        lower.high[axis] = split;
        upper.low[axis] = split;
        (lower, upper)
    }

    /// The box, if it holds anything.
    fn non_empty(self) -> Option<Self> {
        (0..3)
            .all(|axis| self.low[axis] <= self.high[axis])
            .then_some(self)
    }
}

/// A triangle's vertices in double precision, and how far they may seem to be elsewhere.
struct Wide {
    vertices: [[f64; 3]; 3],
    slack: [f64; 3],
}

impl Wide {
    fn new(corners: [[f32; 3]; 3]) -> Self {
        let vertices = corners.map(|corner| corner.map(f64::from));
        let slack = std::array::from_fn(|axis| {
            let [a, b, c] = vertices.map(|vertex| vertex[axis]);
            SLACK * (a.max(b).max(c) - a.min(b).min(c))
        });
        Self { vertices, slack }
    }

    /// The box around points of the triangle, widened by the slack and rounded outwards.
    fn bounds(&self, points: &[[f64; 3]]) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for axis in 0..3 {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for point in points {
                low = low.min(point[axis]);
                high = high.max(point[axis]);
            }
            bounds.low[axis] = rounded_down(low - self.slack[axis]);
            bounds.high[axis] = -rounded_down(-(high + self.slack[axis]));
        }
        bounds
    }
}

/// The largest f32 that is not greater.
fn rounded_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// The box around a whole triangle, where the leaf test may see it.
pub(super) fn bounds_of(corners: [[f32; 3]; 3]) -> Bounds {
    let wide = Wide::new(corners);
    wide.bounds(&wide.vertices)
}

/// The box around the part of a triangle that the leaf test may see within `cell`: none if it
/// does not see the triangle there.
///
/// Sutherland and Hodgman, *Reentrant Polygon Clipping* (1974), in double precision.
pub(super) fn bounds_within(corners: [[f32; 3]; 3], cell: &Bounds) -> Option<Bounds> {
    let wide = Wide::new(corners);
    // Each of the six planes adds at most one vertex.
    let mut polygon = [[0.0; 3]; 9];
    polygon[..3].copy_from_slice(&wide.vertices);
    let mut count = 3;
    for axis in 0..3 {
        let low = f64::from(cell.low[axis]) - wide.slack[axis];
        let high = f64::from(cell.high[axis]) + wide.slack[axis];
        count = keep_above(&mut polygon, count, axis, low, 1.0);
        count = keep_above(&mut polygon, count, axis, -high, -1.0);
    }
    if count == 0 {
        return None;
    }
    let mut bounds = wide.bounds(&polygon[..count]);
    for axis in 0..3 {
        bounds.low[axis] = bounds.low[axis].max(cell.low[axis]);
        bounds.high[axis] = bounds.high[axis].min(cell.high[axis]);
    }
    bounds.non_empty()
}

/// Keeps the part of a convex polygon where the coordinate times `sign` is at least `limit`;
/// returns how many vertices it has.
fn keep_above(
    polygon: &mut [[f64; 3]; 9],
    count: usize,
    axis: usize,
    limit: f64,
    sign: f64,
) -> usize {
    let is_kept = |point: &[f64; 3]| point[axis] * sign >= limit;
    if polygon[..count].iter().all(is_kept) {
        return count;
    }
    let former = *polygon;
    let mut kept = 0;
    for (i, point) in former[..count].iter().enumerate() {
        let next = &former[(i + 1) % count];
        if is_kept(point) {
            polygon[kept] = *point;
            kept += 1;
        }
        // Rounding may bend the polygon, which then has a vertex more than it should: the box
        // loses less than the slack by it.
        if is_kept(point) != is_kept(next) && kept < polygon.len() {
            let part = (limit * sign - point[axis]) / (next[axis] - point[axis]);
            polygon[kept] = std::array::from_fn(|k| point[k] + part * (next[k] - point[k]));
            polygon[kept][axis] = limit * sign;
            kept += 1;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]];

    fn assert_near(found: &Bounds, low: [f32; 3], high: [f32; 3]) {
        for axis in 0..3 {
            // Once for the cell and once for what is left of the triangle, which is 4 wide.
            let slack = 2.0 * 4.0 * SLACK as f32;
            let off = [low[axis] - found.low[axis], found.high[axis] - high[axis]];
            assert!(
                off.iter().all(|off| (0.0..=slack).contains(off)),
                "{found:?}"
            );
        }
    }

    #[test]
    fn a_box_cuts_off_the_corners() {
        let cell = Bounds {
            low: [1.0, 1.0, 0.0],
            high: [9.0, 9.0, 2.0],
        };
        let found = bounds_within(TRIANGLE, &cell).unwrap();
        assert_near(&found, [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]);
        // Flat along z, where nothing is uncertain.
        assert_eq!((found.low[2], found.high[2]), (1.0, 1.0));
    }

    #[test]
    fn the_whole_triangle_keeps_its_box() {
        let found = bounds_of(TRIANGLE);
        assert_near(&found, [0.0, 0.0, 1.0], [4.0, 4.0, 1.0]);
        assert!(found.low[0] < 0.0 && found.high[1] > 4.0);
    }

    #[test]
    fn a_triangle_beside_the_box_has_no_part_in_it() {
        // Its bounding box overlaps, the triangle itself does not.
        let corner = Bounds {
            low: [3.0, 3.0, 0.0],
            high: [4.0, 4.0, 2.0],
        };
        assert_eq!(bounds_within(TRIANGLE, &corner), None);
        let above = Bounds {
            low: [0.0, 0.0, 1.5],
            high: [4.0, 4.0, 2.0],
        };
        assert_eq!(bounds_within(TRIANGLE, &above), None);
    }

    #[test]
    fn a_face_of_the_box_belongs_to_it() {
        let cell = Bounds {
            low: [4.0, -1.0, 1.0],
            high: [5.0, 1.0, 2.0],
        };
        let found = bounds_within(TRIANGLE, &cell).unwrap();
        assert_near(&found, [4.0, 0.0, 1.0], [4.0, 0.0, 1.0]);
    }
}
