//! Stress: seeded cases that try to break every technique, and what breaks.
//!
//! A [`case::Case`] is one integral of one light at one shading point; its numbers fit a line of `glyphlight probe integral`.
//! A [`meter::Meter`] reads it, the float64 yardstick judges it ([`judge`]), and what fails is made small ([`shrink`]).

pub mod case;
pub mod draw;
pub mod judge;
pub mod meter;
pub mod places;
pub mod run;
pub mod shapes;
pub mod shrink;
