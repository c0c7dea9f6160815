// Where a footprint lies on the screen, and which tiles it touches.
// CPU twin: `Splat::span` of caustics-render's `prepared_splat.rs`.

// What lies in a footprint: all pixels of its box; those of its ellipse; those of its ellipse in
// tiles that show nothing but its receiver in its plane, and all in others; what a normal
// distribution over pixels reaches; or all pixels of the box of such a distribution, because some
// see what lies off the footprint's plane.
const SHAPE_BOX: u32 = 0u;
const SHAPE_ELLIPSE: u32 = 1u;
const SHAPE_BY_TILE: u32 = 2u;
const SHAPE_INTEGRAL: u32 = 3u;
const SHAPE_SHIFTED: u32 = 4u;

// By how much the strength of such a box is multiplied. A plane that is seen aslant shows a footprint on
// fewer pixels than a surface before it that faces the view, and each of these may hold all of the flux:
// as bright as the peak that the sums are bounded by.
const CAUGHT_PEAK: f32 = 4.0;

// 40 bytes.
struct SplatPlace {
    // Middle, in pixels of the level.
    center: vec2<f32>,
    // What a step of one pixel of the level along x and y adds to the footprint's coordinates. Of
    // an integral, what is in a `PixelGaussian` after its center.
    step_x: vec2<f32>,
    step_y: vec2<f32>,
    // First pixel in the lower half, the one after the last in the upper.
    columns: u32,
    rows: u32,
    level: u32,
    shape: u32,
}

// Rust mirror: `SplatCounts`.
struct SplatCounts {
    splatted: atomic<u32>,
    outside: atomic<u32>,
    hidden: atomic<u32>,
    turned_away: atomic<u32>,
    invalid: atomic<u32>,
    // Pairs of a footprint and a tile, and those of them for which there was no room.
    pairs: atomic<u32>,
    dropped_pairs: atomic<u32>,
    // From here on of one batch: footprints, and what others catch of them before their planes,
    // which is splatted for itself and numbered after them.
    footprints: atomic<u32>,
    caught: atomic<u32>,
    pad: u32,
    by_level: array<atomic<u32>, 8>,
    level_cursor: array<atomic<u32>, 8>,
}

fn integral_of(place: SplatPlace) -> PixelGaussian {
    let step_x = place.step_x;
    let step_y = place.step_y;
    return PixelGaussian(place.center, step_x.x, step_x.y, step_y.x, step_y.y);
}

fn range_of(packed: u32) -> vec2<u32> {
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

// From where to where along x a footprint's ellipse reaches, relative to its middle, on a line y
// pixels below the middle, if it ends at the squared radius `cut`, in standard deviations; the end
// before the start where it does not.
fn ellipse_span(place: SplatPlace, y: f32, cut: f32) -> vec2<f32> {
    let across = y * place.step_y;
    let a = dot(place.step_x, place.step_x);
    let b = dot(place.step_x, across);
    let c = dot(across, across) - cut;
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 || a <= 0.0 {
        return vec2<f32>(1.0, -1.0);
    }
    let half = sqrt(discriminant) / a;
    return vec2<f32>(-b / a - half, -b / a + half);
}

fn tile_rows(place: SplatPlace) -> vec2<u32> {
    let rows = range_of(place.rows);
    return select(
        vec2<u32>(0u),
        vec2<u32>(rows.x / TILE, (rows.y + TILE - 1u) / TILE),
        rows.y > rows.x,
    );
}

// The tiles of a row of tiles that the ellipse touches, with a pixel to spare on each side: a
// pixel's receiver need not lie under its middle.
fn tile_columns(place: SplatPlace, row: u32, cut: f32) -> vec2<u32> {
    var columns = range_of(place.columns);
    if place.shape == SHAPE_INTEGRAL {
        let low = f32(row * TILE);
        let ends = pixel_gaussian_span(integral_of(place), low, low + f32(TILE));
        if ends.y < ends.x {
            return vec2<u32>(0u);
        }
        let most = vec2<f32>(columns);
        columns.x = u32(clamp(floor(ends.x), most.x, most.y));
        columns.y = u32(clamp(ceil(ends.y), most.x, most.y));
    } else if place.shape == SHAPE_ELLIPSE {
        let a = dot(place.step_x, place.step_x);
        let b = dot(place.step_x, place.step_y);
        let c = dot(place.step_y, place.step_y);
        let determinant = a * c - b * b;
        if determinant > 1e-12 * a * c {
            let bottom = sqrt(cut * a / determinant);
            let right = sqrt(cut * c / determinant);
            // How far below the middle the ellipse's rightmost point lies.
            let at_right = -b / c * right;
            let low = f32(row * TILE) - 0.5 - place.center.y;
            let high = low + f32(TILE + 1u);
            if low >= bottom || high <= -bottom {
                return vec2<u32>(0u);
            }
            let above = max(low, -0.9999 * bottom);
            let below = min(high, 0.9999 * bottom);
            let ends = vec2<f32>(
                ellipse_span(place, clamp(-at_right, above, below), cut).x,
                ellipse_span(place, clamp(at_right, above, below), cut).y,
            ) + place.center.x;
            let most = vec2<f32>(columns);
            columns.x = u32(clamp(floor(ends.x - 1.5), most.x, most.y));
            columns.y = u32(clamp(ceil(ends.y + 1.5), most.x, most.y));
        }
    }
    return select(
        vec2<u32>(0u),
        vec2<u32>(columns.x / TILE, (columns.y + TILE - 1u) / TILE),
        columns.y > columns.x,
    );
}

// Rounds in which tiles are summed whose pairs do not fit together. Mirrors `ROUNDS` in splat_view.rs.
const ROUNDS: u32 = 4u;

// Pairs of one round, in buffers with room for so many pairs and so many footprints: a tile that
// starts in them ends in the buffer, since it has each footprint once.
fn round_pairs(room: u32, footprints: u32) -> u32 {
    return max(room, footprints + 1u) - footprints;
}

// The round in which a tile is summed whose pairs start at so many.
fn round_of(start: u32, each: u32) -> u32 {
    return min(start / each, ROUNDS - 1u);
}
