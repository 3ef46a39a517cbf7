//! Small programs whose answers are known.

use wavepool::Program;

use crate::{arrays, border, memory, traps};

/// Every program of this module.
pub fn all() -> Vec<fn() -> Program> {
    vec![
        collatz,
        hops,
        border::program,
        enclosure,
        unequal,
        identity_sum,
        not_finite,
        waiting,
        given,
        watched,
        weightless,
        heavy,
        memory::relay,
        memory::packed,
        arrays::web,
        arrays::packed_web,
        arrays::out_of_range,
        || trap(&traps::TRAPS[0]),
    ]
}

fn build(name: &str, wgsl: String, stages: &[&str]) -> Program {
    let builder = Program::builder(name).source(format!("{name}.wgsl"), wgsl);
    let program = stages.iter().fold(builder, |builder, stage| builder.stage(stage)).build();
    program.unwrap_or_else(|error| panic!("{name}:\n{error}"))
}

/// The example `collatz`, from its own file.
pub fn collatz() -> Program {
    build("collatz", include_str!("../../examples/collatz/src/collatz.wgsl").to_owned(), &["step"])
}

/// Steps that Collatz's rule takes from `n` down to 1.
pub fn collatz_steps(mut n: u64) -> u64 {
    let mut steps = 0;
    while n != 1 {
        n = if n % 2 == 1 { 3 * n + 1 } else { n / 2 };
        steps += 1;
    }
    steps
}

/// A random flight through fog with three stages, roulette, and every kind of leaf; the result has floats and an integer.
pub fn hops() -> Program {
    let wgsl = "
import wavepool::math::random::{pcg4d, unit_f32};
struct Flight {
    position: vec3f, direction: vec3f, weight: f32, sum: vec2f, key: vec2u, dimension: u32, hop: f32, turns: i32, trail: array<f32, 2>
}
struct Tally { light: vec2f, turns: u32 }

fn draw(f: ptr<function, Flight>) -> vec4f {
    let words = pcg4d(vec4u((*f).key, (*f).dimension, 17u));
    (*f).dimension += 1u;
    return vec4f(unit_f32(words.x), unit_f32(words.y), unit_f32(words.z), unit_f32(words.w));
}
fn generate(f: ptr<function, Flight>, item: Item) {
    (*f).key = vec2u(item.pixel, item.sample);
    let at = vec2f(item_coordinates(item));
    (*f).position = vec3f(at * 0.013, 1.0 / 3.0);
    (*f).direction = vec3f(0.36, 0.48, 0.8);
    (*f).weight = 1.0;
}
fn fly(f: ptr<function, Flight>) {
    (*f).hop = -log(1.0 - draw(f).x) * 0.3;
    (*f).position = (*f).position + (*f).direction * (*f).hop;
    (*f).trail[(*f).dimension % 2u] = (*f).hop;
}
fn queue_key(f: ptr<function, Flight>) -> u32 { return u32(clamp((*f).position.z, 0.0, 2.0) * 97.0); }
fn absorb(f: ptr<function, Flight>) -> u32 {
    let depth = (*f).position.z;
    if (depth < 0.0 || depth > 1.5) {
        (*f).sum.y += (*f).weight;
        return FINISH;
    }
    if ((*f).turns > 200) { return FINISH; }
    (*f).sum.x += (*f).weight * (0.1 + 0.05 * sin(depth * 7.0)) + 1e-3 * ((*f).trail[0] - (*f).trail[1]);
    (*f).weight *= 0.9;
    return CONTINUE;
}
fn turn(f: ptr<function, Flight>) {
    let u = draw(f);
    let z = 1.0 - 2.0 * u.x;
    let r = sqrt(max(0.0, 1.0 - z * z));
    let angle = 6.2831855 * u.y - 3.1415927;
    (*f).direction = vec3f(r * cos(angle), r * sin(angle), z);
    (*f).turns++;
}
fn survival(f: ptr<function, Flight>) -> f32 { return clamp((*f).weight * 1.1, 0.05, 1.0); }
fn reweight(f: ptr<function, Flight>, inverse_p: f32) { (*f).weight *= inverse_p; }
fn finish(f: ptr<function, Flight>) -> Tally { return Tally((*f).sum, u32((*f).turns)); }
";
    build("hops", wgsl.to_owned(), &["fly", "absorb", "turn"])
}

/// [`enclosure_with`] a reflectance of 0.8 and a survival of 0.9.
pub fn enclosure() -> Program {
    enclosure_with(0.8, 0.9)
}

/// A walk in an enclosure that emits 1 and reflects `rho`: every path sums to 1 / (1 - rho) in the mean, with survival `p`. The result is
/// the sum and its square.
pub fn enclosure_with(rho: f32, p: f32) -> Program {
    let wgsl = "
struct Walk { beta: f32, radiance: f32 }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).beta = 1.0; (*w).radiance = 1.0; }
fn bounce(w: ptr<function, Walk>) -> u32 {
    (*w).beta *= RHO;
    if ((*w).beta < 1e-30) { return FINISH; }
    return CONTINUE;
}
fn survival(w: ptr<function, Walk>) -> f32 { return P; }
fn reweight(w: ptr<function, Walk>, inverse_p: f32) { (*w).beta *= inverse_p; (*w).radiance += (*w).beta; }
fn finish(w: ptr<function, Walk>) -> vec2f { return vec2f((*w).radiance, (*w).radiance * (*w).radiance); }
";
    build("enclosure", format!("const RHO = {rho:?};\nconst P = {p:?};\n{wgsl}"), &["bounce"])
}

/// Walls that reflect between 0.4 and 0.9, drawn anew for each bounce of each walk: every path sums to 1 / (1 - 0.65) in the mean, and a
/// lane's chance of survival is what it still carries, 1 at most. The result is the sum, and the most that a survivor ever carried.
pub fn unequal() -> Program {
    let wgsl = "
import wavepool::math::random::{pcg4d, unit_f32};
struct Walk { key: vec2u, bounces: u32, beta: f32, radiance: f32, heaviest: f32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).key = vec2u(item.pixel, item.sample);
    (*w).beta = 1.0;
}
fn bounce(w: ptr<function, Walk>) -> u32 {
    (*w).heaviest = max((*w).heaviest, (*w).beta);
    (*w).radiance += (*w).beta;
    (*w).beta *= 0.4 + 0.5 * unit_f32(pcg4d(vec4u((*w).key, (*w).bounces, 23u)).x);
    (*w).bounces += 1u;
    if ((*w).bounces == 1000u) { return FINISH; }
    return CONTINUE;
}
fn survival(w: ptr<function, Walk>) -> f32 { return min((*w).beta, 1.0); }
fn reweight(w: ptr<function, Walk>, inverse_p: f32) { (*w).beta *= inverse_p; }
fn finish(w: ptr<function, Walk>) -> vec2f { return vec2f((*w).radiance, (*w).heaviest); }
";
    build("unequal", wgsl.to_owned(), &["bounce"])
}

/// A walk that does nothing for [`waiting_steps`] steps; the result is their number. Its length differs between pixels and between
/// samples of a pixel.
pub fn waiting() -> Program {
    let wgsl = "
struct Walk { left: u32, steps: u32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    var h = (item.pixel * 0x9e3779b1u) ^ ((item.sample + 1u) * 0x85ebca6bu);
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h ^= h >> 12u;
    (*w).left = h % 5u + select(0u, (h >> 8u) % 90u, h % 199u == 0u);
}
fn wait(w: ptr<function, Walk>) -> u32 {
    (*w).steps += 1u;
    if ((*w).left == 0u) { return FINISH; }
    (*w).left -= 1u;
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).steps; }
";
    build("waiting", wgsl.to_owned(), &["wait"])
}

/// Steps of a walk of [`waiting`].
pub fn waiting_steps(pixel: u32, sample: u32) -> u32 {
    let mut h = pixel.wrapping_mul(0x9e37_79b1) ^ (sample + 1).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 12;
    1 + h % 5 + if h.is_multiple_of(199) { (h >> 8) % 90 } else { 0 }
}

/// A walk of as many steps as the buffer `lengths` says: the number of pixels, then a word per sample and pixel. The result is their
/// number.
pub fn given() -> Program {
    let wgsl = "
struct Walk { left: u32, steps: u32 }
@group(1) @binding(0) var<storage, read> lengths: array<u32>;
fn generate(w: ptr<function, Walk>, item: Item) { (*w).left = lengths[1u + item.sample * lengths[0] + item.pixel]; }
fn walk(w: ptr<function, Walk>) -> u32 {
    (*w).steps += 1u;
    (*w).left -= 1u;
    if ((*w).left == 0u) { return FINISH; }
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).steps; }
";
    build("given", wgsl.to_owned(), &["walk"])
}

/// Collatz's rule, watched: counters of odd and of all steps, one that nobody calls, and two assertions of which one fails where a walk
/// begins at a multiple of 3.
pub fn watched() -> Program {
    let wgsl = "
struct Walk { n: u32, steps: u32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).n = item.pixel + 1u;
    assert_begins_apart((item.pixel + 1u) % 3u != 0u);
}
fn step(w: ptr<function, Walk>) -> u32 {
    count_steps(1u);
    assert_positive((*w).n > 0u);
    if ((*w).n == 1u) { return FINISH; }
    if ((*w).n % 2u == 1u) { count_odd(2u); }
    (*w).n = select((*w).n / 2u, 3u * (*w).n + 1u, (*w).n % 2u == 1u);
    (*w).steps += 1u;
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).steps; }
";
    let builder = Program::builder("watched").source("watched.wgsl", wgsl).stage("step");
    let builder = builder.counter("steps").counter("odd").counter("uncalled");
    let program = builder.assertion("begins_apart").assertion("positive").assertion("idle").build();
    program.unwrap_or_else(|error| panic!("watched:\n{error}"))
}

/// A state of which no leaf outlives a kernel: one step, in which the only leaf is written before it is read.
pub fn weightless() -> Program {
    let wgsl = "
struct Walk { scratch: u32 }
fn generate(w: ptr<function, Walk>, item: Item) { }
fn stop(w: ptr<function, Walk>) -> u32 { (*w).scratch = 41u; (*w).scratch += 1u; return FINISH; }
fn finish(w: ptr<function, Walk>) -> u32 { return 7u; }
";
    build("weightless", wgsl.to_owned(), &["stop"])
}

/// A state of 1 KiB per lane, every word of it used: 64 rows are filled one per step and summed at the end.
pub fn heavy() -> Program {
    let wgsl = "
struct Walk { rows: array<vec4f, 64>, row: u32 }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).row = item.pixel % 8u; }
fn fill(w: ptr<function, Walk>) -> u32 {
    let row = (*w).row;
    (*w).rows[row % 64u] = vec4f(f32(row), 1.0, 2.0, 3.0);
    (*w).row += 8u;
    if ((*w).row >= 64u) { return FINISH; }
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> vec4f {
    var sum = vec4f();
    for (var row = 0u; row < 64u; row++) { sum += (*w).rows[row]; }
    return sum;
}
";
    build("heavy", wgsl.to_owned(), &["fill"])
}

/// One step; the results are 0.1, a number near 2^32, the pixel and the sample.
pub fn identity_sum() -> Program {
    let wgsl = "
struct Walk { pixel: u32, sample: u32 }
struct Sums { tenth: f32, large: u32, pixel: u32, sample: u32 }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).pixel = item.pixel; (*w).sample = item.sample; }
fn stop(w: ptr<function, Walk>) -> u32 { return FINISH; }
fn finish(w: ptr<function, Walk>) -> Sums { return Sums(0.1, 0xfffffff0u, (*w).pixel, (*w).sample); }
";
    build("identity_sum", wgsl.to_owned(), &["stop"])
}

/// Every seventh pixel divides zero by zero in its odd samples, and every eleventh overflows.
pub fn not_finite() -> Program {
    let wgsl = "
struct Walk { word: u32, weight: f32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).weight = 1.5;
    if (item.pixel % 7u == 0u && item.sample % 2u == 1u) { (*w).word = 0x7fc00001u; }
    if (item.pixel % 11u == 0u) { (*w).word = 0xff800000u; }
}
fn stop(w: ptr<function, Walk>) -> u32 { return FINISH; }
fn finish(w: ptr<function, Walk>) -> vec2f { return vec2f(bitcast<f32>((*w).word), (*w).weight); }
";
    build("not_finite", wgsl.to_owned(), &["stop"])
}

/// Runs a trap three times per walk on a state without special values; the result is a hash over all leaves.
pub fn trap(trap: &traps::Trap) -> Program {
    let floats = ".a .b .c .v.x .v.y .v.z .m[0].x .m[0].y .m[1].x .m[1].y .list[0] .list[1] .list[2] .list[3] .inner.x .inner.y.x \
                  .inner.y.y .pair[0].x .pair[0].y.x .pair[0].y.y .pair[1].x .pair[1].y.x .pair[1].y.y";
    let mut fill = String::new();
    let mut fold = String::new();
    for (index, leaf) in floats.split_whitespace().enumerate() {
        fill.push_str(&format!("    (*p){leaf} = f32((item.pixel * 7u + item.sample + {index}u) % 8u) * 0.125;\n"));
        fold.push_str(&format!("    h = (h ^ bitcast<u32>((*p){leaf})) * 0x01000193u;\n"));
    }
    let wgsl = format!(
        "{}{}
fn generate(p: ptr<function, State>, item: Item) {{
{fill}    (*p).n = item.pixel % 4u;
    (*p).k = i32((item.pixel / 4u) % 4u);
    (*p).rounds = item.sample % 3u;
}}
fn end(p: ptr<function, State>) -> u32 {{
    (*p).n %= 4u;
    if ((*p).rounds == 0u) {{ return FINISH; }}
    (*p).rounds -= 1u;
    return CONTINUE;
}}
fn finish(p: ptr<function, State>) -> u32 {{
    var h = 0x811c9dc5u ^ (*p).n ^ u32((*p).k);
{fold}    return h;
}}",
        traps::STATE.replace("n: u32,", "n: u32, rounds: u32,"),
        trap.wgsl
    );
    build(&format!("trap: {}", trap.name), wgsl, &["probe", "end"])
}
