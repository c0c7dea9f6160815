// The closest hit of a ray. Twins: `Intersect::closest_hit` of `SceneIntersector` and `TriangleBvh`,
// which give the same hits.

fn closest_hit(ray: Ray) -> Hit {
    let sheared_by = sheared_ray(ray);
    let inverse = inverse_direction(ray.direction);
    var left: Traversal;
    left.current = trace.root;
    left.closest = Hit(FAR, 0.0, 0.0, NO_PRIMITIVE);
    while left.current != NO_PRIMITIVE {
        // Until it is over, or a leaf wants a test that is rare.
        let apart = traverse(ray, sheared_by, inverse, &left);
        if apart != NO_PRIMITIVE {
            left.closest = closer_hit(test_apart(ray, sheared_by, apart), left.closest);
        }
    }
    return left.closest;
}
