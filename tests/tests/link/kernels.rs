//! Generated kernels: valid for every execution, and made of the user's stages, called once each.

use std::sync::Arc;

use wavepool::{
    ImageTiles, Instruments, LinearRange, Program, Schedule, naga,
    policy::{BlockInPlace, PerBlock, Roulette, Statistic, WorkSource},
};
use wavepool_tests::programs;

fn validate(name: &str, text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
    // WebGPU without extensions.
    let capabilities = naga::valid::Capabilities::empty();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
    module
}

fn schedules() -> Vec<(&'static str, Schedule)> {
    vec![
        ("never", Schedule::never()),
        ("block", Schedule::block().with_regeneration(BlockInPlace::new(0.25, 3))),
        ("never-full", Schedule::never_full()),
        ("megakernel", Schedule::megakernel()),
        ("persistent", Schedule::persistent()),
        ("megakernel-regen", Schedule::megakernel_regen()),
        ("pins off", Schedule::megakernel().with_pins(false)),
        ("poison", Schedule::block().with_poison(0x7fc0_0000)),
        ("no roulette", Schedule::block().with_roulette(None)),
    ]
}

/// Kills: a NaN written as a constant when poisoning; a kernel that needs more than WebGPU guarantees; a stage copied or called twice.
#[test]
fn every_execution_of_every_program_is_valid() {
    let programs: Vec<Program> = programs::all().iter().map(|build| build()).collect();
    let sources: [&dyn WorkSource; 2] = [&ImageTiles { width: 40, height: 56 }, &LinearRange { count: 1000 }];
    for program in &programs {
        let block: Arc<dyn Roulette> = Arc::new(PerBlock(Statistic::Mean));
        let together =
            [Schedule::megakernel(), Schedule::persistent()].map(|schedule| ("lock-step", schedule.with_roulette(Some(block.clone()))));
        for (name, schedule) in schedules().into_iter().chain(together) {
            for source in sources {
                let modules = program.wgsl(source, &schedule).unwrap_or_else(|error| panic!("{} {name}: {error}", program.name()));
                for (part, text) in &modules {
                    let module = validate(&format!("{} {name} {part}", program.name()), text);
                    assert!(!module.entry_points.is_empty());
                    for entry in &module.entry_points {
                        assert!(entry.workgroup_size.iter().product::<u32>() <= 256);
                    }
                    let storage = |variable: &naga::GlobalVariable| {
                        matches!(variable.space, naga::AddressSpace::Storage { .. })
                            && variable.binding.is_some_and(|binding| binding.group == 0)
                    };
                    assert!(module.global_variables.iter().filter(|(_, variable)| storage(variable)).count() <= 4);
                }
                // Other compilers than naga refuse a constant that is NaN.
                assert!(!modules[0].1.contains("<f32>(0x7fc00000u)"));
                for stage in program.stages() {
                    let calls = modules[0].1.matches(&format!("{stage}(&wf_state)")).count();
                    assert_eq!(calls, 1, "{} {name}: `{stage}` is called {calls} times", program.name());
                }
            }
        }
    }
}

/// Kills: an execution that asks for planes it does not use, or pins that stay when switched off.
#[test]
fn what_is_switched_off_has_no_code() {
    let program = programs::hops();
    let source = LinearRange { count: 1 };
    let stages = |schedule: &Schedule| program.wgsl(&source, schedule).expect("valid")[0].1.clone();
    assert!(!stages(&Schedule::megakernel()).contains("wf_bank[") && !stages(&Schedule::megakernel()).contains("wf_taken"));
    assert!(!stages(&Schedule::persistent()).contains("wf_bank[") && !stages(&Schedule::persistent()).contains("Barrier()"));
    assert!(!stages(&Schedule::block()).contains("wf_megakernel"));
    assert!(stages(&Schedule::never()).contains("= wf_live_block(") && !stages(&Schedule::never_full()).contains("= wf_live_block("));
    assert!(!stages(&Schedule::block().with_roulette(None)).contains("wf_inverse_survival"));
    assert!(stages(&Schedule::block()).contains("| wf_control.opaque_zero"));
    assert!(!stages(&Schedule::block().with_pins(false)).contains("| wf_control.opaque_zero"));
    assert!(!stages(&Schedule::block()).contains("0xdeadbeef"));
    assert!(stages(&Schedule::block().with_poison(0xdead_beef)).contains("0xdeadbeef"));
}

/// Kills: an assertion that is evaluated though nobody asked; a counter or an assertion that nobody calls and that has a slot all the
/// same; checked mode, lengths or a gauge in a kernel that was not asked for them.
#[test]
fn instruments_that_are_off_have_no_code() {
    let (program, source) = (programs::watched(), LinearRange { count: 1 });
    for schedule in [Schedule::block(), Schedule::megakernel()] {
        let stages = |instruments| program.wgsl_with(&source, &schedule, &instruments).expect("valid")[0].1.clone();
        let (off, on) = (stages(Instruments::default()), stages(Instruments { assertions: true, ..Instruments::default() }));
        assert!(off.contains("fn assert_positive(holds: bool) { }") && !off.contains("if (!holds)"));
        assert_eq!(on.matches("if (!holds)").count(), 3, "one for each that is declared");
        for word in ["wf_length;", "wf_audit", "atomicAdd(&wf_counters[WF_FINISHED]"] {
            assert!(!off.contains(word) && !on.contains(word), "{word}");
        }
        let observed = stages(Instruments { checked: true, lengths: true, ..Instruments::default() });
        for word in ["wf_length;", "wf_audit_results", "atomicAdd(&wf_counters[WF_FINISHED]", "if (!holds)"] {
            assert!(observed.contains(word), "{word}");
        }
        validate("observed", &observed);
    }
}
