use caustics_sampling::warp::DensityTable;
use caustics_sampling::{Grid, PointSet, Sequence};

use crate::projection_map::ProjectionMap;

/// How often the number of points is corrected to that of the marked ones.
const CORRECTIONS: u32 = 12;

/// A set with this part less points than it may have is large enough.
const LEAST_MISSING: f64 = 5e-4;

/// The points that an emitter's photons are made from: a whole set or, with a projection map, those
/// of its points that lie in marked cells.
///
/// Leaving points out moves none of the others, so that the photons that are traced stand as
/// regularly as those of the whole set, and each has the share that it would have there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    points: PointSet,
    /// Runs of consecutive points that are used; `None` for all.
    spans: Option<Vec<Span>>,
    count: u32,
}

/// A run of consecutive points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    /// Number of its first point in the set.
    first: u32,
    /// Used points before it.
    before: u32,
}

impl Lattice {
    /// All of `count` points.
    pub(crate) fn whole(sequence: Sequence, count: u32, seed: u64) -> Self {
        Self {
            points: PointSet::new(sequence, count, seed),
            spans: None,
            count,
        }
    }

    /// The points in marked cells of as large a set as has at most `budget` of them; `density` is how
    /// dense points are in the cells, evenly where there is none.
    pub(crate) fn marked(
        sequence: Sequence,
        budget: u32,
        seed: u64,
        map: &ProjectionMap,
        density: Option<&DensityTable>,
    ) -> Self {
        let coverage = match density {
            Some(density) => map.integral(|at| density.density(at)),
            None => f64::from(map.coverage()),
        };
        let mut best: Option<Self> = None;
        let mut size = f64::from(budget) / coverage;
        for _ in 0..CORRECTIONS {
            if !(1.0..=f64::from(u32::MAX)).contains(&size) {
                break;
            }
            let points = PointSet::new(sequence, size as u32, seed);
            let lattice = Self::within(points, map, density);
            let found = f64::from(lattice.count);
            if lattice.count <= budget {
                if best.as_ref().is_none_or(|it| lattice.count > it.count) {
                    best = Some(lattice);
                }
                if f64::from(budget) - found <= LEAST_MISSING * f64::from(budget) {
                    break;
                }
            }
            let missing = f64::from(budget) - found;
            // Towards the budget, and on past it by less each time.
            size += (missing / coverage).clamp(-0.5 * size, size).trunc()
                + if missing < 0.0 { -1.0 } else { 1.0 };
        }
        best.unwrap_or_else(|| Self::whole(sequence, budget, seed))
    }

    /// The points of a set that lie in marked cells, as dense as that says.
    pub(crate) fn within(
        points: PointSet,
        map: &ProjectionMap,
        density: Option<&DensityTable>,
    ) -> Self {
        // Rows of a grid stay rows, and points in them in their order.
        let place = |number: u32| {
            let point = points.point(number);
            density.map_or(point, |it| it.sample(point).value)
        };
        let mut spans = Vec::new();
        let mut count = 0;
        let mut add = |first: u32, length: u32| {
            if length > 0 {
                let before = count;
                spans.push(Span { first, before });
                count += length;
            }
        };
        if points.sequence() == Sequence::Grid {
            for_each_row(&points, |first, columns| {
                let row = (place(first).y * ProjectionMap::RESOLUTION as f32) as u32;
                let column_at = |cell: u32| {
                    let edge = cell as f32 / ProjectionMap::RESOLUTION as f32;
                    partition_point(columns, |column| place(first + column).x < edge)
                };
                for run in map.runs(row) {
                    let (start, end) = (column_at(run.start), column_at(run.end));
                    add(first + start, end - start);
                }
            });
        } else {
            for index in 0..points.count() {
                if map.contains(place(index)) {
                    add(index, 1);
                }
            }
        }
        Self {
            points,
            spans: Some(spans),
            count,
        }
    }

    /// Number of points that are used.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// The whole set.
    pub(crate) fn points(&self) -> &PointSet {
        &self.points
    }

    /// The runs of consecutive points that are used, each as the number of its first point in the set
    /// and of the used points before it; `None` where all are.
    pub(crate) fn spans(&self) -> Option<impl Iterator<Item = (u32, u32)>> {
        let spans = self.spans.as_ref()?;
        Some(spans.iter().map(|span| (span.first, span.before)))
    }

    /// The number in the whole set of used point `index`.
    pub(crate) fn number(&self, index: u32) -> u32 {
        let (span, _) = self.span_of(index);
        span.first + (index - span.before)
    }

    /// The run of points that used point `index` is in, and the used points up to its end.
    fn span_of(&self, index: u32) -> (Span, u32) {
        let whole = Span {
            first: 0,
            before: 0,
        };
        let Some(spans) = &self.spans else {
            return (whole, self.count);
        };
        let after = spans.partition_point(|it| it.before <= index);
        let span = after.checked_sub(1).and_then(|it| spans.get(it));
        let end = spans.get(after).map_or(self.count, |next| next.before);
        (span.copied().unwrap_or(whole), end)
    }

    /// The used points before and after used point `index` of a grid, along each of its axes.
    ///
    /// Where rows differ in length, a neighbour across rows is the nearest.
    pub(crate) fn neighbours(&self, index: u32) -> [[Option<u32>; 2]; 2] {
        let grid = Grid::new(self.points.count());
        let (span, end) = self.span_of(index);
        let number = span.first + (index - span.before);
        let cell = grid.cell(number);
        let columns = grid.columns(cell.row);
        let along = [
            (cell.column > 0).then(|| number - 1),
            (cell.column + 1 < columns).then(|| number + 1),
        ];
        let below = cell.row.checked_sub(1).map(|row| {
            let length = grid.columns(row);
            number - cell.column - length + cell.column.min(length - 1)
        });
        let above = (cell.row + 1 < grid.rows()).then(|| {
            let length = grid.columns(cell.row + 1);
            number - cell.column + columns + cell.column.min(length - 1)
        });
        // Beside a point is mostly one of the same run, which is told without a search.
        let index_of = |number: u32| match number.checked_sub(span.first) {
            Some(place) if place < end - span.before => Some(span.before + place),
            _ => self.index_of(number),
        };
        [along, [below, above]].map(|pair| pair.map(|it| index_of(it?)))
    }

    /// Of a grid whose first `traced` used points are known: how many of them have all their
    /// neighbours known, and from which point on they are neighbours of others.
    pub(crate) fn settled(&self, traced: u32) -> (u32, u32) {
        if traced >= self.count {
            return (self.count, self.count);
        }
        let grid = Grid::new(self.points.count());
        let next = self.number(traced);
        let cell = grid.cell(next);
        // The row before the next point's has neighbours in it; the one before that has none.
        let first_of_row = next - cell.column;
        let Some(before) = cell.row.checked_sub(1) else {
            return (0, 0);
        };
        let first_before = first_of_row - grid.columns(before);
        let needed = before
            .checked_sub(1)
            .map_or(0, |row| self.used_before(first_before - grid.columns(row)));
        (self.used_before(first_before), needed)
    }

    /// Some of the used points, as a lattice of their own that has no others.
    pub(crate) fn window(&self, used: std::ops::Range<u32>) -> Self {
        let count = used.len() as u32;
        let spans = match &self.spans {
            None => vec![Span {
                first: used.start,
                before: 0,
            }],
            Some(spans) => {
                let start = spans.partition_point(|it| it.before <= used.start).max(1) - 1;
                let end = spans.partition_point(|it| it.before < used.end);
                let clipped = spans.get(start..end).unwrap_or_default().iter();
                clipped
                    .map(|span| Span {
                        first: span.first + used.start.saturating_sub(span.before),
                        before: span.before.saturating_sub(used.start),
                    })
                    .collect()
            }
        };
        Self {
            points: self.points,
            spans: Some(spans),
            count,
        }
    }

    /// How many used points have smaller numbers.
    fn used_before(&self, number: u32) -> u32 {
        let Some(spans) = &self.spans else {
            return number.min(self.count);
        };
        let after = spans.partition_point(|it| it.first < number);
        let Some(span) = after.checked_sub(1).and_then(|it| spans.get(it)) else {
            return 0;
        };
        let end = spans.get(after).map_or(self.count, |next| next.before);
        end.min(span.before + (number - span.first))
    }

    /// Which used point number `number` of the whole set is.
    fn index_of(&self, number: u32) -> Option<u32> {
        let Some(spans) = &self.spans else {
            return (number < self.count).then_some(number);
        };
        let after = spans.partition_point(|it| it.first <= number);
        let span = spans.get(after.checked_sub(1)?)?;
        let index = span.before + (number - span.first);
        let end = spans.get(after).map_or(self.count, |next| next.before);
        (index < end).then_some(index)
    }
}

/// Calls `visit` with the first point and the number of points of each row of a grid.
fn for_each_row(points: &PointSet, mut visit: impl FnMut(u32, u32)) {
    let grid = Grid::new(points.count());
    let mut first = 0;
    for row in 0..grid.rows() {
        let columns = grid.columns(row);
        visit(first, columns);
        first += columns;
    }
}

/// How many of `0..count` come before the first for which `is_before` does not hold.
fn partition_point(count: u32, is_before: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low + (high - low) / 2;
        if is_before(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a used point lies.
    fn place(lattice: &Lattice, index: u32) -> glam::Vec2 {
        lattice.points().point(lattice.number(index))
    }

    #[test]
    fn neighbours_lie_beside_each_other() {
        // Rows of unequal length, too.
        for count in [1, 2, 7, 64, 90, 1000] {
            let lattice = Lattice::whole(Sequence::Grid, count, 0);
            let rows = Grid::new(count).rows() as f32;
            let longest = Grid::new(count).columns(0) as f32;
            let (mut along, mut across) = (0, 0);
            for index in 0..count {
                let own = place(&lattice, index);
                let [horizontal, vertical] = lattice.neighbours(index);
                for (found, sign) in horizontal.into_iter().zip([-1.0, 1.0]) {
                    let Some(found) = found else { continue };
                    along += 1;
                    let step = place(&lattice, found) - own;
                    assert!(sign * step.x > 0.5 / longest && step.y == 0.0, "{step}");
                    assert!(step.x.abs() < 1.6 / longest, "{step}");
                }
                for (found, sign) in vertical.into_iter().zip([-1.0, 1.0]) {
                    let Some(found) = found else { continue };
                    across += 1;
                    let step = place(&lattice, found) - own;
                    assert!(
                        sign * step.y > 0.5 / rows && step.y.abs() < 1.6 / rows,
                        "{step}"
                    );
                    assert!(step.x.abs() < 1.1 / longest, "{step}");
                }
            }
            // Each pair twice, but for the ends of rows and columns.
            let grid = Grid::new(count);
            assert_eq!(along, 2 * (count - grid.rows()));
            assert_eq!(
                across,
                2 * count - grid.columns(0) - grid.columns(grid.rows() - 1)
            );
        }
    }

    #[test]
    fn windows_have_the_neighbours_of_the_whole() {
        let bits = |cell: u32| cell % 7 < 4 && cell % 11 != 3;
        let spans = |count: u32| {
            let (mut spans, mut before, mut last) = (Vec::new(), 0, None);
            for number in (0..count).filter(|it| bits(*it)) {
                if last != Some(number.wrapping_sub(1)) {
                    spans.push(Span {
                        first: number,
                        before,
                    });
                }
                last = Some(number);
                before += 1;
            }
            (spans, before)
        };
        for count in [7, 64, 90, 1000] {
            let (spans, used) = spans(count);
            let marked = Lattice {
                points: PointSet::new(Sequence::Grid, count, 0),
                spans: Some(spans),
                count: used,
            };
            for lattice in [Lattice::whole(Sequence::Grid, count, 0), marked] {
                let (mut given, mut kept) = (0, 0);
                for traced in 0..=lattice.count() {
                    let (settled, needed) = lattice.settled(traced);
                    assert!(given <= settled && kept <= needed && needed <= settled);
                    let window = lattice.window(kept..traced);
                    assert_eq!(window.count(), traced - kept);
                    for index in given..settled {
                        let whole = lattice.neighbours(index);
                        let found = window.neighbours(index - kept);
                        assert_eq!(window.number(index - kept), lattice.number(index));
                        let shifted = found.map(|pair| pair.map(|it| Some(it? + kept)));
                        assert_eq!(shifted, whole, "{count}: {index} in {kept}..{traced}");
                    }
                    (given, kept) = (settled, needed);
                }
                assert_eq!(given, lattice.count());
            }
        }
    }

    #[test]
    fn points_that_are_not_used_are_no_neighbours() {
        let points = PointSet::new(Sequence::Grid, 100, 0);
        // The third to fifth column of the first two rows, and the fourth of the third.
        let lattice = Lattice {
            points,
            spans: Some(vec![
                Span {
                    first: 2,
                    before: 0,
                },
                Span {
                    first: 12,
                    before: 3,
                },
                Span {
                    first: 23,
                    before: 6,
                },
            ]),
            count: 7,
        };
        assert_eq!(lattice.neighbours(0), [[None, Some(1)], [None, Some(3)]]);
        assert_eq!(
            lattice.neighbours(4),
            [[Some(3), Some(5)], [Some(1), Some(6)]]
        );
        assert_eq!(lattice.neighbours(5), [[Some(4), None], [Some(2), None]]);
        assert_eq!(lattice.neighbours(6), [[None, None], [Some(4), None]]);
    }
}
