//! Programs about where the state lies and in which form: shared planes, storage formats.

use wavepool::{Program, ProgramBuilder, layout::Storage};

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

/// A flight whose state is packed in every format; fields are written whole, in part, on some ways only, and by the roulette.
const PACKED: &str = "
import wavepool::math::random::{pcg4d, unit_f32};
struct Probe { at: vec2f, load: f32 }
struct Packed {
    key: vec2u, step: u32, position: vec3f, direction: vec3f, normal: vec3f, beta: vec3f, light: vec3f, uv: vec2f, probes: array<Probe, 2>,
    scrap: vec2f
}
struct Answer { position: vec3f, light: vec3f, other: f32 }
fn draw(p: ptr<function, Packed>) -> vec4f {
    let words = pcg4d(vec4u((*p).key, (*p).step, 3u));
    (*p).step += 1u;
    return vec4f(unit_f32(words.x), unit_f32(words.y), unit_f32(words.z), unit_f32(words.w));
}
fn generate(p: ptr<function, Packed>, item: Item) {
    (*p).key = vec2u(item.pixel, item.sample);
    (*p).beta = vec3f(1.0, 0.7, 0.2);
    (*p).direction = normalize(vec3f(f32(item.pixel % 7u) - 3.0, 0.3, f32(item.sample) - 0.5));
}
fn fly(p: ptr<function, Packed>) -> u32 {
    (*p).position += (*p).direction * (*p).beta.y;
    if ((*p).position.z > 3.0) {
        (*p).uv.y = (*p).position.x;
        return FINISH;
    }
    (*p).normal = normalize(vec3f((*p).position.xy * 0.3, 1.1));
    return CONTINUE;
}
fn meet(p: ptr<function, Packed>) {
    let u = draw(p);
    if (u.x > 0.5) { (*p).uv.x = u.y * 3.7; }
    // Written now and then, and read by nobody.
    if (u.y > 0.9) { (*p).scrap = u.xy; }
    (*p).probes[(*p).step % 2u].at = (*p).uv.yx * 1.1 + u.zw;
    (*p).probes[0].load += (*p).probes[1].at.x;
    (*p).light += (*p).beta * u.z;
    // Beyond what the format holds, now and then.
    if (u.w > 0.99) { (*p).light.x = 1e6; }
    if (u.w < 0.01) { (*p).uv = vec2f(-1e5, 0.5); }
}
fn turn(p: ptr<function, Packed>) -> u32 {
    let u = draw(p);
    (*p).direction = reflect((*p).direction, (*p).normal);
    if (u.x < 0.3) { (*p).direction = normalize((*p).direction + (u.yzw - 0.5)); }
    (*p).beta *= vec3f(0.97, 0.9, 0.8);
    // Half of a cell for certain, the other half never.
    (*p).uv.y = u.y + u.z;
    if ((*p).step > 6u + ((*p).key.x / 256u * 11u) % 40u) { return FINISH; }
    return CONTINUE;
}
fn survival(p: ptr<function, Packed>) -> f32 { return clamp((*p).beta.x * 1.05, 0.1, 1.0); }
fn reweight(p: ptr<function, Packed>, inverse_p: f32) { (*p).beta *= inverse_p; }
fn finish(p: ptr<function, Packed>) -> Answer {
    return Answer((*p).position, (*p).light, (*p).uv.x + (*p).uv.y + (*p).probes[0].load + (*p).probes[0].at.y + (*p).direction.x);
}
";

/// The fields of [`packed`] with their formats.
pub const FORMATS: [(&str, Storage); 7] = [
    ("direction", Storage::UnitVector),
    ("normal", Storage::UnitVector),
    ("beta", Storage::Rgb9e5),
    ("light", Storage::Rgb9e5),
    ("uv", Storage::HalfPair),
    ("scrap", Storage::HalfPair),
    ("probes[].at", Storage::HalfPair),
];

/// A program with all formats.
pub fn packed() -> Program {
    let builder = Program::builder("packed").source("packed.wgsl", PACKED).stage("fly").stage("meet").stage("turn");
    let builder = FORMATS.iter().fold(builder, |builder, (field, storage)| builder.storage(field, *storage));
    builder.build().unwrap_or_else(|error| panic!("packed:\n{error}"))
}

/// Decodes words, stores what comes out, and counts the words whose value has changed on the way: six special words per item, then
/// `random` others.
pub fn words_there_and_back(storage: Storage, random: u32) -> Program {
    let (name, shape) = (storage.name(), storage.shape().expect("a packed format"));
    let wgsl = format!(
        "
import wavepool::math::random::pcg4d;
import wavepool::math::{name}::decode_{name};
struct Tried {{ pixel: u32, step: u32, word: u32, wrong: u32, value: {shape} }}
fn generate(t: ptr<function, Tried>, item: Item) {{ (*t).pixel = item.pixel; }}
fn decode(t: ptr<function, Tried>) {{
    let low = (*t).pixel & 0xffffu;
    let special = array<u32, 6>(low, low << 16u, low | (low << 16u), low | 0xffff0000u, (low << 16u) | 1u, low | ((65535u - low) << 16u));
    if ((*t).step < 6u) {{
        (*t).word = special[(*t).step];
    }} else {{
        (*t).word = pcg4d(vec4u((*t).pixel, (*t).step, 11u, 12u)).x;
    }}
    (*t).value = decode_{name}((*t).word);
}}
fn compare(t: ptr<function, Tried>) -> u32 {{
    if (any(bitcast<{bits}>((*t).value) != bitcast<{bits}>(decode_{name}((*t).word)))) {{ (*t).wrong += 1u; }}
    (*t).step += 1u;
    if ((*t).step == 6u + {random}u) {{ return FINISH; }}
    return CONTINUE;
}}
fn finish(t: ptr<function, Tried>) -> vec2u {{ return vec2u((*t).wrong, (*t).step); }}
",
        bits = shape.replace('f', "u")
    );
    let builder = Program::builder("there and back").source("words.wgsl", wgsl).stage("decode").stage("compare");
    builder.storage("value", storage).build().unwrap_or_else(|error| panic!("{name}:\n{error}"))
}

/// Stores random values; the result is each value and what its format has made of it.
pub fn accuracy(storage: Storage) -> Program {
    let (name, shape) = (storage.name(), storage.shape().expect("a packed format"));
    let (value, zeros) = match storage {
        Storage::UnitVector => ("normalize(vec3f(words.xyz) / 2147483648.0 - 1.0)", ""),
        Storage::Rgb9e5 => ("vec3f(words.xyz) / 4294967296.0 * exp2(f32(words.w % 30u) - 14.0)", ""),
        _ => ("(vec2f(words.xy) / 2147483648.0 - 1.0) * exp2(f32(words.w % 36u) - 20.0)", ", 0.0"),
    };
    let wgsl = format!(
        "
import wavepool::math::random::pcg4d;
struct Kept {{ exact: {shape}, value: {shape} }}
struct Both {{ exact: vec3f, value: vec3f }}
fn generate(k: ptr<function, Kept>, item: Item) {{
    let words = pcg4d(vec4u(item.pixel, 1u, 2u, 3u));
    (*k).exact = {value};
    (*k).value = (*k).exact;
}}
fn stop(k: ptr<function, Kept>) -> u32 {{ return FINISH; }}
fn finish(k: ptr<function, Kept>) -> Both {{ return Both(vec3f((*k).exact{zeros}), vec3f((*k).value{zeros})); }}
"
    );
    let builder = Program::builder("accuracy").source("accuracy.wgsl", wgsl).stage("stop").storage("value", storage);
    builder.build().unwrap_or_else(|error| panic!("{name}:\n{error}"))
}
