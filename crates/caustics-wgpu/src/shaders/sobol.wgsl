// Sobol's sequence, Owen-scrambled. Twin: sobol.rs in caustics-sampling.

fn nested_scramble(bits: u32, seed: u32) -> u32 {
    var x = reverseBits(bits);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverseBits(x);
}

// The point's binary digits, the first after the point in the highest bit. The direction numbers
// come from Sobol's recurrence, three back.
fn sobol_bits(index: u32, member: u32) -> u32 {
    if member == 0u {
        return reverseBits(index);
    }
    var bits = 0u;
    // The direction numbers of this bit and the next two; the initial integers are 1, 3 and, of the
    // last member, 1.
    var first = 0x80000000u;
    var second = 0xc0000000u;
    var third = select(select(0x20000000u, 0x60000000u, member == 2u), 0xa0000000u, member == 1u);
    var left = index;
    while left != 0u {
        if (left & 1u) != 0u {
            bits ^= first;
        }
        var next = first ^ (first >> 3u) ^ second;
        if member == 1u {
            next = third ^ (third >> 1u);
        } else if member == 2u {
            next = second ^ (second >> 2u) ^ third;
        }
        first = second;
        second = third;
        third = next;
        left >>= 1u;
    }
    return bits;
}

fn sobol(index: u32, dimension: u32) -> f32 {
    let group = dimension / 4u;
    let member = dimension % 4u;
    let seed = vec2(trace.seed_low, trace.seed_high);
    let hash = pcg4d(vec4(seed, dimension, 0u)).x;
    if group == 0u {
        let bits = sobol_bits(index, member);
        return unit_from_bits(select(nested_scramble(bits, hash), bits, all(seed == vec2(0u))));
    }
    let shuffled = nested_scramble(index, pcg4d(vec4(seed, group, 1u)).x);
    return unit_from_bits(nested_scramble(sobol_bits(shuffled, member), hash));
}
