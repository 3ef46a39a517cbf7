//! Policies of one's own: an order of tiles and a rule of regeneration, written outside of the library and tested in one line each.

use wavepool::{
    GpuContext, ImageTiles, Program, Schedule, Scheduler,
    policy::{OrderRule, Regeneration, TileFormula, TileGrid, TileOrder},
};

// ANCHOR: order
/// Tiles that follow each other in the queue lie far apart, so that a pass that is half done already shows the whole image.
#[derive(Clone, Copy, Debug)]
struct Scattered;

/// A prime: its multiples visit every tile of up to so many.
const STRIDE: u32 = 65_521;

impl TileOrder for Scattered {
    fn name(&self) -> &str {
        "scattered"
    }

    fn rule(&self) -> OrderRule<'_> {
        OrderRule::Formula(self)
    }
}

impl TileFormula for Scattered {
    fn wgsl(&self) -> String {
        format!(
            "fn wf_tile_at(pass_index: u32, position: u32) -> u32 {{
                if (wf_control.tiles >= {STRIDE}u) {{ return position; }}
                return (position * {STRIDE}u + pass_index) % wf_control.tiles;
            }}"
        )
    }

    fn tile_at(&self, pass_index: u32, position: u32, grid: TileGrid) -> u32 {
        if grid.tiles() >= STRIDE { position } else { (position * STRIDE + pass_index) % grid.tiles() }
    }
}
// ANCHOR_END: order

// ANCHOR: regeneration
/// Dead blocks receive tiles once so many of them wait.
#[derive(Clone, Copy, Debug)]
struct AtLeast {
    blocks: u32,
}

impl Regeneration for AtLeast {
    fn name(&self) -> &str {
        "at-least"
    }

    fn wgsl(&self) -> String {
        format!("fn wf_regenerate(live: u32, dead: u32, step: u32) -> bool {{ return live == 0u || dead >= {}u; }}", self.blocks)
    }

    fn regenerate(&self, live: u32, dead: u32, _step: u32) -> bool {
        live == 0 || dead >= self.blocks
    }
}
// ANCHOR_END: regeneration

/// A walk to and fro that ends where it leaves a strip.
const WALK: &str = "
import wavepool::math::random::{pcg4d};
struct Walk { key: vec2u, steps: u32, place: i32 }
fn generate(w: ptr<function, Walk>, item: Item) {
    (*w).key = vec2u(item.pixel, item.sample);
    (*w).place = i32(item_coordinates(item).x % 16u) - 8;
}
fn hop(w: ptr<function, Walk>) -> u32 {
    (*w).steps += 1u;
    (*w).place += select(-1, 1, pcg4d(vec4u((*w).key, (*w).steps, 3u)).x >= 0x80000000u);
    if (abs((*w).place) > 8) { return FINISH; }
    return CONTINUE;
}
fn finish(w: ptr<function, Walk>) -> u32 { return (*w).steps; }
";

fn main() -> Result<(), wavepool::Error> {
    let gpu = GpuContext::headless()?;
    let program = Program::builder("strip").source("strip.wgsl", WALK).stage("hop").build()?;
    // ANCHOR: swap
    let plain = Schedule::block().with_pool_blocks(64);
    let own = plain.clone().with_order(Scattered).with_regeneration(AtLeast { blocks: 8 });
    // ANCHOR_END: swap
    for schedule in [plain, own] {
        let mut scheduler = Scheduler::builder(&program, ImageTiles { width: 320, height: 240 }).schedule(&schedule).build_on(&gpu)?;
        let (film, report) = scheduler.run(4)?;
        println!("{schedule}: {} launches, {} steps, film {:016x}", report.launches, report.steps, film.hash());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    // ANCHOR: tests
    wavepool_lab::conformance!(order scattered_tiles_are_sound: Scattered);
    wavepool_lab::conformance!(regeneration waiting_for_company_is_sound: AtLeast { blocks: 2 });
    // ANCHOR_END: tests
}
