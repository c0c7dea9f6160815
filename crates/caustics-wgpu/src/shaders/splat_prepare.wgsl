// Makes footprints ready for one view: density, level of resolution, pixels.
// CPU twin: `Splat::prepare` of caustics-render's `prepared_splat.rs`.

// The least standard deviation, in pixels of a level, that may be splatted there.
const LEVEL_SIGMA: f32 = 2.0;
// The same for Gaussians that overlap and light only their receiver's plane.
const OVERLAP_LEVEL_SIGMA: f32 = 0.8;
// Footprints with a standard deviation below this many pixels are normalised by their own sum.
const SMALL_SIGMA: f32 = 0.9;
// Footprints longer than this many pixels are not summed.
const SUMMED_EXTENT: f32 = 64.0;
// The least standard deviation of a footprint, in pixels, that is read at the pixels' middles;
// narrower ones are integrated over the pixels.
const INTEGRATED_SIGMA: f32 = 0.9;
// The same for footprints that overlap.
const OVERLAP_INTEGRATED_SIGMA: f32 = 0.35;
// Half a pixel's diagonal and a little, in pixels: no farther is the nearest pixel's middle.
const LEAST_REACH: f32 = 0.75;
// Half the widest rectangle of pixels that a footprint is integrated over.
const INTEGRATED_EXTENT: f32 = 48.0;
// The farthest, in pixels, that light may slide on its way to a footprint's plane for a pixel to be in
// the plane.
const NEGLIGIBLE_SHIFT: f32 = 1e-3;
// The least cosine between the view and the normal of a footprint at which its blur serves for what
// stands before its plane, too.
const LEAST_FACING: f32 = 0.3;

const_assert DENSITY_OVERLAP_BIT == OVERLAP_BIT;
// So much larger are the pixels of a plane than those of what faces the view before it.
const_assert CAUGHT_PEAK * LEAST_FACING > 1.0;

@group(0) @binding(0) var<uniform> view: SplatView;
@group(0) @binding(1) var<storage, read> footprints: array<FootprintRecord>;
@group(0) @binding(2) var<storage, read> footprint_count: array<u32>;
@group(0) @binding(3) var<storage, read_write> densities: array<StoredDensity>;
@group(0) @binding(4) var<storage, read_write> places: array<SplatPlace>;
@group(0) @binding(5) var<storage, read_write> counts: SplatCounts;
@group(0) @binding(6) var<storage, read_write> peak_sums: array<f32>;
@group(0) @binding(7) var<storage, read> surroundings: array<SurroundingTile>;

var<workgroup> peaks: array<f32, 256>;

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
fn normalisation(place: SplatPlace, truncation: Truncation) -> f32 {
    let area = abs(place.step_x.x * place.step_y.y - place.step_x.y * place.step_y.x);
    let cut = kernel_cut(truncation);
    let extent = vec2<f32>(length(place.step_y), length(place.step_x)) * (sqrt(cut) / area);
    if !(max(extent.x, extent.y) <= SUMMED_EXTENT) {
        return 1.0;
    }
    let low = floor(place.center - extent - 0.5);
    let high = ceil(place.center + extent - 0.5);
    var sum = 0.0;
    for (var y = low.y; y <= high.y; y += 1.0) {
        let span = ellipse_span(place, y + 0.5 - place.center.y, cut);
        let first = max(floor(place.center.x + span.x - 0.5), low.x);
        let last = min(ceil(place.center.x + span.y - 0.5), high.x);
        for (var x = first; x <= last; x += 1.0) {
            let offset = vec2<f32>(x + 0.5, y + 0.5) - place.center;
            let at = offset.x * place.step_x + offset.y * place.step_y;
            sum += kernel_density(at.x, at.y, truncation);
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

// Chooses the level of resolution by the smallest standard deviation in pixels, and the least that it
// may have in those of a level.
fn choose_level(place: ptr<function, SplatPlace>, smallest: f32, least: f32) {
    var sigma = smallest;
    while sigma >= 2.0 * least && (*place).level + 1u < LEVELS {
        (*place).level += 1u;
        sigma *= 0.5;
        (*place).center *= 0.5;
        (*place).step_x *= 2.0;
        (*place).step_y *= 2.0;
    }
}

// Writes a footprint that is ready, and returns the peak of its irradiance. Where no pixel of its level
// is left of it, it stays without rows, and is not counted: whoever orders footprints skips those
// without rows, and relies on the counts.
fn store(
    index: u32,
    d: Density,
    gate: Gate,
    object: u32,
    flat: f32,
    bounds: Bounds,
    prepared: SplatPlace,
) -> f32 {
    var place = prepared;
    let stride = exp2(f32(place.level));
    let level = view.levels[place.level];
    place.columns = pixel_range(bounds.low.x, bounds.high.x, stride, level.x);
    place.rows = pixel_range(bounds.low.y, bounds.high.y, stride, level.y);
    let columns = range_of(place.columns);
    let rows = range_of(place.rows);
    if columns.x >= columns.y || rows.x >= rows.y {
        places[index].rows = 0u;
        return 0.0;
    }
    places[index] = place;
    var stored = density_store(d, gate, object);
    stored.flat = flat;
    densities[index] = stored;
    atomicAdd(&counts.by_level[place.level], 1u);
    return max(max(d.strength.x, d.strength.y), d.strength.z) * kernel_peak(view.truncation);
}

fn covariance_of(record: FootprintRecord) -> Covariance {
    let limit = view.max_anisotropy;
    return covariance_of_axes(record.axis_u, record.axis_v, record.normal, view.scale, limit);
}

// With a multiple of the variance of a pixel's edges on the receiver added, or taken away.
fn density_blurred(record: FootprintRecord, x: vec3<f32>, y: vec3<f32>, variance: f32) -> Density {
    let tangent = tangent_of(record.normal);
    let bitangent = bitangent_of(record.normal);
    var c = covariance_of(record);
    c = covariance_add(c, variance, dot(x, tangent), dot(x, bitangent));
    c = covariance_add(c, variance, dot(y, tangent), dot(y, bitangent));
    let truncation = truncation_of(view.truncation, record.object);
    return density_spread(
        record.position, record.normal, record.incoming, flux_of(record), c, truncation,
    );
}

// What other surfaces catch of a footprint whose plane is seen edge-on, or from behind. A plane that
// is seen edge-on blurs its footprints by a pixel that is long on the plane, but not on what stands
// before it. CPU twin: `Splat::before_plane`.
fn prepare_before_plane(record: FootprintRecord, count: u32) -> f32 {
    // Minus the direction of view.
    var back = view.eye.xyz;
    if view.eye.w != 0.0 {
        let matrix = view.view_projection;
        back = -vec3<f32>(matrix[0].w, matrix[1].w, matrix[2].w);
    }
    let axes = pixel_axes(record.position, normalize(back));
    if !axes.is_valid {
        return 0.0;
    }
    let up = towards_light(record.incoming, record.normal);
    let d = density_blurred(
        record,
        axes.x - dot(axes.x, record.normal) * up,
        axes.y - dot(axes.y, record.normal) * up,
        kernel_pixel_variance(),
    );
    if !(d.is_valid && is_finite_vector(record.position)) {
        return 0.0;
    }
    let gate = gate_before(gate_of(density_reach(d)));
    var bounds = bounds_of(d, vec2<f32>(gate.before, gate.reach));
    if is_outside(bounds) {
        return 0.0;
    }
    let reached = in_reach(d, gate, object_of(record.object), bounds);
    if reached.heights.x > reached.heights.y {
        return 0.0;
    }
    bounds = bounds_of(d, reached.heights);
    if is_outside(bounds) {
        return 0.0;
    }
    var place: SplatPlace;
    place.shape = SHAPE_BOX;
    place.step_x = vec2<f32>(dot(axes.x, d.u_gradient), dot(axes.x, d.v_gradient));
    place.step_y = vec2<f32>(dot(axes.y, d.u_gradient), dot(axes.y, d.v_gradient));
    choose_level(&place, least_sigma(place.step_x, place.step_y), LEVEL_SIGMA);
    let index = count + atomicAdd(&counts.caught, 1u);
    return store(index, d, gate, record.object, 0.0, bounds, place);
}

// Whether a footprint is integrated over pixels; then its place and its strength are made so.
// CPU twin: `FootprintIntegral::of`.
fn is_integrated(
    record: FootprintRecord,
    axes: PixelAxes,
    place: ptr<function, SplatPlace>,
    d: ptr<function, Density>,
) -> bool {
    if view.integrate_pixels == 0u {
        return false;
    }
    let tangent = tangent_of(record.normal);
    let bitangent = bitangent_of(record.normal);
    let x = vec2<f32>(dot(axes.x, tangent), dot(axes.x, bitangent));
    let y = vec2<f32>(dot(axes.y, tangent), dot(axes.y, bitangent));
    let area = x.x * y.y - x.y * y.x;
    // The inverse of the matrix with columns x and y: rows of it.
    let to_x = vec2<f32>(y.y, -y.x) / area;
    let to_y = vec2<f32>(-x.y, x.x) / area;
    let mapped = covariance_mapped(covariance_of(record), to_x, to_y);
    let g = pixel_gaussian((*place).center, mapped);
    let extent = pixel_gaussian_extent(g);
    let cosine = max(-dot(record.incoming, record.normal), MIN_INCIDENCE);
    let strength = flux_of(record) / (abs(area) * cosine);
    let reaching = LEAST_REACH / kernel_reach((*d).truncation);
    let least = sqrt(max(reaching * reaching - kernel_pixel_variance(), 0.0));
    let limit = select(INTEGRATED_SIGMA, max(OVERLAP_INTEGRATED_SIGMA, least), overlaps(record.object));
    let is_small = covariance_eigenvalues(mapped).x < limit * limit
        && max(extent.x, extent.y) < INTEGRATED_EXTENT;
    if !(is_small && is_finite_vector(strength)) {
        return false;
    }
    (*place).shape = SHAPE_INTEGRAL;
    (*place).center = g.center;
    (*place).step_x = vec2<f32>(g.long, g.slope);
    (*place).step_y = vec2<f32>(g.short, g.strips);
    // A pixel has at most all of the flux: as bright as the peak of this.
    (*d).strength = strength / kernel_peak(view.truncation);
    return true;
}

// Makes a footprint narrower by as much as interpolation from its level will blur it.
// CPU twin: `Splat::undo_interpolation`.
fn undo_interpolation(
    record: FootprintRecord,
    axes: PixelAxes,
    place: ptr<function, SplatPlace>,
    d: ptr<function, Density>,
) {
    if (*place).level == 0u {
        return;
    }
    let stride = exp2(f32((*place).level));
    let blur = 0.25 * (stride * stride - 1.0);
    let narrower = density_blurred(record, axes.x, axes.y, kernel_pixel_variance() - blur);
    if narrower.is_valid {
        *d = narrower;
        let u = narrower.u_gradient;
        let v = narrower.v_gradient;
        (*place).step_x = stride * vec2<f32>(dot(axes.x, u), dot(axes.x, v));
        (*place).step_y = stride * vec2<f32>(dot(axes.y, u), dot(axes.y, v));
    }
}

// Prepares one footprint and returns the peak of its irradiance, 0 if it is not splatted.
fn prepare(index: u32, count: u32) -> f32 {
    let record = footprints[index];
    places[index].rows = 0u;
    let to_eye = view.eye.xyz - view.eye.w * record.position;
    let facing = dot(record.normal, to_eye) * inverseSqrt(dot(to_eye, to_eye));
    var peak = 0.0;
    if facing < LEAST_FACING {
        peak = prepare_before_plane(record, count);
    }
    if facing <= 0.0 {
        atomicAdd(&counts.turned_away, 1u);
        return peak;
    }
    let axes = pixel_axes(record.position, record.normal);
    var d: Density;
    if axes.is_valid {
        d = density_blurred(record, axes.x, axes.y, kernel_pixel_variance());
    } else {
        d = density_blurred(record, vec3<f32>(0.0), vec3<f32>(0.0), 0.0);
    }
    if !(d.is_valid && is_finite_vector(record.position)) {
        atomicAdd(&counts.invalid, 1u);
        return peak;
    }
    var gate = gate_of(density_reach(d));
    if facing < LEAST_FACING {
        gate = gate_own(gate);
    }
    var bounds = bounds_of(d, vec2<f32>(-gate.plane_distance, gate.reach));
    if is_outside(bounds) {
        atomicAdd(&counts.outside, 1u);
        return peak;
    }
    let reached = in_reach(d, gate, object_of(record.object), bounds);
    if reached.heights.x > reached.heights.y {
        atomicAdd(&counts.hidden, 1u);
        return peak;
    }
    let plane = bounds_of(d, vec2<f32>(0.0));
    let is_linear = plane.is_exact && axes.is_valid;
    var place: SplatPlace;
    var sigma = 1e30;
    if is_linear {
        place.center = project(record.position).xy;
        place.step_x = vec2<f32>(dot(axes.x, d.u_gradient), dot(axes.x, d.v_gradient));
        place.step_y = vec2<f32>(dot(axes.y, d.u_gradient), dot(axes.y, d.v_gradient));
        sigma = least_sigma(place.step_x, place.step_y);
        if is_integrated(record, axes, &place, &d) {
            let g = integral_of(place);
            let middle = select(g.center.yx, g.center, g.strips < 0.0);
            let extent = pixel_gaussian_extent(g);
            var box = Bounds(middle - extent, middle + extent, true);
            let shift = pixels_per_height(d);
            let lower = reached.heights.x * shift;
            let upper = reached.heights.y * shift;
            if max(length(lower), length(upper)) > NEGLIGIBLE_SHIFT && abs(shift.x) < 1e30 {
                place.shape = SHAPE_SHIFTED;
                d.u_gradient = vec3<f32>(shift, 0.0);
                d.strength *= CAUGHT_PEAK;
                box.low += min(min(lower, upper), vec2<f32>(0.0));
                box.high += max(max(lower, upper), vec2<f32>(0.0));
            }
            // Without the blur it may end before the picture begins.
            if is_outside(box) {
                atomicAdd(&counts.outside, 1u);
                return peak;
            }
            atomicAdd(&counts.splatted, 1u);
            return peak + store(index, d, gate, record.object, 0.0, box, place);
        }
        if sigma < SMALL_SIGMA {
            d.strength *= normalisation(place, d.truncation);
        }
    }
    let half_pixel = 0.5 / length(pixels_per_height(d));
    let is_plain = reached.is_own && reached.heights.x >= -half_pixel && reached.heights.y <= half_pixel;
    if is_linear && is_plain && overlaps(record.object) && FOOTPRINT_KERNEL == KERNEL_GAUSSIAN {
        choose_level(&place, sigma, OVERLAP_LEVEL_SIGMA);
        undo_interpolation(record, axes, &place, &d);
    } else {
        choose_level(&place, sigma, LEVEL_SIGMA);
    }
    let flat = exp2(f32(place.level)) * half_pixel;
    let is_flat = reached.heights.x >= -flat && reached.heights.y <= flat;
    if is_linear {
        place.shape = select(SHAPE_BY_TILE, SHAPE_ELLIPSE, is_flat && reached.is_own);
    } else {
        place.shape = SHAPE_BOX;
    }
    bounds = plane;
    if !is_flat {
        bounds = bounds_of(d, reached.heights);
    }
    if is_outside(bounds) {
        atomicAdd(&counts.outside, 1u);
        return peak;
    }
    atomicAdd(&counts.splatted, 1u);
    return peak + store(index, d, gate, record.object, flat, bounds, place);
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
        peak = prepare(id.x, count);
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
