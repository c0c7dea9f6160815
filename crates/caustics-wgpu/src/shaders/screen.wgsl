// The map between the pixels of a view and the world, with its derivative, and the part of the screen
// that a footprint may overlap.
// CPU twins: `screen.rs` and `Bounds` in `splat_bounds.rs` of caustics-render.

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

// In pixels, with the depth along the view as z: behind the eye where it is not positive.
fn project(point: vec3<f32>) -> vec3<f32> {
    let clip = view.view_projection * vec4<f32>(point, 1.0);
    let ndc = clip.xy / clip.w;
    return vec3<f32>(vec2<f32>(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * vec2<f32>(view.size), clip.w);
}

// How many pixels a way makes from a point whose homogeneous place on the screen is `clip`.
fn pixels_along(clip: vec4<f32>, way: vec3<f32>) -> vec2<f32> {
    let along = view.view_projection * vec4<f32>(way, 0.0);
    let half_size = vec2<f32>(0.5, -0.5) * vec2<f32>(view.size) / clip.w;
    return (along.xy - clip.xy / clip.w * along.w) * half_size;
}

// How the point of a plane that a pixel sees moves with the pixel's two coordinates: the inverse of
// the projection's derivative in the plane.
fn pixel_axes(point: vec3<f32>, normal: vec3<f32>) -> PixelAxes {
    let tangent = tangent_of(normal);
    let bitangent = bitangent_of(normal);
    let clip = view.view_projection * vec4<f32>(point, 1.0);
    let t = pixels_along(clip, tangent);
    let b = pixels_along(clip, bitangent);
    let determinant = t.x * b.y - t.y * b.x;
    var axes: PixelAxes;
    axes.x = (b.y * tangent - t.y * bitangent) / determinant;
    axes.y = (t.x * bitangent - b.x * tangent) / determinant;
    axes.is_valid = clip.w > 0.0 && determinant != 0.0 && is_finite_vector(axes.x)
        && is_finite_vector(axes.y);
    return axes;
}

// Of what a footprint lights between two heights before its plane.
fn bounds_of(d: Density, heights: vec2<f32>) -> Bounds {
    let a = kernel_reach(d.truncation) * d.axis_u;
    let b = kernel_reach(d.truncation) * d.axis_v;
    let up = towards_light(d.incoming, d.normal);
    let near = 0.3 * abs(project(d.center).z);
    var bounds = Bounds(vec2<f32>(1e30), vec2<f32>(-1e30), true);
    for (var i = 0u; i < 8u; i++) {
        let signs = 1.0 - 2.0 * vec2<f32>(vec2<u32>(i & 1u, (i >> 1u) & 1u));
        let height = select(heights.x, heights.y, i >= 4u);
        let p = project(d.center + height * up + signs.x * a + signs.y * b);
        if !(p.z > near) {
            return Bounds(vec2<f32>(0.0), vec2<f32>(view.size), false);
        }
        bounds.low = min(bounds.low, p.xy);
        bounds.high = max(bounds.high, p.xy);
    }
    return bounds;
}

fn is_outside(bounds: Bounds) -> bool {
    return any(bounds.high < vec2<f32>(0.0)) || any(bounds.low > vec2<f32>(view.size));
}

// The point of a plane, through `point` with unit `normal`, at pixel coordinates; `point` itself where
// it is not in front of the camera.
fn on_plane(pixel: vec2<f32>, point: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let clip = view.view_projection * vec4<f32>(point, 1.0);
    let ndc = vec2<f32>(2.0, -2.0) * pixel / vec2<f32>(view.size) + vec2<f32>(-1.0, 1.0);
    let seen = view.inverse_view_projection * vec4<f32>(ndc, clip.z / clip.w, 1.0);
    // A point that the pixel sees, and the way to it.
    let start = seen.xyz / seen.w;
    let direction = select(-view.eye.xyz, start - view.eye.xyz, view.eye.w != 0.0);
    let distance = dot(point - start, normal) / dot(direction, normal);
    let is_in_front = view.eye.w == 0.0 || distance > -1.0;
    let moved = start + distance * direction;
    if is_in_front && is_finite_vector(moved) {
        return moved;
    }
    return point;
}
