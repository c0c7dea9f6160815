// Which way a path took, in one word without its highest bit: its channel, a flag that says whether
// more surfaces were met than there is room for, and for each surface whether it was reflected there.

const TURN_CHANNEL: u32 = 3u;
const TURN_TOO_MANY: u32 = 4u;
const TURN_FIRST: u32 = 3u;
const TURN_SURFACES: u32 = 28u;

// With one surface more: that of number `depth`, counted from 1.
fn with_turn(turns: u32, depth: u32, is_reflected: bool) -> u32 {
    if depth > TURN_SURFACES {
        return turns | TURN_TOO_MANY;
    }
    return turns | select(0u, 1u << (TURN_FIRST + depth - 1u), is_reflected);
}

fn with_channel(turns: u32, channel: u32) -> u32 {
    return turns | channel;
}

// Whether two paths go the same way up to a surface.
fn is_same_way(a: u32, b: u32, depth: u32) -> bool {
    return depth <= TURN_SURFACES && (((a ^ b) >> (TURN_FIRST + depth - 1u)) & 1u) == 0u;
}
