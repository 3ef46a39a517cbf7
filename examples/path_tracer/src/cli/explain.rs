//! `path-tracer explain`: what a scene calls for, without rendering it.

use path_tracer::{Renderer, scene::Scene};

use super::{Failure, render, say};

pub(crate) fn run(arguments: &render::Arguments) -> Result<(), Failure> {
    let settings = arguments.settings()?;
    let scene: Scene = arguments.load()?;
    let program = Renderer::program(&scene)?;
    let layout = program.layout(settings.schedule.roulette.as_ref().map(|roulette| roulette.scope()));
    say(format_args!("scene:    {}, {} triangles, {} materials", scene.name, scene.triangles.len(), scene.materials.len()));
    say(format_args!("stages:   {}", program.stages().collect::<Vec<_>>().join(", ")));
    say(format_args!("schedule: {}", settings.schedule));
    say("state per lane (r loaded, f loaded by walks that finish, k by walks killed with their block, w stored):");
    say(layout.table());
    Ok(())
}
