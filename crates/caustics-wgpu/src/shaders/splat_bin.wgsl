// Sorts footprints into the tiles that they touch, by counting: one pass counts each tile's, one
// writes their numbers into the tile's list.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<storage, read> places: array<SplatPlace>;
@group(0) @binding(2) var<storage, read> tile_starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> tile_cursors: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: SplatCounts;
@group(0) @binding(6) var<uniform> step: SplatStep;
@group(0) @binding(7) var<storage, read> densities: array<StoredDensity>;
@group(0) @binding(8) var<storage, read> surroundings: array<SurroundingTile>;

fn footprint_count() -> u32 {
    return atomicLoad(&counts.footprints) + atomicLoad(&counts.caught);
}

// Whether a footprint may light a pixel of a tile.
fn may_light(index: u32, place: SplatPlace, tile: vec2<u32>) -> bool {
    if place.shape == SHAPE_ELLIPSE || place.shape >= SHAPE_INTEGRAL {
        return true;
    }
    let its = surrounding_of_tile(place.level, tile);
    return relation(surroundings[its.x], its.y != 0u, densities[index]) != RELATION_DARK;
}

// Counts, for each tile, the footprints that may light a pixel of it.
@compute @workgroup_size(256)
fn splat_count(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= footprint_count() {
        return;
    }
    let place = places[id.x];
    let level = view.levels[place.level];
    let rows = tile_rows(place);
    let cut = kernel_cut(truncation_of(view.truncation, densities[id.x].object));
    for (var row = rows.x; row < rows.y; row++) {
        let columns = tile_columns(place, row, cut);
        for (var column = columns.x; column < columns.y; column++) {
            if may_light(id.x, place, vec2<u32>(column, row)) {
                atomicAdd(&tile_cursors[level.w + row * level.z + column], 1u);
            }
        }
    }
}

// Writes each footprint's number into the lists of its tiles.
@compute @workgroup_size(256)
fn splat_scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= footprint_count() {
        return;
    }
    let place = places[id.x];
    let level = view.levels[place.level];
    let rows = tile_rows(place);
    let cut = kernel_cut(truncation_of(view.truncation, densities[id.x].object));
    let room = arrayLength(&pairs);
    let each = round_pairs(room, arrayLength(&places));
    // Where all tiles' lists end: most often they fit in one round.
    let last = view.levels[LEVELS - 1u];
    let tiles = last.w + last.z * ((last.y + TILE - 1u) / TILE);
    if step.round * each > tile_starts[tiles] {
        return;
    }
    var made = 0u;
    var dropped = 0u;
    for (var row = rows.x; row < rows.y; row++) {
        let columns = tile_columns(place, row, cut);
        for (var column = columns.x; column < columns.y; column++) {
            let tile = level.w + row * level.z + column;
            let is_mine = round_of(tile_starts[tile], each) == step.round;
            if !(is_mine && may_light(id.x, place, vec2<u32>(column, row))) {
                continue;
            }
            let at = tile_starts[tile] - step.round * each + atomicAdd(&tile_cursors[tile], 1u);
            if at < room {
                pairs[at] = id.x;
            } else {
                dropped += 1u;
            }
            made += 1u;
        }
    }
    atomicAdd(&counts.pairs, made);
    if dropped > 0u {
        atomicAdd(&counts.dropped_pairs, dropped);
    }
}
