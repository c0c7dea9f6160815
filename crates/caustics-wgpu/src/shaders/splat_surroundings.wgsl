// Builds the pyramid of what tiles of the picture show.
// CPU twin: `Surroundings::of` of caustics-render's `surroundings.rs`.

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var texels: texture_2d<u32>;
@group(0) @binding(2) var objects: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> tiles: array<SurroundingTile>;

// The largest float: nothing is beyond it.
const FARTHEST: f32 = 3.4028234e38;

fn empty_tile() -> SurroundingTile {
    return SurroundingTile(vec3<f32>(FARTHEST), 0xffffffffu, vec3<f32>(-FARTHEST), 0u);
}

var<workgroup> joined: array<SurroundingTile, 64>;

// The smallest tiles, one a workgroup.
@compute @workgroup_size(8, 8)
fn splat_surroundings(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var tile = empty_tile();
    if all(id.xy < view.size) {
        let texel = textureLoad(texels, vec2<i32>(id.xy), 0);
        if texel.w != NO_RECEIVER {
            let position = bitcast<vec3<f32>>(texel.xyz);
            let object = textureLoad(objects, vec2<i32>(id.xy), 0).x;
            tile = SurroundingTile(position, object, position, object);
        }
    }
    joined[local] = tile;
    for (var step = 32u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if local < step {
            joined[local] = surrounding_joined(joined[local], joined[local + step]);
        }
    }
    if local == 0u {
        tiles[group.y * view.surroundings[0].x + group.x] = joined[0];
    }
}

// All further levels, each of four tiles of the one before, by one workgroup.
@compute @workgroup_size(256)
fn splat_surroundings_coarser(@builtin(local_invocation_index) local: u32) {
    for (var level = 1u; level < view.surrounding_levels; level++) {
        storageBarrier();
        let fine = view.surroundings[level - 1u];
        let coarse = view.surroundings[level];
        for (var index = local; index < coarse.x * coarse.y; index += 256u) {
            let at = 2u * vec2<u32>(index % coarse.x, index / coarse.x);
            var tile = empty_tile();
            for (var i = 0u; i < 4u; i++) {
                let its = at + vec2<u32>(i & 1u, i >> 1u);
                if all(its < fine.xy) {
                    tile = surrounding_joined(tile, tiles[fine.z + its.y * fine.x + its.x]);
                }
            }
            tiles[coarse.z + index] = tile;
        }
    }
}
