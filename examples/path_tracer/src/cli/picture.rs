//! Options that say how a picture is written.

use std::path::PathBuf;

use clap::ValueEnum;
use path_tracer::output::{Bits, Options, ToneMap};

use super::value;

#[derive(Debug, clap::Args)]
pub(crate) struct PictureArguments {
    /// .png, .exr, .pfm or .npy; the scene's name with .png when not given. With --frames, #### is the number of the frame.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Brightness of a PNG in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = value::finite)]
    exposure: f32,
    /// How a PNG shows light above white.
    #[arg(long, value_name = "MAP", default_value = "none")]
    tone_map: ToneMapName,
    /// Bits per channel of a PNG.
    #[arg(long, value_name = "N", default_value = "8")]
    bits: BitsName,
    /// 16-bit floats in an EXR for colour, alpha, albedo and normals; everything else keeps 32 bits.
    #[arg(long)]
    half: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ToneMapName {
    /// Clip.
    None,
    /// AgX without a look, as in Blender 4.
    Agx,
    /// The reference rendering of ACES, in Stephen Hill's fit.
    Aces,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BitsName {
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

impl From<ToneMapName> for ToneMap {
    fn from(name: ToneMapName) -> ToneMap {
        match name {
            ToneMapName::None => ToneMap::None,
            ToneMapName::Agx => ToneMap::Agx,
            ToneMapName::Aces => ToneMap::Aces,
        }
    }
}

impl PictureArguments {
    pub(crate) fn options(&self) -> Options {
        Options {
            bits: match self.bits {
                BitsName::Eight => Bits::Eight,
                BitsName::Sixteen => Bits::Sixteen,
            },
            exposure: self.exposure,
            tone_map: self.tone_map.into(),
            half: self.half,
        }
    }
}
