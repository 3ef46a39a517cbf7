//! `path-tracer compare`: how far a picture is from another.

use std::path::PathBuf;

use path_tracer::output::{
    difference::{Difference, EPSILON, TILE},
    flip, read_picture,
};

use super::{Failure, value, voice::Voice, voice::VoiceArguments};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The picture in question: .exr, .hdr, .png, .pfm or .npy.
    picture: PathBuf,
    /// What it should be.
    reference: PathBuf,
    /// Fail (exit code 1) when the relMSE is larger, or a value of either picture is not finite.
    #[arg(long, value_name = "LIMIT", allow_negative_numbers = true, value_parser = value::not_negative)]
    max_relmse: Option<f32>,
    /// Compute FLIP too, the difference that is seen, of the colours as a display clips them; seconds per million pixels.
    #[arg(long)]
    flip: bool,
    #[command(flatten)]
    voice: VoiceArguments,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut voice = Voice::of(arguments.voice);
    let (picture, notes) = read_picture(&arguments.picture)?;
    voice.notes(&notes);
    let (reference, notes) = read_picture(&arguments.reference)?;
    voice.notes(&notes);
    let sizes = |wrong: String| Failure::Runtime(format!("{}: {wrong}", arguments.picture.display()));
    let difference = Difference::between(&picture, &reference).map_err(sizes)?;

    let Difference { mse, relative_mse, mean, relative_mean, ref worst, .. } = difference;
    voice.say(format_args!("size:            {}x{}", picture.width, picture.height));
    voice.say(format_args!("MSE:             {mse:.6e}"));
    voice.say(format_args!("relMSE:          {relative_mse:.6e}  (squared difference over squared reference + {EPSILON})"));
    voice.say(format_args!("mean difference: {mean:+.6e}  ({:+.4} % of the reference)", relative_mean * 100.0));
    if let Some(worst) = worst {
        voice.say(format_args!(
            "worst tile:      relMSE {:.6e} in the {TILE}x{TILE} pixels from {},{}",
            worst.relative_mse, worst.x, worst.y
        ));
    }
    let flip = arguments.flip.then(|| flip::mean(&picture, &reference).map_err(sizes)).transpose()?;
    if let Some(flip) = flip {
        voice.say(format_args!("FLIP:            {flip:.6}  (at {:.1} pixels per degree)", flip::PIXELS_PER_DEGREE));
    }
    let [picture_odd, reference_odd] = difference.not_finite;
    voice.say(format_args!("not finite:      {picture_odd} values of the picture, {reference_odd} of the reference; they are left out"));
    let failure = arguments.max_relmse.and_then(|limit| excess(&difference, limit));
    voice.conclude(serde_json::json!({
        "picture": arguments.picture.display().to_string(),
        "reference": arguments.reference.display().to_string(),
        "width": picture.width,
        "height": picture.height,
        "mse": mse,
        "relmse": relative_mse,
        "relmse_epsilon": EPSILON,
        "mean_difference": mean,
        "relative_mean_difference": relative_mean,
        "worst_tile": worst.map(|tile| serde_json::json!({ "x": tile.x, "y": tile.y, "side": TILE, "relmse": tile.relative_mse })),
        "not_finite": { "picture": picture_odd, "reference": reference_odd },
        "flip": flip,
        "max_relmse": arguments.max_relmse,
        "passed": failure.is_none(),
    }));
    failure.map_or(Ok(()), |what| Err(Failure::Runtime(format!("{}: {what}", arguments.picture.display()))))
}

/// Why a check fails.
fn excess(difference: &Difference, limit: f32) -> Option<String> {
    let odd: u64 = difference.not_finite.iter().sum();
    if odd > 0 {
        return Some(format!("{odd} values are not finite"));
    }
    let relative = difference.relative_mse;
    (relative > f64::from(limit)).then(|| format!("relMSE {relative:.6e} is more than --max-relmse {limit}"))
}
