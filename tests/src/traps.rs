//! Functions that are easy to analyse wrongly, each with what it truly reads and writes.
//!
//! Key decision: the same list is read by the inference test, which compares the sets, and by the conformance test, which runs every
//! trap with the leaves that it does not read poisoned. A set written down here wrongly fails one of the two.

/// One stage named `probe`, written against [`STATE`], and its sets as leaf names; `*` stands for all leaves, `v` for all of `v`.
#[derive(Clone, Copy, Debug)]
pub struct Trap {
    /// What it is about.
    pub name: &'static str,
    /// WGSL that declares `probe` and what it needs.
    pub wgsl: &'static str,
    /// Read while perhaps not yet written.
    pub reads: &'static str,
    /// Certainly written, and perhaps written, at exits that continue, as `must / may`; `-` when there is no such exit.
    pub continues: &'static str,
    /// The same at exits that finish.
    pub finishes: &'static str,
}

/// The state that all traps share.
pub const STATE: &str = "
struct Inner { x: f32, y: vec2f }
struct State { a: f32, b: f32, c: f32, n: u32, k: i32, v: vec3f, m: mat2x2f, list: array<f32, 4>, inner: Inner, pair: array<Inner, 2> }
";

const fn plain(name: &'static str, reads: &'static str, continues: &'static str, wgsl: &'static str) -> Trap {
    Trap { name, wgsl, reads, continues, finishes: "-" }
}

/// All of them. Indices stay in bounds for `n` and `k` from 0 to 3, and every loop ends.
pub const TRAPS: &[Trap] = &[
    plain("early return", "n", "/ a", "fn probe(p: ptr<function, State>) { if ((*p).n == 0u) { return; } (*p).a = 1.0; }"),
    plain(
        "both branches write",
        "n",
        "a / a",
        "fn probe(p: ptr<function, State>) { if ((*p).n == 0u) { (*p).a = 2.0; } else { (*p).a = 1.0; } }",
    ),
    plain(
        "else branch returns",
        "n",
        "/ a b",
        "fn probe(p: ptr<function, State>) { if ((*p).n > 0u) { (*p).a = 2.0; } else { return; } (*p).b = (*p).a; }",
    ),
    plain(
        "for loop that may not run",
        "a n",
        "b / a b",
        "fn probe(p: ptr<function, State>) { for (var i = 0u; i < (*p).n; i++) { (*p).a = 1.0; } (*p).b = (*p).a; }",
    ),
    plain(
        "while loop that may not run",
        "n",
        "/ a n",
        "fn probe(p: ptr<function, State>) { while ((*p).n > 0u) { (*p).n -= 1u; (*p).a = f32((*p).n); } }",
    ),
    plain(
        "loop writes before its break",
        "n",
        "a / a b n",
        "fn probe(p: ptr<function, State>) { loop { (*p).a = 1.0; if ((*p).n == 0u) { break; } (*p).n -= 1u; (*p).b = 2.0; } }",
    ),
    plain(
        "continue skips a write",
        "n",
        "c n / a c n",
        "fn probe(p: ptr<function, State>) {
            loop {
                if ((*p).n % 2u == 1u) { continue; }
                (*p).a = 1.0;
                continuing { (*p).c = 1.0; (*p).n += 1u; break if (*p).n > 5u; }
            }
        }",
    ),
    plain(
        "read in the first round what the second has written",
        "a n",
        "a b / a b",
        "fn probe(p: ptr<function, State>) { (*p).b = 0.0; for (var i = 0u; i < 9u; i++) { (*p).b += (*p).a; (*p).a = 1.0; if (i >= (*p).n) { return; } } (*p).a = 0.0; }",
    ),
    plain(
        "continue out of a switch",
        "n",
        "/ a b",
        "fn probe(p: ptr<function, State>) {
            for (var i = 0u; i < (*p).n; i++) {
                switch i { case 0u: { continue; } default: { (*p).a = 1.0; } }
                (*p).b = (*p).a;
            }
        }",
    ),
    plain(
        "break of an inner loop",
        "n",
        "a / a b",
        "fn probe(p: ptr<function, State>) {
            loop { loop { if ((*p).n == 0u) { break; } (*p).b = 1.0; break; } (*p).a = 1.0; break; }
        }",
    ),
    plain(
        "switch writes in every case",
        "n",
        "a / a",
        "fn probe(p: ptr<function, State>) {
            switch (*p).n { case 0u: { (*p).a = 1.0; } case 1u, 2u: { (*p).a = 2.0; } default: { (*p).a = 3.0; } }
        }",
    ),
    plain(
        "switch whose default writes nothing",
        "n",
        "/ a b",
        "fn probe(p: ptr<function, State>) { switch (*p).n { case 0u, 1u: { (*p).a = 1.0; (*p).b = (*p).a; } default: {} } }",
    ),
    plain(
        "break inside a case",
        "b n",
        "/ a",
        "fn probe(p: ptr<function, State>) {
            switch (*p).n { case 0u: { if ((*p).b > 0.5) { break; } (*p).a = 1.0; } default: { (*p).a = 3.0; } }
        }",
    ),
    plain(
        "return inside a case",
        "n",
        "/ a b",
        "fn probe(p: ptr<function, State>) { switch (*p).n { case 2u: { return; } default: { (*p).a = 1.0; } } (*p).b = (*p).a; }",
    ),
    plain(
        "call reads and writes",
        "b",
        "a / a",
        "fn inner(q: ptr<function, State>) { (*q).a = (*q).b; }
         fn outer(q: ptr<function, State>) { inner(q); }
         fn probe(p: ptr<function, State>) { outer(p); (*p).a += 1.0; }",
    ),
    plain(
        "call that may write",
        "a n",
        "c / a c",
        "fn maybe(x: f32, q: ptr<function, State>) { if ((*q).n > 1u) { (*q).a = x; } }
         fn probe(p: ptr<function, State>) { maybe(2.0, p); (*p).c = (*p).a; }",
    ),
    plain(
        "call after the write that it reads",
        "",
        "a b / a b",
        "fn look(q: ptr<function, State>) -> f32 { return (*q).b; }
         fn probe(p: ptr<function, State>) { (*p).b = 3.0; (*p).a = look(p); }",
    ),
    plain(
        "one state under two names",
        "a",
        "a b / a b",
        "fn both(q: ptr<function, State>, r: ptr<function, State>) { (*q).b = (*r).a; (*r).a = 2.0; }
         fn probe(p: ptr<function, State>) { both(p, p); }",
    ),
    plain(
        "call in a loop that may not run",
        "a n",
        "c / b c",
        "fn write(q: ptr<function, State>) { (*q).b = (*q).a; }
         fn probe(p: ptr<function, State>) { for (var i = 0u; i < (*p).n; i++) { write(p); } (*p).c = 1.0; }",
    ),
    plain("pointer to a member", "v.y", "v.x / v.x", "fn probe(p: ptr<function, State>) { let q = &(*p).v; (*q).x = (*q).y; }"),
    plain(
        "pointer to a nested member",
        "a",
        "inner / inner",
        "fn probe(p: ptr<function, State>) { let q = &(*p).inner; let r = &(*q).y; *r = vec2f(2.0, 3.0); (*q).x = (*p).a; }",
    ),
    plain(
        "pointer to a member, stored whole",
        "pair[1]",
        "inner / inner",
        "fn probe(p: ptr<function, State>) { let q = &(*p).inner; *q = (*p).pair[1]; }",
    ),
    plain("copy of the whole state", "*", "a / a", "fn probe(p: ptr<function, State>) { let all = *p; (*p).a = all.b + all.v.z; }"),
    plain(
        "whole state assigned",
        "",
        "* / *",
        "fn probe(p: ptr<function, State>) { var fresh: State; fresh.a = 1.0; fresh.n = 2u; *p = fresh; (*p).b = (*p).c + (*p).a; }",
    ),
    plain(
        "whole state assigned on some path",
        "a n",
        "b / *",
        "fn probe(p: ptr<function, State>) { if ((*p).n == 1u) { *p = State(); } (*p).b = (*p).a; }",
    ),
    plain(
        "copy, change, put back",
        "*",
        "* / *",
        "fn probe(p: ptr<function, State>) { var mine = *p; mine.c = mine.a + mine.b; mine.v.y = 4.0; *p = mine; }",
    ),
    plain(
        "vector written component by component",
        "",
        "a v / a v",
        "fn probe(p: ptr<function, State>) { (*p).v.x = 1.0; (*p).v.y = 2.0; (*p).v.z = 3.0; let v = (*p).v; (*p).a = v.x + v.y + v.z; }",
    ),
    plain(
        "one component of a vector written",
        "v.y v.z",
        "a v.x / a v.x",
        "fn probe(p: ptr<function, State>) { (*p).v.x = 1.0; let v = (*p).v; (*p).a = v.x + v.y + v.z; }",
    ),
    plain("array indexed at run time, read", "list n", "a / a", "fn probe(p: ptr<function, State>) { (*p).a = (*p).list[(*p).n]; }"),
    plain(
        "array indexed at run time, written",
        "list[0] n",
        "a / a list",
        "fn probe(p: ptr<function, State>) { (*p).list[(*p).n] = 5.0; (*p).a = (*p).list[0]; }",
    ),
    plain(
        "array element by constant index",
        "list[1]",
        "list[2] / list[2]",
        "const SECOND = 2; fn probe(p: ptr<function, State>) { (*p).list[SECOND] = (*p).list[1]; }",
    ),
    plain(
        "array of structs indexed at run time",
        "n pair[0].y.x",
        "b / b pair",
        "fn probe(p: ptr<function, State>) { (*p).pair[(*p).n % 2u].y.x = 5.0; (*p).b = (*p).pair[0].y.x; }",
    ),
    plain(
        "array of structs, constant index",
        "pair[0].y.y",
        "pair[1].x / pair[1].x",
        "fn probe(p: ptr<function, State>) { (*p).pair[1].x = (*p).pair[0].y.y; }",
    ),
    plain(
        "pointer to an element indexed at run time",
        "k list",
        "/ list",
        "fn probe(p: ptr<function, State>) { let q = &(*p).list[(*p).k]; *q = *q * 2.0; }",
    ),
    plain(
        "vector component indexed at run time",
        "n v",
        "c / c v",
        "fn probe(p: ptr<function, State>) { let i = (*p).n % 3u; (*p).v[i] = 7.0; (*p).c = (*p).v[(i + 1u) % 3u]; }",
    ),
    plain("read-modify-write", "a b", "a / a", "fn probe(p: ptr<function, State>) { (*p).a += (*p).b; }"),
    plain("increment", "n", "n / n", "fn probe(p: ptr<function, State>) { (*p).n++; (*p).n %= 4u; }"),
    plain("read-modify-write on some path", "a b", "/ a", "fn probe(p: ptr<function, State>) { if ((*p).b > 0.5) { (*p).a *= 0.5; } }"),
    plain(
        "second operand of a short-circuit",
        "a b c",
        "/ n",
        "fn probe(p: ptr<function, State>) { if ((*p).a > 0.25 && (*p).b > 0.25 || (*p).c > 0.9) { (*p).n = 1u; } }",
    ),
    plain(
        "write in the second operand",
        "a b n",
        "c / b c",
        "fn sets(q: ptr<function, State>) -> bool { (*q).b = 1.5; return true; }
         fn probe(p: ptr<function, State>) { let both = (*p).n > 1u && sets(p); (*p).c = select((*p).a, (*p).b, both); }",
    ),
    plain(
        "column of a matrix",
        "m[0]",
        "a m[1] / a m[1]",
        "fn probe(p: ptr<function, State>) { (*p).m[1] = vec2f(1.0, 2.0); let m = (*p).m; (*p).a = m[0].x + m[1].y + m[0].y; }",
    ),
    plain(
        "column of a matrix indexed at run time",
        "m[0] n",
        "/ m",
        "fn probe(p: ptr<function, State>) { (*p).m[(*p).n % 2u] = (*p).m[0] + vec2f(1.0); }",
    ),
    plain("component of a matrix", "m[1].x", "m[0].y / m[0].y", "fn probe(p: ptr<function, State>) { (*p).m[0].y = (*p).m[1].x; }"),
    plain(
        "nested struct, written then read whole",
        "inner.x inner.y.y",
        "inner.y.x pair[0] / inner.y.x pair[0]",
        "fn probe(p: ptr<function, State>) { (*p).inner.y.x = 3.0; (*p).pair[0] = (*p).inner; }",
    ),
    plain(
        "code after a return",
        "n",
        "n / n",
        "fn probe(p: ptr<function, State>) { (*p).n = ((*p).n + 1u) % 4u; { return; } (*p).a = (*p).b; }",
    ),
    plain("value thrown away", "b", "/", "fn probe(p: ptr<function, State>) { _ = (*p).b; }"),
    Trap {
        name: "finishes on one way",
        wgsl: "fn probe(p: ptr<function, State>) -> u32 {
            if ((*p).n == 0u) { (*p).a = 1.0; return FINISH; }
            (*p).n -= 1u;
            return CONTINUE;
        }",
        reads: "n",
        continues: "n / n",
        finishes: "a / a",
    },
    Trap {
        name: "finishes on every way",
        wgsl: "fn probe(p: ptr<function, State>) -> u32 { if ((*p).n == 0u) { (*p).a = 1.0; return 1u; } return FINISH; }",
        reads: "n",
        continues: "-",
        finishes: "/ a",
    },
    Trap {
        name: "verdict computed",
        wgsl: "fn probe(p: ptr<function, State>) -> u32 { (*p).c = 1.0; (*p).n += 1u; return select(CONTINUE, FINISH, (*p).n > 3u); }",
        reads: "n",
        continues: "c n / c n",
        finishes: "c n / c n",
    },
    Trap {
        name: "verdict of a helper",
        wgsl: "const DONE = FINISH;
         fn judge(q: ptr<function, State>) -> u32 { if ((*q).n > 2u) { (*q).b = 0.5; return DONE; } (*q).n += 1u; return CONTINUE; }
         fn probe(p: ptr<function, State>) -> u32 { return judge(p); }",
        reads: "n",
        continues: "/ b n",
        finishes: "/ b n",
    },
    Trap {
        name: "verdict in a variable",
        wgsl: "fn probe(p: ptr<function, State>) -> u32 {
            var verdict = CONTINUE;
            switch (*p).n { case 3u: { verdict = FINISH; (*p).a = 9.0; } default: { (*p).n += 1u; } }
            return verdict;
        }",
        reads: "n",
        continues: "/ a n",
        finishes: "/ a n",
    },
    Trap {
        name: "finish inside a loop",
        wgsl: "fn probe(p: ptr<function, State>) -> u32 {
            for (var i = 0u; i < 3u; i++) { if (i > (*p).n) { return FINISH; } (*p).list[i] = 2.0; (*p).b = 1.0; }
            (*p).n = 0u;
            return CONTINUE;
        }",
        reads: "n",
        continues: "n / b list n",
        finishes: "/ b list",
    },
];
