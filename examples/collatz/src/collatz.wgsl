// Counts the steps that Collatz's rule takes from each item's number down to 1.

struct Walk { number: u32, steps: u32 }

fn generate(walk: ptr<function, Walk>, item: Item) {
    (*walk).number = item.pixel + 1u;
}

fn step(walk: ptr<function, Walk>) -> u32 {
    let n = (*walk).number;
    if (n == 1u) { return FINISH; }
    (*walk).number = select(n / 2u, 3u * n + 1u, n % 2u == 1u);
    (*walk).steps += 1u;
    return CONTINUE;
}

fn finish(walk: ptr<function, Walk>) -> u32 { return (*walk).steps; }
