//! Pure mathematics of the shading pass: f32, no I/O, no allocation, no wgpu. Each file has a WGSL twin of the
//! same stem under `shaders/`.
//!
//! Cosine space is the space after the inverse LTC matrix, where the lobe is a clamped cosine about +z. A point
//! (x, y) of a light's plane goes there by the affine map p = c0·x + c1·y + c2 (Heitz et al. 2016, §3). All
//! integrals are normalised: a full hemisphere gives 1.

pub mod body;
pub mod cluster;
pub mod cluster_list;
pub mod cluster_walk;
pub mod cubic;
pub mod curve;
pub mod edge;
pub mod expansion;
pub mod frame;
pub mod horizon;
pub mod lanes;
pub mod local;
pub mod map;
pub mod mosaic;
pub mod packet;
pub mod pal;
pub mod picture;
pub mod polygon;
pub mod quad;
pub mod receiver;
pub mod reflect;
pub mod representative;
pub mod roots;
pub mod subdivide;
pub mod surface;
pub mod tile;
pub mod tree;
pub mod wide;
