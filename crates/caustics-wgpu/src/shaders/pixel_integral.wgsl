// A footprint much like a pixel in size, as the part of its flux that each pixel gets: a normal
// distribution integrated over the pixels' squares, by strips of a part of a pixel.
// CPU twin: `PixelGaussian` of caustics-render's `pixel_integral.rs`.

// Where the normal distribution ends, in standard deviations.
const INTEGRAL_CUT: f32 = 3.0;
// Strips that a pixel is cut into across the longer extent, at most.
const MOST_STRIPS: f32 = 32.0;
// The widest strip, in standard deviations along the longer extent, where it matters at what place in
// the strip its flux has its mean.
const WIDEST_STRIP: f32 = 0.75;
// By how much, in pixels, the middle may slant along the shorter extent from one end of a strip to the
// other; or by one standard deviation.
const MOST_SLANT: f32 = 0.25;
// By how much it may be off, in standard deviations.
const MOST_SHIFT: f32 = 0.05;
// The least standard deviation, in pixels.
const LEAST_SIGMA: f32 = 1e-3;
// The part of the normal distribution that is not cut off.
const INTEGRAL_PART: f32 = 0.9973002;

struct PixelGaussian {
    // Middle, in pixels: along the longer extent, along the shorter one.
    center: vec2<f32>,
    // Standard deviation along the longer extent.
    long: f32,
    // How the middle of a strip moves along the shorter extent with its place along the longer.
    slope: f32,
    // Standard deviation along the shorter extent, in one place of the longer.
    short: f32,
    // Strips in a pixel, a power of two; negative where the footprint is wider than high.
    strips: f32,
}

// A footprint around `center`, both in pixels.
fn pixel_gaussian(center: vec2<f32>, c: Covariance) -> PixelGaussian {
    let is_wide = c.x > c.z;
    let variances = select(c.zx, c.xz, is_wide);
    var g: PixelGaussian;
    g.center = select(center.yx, center, is_wide);
    g.slope = select(0.0, c.y / variances.x, variances.x > 0.0);
    // What is left of the shorter variance in one place, and what the strip's own extent adds.
    var within = max(variances.y - g.slope * c.y, 0.0);
    g.long = max(sqrt(variances.x), LEAST_SIGMA);
    let deviation = sqrt(within);
    let lean = abs(g.slope);
    let most_slant = max(MOST_SLANT, deviation);
    let is_level = lean * g.long <= MOST_SHIFT * deviation;
    var strips = 1.0;
    while strips < MOST_STRIPS
        && (lean > most_slant * strips || (!is_level && strips * g.long * WIDEST_STRIP < 1.0)) {
        strips *= 2.0;
    }
    let strip = min(1.0 / strips, 2.0 * INTEGRAL_CUT * g.long);
    within += (g.slope * strip) * (g.slope * strip) / 12.0;
    g.short = max(sqrt(within), LEAST_SIGMA);
    g.strips = select(strips, -strips, is_wide);
    return g;
}

// What it was made of, in squares of pixels.
fn pixel_gaussian_covariance(g: PixelGaussian) -> Covariance {
    let long = g.long * g.long;
    let cross = g.slope * long;
    // Without what the strip's own extent added.
    let strip = g.slope * min(1.0 / abs(g.strips), 2.0 * INTEGRAL_CUT * g.long);
    let short = max(g.short * g.short - strip * strip / 12.0, 0.0) + g.slope * cross;
    return select(vec3<f32>(short, cross, long), vec3<f32>(long, cross, short), g.strips < 0.0);
}

// Half the sides of the rectangle that holds it, in pixels.
fn pixel_gaussian_extent(g: PixelGaussian) -> vec2<f32> {
    let along = INTEGRAL_CUT * g.long;
    let across = INTEGRAL_CUT * g.short + abs(g.slope) * along;
    return select(vec2<f32>(across, along), vec2<f32>(along, across), g.strips < 0.0);
}

// Between which places along x it has light, from one place along y to another; the end before the
// start where it has none.
fn pixel_gaussian_span(g: PixelGaussian, low: f32, high: f32) -> vec2<f32> {
    let along = INTEGRAL_CUT * g.long;
    let across = INTEGRAL_CUT * g.short;
    if g.strips > 0.0 {
        let ends = vec2<f32>(low, high) - g.center.x;
        if ends.x > along || ends.y < -along {
            return vec2<f32>(1.0, -1.0);
        }
        let middles = g.slope * clamp(ends, vec2<f32>(-along), vec2<f32>(along));
        return g.center.y
            + vec2<f32>(min(middles.x, middles.y) - across, max(middles.x, middles.y) + across);
    }
    // Where the middle of a strip must be, across.
    let middles = vec2<f32>(low - across, high + across) - g.center.y;
    let most = abs(g.slope) * along;
    if middles.x > most || middles.y < -most {
        return vec2<f32>(1.0, -1.0);
    }
    var ends = vec2<f32>(-along, along);
    if most > 1e-3 {
        let places = middles / g.slope;
        ends = vec2<f32>(
            max(ends.x, min(places.x, places.y)),
            min(ends.y, max(places.x, places.y)),
        );
    }
    return g.center.x + ends;
}

// The cumulative distribution of the normal distribution cut off at the cut: right to 2e-7, by the
// error function of Abramowitz and Stegun 1964, 7.1.26.
fn cumulative(deviations: f32) -> f32 {
    let x = min(abs(deviations), INTEGRAL_CUT) * 0.70710678;
    let t = 1.0 / (1.0 + 0.3275911 * x);
    let series = t * (0.254829592
        + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    let part = min((1.0 - series * exp(-x * x)) / INTEGRAL_PART, 1.0);
    return 0.5 + 0.5 * sign(deviations) * part;
}

// The part of the flux that the pixel gets whose corner with the least coordinates is `corner`. All
// pixels together get 1.
fn pixel_gaussian_weight(g: PixelGaussian, corner: vec2<f32>) -> f32 {
    // Along the longer extent, and across.
    let pixel = select(corner.yx, corner, g.strips < 0.0);
    let strips = abs(g.strips);
    let along = INTEGRAL_CUT * g.long;
    let last = min(g.center.x + along, pixel.x + 1.0);
    var low = max(g.center.x - along, pixel.x);
    var below = cumulative((low - g.center.x) / g.long);
    var weight = 0.0;
    while low < last {
        // The next multiple of a strip's width, exact in binary.
        let high = min((floor(low * strips) + 1.0) / strips, last);
        let above = cumulative((high - g.center.x) / g.long);
        // Where the strip's flux has its mean, to first order: the density slopes down outwards.
        let strip = high - low;
        let slant = strip * strip / (12.0 * g.long * g.long);
        let mean = (0.5 * (low + high) - g.center.x) * (1.0 - min(slant, 1.0));
        let middle = g.center.y + g.slope * mean;
        let ends = (vec2<f32>(pixel.y, pixel.y + 1.0) - middle) / g.short;
        weight += (above - below) * (cumulative(ends.y) - cumulative(ends.x));
        low = high;
        below = above;
    }
    return weight;
}
