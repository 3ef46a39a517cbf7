//! Programs about where the state lies: shared planes.

use wavepool::{Program, ProgramBuilder};

/// Four stages hand numbers on: each number lives from one stage to the next, and some round the step.
const RELAY: &str = "
import wavepool::math::random::{pcg4d, unit_f32};
struct Runner {
    key: vec2u, leg: u32, total: f32, start: vec3f, lap: vec2f, pace: vec3f, last: f32, turn: vec2u, baton: f32, never: vec4f
}
fn generate(r: ptr<function, Runner>, item: Item) {
    (*r).key = vec2u(item.pixel, item.sample);
    (*r).baton = 0.75;
}
fn set_out(r: ptr<function, Runner>) {
    let words = pcg4d(vec4u((*r).key, (*r).leg, 5u));
    (*r).start = vec3f(unit_f32(words.x), unit_f32(words.y), unit_f32(words.z)) * (*r).baton;
    (*r).turn = words.zw;
}
fn run_on(r: ptr<function, Runner>) {
    (*r).lap = (*r).start.xy * 0.5 + (*r).start.yz * 0.3;
    (*r).last = unit_f32((*r).turn.x) - 0.4;
}
fn hand_over(r: ptr<function, Runner>) -> u32 {
    (*r).pace = vec3f((*r).lap, (*r).last);
    (*r).leg += 1u;
    if ((*r).leg > 30u || (*r).last > 0.5) { return FINISH; }
    return CONTINUE;
}
fn arrive(r: ptr<function, Runner>) {
    (*r).total += dot((*r).pace, vec3f(0.5, 0.25, 1.0));
    (*r).baton = fract((*r).total * 3.0) + 0.25;
}
fn survival(r: ptr<function, Runner>) -> f32 { return clamp((*r).baton, 0.3, 1.0); }
fn reweight(r: ptr<function, Runner>, inverse_p: f32) { (*r).total *= inverse_p; }
fn finish(r: ptr<function, Runner>) -> vec2f { return vec2f((*r).total, f32((*r).leg)); }
";

/// [`relay`], built in another way.
pub fn relay_with(change: impl Fn(ProgramBuilder) -> ProgramBuilder) -> Program {
    let builder = ["set_out", "run_on", "hand_over", "arrive"]
        .iter()
        .fold(Program::builder("relay").source("relay.wgsl", RELAY), |builder, stage| builder.stage(stage));
    change(builder).build().unwrap_or_else(|error| panic!("relay:\n{error}"))
}

/// A program whose leaves mostly live from one stage to the next.
pub fn relay() -> Program {
    relay_with(|builder| builder)
}
