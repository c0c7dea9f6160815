// The hierarchy of four children a node, for traverse_wide.wgsl.

@group(0) @binding(1) var<storage, read> wide_nodes: array<WideNode>;
