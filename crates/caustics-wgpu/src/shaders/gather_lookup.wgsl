// The irradiance of the caustics at any point, in W/m²: `caustics_irradiance` and
// `caustics_irradiance_on`.
// CPU twins: `FootprintGather::irradiance` and `irradiance_on` of caustics-render.

// For points whose object is not known.
const CAUSTICS_ANY_OBJECT: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> caustics_grid: GatherGrid;
@group(0) @binding(1) var<storage, read> caustics_densities: array<StoredDensity>;
@group(0) @binding(2) var<storage, read> caustics_lists: array<u32>;
@group(0) @binding(3) var<storage, read> caustics_entries: array<u32>;
@group(0) @binding(4) var<storage, read> caustics_counts: array<u32>;

// At a point of a surface with unit `normal`, by the light that falls on the side of the normal;
// whatever object it belongs to.
fn caustics_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    return caustics_irradiance_on(CAUSTICS_ANY_OBJECT, position, normal);
}

// The same at a point of the object with this index among the world's.
fn caustics_irradiance_on(object: u32, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    var sizes = caustics_counts[6];
    while sizes != 0u {
        let size = countTrailingZeros(sizes);
        sizes &= sizes - 1u;
        let cell = gather_cell(position, caustics_grid.cell * exp2(f32(size)));
        let list = gather_list(cell, size, caustics_grid.lists);
        let room = arrayLength(&caustics_entries);
        let last = min(caustics_lists[list + 1u], room);
        for (var i = caustics_lists[list]; i < last; i++) {
            let entry = caustics_entries[i];
            if entry >> GATHER_SIZE_SHIFT != size {
                continue;
            }
            let stored = caustics_densities[entry & ((1u << GATHER_SIZE_SHIFT) - 1u)];
            let incoming = stored_incoming(stored);
            let plane = decode_octahedral(stored.normal);
            let is_own = object == CAUSTICS_ANY_OBJECT || object == object_of(stored.object);
            let cosine = density_cosine(stored, plane, incoming, position, normal, is_own);
            if cosine > 0.0 {
                let kernel = density_kernel(stored, position, caustics_grid.truncation);
                sum += cosine * kernel * stored.strength;
            }
        }
    }
    return sum;
}
