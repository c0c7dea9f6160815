// The binary hierarchy, for traverse.wgsl.

@group(0) @binding(1) var<storage, read> nodes: array<Node>;
