//! What a picture has beside its colour: named planes of numbers, pixel by pixel.
//!
//! Key decision: a layer carries the channel names that the tools of the field know, so that a writer of files only has to join them:
//! `albedo.R`, `normal.X`, `position.Z`; a channel without a name is called as its layer (`Z`).
//!
//! **Invariant:** every channel has one value per pixel, row 0 at the top.

/// A named group of channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// As in a file: `albedo`, `normal`, `Z`, `position`, `object`, `material`, `variance`, `samples`.
    pub name: String,
    /// In the order of the tools that read them.
    pub channels: Vec<Channel>,
}

/// One number per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// `R`, `X` and so on; empty when the layer has only this one.
    pub name: String,
    /// The numbers.
    pub values: Values,
}

/// The numbers of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Quantities.
    F32(Vec<f32>),
    /// Numbers of things.
    U32(Vec<u32>),
}

impl Layer {
    /// The name of a channel in a file: `albedo.R`, or `Z` alone.
    pub fn full_name(&self, channel: &Channel) -> String {
        if channel.name.is_empty() { self.name.clone() } else { format!("{}.{}", self.name, channel.name) }
    }
}
