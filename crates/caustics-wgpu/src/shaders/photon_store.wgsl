// Stored photons as they land, with the links that photon_links.wgsl describes.

@group(0) @binding(6) var<storage, read_write> appended: array<FootprintRecord>;

@group(0) @binding(8) var<storage, read_write> links: array<u32>;
