// From directions back to the unit square. Twins: the inverses in the modules of `warp` in
// caustics-sampling.

fn disc_concentric_to_square(point: vec2<f32>) -> vec2<f32> {
    let horizontal = abs(point.x) > abs(point.y);
    let axis = select(point.y, point.x, horizontal);
    let other = select(point.x, point.y, horizontal);
    let radius = sqrt(dot(point, point)) * sign_of(axis);
    var angle = 0.0;
    if axis != 0.0 {
        angle = atan(other / axis);
    }
    let centred = vec2(radius, radius * angle * (1.0 / QUARTER_PI));
    let square = 0.5 * select(centred.yx, centred, horizontal) + vec2(0.5);
    return vec2(unit_nearest(square.x), unit_nearest(square.y));
}

fn cone_to_square(direction: vec3<f32>, height: f32) -> vec2<f32> {
    let squared = dot(direction.xy, direction.xy);
    var fallen = 1.0 - direction.z;
    if direction.z > 0.0 {
        fallen = squared / (1.0 + direction.z);
    }
    var across = vec2(1.0, 0.0);
    if squared > 0.0 {
        across = direction.xy * (1.0 / sqrt(squared));
    }
    return disc_concentric_to_square(sqrt(fallen / height) * across);
}

fn sphere_octahedral_to_square(direction: vec3<f32>) -> vec2<f32> {
    let across = abs(direction.xy);
    let r = sqrt(dot(across, across) / (1.0 + abs(direction.z)));
    var angle = 0.0;
    if across.x > 0.0 || across.y > 0.0 {
        angle = atan2(across.y, across.x);
    }
    let q = r * angle * (1.0 / HALF_PI);
    let p = r - q;
    let folded = select(vec2(1.0 - q, 1.0 - p), vec2(p, q), direction.z >= 0.0);
    let side = vec2(sign_of(direction.x), sign_of(direction.y));
    let square = 0.5 * abs(folded) * side + vec2(0.5);
    return vec2(unit_nearest(square.x), unit_nearest(square.y));
}
