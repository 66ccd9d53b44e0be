//! How surfaces reflect: GGX ([`ggx`]), the linearly transformed cosines that stand for it ([`ltc`]) and their fit.

pub mod errors;
pub mod fit;
pub mod ggx;
pub mod ltc;
mod lobe;
mod quadrature;

pub use ltc::{Lobe, Table};
pub use quadrature::Grid;
