// Makes footprints ready for one view: density, level of resolution, pixels.
// CPU twin: `Splat::prepare` of caustics-render's `splat.rs`.

// The least standard deviation, in pixels of a level, that may be splatted there.
const LEVEL_SIGMA: f32 = 2.0;
// Footprints with a standard deviation below this many pixels are normalised by their own sum.
const SMALL_SIGMA: f32 = 0.9;
// Footprints longer than this many pixels are not summed.
const SUMMED_EXTENT: f32 = 64.0;

struct PixelAxes {
    x: vec3<f32>,
    y: vec3<f32>,
    is_valid: bool,
}

struct Bounds {
    low: vec2<f32>,
    high: vec2<f32>,
    is_exact: bool,
}

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<storage, read> footprints: array<FootprintRecord>;
@group(0) @binding(2) var<storage, read> footprint_count: array<u32>;
@group(0) @binding(3) var<storage, read_write> densities: array<StoredDensity>;
@group(0) @binding(4) var<storage, read_write> places: array<SplatPlace>;
@group(0) @binding(5) var<storage, read_write> counts: SplatCounts;
@group(0) @binding(6) var<storage, read_write> peak_sums: array<f32>;

var<workgroup> peaks: array<f32, 256>;

// In pixels, with the depth along the view as z: behind the eye where it is not positive.
fn project(point: vec3<f32>) -> vec3<f32> {
    let clip = view.view_projection * vec4<f32>(point, 1.0);
    let ndc = clip.xy / clip.w;
    return vec3<f32>(vec2<f32>(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * vec2<f32>(view.size), clip.w);
}

// How the point of a plane that a pixel sees moves with the pixel's two coordinates: the inverse of
// the projection's derivative in the plane.
fn pixel_axes(point: vec3<f32>, normal: vec3<f32>) -> PixelAxes {
    let tangent = tangent_of(normal);
    let bitangent = bitangent_of(normal);
    let clip = view.view_projection * vec4<f32>(point, 1.0);
    let ndc = clip.xy / clip.w;
    let half_size = vec2<f32>(0.5, -0.5) * vec2<f32>(view.size) / clip.w;
    let along_t = view.view_projection * vec4<f32>(tangent, 0.0);
    let along_b = view.view_projection * vec4<f32>(bitangent, 0.0);
    let t = (along_t.xy - ndc * along_t.w) * half_size;
    let b = (along_b.xy - ndc * along_b.w) * half_size;
    let determinant = t.x * b.y - t.y * b.x;
    var axes: PixelAxes;
    axes.x = (b.y * tangent - t.y * bitangent) / determinant;
    axes.y = (t.x * bitangent - b.x * tangent) / determinant;
    axes.is_valid = clip.w > 0.0 && determinant != 0.0 && is_finite_vector(axes.x)
        && is_finite_vector(axes.y);
    return axes;
}

fn bounds_of(d: Density, depth: f32) -> Bounds {
    let a = kernel_reach() * d.axis_u;
    let b = kernel_reach() * d.axis_v;
    let p = project(d.center + a + b);
    let q = project(d.center + a - b);
    let r = project(d.center - a + b);
    let s = project(d.center - a - b);
    let near = 0.3 * abs(depth);
    if min(min(p.z, q.z), min(r.z, s.z)) > near {
        return Bounds(
            min(min(p.xy, q.xy), min(r.xy, s.xy)),
            max(max(p.xy, q.xy), max(r.xy, s.xy)),
            true,
        );
    }
    return Bounds(vec2<f32>(0.0), vec2<f32>(view.size), false);
}

// The smallest standard deviation across the screen, in pixels.
fn least_sigma(step_x: vec2<f32>, step_y: vec2<f32>) -> f32 {
    let xx = dot(step_x, step_x);
    let yy = dot(step_y, step_y);
    let xy = dot(step_x, step_y);
    let half = 0.5 * (xx - yy);
    return inverseSqrt(0.5 * (xx + yy) + sqrt(half * half + xy * xy));
}

// By how much a small footprint must be brighter so that its values at the pixels' middles sum to
// its flux.
fn normalisation(place: SplatPlace) -> f32 {
    let area = abs(place.step_x.x * place.step_y.y - place.step_x.y * place.step_y.x);
    let extent = vec2<f32>(length(place.step_y), length(place.step_x)) * (sqrt(kernel_cut()) / area);
    if !(max(extent.x, extent.y) <= SUMMED_EXTENT) {
        return 1.0;
    }
    let low = floor(place.center - extent - 0.5);
    let high = ceil(place.center + extent - 0.5);
    var sum = 0.0;
    for (var y = low.y; y <= high.y; y += 1.0) {
        let span = ellipse_span(place, y + 0.5 - place.center.y);
        let first = max(floor(place.center.x + span.x - 0.5), low.x);
        let last = min(ceil(place.center.x + span.y - 0.5), high.x);
        for (var x = first; x <= last; x += 1.0) {
            let offset = vec2<f32>(x + 0.5, y + 0.5) - place.center;
            let at = offset.x * place.step_x + offset.y * place.step_y;
            sum += kernel_density(at.x, at.y);
        }
    }
    sum *= area;
    return select(1.0, 1.0 / sum, sum > 0.05);
}

fn pixel_range(low: f32, high: f32, stride: f32, size: u32) -> u32 {
    let most = f32(size);
    let first = u32(clamp(floor(low / stride - 1.0), 0.0, most));
    let last = u32(clamp(ceil(high / stride + 1.0), 0.0, most));
    return first | (last << 16u);
}

// Prepares one footprint and returns the peak of its irradiance, 0 if it is not splatted.
fn prepare(index: u32) -> f32 {
    let record = footprints[index];
    places[index].rows = 0u;
    let facing = dot(record.normal, view.eye.xyz - view.eye.w * record.position);
    if facing <= 0.0 {
        atomicAdd(&counts.turned_away, 1u);
        return 0.0;
    }
    var c = covariance_of_axes(record.axis_u, record.axis_v, record.normal, view.scale, view.max_anisotropy);
    let axes = pixel_axes(record.position, record.normal);
    if axes.is_valid {
        let tangent = tangent_of(record.normal);
        let bitangent = bitangent_of(record.normal);
        let variance = kernel_pixel_variance();
        c = covariance_add(c, variance, dot(axes.x, tangent), dot(axes.x, bitangent));
        c = covariance_add(c, variance, dot(axes.y, tangent), dot(axes.y, bitangent));
    }
    let flux = vec3<f32>(record.flux_r, record.flux_g, record.flux_b);
    var d = density_spread(record.position, record.normal, record.incoming, flux, c);
    if !(d.is_valid && is_finite_vector(record.position)) {
        atomicAdd(&counts.invalid, 1u);
        return 0.0;
    }
    let center = project(record.position);
    let bounds = bounds_of(d, center.z);
    if any(bounds.high < vec2<f32>(0.0)) || any(bounds.low > vec2<f32>(view.size)) {
        atomicAdd(&counts.outside, 1u);
        return 0.0;
    }
    atomicAdd(&counts.splatted, 1u);
    var place: SplatPlace;
    place.is_local = u32(bounds.is_exact && axes.is_valid);
    var sigma = 1e30;
    if place.is_local != 0u {
        place.center = center.xy;
        place.step_x = vec2<f32>(dot(axes.x, d.u_gradient), dot(axes.x, d.v_gradient));
        place.step_y = vec2<f32>(dot(axes.y, d.u_gradient), dot(axes.y, d.v_gradient));
        sigma = least_sigma(place.step_x, place.step_y);
        if sigma < SMALL_SIGMA {
            d.strength *= normalisation(place);
        }
    }
    var stride = 1.0;
    while sigma >= 2.0 * LEVEL_SIGMA && place.level + 1u < LEVELS {
        place.level += 1u;
        sigma *= 0.5;
        stride *= 2.0;
    }
    place.center /= stride;
    place.step_x *= stride;
    place.step_y *= stride;
    let level = view.levels[place.level];
    place.columns = pixel_range(bounds.low.x, bounds.high.x, stride, level.x);
    place.rows = pixel_range(bounds.low.y, bounds.high.y, stride, level.y);
    places[index] = place;
    densities[index] = density_store(d);
    atomicAdd(&counts.by_level[place.level], 1u);
    return max(max(d.strength.x, d.strength.y), d.strength.z) * kernel_peak();
}

@compute @workgroup_size(256)
fn splat_prepare(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3<u32>,
) {
    let count = min(footprint_count[0], arrayLength(&footprints));
    if id.x == 0u {
        atomicStore(&counts.footprints, count);
    }
    var peak = 0.0;
    if id.x < count {
        peak = prepare(id.x);
    }
    // The sum of a workgroup's peaks, in a fixed order.
    peaks[local] = peak;
    workgroupBarrier();
    if local < 16u {
        var sum = 0.0;
        for (var i = 0u; i < 16u; i++) {
            sum += peaks[16u * local + i];
        }
        peaks[16u * local] = sum;
    }
    workgroupBarrier();
    if local == 0u {
        var sum = 0.0;
        for (var i = 0u; i < 16u; i++) {
            sum += peaks[16u * i];
        }
        peak_sums[group.x] = sum;
    }
}
