//! Where to split a cell.

use super::clip::Bounds;
use super::events::{Event, Events, Kind};
use crate::simd::WIDTH;

/// Cost of a step past one node, in arbitrary units.
const NODE_COST: f32 = 1.0;
/// Cost of testing a block of eight triangles, in the same units.
const BLOCK_COST: f32 = 2.0;
/// What a split's cost is multiplied by that cuts off empty space.
const EMPTY_BONUS: f32 = 0.85;

/// A plane, and where triangles in it go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) axis: usize,
    pub(super) position: f32,
    /// Triangles that lie in the plane go to the lower side.
    pub(super) planar_below: bool,
}

/// Cost of a leaf of so many triangles, if it is met. A block costs the same however full it is,
/// but one that is overfull may yet be split well.
fn leaf_cost(triangles: usize) -> f32 {
    if triangles == 0 {
        0.0
    } else {
        BLOCK_COST * (triangles as f32 / WIDTH as f32).max(1.0)
    }
}

fn half_area(bounds: &Bounds) -> f32 {
    let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
    x * y + y * z + z * x
}

/// The plane of least cost by the surface area heuristic; none where a leaf is cheaper.
///
/// A sweep over the sorted events, after Wald and Havran, *On building fast kd-Trees for Ray
/// Tracing, and on doing that in O(N log N)* (2006).
pub(super) fn cheapest(events: &Events, count: usize, cell: &Bounds) -> Option<Plane> {
    let whole = half_area(cell);
    if whole <= 0.0 || !whole.is_finite() {
        return None;
    }
    let mut best = (leaf_cost(count), None);
    for (axis, events) in events.iter().enumerate() {
        let (low, high) = (cell.low[axis], cell.high[axis]);
        let [others_area, others_length] = {
            let [a, b] =
                [(axis + 1) % 3, (axis + 2) % 3].map(|other| cell.high[other] - cell.low[other]);
            [a * b, a + b]
        };
        let area = |length: f32| others_area + length * others_length;
        let (mut below, mut above) = (0, count);
        let mut rest = events.as_slice();
        while let Some(first) = rest.first() {
            let position = first.position();
            let (ends, planars, starts) = take_at(&mut rest, position);
            above -= ends + planars;
            if low < position && position < high {
                let lower = area(position - low) / whole;
                let upper = area(high - position) / whole;
                for planar_below in [true, false] {
                    let (below, above) = if planar_below {
                        (below + planars, above)
                    } else {
                        (below, above + planars)
                    };
                    let mut cost = NODE_COST + lower * leaf_cost(below) + upper * leaf_cost(above);
                    if below == 0 || above == 0 {
                        cost *= EMPTY_BONUS;
                    }
                    if cost < best.0 {
                        let plane = Plane {
                            axis,
                            position,
                            planar_below,
                        };
                        best = (cost, Some(plane));
                    }
                    if planars == 0 {
                        break;
                    }
                }
            }
            below += starts + planars;
        }
    }
    best.1
}

/// Counts the events at a position, by kind, and goes past them.
fn take_at(rest: &mut &[Event], position: f32) -> (usize, usize, usize) {
    let mut counts = [0; 3];
    while let Some((event, others)) = rest.split_first() {
        if event.position() != position {
            break;
        }
        counts[event.kind() as usize] += 1;
        *rest = others;
    }
    let [ends, planars, starts] = counts;
    (ends, planars, starts)
}

/// The plane through the middle of the cell's longest side; none where the triangles fit a block
/// or the cell is too small to halve.
pub(super) fn middle(count: usize, cell: &Bounds) -> Option<Plane> {
    if count <= WIDTH {
        return None;
    }
    let length = |axis: &usize| cell.high[*axis] - cell.low[*axis];
    let axis = (0..3)
        .max_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or(0);
    let position = 0.5 * cell.low[axis] + 0.5 * cell.high[axis];
    (cell.low[axis] < position && position < cell.high[axis]).then_some(Plane {
        axis,
        position,
        planar_below: true,
    })
}

/// On which side of a plane a triangle lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Both,
    Below,
    Above,
}

/// Notes for each triangle on which side of a plane it lies, and returns how many lie on one side
/// only, below and above.
pub(super) fn classify(events: &Events, plane: Plane, sides: &mut [Side]) -> (usize, usize) {
    let events = &events[plane.axis];
    for event in events {
        sides[event.triangle() as usize] = Side::Both;
    }
    let mut counts = (0, 0);
    for event in events {
        let position = event.position();
        let side = match event.kind() {
            Kind::End if position <= plane.position => Side::Below,
            Kind::Start if position >= plane.position => Side::Above,
            Kind::Planar if position < plane.position => Side::Below,
            Kind::Planar if position > plane.position => Side::Above,
            Kind::Planar if plane.planar_below => Side::Below,
            Kind::Planar => Side::Above,
            _ => continue,
        };
        if side == Side::Below {
            counts.0 += 1;
        } else {
            counts.1 += 1;
        }
        sides[event.triangle() as usize] = side;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangle_kd_tree::events::push;

    fn events_of(boxes: &[Bounds]) -> Events {
        let mut events = Events::default();
        for (triangle, bounds) in boxes.iter().enumerate() {
            push(&mut events, bounds, triangle as u32);
        }
        for events in &mut events {
            events.sort_unstable();
        }
        events
    }

    fn slab(low: f32, high: f32) -> Bounds {
        Bounds {
            low: [low, 0.0, 0.0],
            high: [high, 1.0, 1.0],
        }
    }

    #[test]
    fn two_groups_are_parted_between_them() {
        // Eight at either end of a long cell: the split cuts off the lower eight where they end,
        // or the upper eight where they begin.
        let mut boxes = vec![slab(0.0, 1.0); 8];
        boxes.extend([slab(9.0, 10.0); 8]);
        let cell = slab(0.0, 10.0);
        let plane = cheapest(&events_of(&boxes), boxes.len(), &cell).unwrap();
        assert_eq!(plane.axis, 0);
        assert!(plane.position == 1.0 || plane.position == 9.0);
        let mut sides = vec![Side::Both; 16];
        assert_eq!(classify(&events_of(&boxes), plane, &mut sides), (8, 8));
        assert_eq!(sides[..8], [Side::Below; 8]);
        assert_eq!(sides[8..], [Side::Above; 8]);
    }

    #[test]
    fn copies_are_not_worth_a_split() {
        let boxes = vec![slab(0.0, 1.0); 100];
        assert_eq!(cheapest(&events_of(&boxes), 100, &slab(0.0, 1.0)), None);
    }

    #[test]
    fn the_middle_of_the_longest_side() {
        let plane = middle(9, &slab(-1.0, 5.0)).unwrap();
        assert_eq!((plane.axis, plane.position), (0, 2.0));
        assert_eq!(middle(8, &slab(-1.0, 5.0)), None);
        // Nothing lies between two numbers that follow each other.
        let mut thin = slab(1.0, 1.0_f32.next_up());
        (thin.high[1], thin.high[2]) = (0.0, 0.0);
        assert_eq!(middle(9, &thin), None);
    }

    #[test]
    fn triangles_in_the_plane_go_where_they_are_told() {
        let events = events_of(&[slab(2.0, 2.0), slab(1.0, 3.0)]);
        for (planar_below, side) in [(true, Side::Below), (false, Side::Above)] {
            let plane = Plane {
                axis: 0,
                position: 2.0,
                planar_below,
            };
            let mut sides = vec![Side::Below; 2];
            classify(&events, plane, &mut sides);
            assert_eq!(sides, [side, Side::Both]);
        }
    }
}
