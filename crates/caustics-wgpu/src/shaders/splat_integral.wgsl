// What pixels get of a footprint that is integrated over them, by what they see.
// CPU twin: `FootprintIntegral` of caustics-render's `footprint_integral.rs`.

// Another object whose normal has at least this cosine with the footprint's lies in its plane.
const COPLANAR_COSINE: f32 = 0.999;

// The part of its flux that a pixel gets from a footprint whose light the pixel's surface catches on its
// way to the plane, times how much larger a pixel of the plane is. Slid along the light, the pixel's
// square on that surface is a parallelogram in the plane, here in the pixels that see the plane.
fn caught_part(
    stored: StoredDensity,
    place: SplatPlace,
    plane: vec3<f32>,
    incoming: vec3<f32>,
    position: vec3<f32>,
    normal: vec3<f32>,
    pixel: vec2<f32>,
) -> f32 {
    let axes = pixel_axes(position, normal);
    let up = towards_light(incoming, plane);
    let clip = view.view_projection * vec4<f32>(stored.center, 1.0);
    let x = pixels_along(clip, axes.x - dot(axes.x, plane) * up);
    let y = pixels_along(clip, axes.y - dot(axes.y, plane) * up);
    let relative = position - stored.center;
    let at = pixels_along(clip, relative - dot(relative, plane) * up);
    let area = x.x * y.y - x.y * y.x;
    // The inverse of the matrix with columns x and y: rows of it.
    let to_x = vec2<f32>(y.y, -y.x) / area;
    let to_y = vec2<f32>(-x.y, x.x) / area;
    let center = project(position).xy - vec2<f32>(dot(to_x, at), dot(to_y, at));
    let c = covariance_mapped(pixel_gaussian_covariance(integral_of(place)), to_x, to_y);
    // Neither where the light goes along the surface, nor where that is seen edge-on.
    if !(axes.is_valid && is_finite_vector(c) && is_finite_vector(vec3<f32>(center, 1.0 / area))) {
        return 0.0;
    }
    return pixel_gaussian_weight(pixel_gaussian(center, c), pixel) / abs(area);
}

// What a footprint adds to a pixel, over its strength and the kernel's peak, where its light falls on
// what the pixel sees at a cosine. What a receiver that curves shows off the plane is the pixel's square
// moved to where its light meets the plane.
fn integral_weight(
    stored: StoredDensity,
    place: SplatPlace,
    plane: vec3<f32>,
    incoming: vec3<f32>,
    position: vec3<f32>,
    normal: vec3<f32>,
    is_own: bool,
    cosine: f32,
    pixel: vec2<f32>,
) -> f32 {
    if place.shape != SHAPE_SHIFTED {
        return cosine * pixel_gaussian_weight(integral_of(place), pixel);
    }
    if dot(normal, plane) < select(COPLANAR_COSINE, MIN_NORMAL_COSINE, is_own) {
        let part = caught_part(stored, place, plane, incoming, position, normal, pixel);
        return min(cosine * part / CAUGHT_PEAK, 1.0);
    }
    var corner = pixel;
    if is_own {
        // Pixels a metre, in the place of a gradient that is not asked for.
        corner -= dot(position - stored.center, plane) * stored.u_gradient.xy;
    }
    return cosine * pixel_gaussian_weight(integral_of(place), corner) / CAUGHT_PEAK;
}
