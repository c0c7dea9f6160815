// From light to receiver. Twins: tracer.rs and trace.rs in caustics-trace.

// Branches of one photon that wait. Where no more than a few have room left, photons go one way, as
// with `BRANCHING_ROULETTE`; what finds no room even so is booked as crowded.
const MAX_PENDING: u32 = 28u;
const RESERVED_PENDING: u32 = 4u;

// The longest change of direction that a differential keeps. Twin: `DIRECTION_CHANGE_LIMIT`.
const DIRECTION_CHANGE_LIMIT: f32 = 0.5;

const ALL_CHANNELS: u32 = 3u;

// A path, or a branch of one, on its way to the next surface.
struct Branch {
    ray: Ray,
    differential: Differential,
    flux: vec3<f32>,
    media: MediumStack,
    // Surfaces met so far.
    depth: u32,
    // Specular events so far.
    events: u32,
    has_split: bool,
    channel: u32,
    // A hash of what the path met and did there.
    path: u32,
}

var<private> pending: array<Branch, MAX_PENDING>;
var<private> pending_count: u32;
// Flux below which roulette begins.
var<private> threshold: f32;
var<private> photon_number: u32;
var<private> photon_emitter: u32;

fn extended(path: u32, object: u32, event: u32) -> u32 {
    let word = object * 4u + event + 0x9e3779b9u;
    return (((path << 5u) | (path >> 27u)) ^ word) * 0x01000193u;
}

fn receive(branch: Branch, point: SurfacePoint) {
    if branch.events == 0u {
        book(FATE_DIRECT, branch.flux);
        return;
    }
    let axes = footprint_axes(branch.differential, point.geometric_normal);
    let side = select(-1.0, 1.0, point.from_outside);
    let object = bodies[point.body].object;
    let record = FootprintRecord(
        point.spawn.position,
        branch.flux.x,
        axes[0],
        branch.flux.y,
        axes[1],
        branch.flux.z,
        branch.ray.direction,
        object,
        side * point.geometric_normal,
        photon_number,
    );
    let has_room = store_photon(record, branch.path);
    book(select(FATE_CROWDED, FATE_STORED, has_room), branch.flux);
}

// Queues one outgoing direction, if roulette lets it live. `chosen` is the part of such paths that
// were chosen to go on here.
fn follow(
    branch: Branch,
    point: SurfacePoint,
    outgoing: Outgoing,
    flux_given: vec3<f32>,
    chosen: f32,
    gradient: mat3x3<f32>,
) {
    var flux = flux_given;
    var kept = chosen;
    let strongest = largest(flux);
    if strongest <= 0.0 {
        return;
    }
    if strongest < threshold {
        let survival = strongest / threshold;
        if random_next() >= survival {
            book(FATE_ROULETTE, flux);
            return;
        }
        let stronger = flux / survival;
        book(LINE_ROULETTE_GAIN, stronger - flux);
        flux = stronger;
        kept *= survival;
    }
    if pending_count == MAX_PENDING {
        count_up(COUNTER_LOST, 1u);
        book(FATE_CROWDED, flux);
        return;
    }
    var differential = branch.differential;
    if outgoing.event == EVENT_REFLECTION {
        differential = reflected(
            differential, branch.ray.direction, outgoing.normal, gradient);
    } else if outgoing.event == EVENT_REFRACTION {
        differential = refracted(
            differential,
            branch.ray.direction,
            outgoing.direction,
            outgoing.normal,
            outgoing.eta,
            gradient,
        );
    }
    // Where only a part of the paths goes on, those that do stand farther apart.
    if kept < 1.0 {
        let root = sqrt(kept);
        differential = scaled_by(
            differential, 1.0 / select(sqrt(root), root, PARAMETERS == 2u));
    }
    let shortened = bounded(differential, DIRECTION_CHANGE_LIMIT);
    count_up(COUNTER_BOUNDED, select(0u, 1u, shortened.shortened));
    let origin = origin_towards(point.spawn, point.geometric_normal, outgoing.direction);
    let object = bodies[point.body].object;
    pending[pending_count] = Branch(
        Ray(origin, outgoing.direction),
        shortened.differential,
        flux,
        outgoing.media,
        branch.depth,
        branch.events + select(1u, 0u, outgoing.event == EVENT_PASSAGE),
        branch.has_split,
        branch.channel,
        extended(branch.path, object, 1u + outgoing.event),
    );
    pending_count += 1u;
}

fn branch_out(branch_given: Branch, point: SurfacePoint) {
    let scattering = scatter(
        point, branch_given.ray.direction, branch_given.media, branch_given.channel);
    count_up(COUNTER_FALLBACKS, scattering.fallbacks);
    if any(scattering.absorbed != vec3(0.0)) {
        book(FATE_ABSORBED, branch_given.flux * scattering.absorbed);
    }
    let both = scattering.count == 2u;
    let has_room = pending_count + RESERVED_PENDING <= MAX_PENDING;
    let may_split = trace.branching == BRANCHING_SPLIT_ALL
        || (trace.branching == BRANCHING_SPLIT_FIRST && !branch_given.has_split);
    let splits = may_split && has_room;
    var branch = branch_given;
    branch.has_split = branch_given.has_split || (both && splits);
    let side = select(-1.0, 1.0, point.from_outside);
    let gradient = side * normal_gradient(point);
    var first = 0u;
    var end = scattering.count;
    let chooses = both && !splits;
    if chooses {
        first = select(1u, 0u, random_next() < scattering.outgoing[0].weight.x);
        end = first + 1u;
    }
    for (var i = first; i < end; i++) {
        let outgoing = scattering.outgoing[i];
        let flux = branch.flux * select(outgoing.weight, vec3(1.0), chooses);
        follow(branch, point, outgoing, flux, select(1.0, outgoing.weight.x, chooses), gradient);
    }
}

// Takes a branch to the next surface and queues what leaves it.
fn advance(branch_given: Branch) {
    var branch = branch_given;
    if !(all_finite(branch.ray.origin) && all_finite(branch.ray.direction)) {
        book(FATE_INVALID, branch.flux);
        return;
    }
    count_up(COUNTER_RAYS, 1u);
    let hit = closest_hit(branch.ray);
    let misses = hit.primitive == NO_PRIMITIVE;
    var point: SurfacePoint;
    point.body = NO_BODY;
    if !misses {
        point = surface_at(branch.ray, hit);
        if !point.is_valid {
            book(FATE_INVALID, branch.flux);
            return;
        }
    }
    if branch.depth == 0u && is_overlap(photon_emitter, branch.ray, point.body) {
        book(FATE_OVERLAP, branch.flux);
        return;
    }
    if misses {
        book(select(FATE_ESCAPED, FATE_MISSED, branch.events == 0u), branch.flux);
        return;
    }
    let medium = current_medium(branch.media);
    if medium != NO_BODY && any(bodies[medium].color != vec3(0.0)) {
        let arriving = branch.flux * beer_lambert(bodies[medium].color, hit.t);
        book(FATE_ABSORBED, branch.flux - arriving);
        branch.flux = arriving;
    }
    branch.differential = transferred(
        branch.differential, branch.ray.direction, hit.t, point.geometric_normal);
    branch.depth += 1u;

    let kind = bodies[point.body].kind;
    let splits_channels = branch.channel == ALL_CHANNELS && bodies[point.body].disperses != 0u;
    let whole = branch.flux;
    for (var channel = 0u; channel < select(1u, 3u, splits_channels); channel++) {
        if splits_channels {
            branch.flux = vec3(0.0);
            branch.flux[channel] = whole[channel];
            branch.channel = channel;
            if whole[channel] == 0.0 {
                continue;
            }
        }
        if kind == BODY_RECEIVER {
            receive(branch, point);
        } else if branch.depth >= trace.max_depth {
            book(FATE_TOO_DEEP, branch.flux);
        } else {
            branch_out(branch, point);
        }
    }
}

fn trace_photon(number: u32) {
    // The emitter whose photons these are: the last that does not begin after it.
    var emitter = 0u;
    while emitter + 1u < trace.emitter_count && trace.emitters[emitter + 1u].first <= number {
        emitter += 1u;
    }
    photon_number = number;
    photon_emitter = emitter;
    last_record = 0u;
    pending_count = 0u;
    let point = point_number(emitter, number - trace.emitters[emitter].first);
    random_start(point, trace.emitters[emitter].stream);
    let emission = emit(emitter, point);
    if emission.is_valid {
        book(LINE_EMITTED, emission.flux);
        threshold = trace.min_weight * largest(emission.flux);
        pending[0] = Branch(
            emission.ray,
            emission.differential,
            emission.flux,
            MediumStack(trace.emitters[emitter].media, trace.emitters[emitter].media_count),
            0u,
            0u,
            false,
            ALL_CHANNELS,
            0u,
        );
        pending_count = 1u;
    }
    while pending_count > 0u {
        pending_count -= 1u;
        advance(pending[pending_count]);
    }
    links[number - trace.batch_first] = last_record;
}

const WORKGROUP_SIZE: u32 = 64u;

@compute @workgroup_size(WORKGROUP_SIZE)
fn trace_photons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    let index = (group.y * groups.x + group.x) * WORKGROUP_SIZE + invocation;
    if index < trace.count {
        trace_photon(trace.first + index);
    }
    workgroupBarrier();
    publish_ledger(invocation, WORKGROUP_SIZE);
}
