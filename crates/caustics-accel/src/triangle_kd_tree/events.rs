//! Where triangles begin and end along the axes.

use super::clip::Bounds;

/// What happens at a coordinate, in the order in which a sweep wants to hear of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(super) enum Kind {
    /// A triangle ends.
    End = 0,
    /// A triangle lies in the plane.
    Planar = 1,
    /// A triangle begins.
    Start = 2,
}

/// A coordinate, what happens there, and the triangle that it happens to, as one number that sorts
/// in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Event(u64);

impl Event {
    /// The most triangles that can be told apart.
    pub(super) const MAX_TRIANGLES: usize = 1 << 30;

    fn new(position: f32, kind: Kind, triangle: u32) -> Self {
        // The sum turns a negative zero into a positive one.
        let bits = (position + 0.0).to_bits();
        // The bits of floats in rising order.
        let ordered = if bits >> 31 == 1 {
            !bits
        } else {
            bits | 1 << 31
        };
        Self(u64::from(ordered) << 32 | (kind as u64) << 30 | u64::from(triangle))
    }

    pub(super) fn position(self) -> f32 {
        let ordered = (self.0 >> 32) as u32;
        f32::from_bits(if ordered >> 31 == 1 {
            ordered & !(1 << 31)
        } else {
            !ordered
        })
    }

    pub(super) fn kind(self) -> Kind {
        match self.0 >> 30 & 3 {
            0 => Kind::End,
            1 => Kind::Planar,
            _ => Kind::Start,
        }
    }

    pub(super) fn triangle(self) -> u32 {
        (self.0 & (Self::MAX_TRIANGLES as u64 - 1)) as u32
    }
}

/// The events of a set of triangles, by axis, each sorted.
pub(super) type Events = [Vec<Event>; 3];

/// Notes where a triangle's box begins and ends.
pub(super) fn push(events: &mut Events, bounds: &Bounds, triangle: u32) {
    for (axis, events) in events.iter_mut().enumerate() {
        let (low, high) = (bounds.low[axis], bounds.high[axis]);
        if low == high {
            events.push(Event::new(low, Kind::Planar, triangle));
        } else {
            events.push(Event::new(low, Kind::Start, triangle));
            events.push(Event::new(high, Kind::End, triangle));
        }
    }
}

/// Which triangles the events are about, each once.
pub(super) fn triangles(events: &Events) -> impl Iterator<Item = u32> + '_ {
    events[0]
        .iter()
        .filter(|event| event.kind() != Kind::End)
        .map(|event| event.triangle())
}

/// One sorted list of two.
pub(super) fn merge(a: Vec<Event>, mut b: Vec<Event>) -> Vec<Event> {
    b.sort_unstable();
    if b.is_empty() {
        return a;
    }
    let mut merged = Vec::with_capacity(a.len() + b.len());
    let mut rest = b.into_iter().peekable();
    for event in a {
        while let Some(other) = rest.next_if(|&other| other < event) {
            merged.push(other);
        }
        merged.push(event);
    }
    merged.extend(rest);
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_sort_by_position_then_kind_then_triangle() {
        let positions = [f32::MIN, -1.0, -1e-40, 0.0, 1e-40, 1.0, f32::MAX];
        let mut last = Event(0);
        for position in positions {
            for kind in [Kind::End, Kind::Planar, Kind::Start] {
                for triangle in [0, 1, (1 << 30) - 1] {
                    let event = Event::new(position, kind, triangle);
                    assert!(event > last);
                    assert_eq!(
                        (event.position(), event.kind(), event.triangle()),
                        (position, kind, triangle)
                    );
                    last = event;
                }
            }
        }
        assert_eq!(
            Event::new(-0.0, Kind::Start, 1),
            Event::new(0.0, Kind::Start, 1)
        );
    }

    #[test]
    fn merging_keeps_the_order() {
        let of = |x: f32| Event::new(x, Kind::Start, 0);
        let merged = merge(
            vec![of(1.0), of(3.0), of(5.0)],
            vec![of(9.0), of(0.0), of(4.0)],
        );
        assert_eq!(merged, [0.0, 1.0, 3.0, 4.0, 5.0, 9.0].map(of));
    }
}
