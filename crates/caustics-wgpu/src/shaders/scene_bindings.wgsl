// Where the tracer finds the scene. Twin: `SceneBuffers` in scene_buffers.rs.

@group(0) @binding(2) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(3) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(4) var<storage, read> bodies: array<Body>;

fn vertex_normal(vertex: u32) -> vec3<f32> {
    return vec3(vertices[vertex].normal_x, vertices[vertex].normal_y, vertices[vertex].normal_z);
}
