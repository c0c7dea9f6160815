// From light to receiver. Twins: tracer.rs and trace.rs in caustics-trace.
//
// Each place that books is worth its sums on adapters that run all that is in a loop, so there are
// few of them.

// The longest change of direction that a differential keeps. Twin: `DIRECTION_CHANGE_LIMIT`.
const DIRECTION_CHANGE_LIMIT: f32 = 0.5;

const ALL_CHANNELS: u32 = 3u;

// No line of the ledger.
const NO_LINE: u32 = 0xffffffffu;

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
    // Which way it took; see photon_links.wgsl.
    turns: u32,
    // Whether its footprint was widened for paths that ended where it went on.
    is_thinned: bool,
}

var<private> pending: array<Branch, MAX_PENDING>;
var<private> pending_count: u32;
// Flux below which roulette begins.
var<private> threshold: f32;
var<private> photon_number: u32;
var<private> photon_emitter: u32;
// Whether its ray is one of an earlier emitter's too.
var<private> photon_covered: bool;

fn extended(path: u32, object: u32, event: u32) -> u32 {
    let word = object * 4u + event + 0x9e3779b9u;
    return ((((path << 5u) | (path >> 27u)) ^ word) * 0x01000193u) & ~TURNED;
}

// The hash of a path that landed, by where the axes of its footprint lie on a receiver with `normal`.
fn path_landed(path: u32, axes: array<vec3<f32>, 2>, normal: vec3<f32>) -> u32 {
    return path | select(0u, TURNED, signed_area(axes[0], axes[1], normal) < 0.0);
}

// Stores light that has landed, and says what became of it.
fn receive(branch: Branch, point: SurfacePoint) -> u32 {
    if branch.events == 0u {
        return FATE_DIRECT;
    }
    let its = footprint(branch.differential, point.geometric_normal);
    let side = select(-1.0, 1.0, point.from_outside);
    let object = bodies[point.body].object;
    let record = FootprintRecord(
        point.spawn.position,
        branch.flux.x,
        its.axes[0],
        branch.flux.y,
        its.axes[1],
        branch.flux.z,
        branch.ray.direction,
        object | select(0u, OVERLAP_BIT, its.is_overlap),
        side * point.geometric_normal,
        photon_number,
    );
    let path = path_landed(branch.path, its.axes, record.normal);
    let has_room = store_photon(record, branch, path);
    if PARAMETERS > 2u && its.is_overlap && has_room {
        reflect_at_boundaries(record, branch, path, object);
    }
    return select(FATE_CROWDED, FATE_STORED, has_room);
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
    let turns = with_turn(branch.turns, branch.depth, outgoing.event == EVENT_REFLECTION);
    if strongest <= 0.0 || !is_followed(turns, branch.depth) {
        return;
    }
    // What is booked of it here, and whether it ends.
    var line = NO_LINE;
    var booked = flux;
    var ends = false;
    if pending_count == MAX_PENDING {
        count_up(COUNTER_LOST, 1u);
        line = FATE_CROWDED;
        ends = true;
    } else if strongest < threshold {
        let survival = strongest / threshold;
        ends = random_next() >= survival;
        line = FATE_ROULETTE;
        if !ends {
            line = LINE_ROULETTE_GAIN;
            flux = flux_given / survival;
            booked = flux - flux_given;
            kept *= survival;
        }
    }
    if line != NO_LINE {
        book(line, booked);
    }
    if ends {
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
    var is_grazing = false;
    if PARAMETERS > 2u && outgoing.event != EVENT_PASSAGE {
        let kept = bounded_at_silhouette(
            differential,
            branch.differential,
            branch.ray.direction,
            outgoing.direction,
            outgoing.normal,
            select(0.0, outgoing.eta, outgoing.event == EVENT_REFRACTION),
            gradient,
        );
        differential = kept.differential;
        is_grazing = kept.shortened;
    }
    // Where only a part of the paths goes on, those that do stand farther apart.
    if kept < 1.0 {
        let root = sqrt(kept);
        differential = scaled_by(
            differential, 1.0 / select(sqrt(root), root, PARAMETERS == 2u));
    }
    let shortened = bounded(differential, DIRECTION_CHANGE_LIMIT);
    count_up(COUNTER_BOUNDED, select(0u, 1u, is_grazing || shortened.shortened));
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
        // A flat face's light is a sheet of its own.
        extended(branch.path, object ^ flat_face(point), 1u + outgoing.event),
        turns,
        branch.is_thinned || kept < 1.0,
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
    // What becomes of it, where it goes no further.
    var fate = NO_LINE;
    var point: SurfacePoint;
    point.body = NO_BODY;
    var distance = 0.0;
    if all_finite(branch.ray.origin) && all_finite(branch.ray.direction) {
        count_up(COUNTER_RAYS, 1u);
        let hit = closest_hit(branch.ray);
        distance = hit.t;
        if hit.primitive == NO_PRIMITIVE {
            fate = select(FATE_ESCAPED, FATE_MISSED, branch.events == 0u);
        } else {
            point = surface_at(branch.ray, hit);
            if !point.is_valid {
                fate = FATE_INVALID;
            }
        }
        if branch.depth == 0u && fate != FATE_INVALID
            && is_overlap(photon_emitter, photon_covered, point.body) {
            fate = FATE_OVERLAP;
        }
    } else {
        fate = FATE_INVALID;
    }
    if fate != NO_LINE {
        book(fate, branch.flux);
        return;
    }
    let medium = current_medium(branch.media);
    if medium != NO_BODY && any(bodies[medium].color != vec3(0.0)) {
        let arriving = branch.flux * beer_lambert(bodies[medium].color, distance);
        book(FATE_ABSORBED, branch.flux - arriving);
        branch.flux = arriving;
    }
    branch.differential = transferred(
        branch.differential, branch.ray.direction, distance, point.geometric_normal);
    branch.depth += 1u;

    let kind = bodies[point.body].kind;
    let splits_channels = branch.channel == ALL_CHANNELS && bodies[point.body].disperses != 0u;
    let whole = branch.flux;
    let path = branch.path;
    for (var channel = 0u; channel < select(1u, 3u, splits_channels); channel++) {
        if splits_channels {
            branch.flux = vec3(0.0);
            branch.flux[channel] = whole[channel];
            branch.channel = channel;
            // Each colour is a sheet of light of its own.
            branch.path = extended(path, channel, 0u);
            if whole[channel] == 0.0 || !is_followed_channel(channel) {
                continue;
            }
        }
        fate = NO_LINE;
        if kind == BODY_RECEIVER {
            fate = receive(branch, point);
        } else if branch.depth >= trace.max_depth {
            fate = FATE_TOO_DEEP;
        } else {
            branch_out(branch, point);
        }
        if fate != NO_LINE {
            book(fate, branch.flux);
        }
    }
}

// Sends a photon that is made from point number `point` of its emitter's, at `sample`, and follows all
// its branches to their ends.
fn send(emitter: u32, point: u32, sample: EmissionSample) {
    pending_count = 0u;
    random_start(point, trace.emitters[emitter].stream);
    let emission = emit(emitter, sample);
    if emission.is_valid {
        book(LINE_EMITTED, emission.flux);
        photon_emitter = emitter;
        photon_covered = is_covered(emitter, emission.ray);
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
            0u,
            false,
        );
        pending_count = 1u;
    }
    while pending_count > 0u {
        pending_count -= 1u;
        advance(pending[pending_count]);
    }
}
