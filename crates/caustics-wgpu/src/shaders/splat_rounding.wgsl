// Rounds what a footprint adds to a pixel such that blending need not round.
//
// A sum of n equal parts in floats of b bits errs by up to n 2^-b, all in one direction: of 24 bits,
// a percent is lost or gained of 300,000 parts. But if all parts are multiples of a unit, of which
// the sum has at most 2^b, no addition rounds, on whatever hardware and in whatever order. Each part
// is rounded to a multiple of its pixel's unit, up or down so that the mean is right; the errors grow
// with the root of n at most.

// Bits that a unit is below a pixel's likely sum: fewer than the numbers have, since more may come.
const SINGLE_BITS: f32 = 23.0;
const HALF_BITS: f32 = 10.0;
// The same where a part is as large as all that is likely: the sample had few or none of the pixel's
// parts, and dozens may come.
const LEAST_BITS: f32 = 7.0;

// Parts of the sum above which rounding is left to the blending: of fewer than 2^11 parts it errs
// less.
const COARSE_PARTS: f32 = 11.0;

// The exponent of the last bit of the least half floats, and of the least normal float.
const LEAST_HALF: f32 = -24.0;
const LEAST_SINGLE: f32 = -126.0;

// By their bits: `exp2` may be off by a few last bits, and what is added would be no multiple.
fn power_of_two(exponent: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(vec3<u32>(vec3<i32>(exponent) + 127) << vec3<u32>(23u));
}

// A multiple of `unit` next to `x`: the one above as often as it takes for `x` to be the mean, if
// `place` spreads evenly over 0..1.
fn dithered(x: vec3<f32>, unit: vec3<f32>, place: f32) -> vec3<f32> {
    return unit * floor(x / unit + place);
}

// Two numbers from 0 up to 1 for each pixel and footprint. They spread evenly over each 64 footprints in
// a row, for their steps are the fractional parts of the golden ratio and of the root of two; and each
// such row starts anywhere, since a lattice may put all footprints on a pixel that are so many steps apart.
fn dither_places(pixel: vec2<u32>, index: u32) -> vec2<f32> {
    let start = sample_hash(pixel.x + sample_hash(pixel.y + sample_hash(index >> 6u)));
    let places = vec2<u32>(start, sample_hash(start)) + index * vec2<u32>(0x9e3779b9u, 0x6a09e667u);
    return vec2<f32>(places >> vec2<u32>(8u)) / 16777216.0;
}

// For sums of 32 bits.
fn single(share: vec3<f32>, pixel: vec2<u32>, index: u32) -> vec3<f32> {
    let code = textureLoad(units, vec2<i32>(pixel), 0).xyz;
    let exponent = vec3<f32>(vec3<i32>(code) - UNIT_OFFSET);
    let coarse = power_of_two(max(exponent - COARSE_PARTS, vec3<f32>(LEAST_SINGLE)));
    let is_fine = (code != vec3<u32>(0u)) & (share < coarse);
    if !any(is_fine) {
        return share;
    }
    let unit = power_of_two(max(exponent - SINGLE_BITS, vec3<f32>(LEAST_SINGLE)));
    return select(share, dithered(share, unit, dither_places(pixel, index).x), is_fine);
}

struct Limbs {
    @location(0) high: vec4<f32>,
    @location(1) low: vec4<f32>,
}

// For sums in pairs of half floats: the second has what the first was rounded by. Since that is as
// often too much as too little, its sum grows with the root of the number of parts, which the pixel's
// sum over this part is an estimate of; and no further than to 32 units, since a part that is below a
// unit seldom adds one.
fn limbs(share: vec3<f32>, pixel: vec2<u32>, index: u32) -> Limbs {
    let code = textureLoad(units, vec2<i32>(pixel), 0).xyz;
    let likely = vec3<f32>(vec3<i32>(code) - UNIT_OFFSET);
    let own = ceil(log2(max(share, vec3<f32>(1e-30))));
    let exponent = max(own, select(own, likely, code != vec3<u32>(0u)));
    let bits = min(LEAST_BITS + (exponent - own), vec3<f32>(HALF_BITS));
    let unit = max(exponent - bits, vec3<f32>(LEAST_HALF));
    let places = dither_places(pixel, index);
    let high = dithered(share, power_of_two(unit), places.x);
    // Of the second sum's 2^11 units five standard deviations are less, each half a unit of the first
    // times the root of the number of parts.
    let steps = clamp(ceil(0.5 * (exponent - own)), vec3<f32>(0.0), vec3<f32>(6.0));
    let low_unit = max(unit + steps - HALF_BITS, vec3<f32>(LEAST_HALF - log2(LOW_SCALE)));
    let low = dithered(share - high, power_of_two(low_unit), places.y);
    return Limbs(vec4<f32>(high, 0.0), vec4<f32>(LOW_SCALE * low, 0.0));
}
