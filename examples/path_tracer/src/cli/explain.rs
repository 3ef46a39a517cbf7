//! `path-tracer explain`: what a scene calls for, without rendering it.

use std::path::PathBuf;

use path_tracer::{Renderer, output, wavepool::ImageTiles};

use super::{Failure, render, say};

#[derive(Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Arguments {
    #[command(flatten)]
    render: render::Arguments,
    /// Write the WGSL of every part (stages, tick, resolve) and the table of leaves and stages into this folder.
    #[arg(long, value_name = "FOLDER")]
    dump: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.render.settings()?;
    arguments.render.frames.refuse("explain")?;
    if arguments.render.voice.wants_json() {
        return Err(Failure::Usage("--json: explain speaks to people; `path-tracer info SCENE --json` to programs".into()));
    }
    if !settings.schedule.candidates.is_empty() {
        let what = format!("--schedule {}: it chooses among several, of which one can be explained", settings.schedule);
        return Err(Failure::Usage(what));
    }
    let scene = arguments.render.scene.load()?;
    let program = Renderer::program_with(&scene, &settings)?;
    let scope = settings.schedule.roulette.as_ref().map(|roulette| roulette.scope());
    let layout = program.layout_at(scope, settings.schedule.grain());
    if let Some(folder) = &arguments.dump {
        let source = ImageTiles { width: settings.width, height: settings.height };
        let parts = program.wgsl(&source, &settings.schedule)?;
        let mut texts: Vec<(String, String)> = parts.into_iter().map(|(part, text)| (format!("{part}.wgsl"), text)).collect();
        texts.push(("leaves.txt".into(), layout.table()));
        output::text::write_all(folder, &texts)?;
    }
    say(format_args!("scene:    {}, {} triangles, {} materials", scene.name, scene.triangles.len(), scene.materials.len()));
    say(format_args!("stages:   {}", program.stages().collect::<Vec<_>>().join(", ")));
    say(format_args!("schedule: {}", settings.schedule));
    say("state per lane (r loaded, f loaded by walks that finish, k by walks killed with their block, w stored):");
    say(layout.table());
    if let Some(folder) = &arguments.dump {
        say(format_args!("dumped:   stages.wgsl, tick.wgsl, resolve.wgsl and leaves.txt to {}", folder.display()));
    }
    Ok(())
}
