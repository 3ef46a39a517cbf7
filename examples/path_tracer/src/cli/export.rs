//! `path-tracer export`: a scene for another renderer.

use std::path::PathBuf;

use path_tracer::{
    export::mitsuba::{self, Materials},
    output,
};

use super::{Failure, render, say};

#[derive(Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Arguments {
    #[command(flatten)]
    render: render::Arguments,
    /// Write a scene for Mitsuba 3, with meshes and textures in a folder beside it.
    #[arg(long, value_name = "FILE.xml")]
    mitsuba: PathBuf,
    /// `standard`: surfaces by Mitsuba's own plugins, some of them approximated; `model`: by a plugin `wavepool`, which a peer test defines.
    #[arg(long, value_name = "KIND", default_value = "standard", value_parser = ["standard", "model"])]
    materials: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.render.settings()?;
    arguments.render.frames.refuse("export")?;
    output::check_place(&arguments.mitsuba)?;
    let mut scene = arguments.render.scene.load()?;
    scene.reframe(settings.width as f32 / settings.height as f32);
    let Some(camera) = arguments.render.view.camera(&scene)?.or_else(|| scene.cameras.first().cloned()) else {
        return Err(Failure::Runtime(format!("{}: no camera", arguments.render.scene.scene)));
    };
    let materials = if arguments.materials == "model" { Materials::Model } else { Materials::Standard };
    let notes = mitsuba::write(&arguments.mitsuba, &scene, &camera, &settings, materials)?;
    arguments.render.view.notes(&scene).chain(&notes).for_each(|note| eprintln!("note: {note}"));
    say(format_args!("scene:      {}, {} triangles, {} lights", scene.name, scene.triangles.len(), scene.lights.len()));
    say(format_args!("written:    {}", arguments.mitsuba.display()));
    Ok(())
}
