//! Conditions before every kind of node: what stays, what goes, and that nothing moves.

use super::*;

fn resolved(text: &str, features: &[(&str, bool)]) -> Result<String, Vec<String>> {
    let module = SourceModule { package: "package".into(), path: "a".into(), file: "a.wgsl".into(), text: text.to_owned().into() };
    let features: Vec<(String, bool)> = features.iter().map(|(name, is_on)| ((*name).to_owned(), *is_on)).collect();
    let (found, errors) = resolve(&module, &features);
    assert_eq!(found.len(), text.len(), "{text}");
    for (before, after) in text.bytes().zip(found.bytes()) {
        assert!(after == before || (after == b' ' && before != b'\n' && before != b'\r'), "{text}\n{found}");
    }
    if errors.is_empty() {
        Ok(found)
    } else {
        Err(errors.iter().map(|error| format!("{}:{} {}", error.line, error.column, error.message)).collect())
    }
}

/// Words with one space between them.
fn squeezed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Text, then what stays of it with `a` on and with `a` off.
const FORMS: &[(&str, &str, &str)] = &[
    // Declarations and imports.
    ("@if(a) const A = 1u; const B = 2u;", "const A = 1u; const B = 2u;", "const B = 2u;"),
    (
        "@if(a) fn f(x: array<u32, 2>) -> u32 { if x[0] > 1u { return 1u; } return 0u; } fn g() {}",
        "fn f(x: array<u32, 2>) -> u32 { if x[0] > 1u { return 1u; } return 0u; } fn g() {}",
        "fn g() {}",
    ),
    ("@if(a) struct S { a: u32, b: f32 } @else struct S { c: u32 }", "struct S { a: u32, b: f32 }", "struct S { c: u32 }"),
    ("@if(a) @group(1) @binding(0) var<storage, read> t: array<u32>;", "@group(1) @binding(0) var<storage, read> t: array<u32>;", ""),
    (
        "@if(!a) alias V = vec3f; @if(a) const_assert 1 < 2; @if(a) override o = 3u;",
        "const_assert 1 < 2; override o = 3u;",
        "alias V = vec3f;",
    ),
    (
        "@if(a) import package::m::{x, y}; @else import package::n::x; const C = 1u;",
        "import package::m::{x, y}; const C = 1u;",
        "import package::n::x; const C = 1u;",
    ),
    // Members.
    (
        "struct S { @if(a) x: array<vec2<f32>, 4>, y: u32, @if(!a) @align(16) z: u32 }",
        "struct S { x: array<vec2<f32>, 4>, y: u32, }",
        "struct S { y: u32, @align(16) z: u32 }",
    ),
    (
        "struct S { @if(a) x: array<u32, 1 << 2>, @else x: u32, y: mat2x2<f32>, }",
        "struct S { x: array<u32, 1 << 2>, y: mat2x2<f32>, }",
        "struct S { x: u32, y: mat2x2<f32>, }",
    ),
    // Statements.
    ("fn f() { @if(a) x = 1u; y = 2u; }", "fn f() { x = 1u; y = 2u; }", "fn f() { y = 2u; }"),
    ("fn f() { @if(a) { x(); { y(); } } z(); }", "fn f() { { x(); { y(); } } z(); }", "fn f() { z(); }"),
    (
        "fn f() { @if(a) if x < y { p(); } else if (z) { q(); } else { r(); } s(); }",
        "fn f() { if x < y { p(); } else if (z) { q(); } else { r(); } s(); }",
        "fn f() { s(); }",
    ),
    (
        "fn f() { @if(a) for (var i = 0u; i < 3u; i++) { p(); } @else while x { q(); } }",
        "fn f() { for (var i = 0u; i < 3u; i++) { p(); } }",
        "fn f() { while x { q(); } }",
    ),
    (
        "fn f() { @if(a) loop { p(); continuing { i++; break if i > 3u; } } s(); }",
        "fn f() { loop { p(); continuing { i++; break if i > 3u; } } s(); }",
        "fn f() { s(); }",
    ),
    (
        "fn f() { @if(a) switch x { case 1u: { p(); } default: {} } s(); }",
        "fn f() { switch x { case 1u: { p(); } default: {} } s(); }",
        "fn f() { s(); }",
    ),
    (
        "fn f() { @if(a) (*p).x = 1u; @else *q = 2u; @if(a) _ = g(); @if(a) return; }",
        "fn f() { (*p).x = 1u; _ = g(); return; }",
        "fn f() { *q = 2u; }",
    ),
    ("fn f() { loop { @if(a) continuing { i++; } } }", "fn f() { loop { continuing { i++; } } }", "fn f() { loop { } }"),
    (
        "fn f() { @if(a) p(); @else (*q).x[1] += 2u; @if(a) p(); @else (*q) = 1u; }",
        "fn f() { p(); p(); }",
        "fn f() { (*q).x[1] += 2u; (*q) = 1u; }",
    ),
    // Cases.
    (
        "fn f() { switch x { @if(a) case 1u, 2u { p(); } @else case 1u: { q(); } default { } } }",
        "fn f() { switch x { case 1u, 2u { p(); } default { } } }",
        "fn f() { switch x { case 1u: { q(); } default { } } }",
    ),
    // Chains: the first that holds, one by one.
    ("@if(b) const X = 1; @elif(a) const X = 2; @elif(true) const X = 3; @else const X = 4;", "const X = 2;", "const X = 3;"),
    ("@if(true) const X = 1; @elif(a) const X = 2; @else const X = 3;", "const X = 1;", "const X = 1;"),
    ("@if(b) const X = 1; @elif(!a) const X = 2; @else const X = 3;", "const X = 3;", "const X = 2;"),
    // Nesting: conditions inside what stays and inside what goes.
    (
        "@if(a) fn f() { @if(b) p(); @else q(); r(); } @else fn f() { @if(!b) { @if(a) s(); @else t(); } }",
        "fn f() { q(); r(); }",
        "fn f() { { t(); } }",
    ),
    (
        "fn f() { if x { @if(a) p(); } else { while y { @if(!a) q(); } } }",
        "fn f() { if x { p(); } else { while y { } } }",
        "fn f() { if x { } else { while y { q(); } } }",
    ),
    // Comments hide conditions and survive them; conditions may have spaces and comments inside.
    (
        "// @if(nope)\n/* @else /* @if( */ */ const A = 1; @if /* x */ ( a // y\n ) const B = 2;",
        "// @if(nope) /* @else /* @if( */ */ const A = 1; const B = 2;",
        "// @if(nope) /* @else /* @if( */ */ const A = 1;",
    ),
    ("@ if(a) const Ä = 1; /* ½ */ @else /* Größe */ const ß = 2;", "const Ä = 1; /* ½ */ /* Größe */", "/* ½ */ /* Größe */ const ß = 2;"),
    // `if` and `else` without `@` are none of ours.
    ("fn f() { if a { p(); } else { q(); } }", "fn f() { if a { p(); } else { q(); } }", "fn f() { if a { p(); } else { q(); } }"),
];

/// Kills: a node cut short or taken too far, a chain that keeps two nodes or none, a condition read out of a comment, text that moves.
#[test]
fn every_form_keeps_what_it_should() {
    for (text, on, off) in FORMS {
        for (is_on, expected) in [(true, on), (false, off)] {
            let found = resolved(text, &[("a", is_on), ("b", false)]).unwrap_or_else(|errors| panic!("{text}: {errors:?}"));
            assert_eq!(squeezed(&found), *expected, "a = {is_on}: {text}");
        }
    }
}

/// Kills: a condition that is dropped in silence because of where it stands, or a mistake in a part that is removed and so unseen.
#[test]
fn conditions_that_mean_nothing_are_refused() {
    for (text, message) in [
        ("@else const A = 1;", "`@else` without its `@if`"),
        ("@if(a) const A = 1; const B = 2; @elif(a) const C = 3;", "`@elif` without its `@if`"),
        ("@if(a) const A = 1; @else const A = 2; @else const A = 3;", "`@else` without its `@if`"),
        ("fn f() { @if(a) p(); } @else fn g() {}", "`@else` without its `@if`"),
        ("@if(a) const A = 1; @else(a) const A = 2;", "`@else` takes no condition"),
        ("@if const A = 1;", "malformed condition"),
        ("@if() const A = 1;", "malformed condition"),
        ("@if(a) @if(a) const A = 1;", "a second condition for one node"),
        ("@group(1) @if(a) @binding(0) var<uniform> t: u32;", "a condition behind another attribute"),
        ("@if(a)", "a condition for nothing"),
        ("@if(a) ;", "a condition for nothing"),
        ("fn f() { @if(a) }", "a condition for nothing"),
        ("fn f() { if x {} @if(a) else {} }", "a condition for nothing"),
        ("struct S { a: u32, @if(a) }", "a condition for nothing"),
        ("fn f() { switch x { @if(a) p(); default {} } }", "a condition for nothing"),
        ("fn f(@if(a) x: u32) {}", "a condition where none may stand"),
        ("fn f() { p(@if(a) x); }", "a condition where none may stand"),
        ("fn f() { let x = @if(a) 1u; }", "a condition where none may stand"),
        ("fn f() { if x @if(a) { } }", "a condition where none may stand"),
        ("struct S { x: @if(a) u32, }", "a condition where none may stand"),
        ("@if(a) const A = 1u fn f() {}", "what stands behind the condition is not complete"),
        ("fn f() { @if(a) p() }", "what stands behind the condition is not complete"),
        ("@if(a) fn f();", "what stands behind the condition is not complete"),
        ("@if(!a) fn f() { @if(c) p(); }", "unknown feature `c`"),
    ] {
        let errors = resolved(text, &[("a", true)]).expect_err(text);
        assert!(errors.len() == 1 && errors[0].contains(message), "{text}: {errors:?}");
    }
}

/// A module of random nodes, with conditions at random places.
fn random_module(random: &mut impl FnMut(usize) -> usize) -> String {
    const DECLARATIONS: [&str; 4] =
        ["const Ä = 1u;\r\n", "alias V = vec3<f32>;", "struct S { a: array<u32, 4>,\n @if(a) b: u32 }", "import x::{y,\r\n z};"];
    const STATEMENTS: [&str; 5] =
        ["p(x[1], y);", "x = /* ½ */ y + 1;\n", "if x < y { p(); }\nelse if z { q(); } else {}", "for (;;) { break; }", "let s = 1;"];
    fn statements(random: &mut impl FnMut(usize) -> usize, depth: usize, out: &mut String) {
        for _ in 0..random(4) {
            out.push_str(["", "", "@if(a)\n", "@if(!a || b) ", "@if (a && (b)) // c @if(\n"][random(5)]);
            match random(8) {
                0 if depth < 5 => {
                    out.push_str("{\n");
                    statements(random, depth + 1, out);
                    out.push('}');
                }
                1 => out.push_str("switch x { @if(a) case 1: { p(); }\n default: { @if(b) q(); } }"),
                _ => out.push_str(STATEMENTS[random(STATEMENTS.len())]),
            }
            if random(6) == 0 {
                out.push_str("@if(b) p(); @elif(a)\n { @diagnostic(off, x) { q(); } } @else return;\n");
            }
        }
    }
    let mut text = String::new();
    for _ in 0..1 + random(5) {
        text.push_str(["", "@if(a) ", "@if(b)\r\n@must_use ", "/* @if */"][random(4)]);
        if random(2) == 0 {
            text.push_str(DECLARATIONS[random(DECLARATIONS.len())]);
        } else {
            text.push_str("fn f(x: u32)\n{ ");
            statements(random, 0, &mut text);
            text.push_str("}\n");
        }
    }
    text
}

/// Kills: a length or a line break that depends on what is removed; conditions left behind; a bracket removed without its partner.
#[test]
fn nothing_moves_whatever_is_removed() {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let mut removed = 0;
    for _ in 0..2000 {
        let text = random_module(&mut random);
        for features in [[("a", false), ("b", false)], [("a", true), ("b", true)], [("a", true), ("b", false)]] {
            // Length and line breaks are compared inside.
            let found = resolved(&text, &features).unwrap_or_else(|errors| panic!("{text}: {errors:?}"));
            let (code, _) = without_comments(&found);
            let code = String::from_utf8(code).expect("whole characters");
            assert!(!["@if", "@elif", "@else "].iter().any(|word| code.contains(word)), "{text}\n{found}");
            for (open, close) in [('{', '}'), ('(', ')')] {
                assert_eq!(code.matches(open).count(), code.matches(close).count(), "{text}\n{found}");
            }
            removed += usize::from(found != text);
        }
    }
    assert!(removed > 2000, "{removed}");
}

/// Kills: recursion that follows the nesting of the text down to the end of the stack.
#[test]
fn deep_nesting_is_left_to_naga() {
    let text = format!("fn f() {} @if(a) p(); {}", "{".repeat(100_000), "}".repeat(100_000));
    assert!(resolved(&text, &[("a", false)]).is_ok());
}
