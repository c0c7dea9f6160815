// Lines of small letters in the upper left corner, on a dark ground.

const COLUMNS: u32 = 44u;
const ROWS: u32 = 20u;
// A letter is 3 by 5 dots and has one to spare on the right and two below.
const CELL: vec2<u32> = vec2<u32>(4u, 7u);

struct Text {
    // Columns and rows in use, and pixels of a dot.
    used: vec2<u32>,
    dot: u32,
    pad: u32,
    // The dots of each letter, one bit each, the upper left one first.
    glyphs: array<vec4<u32>, 220>,
}

@group(0) @binding(0) var<uniform> text: Text;

@vertex
fn overlay_corner(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    let at = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u));
    return vec4<f32>(4.0 * at - 1.0, 0.0, 1.0);
}

@fragment
fn overlay_letters(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    // A dot to spare to the left and above.
    let dots = vec2<i32>(position.xy) / i32(text.dot) - 2;
    let size = vec2<i32>(text.used * CELL);
    if any(dots < vec2<i32>(-2)) || any(dots > size) || size.y == 0 {
        discard;
    }
    var is_lit = false;
    if all(dots >= vec2<i32>(0)) && all(dots < size) {
        let cell = vec2<u32>(dots) / CELL;
        let at = vec2<u32>(dots) % CELL;
        let index = cell.y * COLUMNS + cell.x;
        let glyph = text.glyphs[index / 4u][index % 4u];
        is_lit = at.x < 3u && at.y < 5u && ((glyph >> (14u - 3u * at.y - at.x)) & 1u) == 1u;
    }
    return select(vec4<f32>(0.0, 0.0, 0.0, 0.6), vec4<f32>(1.0), is_lit);
}
