// A photon's footprint as a density over its receiver's tangent plane: covariance and kernel.
// CPU twins: `footprint.rs`, `truncated_kernel.rs` and `covariance.rs` of caustics-render.

// 0 Gaussian, 1 ellipse (Epanechnikov), 2 disc, 3 tent: as `FootprintKernel::ALL` has them.
override FOOTPRINT_KERNEL: u32 = 0u;

const KERNEL_GAUSSIAN: u32 = 0u;
const KERNEL_ELLIPSE: u32 = 1u;
const KERNEL_DISC: u32 = 2u;

const MIN_INCIDENCE: f32 = 0.05;
const MAX_SLIDE: f32 = 2.0;
// sqrt(6): the radius at which the ellipse and the tent have variance 1.
const WIDE_REACH: f32 = 2.4494897;

// What one thread keeps of a footprint while it prepares it.
struct Density {
    center: vec3<f32>,
    normal: vec3<f32>,
    incoming: vec3<f32>,
    // Dot products with these are coordinates in standard deviations.
    u_gradient: vec3<f32>,
    v_gradient: vec3<f32>,
    // Two axes of one standard deviation in the plane.
    axis_u: vec3<f32>,
    axis_v: vec3<f32>,
    // Flux over area and incident cosine.
    strength: vec3<f32>,
    truncation: Truncation,
    is_valid: bool,
}

// A prepared footprint as memory holds it: 80 bytes.
struct StoredDensity {
    center: vec3<f32>,
    // Octahedral, two signed 16-bit parts.
    normal: u32,
    u_gradient: vec3<f32>,
    // Octahedral, in full: at grazing incidence the cosine is as small as its error else.
    incoming_x: f32,
    v_gradient: vec3<f32>,
    // Of the gate, as the next but one and the one after it.
    reach: f32,
    strength: vec3<f32>,
    incoming_y: f32,
    // Index of its receiver among the world's objects, and `DENSITY_OVERLAP_BIT`.
    object: u32,
    before: f32,
    plane_distance: f32,
    // How far off the plane, in metres, is still in it: the pixels that see it are those that see
    // where its light meets the plane, to half a pixel.
    flat: f32,
}

// `OVERLAP_BIT` of footprint_record.wgsl, which not all that know densities know.
const DENSITY_OVERLAP_BIT: u32 = 0x80000000u;

fn object_of(object_and_bit: u32) -> u32 {
    return object_and_bit & ~DENSITY_OVERLAP_BIT;
}

fn overlaps(object_and_bit: u32) -> bool {
    return (object_and_bit & DENSITY_OVERLAP_BIT) != 0u;
}

// A symmetric matrix in the tangent plane's basis: xx, xy, yy.
alias Covariance = vec3<f32>;

// Where a Gaussian ends, in standard deviations, and its value in its middle.
alias Truncation = vec2<f32>;

// The `Truncation` of footprints that lie side by side, then that of those that overlap.
alias Truncations = vec4<f32>;

fn truncation_of(all: Truncations, object_and_bit: u32) -> Truncation {
    return select(all.xy, all.zw, overlaps(object_and_bit));
}

fn is_finite_number(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_finite_vector(v: vec3<f32>) -> bool {
    return is_finite_number(v.x) && is_finite_number(v.y) && is_finite_number(v.z);
}

// Duff et al. 2017, as glam has it, so that both sides factor the same matrix.
fn tangent_of(n: vec3<f32>) -> vec3<f32> {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    return vec3<f32>(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
}

fn bitangent_of(n: vec3<f32>) -> vec3<f32> {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    return vec3<f32>(n.x * n.y * a, s + n.y * n.y * a, -n.y);
}

fn to_octahedral(v: vec3<f32>) -> vec2<f32> {
    let p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    let signs = select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    let folded = (1.0 - abs(p.yx)) * signs;
    return select(p, folded, v.z < 0.0);
}

fn from_octahedral(p: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let signs = select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    let folded = (1.0 - abs(p.yx)) * signs;
    return normalize(vec3<f32>(select(p, folded, z < 0.0), z));
}

fn encode_octahedral(v: vec3<f32>) -> u32 {
    return pack2x16snorm(to_octahedral(v));
}

fn decode_octahedral(packed: u32) -> vec3<f32> {
    return from_octahedral(unpack2x16snorm(packed));
}

fn stored_incoming(stored: StoredDensity) -> vec3<f32> {
    return from_octahedral(vec2<f32>(stored.incoming_x, stored.incoming_y));
}

// Squared radius, in standard deviations, beyond which there is no light.
fn kernel_cut(gaussian: Truncation) -> f32 {
    switch FOOTPRINT_KERNEL {
        case 0u: { return gaussian.x * gaussian.x; }
        case 1u: { return 6.0; }
        case 2u: { return 4.0; }
        default: { return 12.0; }
    }
}

// Extent along each axis, in standard deviations.
fn kernel_reach(gaussian: Truncation) -> f32 {
    switch FOOTPRINT_KERNEL {
        case 0u: { return gaussian.x; }
        case 2u: { return 2.0; }
        default: { return WIDE_REACH; }
    }
}

// The farthest that light gets along any direction: the tent has corners beyond the ellipse.
fn kernel_outer_reach(gaussian: Truncation) -> f32 {
    return select(kernel_reach(gaussian), 3.4641016, FOOTPRINT_KERNEL > KERNEL_DISC);
}

fn kernel_pixel_variance() -> f32 {
    return select(0.25, 1.0 / 12.0, FOOTPRINT_KERNEL == KERNEL_GAUSSIAN);
}

// The largest value that the kernel of any footprint has.
fn kernel_peak(gaussians: Truncations) -> f32 {
    switch FOOTPRINT_KERNEL {
        case 0u: { return max(gaussians.y, gaussians.w); }
        case 1u: { return 0.10610330; }
        case 2u: { return 0.07957747; }
        default: { return 0.16666667; }
    }
}

// The kernel at coordinates in standard deviations; its integral is 1.
fn kernel_density(u: f32, v: f32, gaussian: Truncation) -> f32 {
    let squared = u * u + v * v;
    switch FOOTPRINT_KERNEL {
        case 0u: {
            // exp(-squared / 32) by its series, to the 16th power.
            let y = squared * (1.0 / 32.0);
            let series = 1.0 - y * (1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0)))));
            let second = series * series;
            let fourth = second * second;
            let eighth = fourth * fourth;
            return select(0.0, gaussian.y * (eighth * eighth), squared < gaussian.x * gaussian.x);
        }
        case 1u: { return max(1.0 - squared / 6.0, 0.0) * 0.10610330; }
        case 2u: { return select(0.0, 0.07957747, squared < 4.0); }
        default: {
            let tents = max(vec2<f32>(1.0) - abs(vec2<f32>(u, v)) / WIDE_REACH, vec2<f32>(0.0));
            return tents.x * tents.y / 6.0;
        }
    }
}

fn covariance_add(c: Covariance, weight: f32, x: f32, y: f32) -> Covariance {
    return c + weight * vec3<f32>(x * x, x * y, y * y);
}

// What a linear map makes of it, given by the rows of its matrix.
fn covariance_mapped(c: Covariance, to_x: vec2<f32>, to_y: vec2<f32>) -> Covariance {
    let by_x = vec2<f32>(c.x * to_x.x + c.y * to_x.y, c.y * to_x.x + c.z * to_x.y);
    let by_y = vec2<f32>(c.x * to_y.x + c.y * to_y.y, c.y * to_y.x + c.z * to_y.y);
    return vec3<f32>(dot(to_x, by_x), dot(to_x, by_y), dot(to_y, by_y));
}

// The shorter and the longer variance.
fn covariance_eigenvalues(c: Covariance) -> vec2<f32> {
    let mean = 0.5 * (c.x + c.z);
    let half = 0.5 * (c.x - c.z);
    let spread = sqrt(half * half + c.y * c.y);
    return vec2<f32>(max(mean - spread, 0.0), mean + spread);
}

fn covariance_of_axes(
    axis_u: vec3<f32>,
    axis_v: vec3<f32>,
    normal: vec3<f32>,
    scale: f32,
    max_anisotropy: f32,
) -> Covariance {
    let tangent = tangent_of(normal);
    let bitangent = bitangent_of(normal);
    var c = vec3<f32>(0.0);
    c = covariance_add(c, scale * scale, dot(axis_u, tangent), dot(axis_u, bitangent));
    c = covariance_add(c, scale * scale, dot(axis_v, tangent), dot(axis_v, bitangent));
    // A limit of 0 stands for none: shaders need not know infinity.
    if max_anisotropy > 0.0 {
        let bounds = covariance_eigenvalues(c);
        let squared = max_anisotropy * max_anisotropy;
        if max_anisotropy <= 1.0 {
            c = vec3<f32>(bounds.y, 0.0, bounds.y);
        } else if bounds.x < bounds.y / squared {
            let widened = (bounds.y - squared * bounds.x) / (squared - 1.0);
            c += vec3<f32>(widened, 0.0, widened);
        }
    }
    if FOOTPRINT_KERNEL == KERNEL_DISC {
        let bounds = covariance_eigenvalues(c);
        let variance = sqrt(bounds.x * bounds.y);
        c = vec3<f32>(variance, 0.0, variance);
    }
    return c;
}

fn density_spread(
    center: vec3<f32>,
    normal: vec3<f32>,
    incoming: vec3<f32>,
    flux: vec3<f32>,
    c: Covariance,
    truncation: Truncation,
) -> Density {
    var d: Density;
    d.truncation = truncation;
    d.center = center;
    d.normal = normal;
    d.incoming = incoming;
    let tangent = tangent_of(normal);
    let bitangent = bitangent_of(normal);
    let xx = sqrt(c.x);
    let xy = c.y / xx;
    let yy = sqrt(max(c.z - xy * xy, 1e-6 * c.z));
    let area = xx * yy;
    d.u_gradient = tangent / xx;
    d.v_gradient = (bitangent - (xy / xx) * tangent) / yy;
    let incidence = dot(incoming, normal);
    if incidence < -MIN_INCIDENCE {
        d.u_gradient -= normal * (dot(incoming, d.u_gradient) / incidence);
        d.v_gradient -= normal * (dot(incoming, d.v_gradient) / incidence);
    }
    d.axis_u = xx * tangent + xy * bitangent;
    d.axis_v = yy * bitangent;
    d.strength = flux / (area * max(-incidence, MIN_INCIDENCE));
    d.is_valid = c.x > 0.0 && yy > 0.0 && area > 0.0 && is_finite_number(xx)
        && is_finite_number(yy) && is_finite_number(area) && is_finite_vector(d.strength);
    return d;
}

// No point farther from the center than this belongs to the footprint, but for a tent's corners.
fn density_radius(d: Density) -> f32 {
    let r = kernel_reach(d.truncation);
    return r * sqrt(dot(d.axis_u, d.axis_u) + dot(d.axis_v, d.axis_v));
}

fn density_reach(d: Density) -> f32 {
    let cosine = -dot(d.incoming, d.normal);
    return density_radius(d) * clamp(MAX_SLIDE * cosine, MIN_INCIDENCE, 1.0);
}

// The way from a plane towards the light, one metre off the plane.
fn towards_light(incoming: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let incidence = dot(incoming, normal);
    if incidence < -MIN_INCIDENCE {
        return incoming / incidence;
    }
    return normal;
}

fn density_store(d: Density, gate: Gate, object: u32) -> StoredDensity {
    var stored: StoredDensity;
    stored.center = d.center;
    stored.normal = encode_octahedral(d.normal);
    stored.u_gradient = d.u_gradient;
    let incoming = to_octahedral(d.incoming);
    stored.incoming_x = incoming.x;
    stored.incoming_y = incoming.y;
    stored.v_gradient = d.v_gradient;
    stored.reach = gate.reach;
    stored.strength = d.strength;
    stored.object = object;
    stored.before = gate.before;
    stored.plane_distance = gate.plane_distance;
    return stored;
}

// The cosine at which a stored density's light falls on a point of a surface with unit `normal`, 0
// where the point does not pass the gate.
fn density_cosine(
    stored: StoredDensity,
    plane: vec3<f32>,
    incoming: vec3<f32>,
    position: vec3<f32>,
    normal: vec3<f32>,
    is_own: bool,
) -> f32 {
    let off = dot(position - stored.center, plane);
    let gate = Gate(stored.before, stored.reach, stored.plane_distance);
    if !gate_admits(gate, off, dot(normal, plane), is_own) {
        return 0.0;
    }
    return max(-dot(normal, incoming), 0.0);
}

// The kernel of a stored density at a point.
fn density_kernel(stored: StoredDensity, position: vec3<f32>, gaussians: Truncations) -> f32 {
    let relative = position - stored.center;
    let u = dot(relative, stored.u_gradient);
    let v = dot(relative, stored.v_gradient);
    return kernel_density(u, v, truncation_of(gaussians, stored.object));
}
