// Photons from an environment. Twins: sky_emission.rs in caustics-trace; environment.rs and
// environment_parts.rs in caustics-scene, `packed_sky` in sky_tables.rs.
//
// Its rows and its texels, row by row, lie behind the scene's triangles in the same buffer, since
// there is no room for another. The fourth word is where a row's or a texel's part of the samples
// ends; the others are floats: cosines at which a row begins and ends and the solid angle of its
// texels, or a texel's radiance.

const TAU: f32 = 6.28318531;

// Parts of all samples.
const SKY_PARTS: u32 = 0x80000000u;

struct SkyChoice {
    index: u32,
    along: f32,
    part: f32,
}

struct SkySample {
    // Towards the light.
    towards: vec3<f32>,
    radiance: vec3<f32>,
    pdf: f32,
}

fn sky_floats(place: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(vec3(triangles[place].a, triangles[place].b, triangles[place].c));
}

fn sky_end(place: u32) -> u32 {
    return triangles[place].body;
}

// Which of `count` rows or texels a number falls on.
fn sky_choice(first: u32, count: u32, number: f32) -> SkyChoice {
    let at = u32(unit_nearest(number) * f32(SKY_PARTS));
    var low = 0u;
    var high = count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if sky_end(first + middle) <= at {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var start = 0u;
    if low > 0u {
        start = sky_end(first + low - 1u);
    }
    let parts = sky_end(first + low) - start;
    var along = 0.5;
    if parts > 0u {
        along = f32(at - start) / f32(parts);
    }
    return SkyChoice(low, min(along, BELOW_ONE), f32(parts) / f32(SKY_PARTS));
}

// Twin: `Environment::sample`.
fn sky_sample(emitter: u32, sample: vec2<f32>) -> SkySample {
    let width = trace.emitters[emitter].sky_width;
    let rows = trace.emitters[emitter].sky_height;
    let first_row = trace.emitters[emitter].sky_first;
    let row = sky_choice(first_row, rows, sample.y);
    let first = first_row + rows + row.index * width;
    let column = sky_choice(first, width, sample.x);
    // Top, bottom, solid angle.
    let ring_of = sky_floats(first_row + row.index);
    let height = ring_of.x + rounded((ring_of.y - ring_of.x) * row.along);
    let ring = sqrt(max(1.0 - rounded(height * height), 0.0));
    let turn = (f32(column.index) + column.along) / f32(width) - 0.5;
    let angle = sine_cosine(TAU * turn);
    return SkySample(
        vec3(ring * angle.x, height, -ring * angle.y),
        sky_floats(first + column.index),
        row.part * column.part / ring_of.z,
    );
}

fn emit_from_sky(emitter: u32, sample: EmissionSample) -> Emission {
    var emission: Emission;
    let sky = sky_sample(emitter, sample.place);
    if sky.pdf <= 0.0 || !is_finite(sky.pdf) {
        return emission;
    }
    let target_radius = trace.emitters[emitter].target_radius;
    let distance = trace.emitters[emitter].radius;
    let tangents = tangents_of(sky.towards);
    let place = square_to_disc_concentric(sample.point);
    let count = f32(trace.emitters[emitter].points);
    // Rounded, or compilers sum and multiply in another order.
    let before = trace.emitters[emitter].target_center + rounded_vector(distance * sky.towards);
    let across = rounded_vector(target_radius * vec3(place.value, 0.0));
    emission.ray = Ray(
        before + rounded_vector(from_frame(tangents, sky.towards, across)),
        -sky.towards,
    );
    emission.flux = sky.radiance * (trace.emitters[emitter].area / (sky.pdf * count));
    emission.is_valid = true;
    if PARAMETERS == 4u {
        // The steps come first.
        let edge = 1.0 / sqrt(count);
        let steps = array(
            rounded_vector(target_radius * vec3(place.d_du, 0.0)),
            rounded_vector(target_radius * vec3(place.d_dv, 0.0)),
        );
        let angle = BLUR_EDGE * (1.0 / sqrt(sky.pdf));
        let turned = array(angle * tangents.first, angle * tangents.second);
        for (var i = 0u; i < 2u; i++) {
            emission.differential.position[i] =
                edge * rounded_vector(from_frame(tangents, sky.towards, steps[i]));
            emission.differential.position[PARAMETERS - 2u + i] = -distance * turned[i];
            emission.differential.direction[PARAMETERS - 2u + i] = turned[i];
        }
    }
    return emission;
}
