//! Scenes for other renderers, so that pictures can be compared.
//!
//! Key decision: what another renderer cannot express is written as the nearest thing it has, and each such step is a line of the result:
//! a comparison that differs should say why before anybody looks for a bug.

pub mod mitsuba;
mod ply;
mod textures;
