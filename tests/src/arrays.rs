//! Programs that keep arrays in their state and reach them through accessors.

use wavepool::{Program, ProgramBuilder, layout::Storage};

/// A walk that stores where it has been, then connects every pair of its vertices, one vertex per step. Some places are read before they
/// are written, and some do not exist.
pub const WEB: &str = "
import wavepool::math::random::{pcg4d, unit_f32};
const MOST = 6u;
struct Vertex { position: vec3f, direction: vec3f, weight: f32, mark: u32 }
struct Walk {
    key: vec2u,
    step: u32,
    count: u32,
    position: vec3f,
    direction: vec3f,
    @align(16) vertices: array<Vertex, MOST>,
    joined: u32,
    links: array<f32, 5>,
    sum: f32,
}
struct Web { sum: f32, links: f32, unwritten: u32, count: u32 }
fn draw(w: ptr<function, Walk>) -> vec4f {
    let words = pcg4d(vec4u((*w).key, (*w).step, 21u));
    (*w).step += 1u;
    return vec4f(unit_f32(words.x), unit_f32(words.y), unit_f32(words.z), unit_f32(words.w));
}
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).key = vec2u(item.pixel, item.sample);
    (*w).direction = normalize(vec3f(f32(item.pixel % 5u) - 2.2, 0.4, f32(item.sample % 3u) - 1.0));
    store_links(w, item.pixel % 5u, 0.25);
}
fn wander(w: ptr<function, Walk>) {
    if ((*w).joined > 0u || (*w).count == MOST) { return; }
    let u = draw(w);
    (*w).position += (*w).direction * (0.1 + u.x);
    (*w).direction = normalize((*w).direction + u.yzw - 0.5);
    // Nothing has been stored here yet: zeros.
    let before = load_vertices(w, (*w).count);
    let weight = before.weight + 0.1 * u.x * 10.0;
    store_vertices(w, (*w).count, Vertex((*w).position, (*w).direction, weight, 1u + before.mark));
    (*w).count += 1u;
}
fn connect(w: ptr<function, Walk>) -> u32 {
    let u = draw(w);
    // Tiles of an image of 40 columns differ in how long their walks may be.
    let most = 1u + ((*w).key.x / 640u * 2u + (*w).key.x % 40u / 16u + (*w).key.y) % MOST;
    if ((*w).joined == 0u && (*w).count < most && u.x > 0.25) { return CONTINUE; }
    // The number joined so far connects to all others.
    let mine = load_vertices(w, (*w).joined);
    for (var other = 0u; other < (*w).count; other++) {
        let theirs = load_vertices(w, other);
        let between = theirs.position - mine.position;
        (*w).sum += mine.weight * theirs.weight * dot(mine.direction, theirs.direction) / (1.0 + dot(between, between));
        let place = (other + (*w).joined) % 5u;
        store_links(w, place, load_links(w, place) * 0.9 + between.x);
    }
    (*w).joined += 1u;
    if ((*w).joined >= (*w).count) { return FINISH; }
    return CONTINUE;
}
fn survival(w: ptr<function, Walk>) -> f32 { return select(0.97, 0.9, load_vertices(w, 0u).weight > 0.5); }
fn reweight(w: ptr<function, Walk>, inverse_p: f32) {
    var first = load_vertices(w, 0u);
    first.weight *= inverse_p;
    store_vertices(w, 0u, first);
}
fn finish(w: ptr<function, Walk>) -> Web {
    var marks = 0u;
    for (var i = 0u; i < MOST; i++) { marks += load_vertices(w, i).mark; }
    var links = 0.0;
    for (var i = 0u; i < 5u; i++) { links += load_links(w, i); }
    return Web((*w).sum, links, marks - (*w).count, (*w).count);
}
";

/// [`WEB`], built in another way.
pub fn web_with(name: &str, wgsl: &str, change: impl Fn(ProgramBuilder) -> ProgramBuilder) -> Program {
    let builder = Program::builder(name).source("web.wgsl", wgsl.to_owned()).stage("wander").stage("connect");
    change(builder.array("vertices").array("links")).build().unwrap_or_else(|error| panic!("{name}:\n{error}"))
}

/// Arrays of structs and of numbers.
pub fn web() -> Program {
    web_with("web", WEB, |builder| builder)
}

/// The same with packed elements.
pub fn packed_web() -> Program {
    let formats =
        [("direction", Storage::UnitVector), ("vertices[].direction", Storage::UnitVector), ("vertices[].position", Storage::Rgb9e5)];
    web_with("packed web", WEB, |builder| formats.iter().fold(builder, |builder, (field, storage)| builder.storage(field, *storage)))
}

/// Every walk loads and stores far beyond the end of an array, twice each.
pub fn out_of_range() -> Program {
    let wgsl = "
struct Walk { pixel: u32, list: array<vec2u, 3> }
fn generate(w: ptr<function, Walk>, item: Item) { (*w).pixel = item.pixel; store_list(w, 3u, vec2u(7u)); }
fn stop(w: ptr<function, Walk>) -> u32 {
    store_list(w, 0xffffffffu, vec2u(9u));
    store_list(w, 2u, vec2u((*w).pixel, 1u));
    return FINISH;
}
fn finish(w: ptr<function, Walk>) -> vec3u {
    return vec3u(load_list(w, 2u).x, load_list(w, 3u).x + load_list(w, 4096u).y, load_list(w, 0u).x + load_list(w, 1u).y);
}
";
    let builder = Program::builder("out of range").source("range.wgsl", wgsl).stage("stop").array("list");
    builder.build().unwrap_or_else(|error| panic!("out of range:\n{error}"))
}
