//! How surfaces reflect: GGX ([`ggx`]), the linearly transformed cosines that stand for it ([`ltc`]) and their fit.

pub mod errors;
pub mod fit;
pub mod ggx;
mod lobe;
pub mod ltc;
mod quadrature;

pub use ltc::{Lobe, Table};
pub use quadrature::Grid;
