//! Algebra that a compiler would like to simplify once two stages stand in one kernel.
//!
//! Key decision: each pattern is its own leaf of the result, so that a difference names the pattern. A scene that agrees proves little;
//! this program differs when pins are off.

use wavepool::Program;

/// One pattern: what the stages do to `x`, in order. `a`, `b`, `c` are numbers of the item.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// As written in reports.
    pub name: &'static str,
    /// One expression per stage.
    pub stages: [&'static str; 3],
}

const fn two(name: &'static str, first: &'static str, second: &'static str) -> Pattern {
    Pattern { name, stages: [first, second, "x"] }
}

/// All patterns.
pub const PATTERNS: &[Pattern] = &[
    two("x*0.1|*10", "a * 0.1", "x * 10.0"),
    two("x*3|*0.33333334", "a * 3.0", "x * 0.33333334"),
    two("x/3|*3", "a / 3.0", "x * 3.0"),
    two("x*0.7|/0.7", "a * 0.7", "x / 0.7"),
    two("a*b|+a*c", "a * b", "x + a * c"),
    two("a*b|-a*b", "a * b + c", "x - a * b"),
    two("1-x|1-y", "1.0 - a", "1.0 - x"),
    two("sqrt|square", "sqrt(a)", "x * x"),
    two("square|sqrt", "a * a", "sqrt(x)"),
    two("exp2|log2", "exp2(a)", "log2(x)"),
    two("log2|exp2", "log2(a)", "exp2(x)"),
    two("x+1000|-1000", "a + 1000.0", "x - 1000.0"),
    two("x-y|+y", "a - b", "x + b"),
    two("1/x|1/y", "1.0 / a", "1.0 / x"),
    two("1/sqrt|square", "inverseSqrt(a)", "x * x"),
    two("x/y|*y", "a / b", "x * b"),
    two("-x|+y", "-(a * b)", "x + c"),
    two("x*2|*0.3", "a * 0.6000001", "x * 1.7"),
    two("exp|log", "exp(a)", "log(x)"),
    two("pow|pow", "pow(a, 3.0)", "pow(x, 0.33333334)"),
    two("bits|*10", "a * 0.1", "bits * 10.0"),
    // Two pins without a use between them.
    Pattern { name: "x*0.1||*10", stages: ["a * 0.1", "x", "x * 10.0"] },
    Pattern { name: "sqrt||square", stages: ["sqrt(a)", "x", "x * x"] },
    Pattern { name: "x*0.1|+1|-1", stages: ["a * 0.1", "x + 1.0", "x - 1.0"] },
    Pattern { name: "x*0.1|*10|*0.1", stages: ["a * 0.1", "x * 10.0", "x * 0.1"] },
    Pattern { name: "a*b|+c|-c", stages: ["a * b", "x + c", "x - c"] },
];

/// The pattern behind a leaf of the result.
pub fn leaf_name(leaf: usize) -> &'static str {
    let edges = ["generate: x*0.1|*10", "finish: x*0.1|*10", "generate: x*0.1||*10"];
    PATTERNS.get(leaf).map_or(edges[leaf.saturating_sub(PATTERNS.len()).min(2)], |pattern| pattern.name)
}

/// Three stages that do all patterns at once.
pub fn program() -> Program {
    let mut state = String::from("struct Sums {\n");
    let mut bodies = [String::new(), String::new(), String::new()];
    let mut sums = Vec::new();
    for (index, pattern) in PATTERNS.iter().enumerate() {
        state.push_str(&format!("    p{index}: f32,\n"));
        for (body, expression) in bodies.iter_mut().zip(pattern.stages) {
            // A float that crosses the border as an integer: its pattern reads `bits` where others read `x`.
            let x = format!("(*s).x[{index}]");
            let value = expression.replace("bits", "bitcast<f32>((*s).word)");
            let value: String = value
                .split_inclusive(|c: char| !c.is_alphanumeric())
                .map(|part| {
                    let word = part.trim_end_matches(|c: char| !c.is_alphanumeric());
                    if word == "x" { part.replacen('x', &x, 1) } else { part.to_owned() }
                })
                .collect();
            body.push_str(&format!("    {x} = {value};\n"));
            if pattern.name.starts_with("bits") && expression == pattern.stages[0] {
                body.push_str(&format!("    (*s).word = bitcast<u32>({x});\n"));
            }
        }
        sums.push(format!("(*s).x[{index}]"));
    }
    state.push_str("    born: f32,\n    ended: f32,\n    passed: f32,\n}\n");
    sums.extend(["(*s).edge.x".to_owned(), "(*s).edge.y * 10.0".to_owned(), "(*s).edge.z".to_owned()]);
    let [first, second, third] = bodies;
    let lets = "    let a = (*s).a; let b = (*s).b; let c = (*s).c;\n";
    let wgsl = format!(
        "import wavepool::math::random::{{pcg4d, unit_f32}};
struct State {{ a: f32, b: f32, c: f32, word: u32, rounds: u32, edge: vec3f, x: array<f32, {count}> }}
{state}
fn generate(s: ptr<function, State>, item: Item) {{
    let words = pcg4d(vec4u(item.pixel, item.sample, 5u, 7u));
    (*s).a = 0.5 + unit_f32(words.x);
    (*s).b = 0.5 + unit_f32(words.y);
    (*s).c = 0.5 + unit_f32(words.z);
    (*s).edge.x = (*s).a * 0.1;
    (*s).edge.z = (*s).b * 0.1;
}}
fn first(s: ptr<function, State>) {{
{lets}{first}    if ((*s).rounds == 0u) {{ (*s).edge.x = (*s).edge.x * 10.0; }}
}}
fn second(s: ptr<function, State>) {{
{lets}{second}    if ((*s).rounds == 0u) {{ (*s).edge.z = (*s).edge.z * 10.0; }}
}}
fn third(s: ptr<function, State>) -> u32 {{
{lets}{third}    (*s).edge.y = a * 0.1;
    (*s).rounds += 1u;
    if ((*s).rounds == 2u) {{ return FINISH; }}
    return CONTINUE;
}}
fn finish(s: ptr<function, State>) -> Sums {{ return Sums({sums}); }}
",
        count = PATTERNS.len(),
        sums = sums.join(", ")
    );
    let builder = Program::builder("border").source("border.wgsl", wgsl).stage("first").stage("second").stage("third");
    builder.build().unwrap_or_else(|error| panic!("border:\n{error}"))
}
