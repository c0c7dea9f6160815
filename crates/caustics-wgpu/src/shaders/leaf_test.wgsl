// What a traversal does with a leaf. Twin: leaf_test.rs in caustics-accel.
//
// Tests that are rare and long stand apart from the loop over nodes, which is left for them and gone
// on with afterwards: where invocations run in lockstep, each round of a loop costs what is longest
// in it, and on software adapters all that is in it.

// Widens the far side of every box, so that no rounding lets a ray slip between two of them: the
// twin's factor, and what WGSL's division may be off by on top.
const WIDEN: f32 = 1.0000031;

// Components of directions are taken as at least this long. A ray in the plane of a box's side would
// otherwise have 0 times infinity there; the boxes are a little wider than what they hold, so that
// such a ray is well inside.
const SHORTEST: f32 = 1e-18;

// Nodes that wait on a traversal's stack; the builder sees to it that there are no more.
const MAX_WAITING: u32 = 64u;

fn inverse_direction(direction: vec3<f32>) -> vec3<f32> {
    let size = max(abs(direction), vec3(SHORTEST));
    return select(1.0 / size, -1.0 / size, direction < vec3(0.0));
}

// Of equal hits the lowest number wins.
fn closer_hit(found: Hit, closest: Hit) -> Hit {
    let is_closer = found.t > 0.0
        && (found.t < closest.t || (found.t == closest.t && found.primitive < closest.primitive));
    if is_closer {
        return found;
    }
    return closest;
}

// Spheres, and triangles in which all edge functions vanish, are for `test_apart`: their `t` is
// `DOUBTFUL`.
fn test_leaf(ray: ShearedRay, primitive: u32) -> Hit {
    if (primitive & SPHERE_BIT) != 0u {
        return Hit(DOUBTFUL, 0.0, 0.0, primitive);
    }
    let triangle = triangles[primitive];
    let found = intersect_triangle(
        ray,
        vertices[triangle.a].position,
        vertices[triangle.b].position,
        vertices[triangle.c].position,
    );
    return Hit(found.x, found.y, found.z, primitive);
}

fn test_apart(ray: Ray, sheared_by: ShearedRay, primitive: u32) -> Hit {
    if (primitive & SPHERE_BIT) != 0u {
        let body = primitive ^ SPHERE_BIT;
        let t = intersect_sphere(ray, bodies[body].center, bodies[body].radius);
        return Hit(t, 0.0, 0.0, primitive);
    }
    let triangle = triangles[primitive];
    let found = intersect_triangle_exactly(
        sheared_by,
        vertices[triangle.a].position,
        vertices[triangle.b].position,
        vertices[triangle.c].position,
    );
    return Hit(found.x, found.y, found.z, primitive);
}
