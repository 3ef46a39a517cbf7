//! What the user declares: the program.
//!
//! Key decision: state, stages and their order are declared once, in WGSL and in one list of names; everything else (what each stage
//! moves, which bindings exist, what the result looks like) is read from the WGSL. A program knows no device and no schedule.

mod gauge;

use std::borrow::Cow;

pub(crate) use gauge::Gauge;

use crate::{
    Instruments, Result, Schedule,
    control::TICK_LANES,
    error::Error,
    layout::{Layout, Storage, cells, lay_out},
    policy::{Grain, ImageTiles, RouletteScope, WorkSource},
    shader::{
        Composition, Constant, Diagnostic, GENERATED, Interface, SourceModule, Sources, Summary, compose, find_arrays, header, inspect,
        link, plain_accessors,
    },
};

/// The names of the contract's functions.
#[derive(Clone, Debug)]
pub(crate) struct Names {
    pub(crate) generate: String,
    pub(crate) stages: Vec<String>,
    pub(crate) finish: String,
    pub(crate) survival: String,
    pub(crate) reweight: String,
    pub(crate) queue_key: String,
}

/// A checked wavefront program: WGSL modules, stages in order, and what the library has found out about them.
#[derive(Clone, Debug)]
pub struct Program {
    name: String,
    names: Names,
    sources: Sources,
    gauges: Vec<Gauge>,
    interface: Interface,
    is_sharing: bool,
}

/// Collects the parts of a [`Program`].
#[derive(Clone, Debug)]
pub struct ProgramBuilder {
    name: String,
    names: Names,
    sources: Sources,
    gauges: Vec<Gauge>,
    is_sharing: bool,
    storage: Vec<(String, Storage)>,
    arrays: Vec<String>,
}

impl Program {
    /// Begins a program; the name appears in labels and messages.
    ///
    /// # Example
    /// ```
    /// let program = wavepool::Program::builder("count")
    ///     .source("count.wgsl", "
    ///         struct Walk { left: u32, steps: u32 }
    ///         fn generate(walk: ptr<function, Walk>, item: Item) { (*walk).left = item.pixel % 7u; }
    ///         fn count_down(walk: ptr<function, Walk>) -> u32 {
    ///             if ((*walk).left == 0u) { return FINISH; }
    ///             (*walk).left -= 1u;
    ///             (*walk).steps += 1u;
    ///             return CONTINUE;
    ///         }
    ///         fn finish(walk: ptr<function, Walk>) -> u32 { return (*walk).steps; }")
    ///     .stage("count_down")
    ///     .build()?;
    /// assert_eq!(program.layout(None).bytes_per_lane(), 12);
    /// # Ok::<(), wavepool::Error>(())
    /// ```
    pub fn builder(name: &str) -> ProgramBuilder {
        ProgramBuilder {
            name: name.to_owned(),
            names: Names {
                generate: "generate".into(),
                stages: Vec::new(),
                finish: "finish".into(),
                survival: "survival".into(),
                reweight: "reweight".into(),
                queue_key: "queue_key".into(),
            },
            sources: Sources {
                library: wavepool_shaders::MATH.iter().map(|module| library_module("wavepool", module)).collect(),
                ..Sources::default()
            },
            gauges: Vec::new(),
            is_sharing: true,
            storage: Vec::new(),
            arrays: Vec::new(),
        }
    }

    /// The name given to [`builder`](Self::builder).
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The stages, in the order of a step.
    pub fn stages(&self) -> impl Iterator<Item = &str> {
        self.names.stages.iter().map(String::as_str)
    }

    /// True when the program declares `survival` and `reweight`.
    pub fn has_roulette(&self) -> bool {
        self.interface.survival.is_some()
    }

    /// True when the program declares `queue_key`, the kind of work that a walk asks for after the first stage.
    pub fn has_queue_key(&self) -> bool {
        self.interface.queue_key.is_some()
    }

    /// What is kept where, and who moves it; it depends on who shares a draw of roulette, if there is any.
    pub fn layout(&self, roulette: Option<RouletteScope>) -> Layout {
        self.layout_at(roulette, Grain::Tiles)
    }

    /// The same where work is handed out in portions of `grain`.
    pub fn layout_at(&self, roulette: Option<RouletteScope>, grain: Grain) -> Layout {
        lay_out(&self.interface, roulette.filter(|_| self.has_roulette()), grain, self.is_sharing)
    }

    /// What a stage reads and writes, by name.
    pub fn summary(&self, stage: &str) -> Option<&Summary> {
        match stage {
            _ if stage == self.names.generate => Some(&self.interface.generate),
            _ if stage == self.names.finish => Some(&self.interface.finish),
            _ => self.interface.stages.iter().find(|facts| facts.name == stage).map(|facts| &facts.summary),
        }
    }

    /// Places where the inference had to count more leaves than are used: one line each, `file:line:column: reason`.
    pub fn widened(&self) -> Vec<String> {
        let Ok(composition) = composition(&self.sources, &self.gauges, &default_source(), true) else { return Vec::new() };
        let mut lines: Vec<String> = self
            .interface
            .stages
            .iter()
            .map(|stage| &stage.summary)
            .chain([&self.interface.generate, &self.interface.finish])
            .flat_map(|summary| &summary.widened)
            .map(|(span, reason)| {
                let place = composition.diagnostic(*span, reason, "", &[]);
                format!("{}:{}:{}: {reason}", place.file, place.line, place.column)
            })
            .collect();
        lines.dedup();
        lines
    }

    /// The WGSL that a schedule makes of this program, by name: `stages`, `tick`, `resolve`. For reading; it needs no device.
    ///
    /// # Errors
    /// [`Error::Shader`] when a policy's WGSL and the program's do not go together.
    pub fn wgsl(&self, source: &dyn WorkSource, schedule: &Schedule) -> Result<[(&'static str, String); 3]> {
        self.wgsl_with(source, schedule, &Instruments::default())
    }

    /// The same with instruments.
    ///
    /// # Errors
    /// As [`wgsl`](Self::wgsl).
    pub fn wgsl_with(
        &self,
        source: &dyn WorkSource,
        schedule: &Schedule,
        instruments: &Instruments,
    ) -> Result<[(&'static str, String); 3]> {
        let linked = link(self, source, schedule, instruments, TICK_LANES, &[])?;
        Ok([("stages", linked.stages.text), ("tick", linked.tick), ("resolve", linked.resolve)])
    }

    /// Generates and validates every kernel that `schedule` makes of this program, without a device; returns what is kept where. Of a schedule
    /// that chooses among candidates: for the first of them that can do what is asked.
    ///
    /// # Errors
    /// [`Error::Shader`] with file, line and caret, [`Error::Schedule`] when the policies do not go together.
    ///
    /// # Example
    /// ```
    /// # let text = "struct S { n: u32 } fn generate(s: ptr<function, S>, item: Item) {}
    /// #   fn end(s: ptr<function, S>) -> u32 { return FINISH; } fn finish(s: ptr<function, S>) -> u32 { return (*s).n; }";
    /// use wavepool::{LinearRange, Program, Schedule};
    /// let program = Program::builder("end").source("end.wgsl", text).stage("end").build()?;
    /// program.check(&LinearRange { count: 1000 }, &Schedule::block())?;
    /// # Ok::<(), wavepool::Error>(())
    /// ```
    pub fn check(&self, source: &dyn WorkSource, schedule: &Schedule) -> Result<Layout> {
        if !schedule.candidates.is_empty() {
            // As when it runs: candidates that cannot do what is asked are left out, but one must be there.
            let mut refusal = Error::Schedule("there is no candidate".into());
            for candidate in schedule.candidates_as_asked() {
                match self.check(source, &candidate) {
                    Err(error @ Error::Schedule(_)) => refusal = error,
                    outcome => return outcome,
                }
            }
            return Err(refusal);
        }
        let linked = link(self, source, schedule, &Instruments::default(), TICK_LANES, &[])?;
        linked.check_scheduler_kernels()?;
        Ok(linked.layout)
    }

    /// The program's text behind the declarations for `source`, as far as it does not depend on the schedule.
    pub(crate) fn compose(&self, source: &dyn WorkSource, assertions: bool) -> Result<Composition> {
        composition(&self.sources, &self.gauges, source, assertions).map_err(Error::Shader)
    }

    /// Counters and assertions in the order of their slots, and whether anything calls them.
    pub(crate) fn gauges(&self) -> impl Iterator<Item = (&Gauge, bool)> {
        self.gauges.iter().map(|gauge| (gauge, self.interface.functions.contains(&gauge.function())))
    }

    pub(crate) fn interface(&self) -> &Interface {
        &self.interface
    }

    pub(crate) fn names(&self) -> &Names {
        &self.names
    }
}

fn library_module(package: &'static str, module: &wavepool_shaders::Module) -> SourceModule {
    SourceModule { package: package.into(), path: module.path.into(), file: module.file.into(), text: module.text.into() }
}

/// Stands in for the work source while a program is checked without a run.
fn default_source() -> ImageTiles {
    ImageTiles { width: 16, height: 16 }
}

fn composition(
    sources: &Sources,
    gauges: &[Gauge],
    source: &dyn WorkSource,
    assertions: bool,
) -> std::result::Result<Composition, Vec<Diagnostic>> {
    let mut composition = Composition::default();
    let header = header(source, gauges, assertions);
    composition.push(GENERATED, &header, &header);
    compose(&mut composition, sources)?;
    Ok(composition)
}

impl ProgramBuilder {
    /// Adds a WGSL file whose declarations belong to the program. `file` is shown in messages; imports know it as
    /// `package::` and its name without extension.
    pub fn source(mut self, file: impl Into<Cow<'static, str>>, text: impl Into<Cow<'static, str>>) -> Self {
        let file = file.into();
        let stem = file.rsplit(['/', '\\']).next().unwrap_or(&file);
        let path = stem.strip_suffix(".wgsl").unwrap_or(stem).to_owned();
        self.sources.roots.push(SourceModule { package: "package".into(), path: path.into(), file, text: text.into() });
        self
    }

    /// Adds a module that belongs to the program, with its package and path for imports spelled out.
    pub fn module(mut self, module: SourceModule) -> Self {
        self.sources.roots.push(module);
        self
    }

    /// Adds a module that is used only when something imports it.
    pub fn library(mut self, module: SourceModule) -> Self {
        self.sources.library.push(module);
        self
    }

    /// Declares a feature, on or off, that `@if(name)`, `@elif(..)` and `@else` in the program's modules may ask for. They stand before
    /// declarations, imports, members, statements and cases of a switch, and ask with `!`, `&&`, `||` and parentheses; what is not asked
    /// for is not part of the program. A condition with a name that is no feature is a mistake; a feature that nothing asks for is none.
    ///
    /// # Example
    /// ```
    /// let text = "
    ///     struct Walk { left: u32, @if(count) steps: u32, }
    ///     fn generate(walk: ptr<function, Walk>, item: Item) { (*walk).left = item.pixel % MODULUS; }
    ///     fn count_down(walk: ptr<function, Walk>) -> u32 {
    ///         if ((*walk).left == 0u) { return FINISH; }
    ///         (*walk).left -= 1u;
    ///         @if(count) (*walk).steps += 1u;
    ///         return CONTINUE;
    ///     }
    ///     @if(count) fn finish(walk: ptr<function, Walk>) -> u32 { return (*walk).steps; }
    ///     @else fn finish(walk: ptr<function, Walk>) -> u32 { return 1u; }";
    /// let walk = wavepool::Program::builder("walk").source("walk.wgsl", text).stage("count_down").constant("MODULUS", 7u32);
    /// assert!(walk.clone().build().is_err(), "nobody said what `count` is");
    /// assert_eq!(walk.clone().feature("count", true).build()?.layout(None).leaves.len(), 2);
    /// assert_eq!(walk.feature("count", false).build()?.layout(None).leaves.len(), 1);
    /// # Ok::<(), wavepool::Error>(())
    /// ```
    pub fn feature(mut self, name: &str, is_on: bool) -> Self {
        self.sources.features.push((name.to_owned(), is_on));
        self
    }

    /// Declares a constant of WGSL for all modules. It needs no import; one from the package `constants` checks that it is there.
    pub fn constant(mut self, name: &str, value: impl Into<Constant>) -> Self {
        self.sources.constants.push((name.to_owned(), value.into()));
        self
    }

    /// Adds a stage: a function of this name, run once per live lane and step, in the order of the calls.
    pub fn stage(mut self, name: &str) -> Self {
        self.names.stages.push(name.to_owned());
        self
    }

    /// Declares a counter: stages call `count_NAME(amount: u32)`, a run reports the sum as 64 bits. Without calls it has no code.
    pub fn counter(mut self, name: &str) -> Self {
        self.gauges.push(Gauge { name: name.to_owned(), is_assertion: false });
        self
    }

    /// Declares an assertion: stages call `assert_NAME(holds: bool)`, a run reports how often it did not hold. It has code only when
    /// [`Instruments`] ask for assertions.
    pub fn assertion(mut self, name: &str) -> Self {
        self.gauges.push(Gauge { name: name.to_owned(), is_assertion: true });
        self
    }

    /// Lets leaves that are never needed at the same border of stages share a plane; the default. It changes no result, only bytes.
    pub fn share_planes(mut self, is_sharing: bool) -> Self {
        self.is_sharing = is_sharing;
        self
    }

    /// Keeps a field of the state in a storage format. `field` is a path below the state as in the table: `direction`, `inner.y`,
    /// `pair[0].y` for one element of an array, `pair[].y` for every element. Formats change values: each goes through its format
    /// wherever it was written, alike under every schedule; what does not fit counts in [`Report::storage_clamped`](crate::Report).
    pub fn storage(mut self, field: &str, storage: Storage) -> Self {
        self.storage.push((field.to_owned(), storage));
        self
    }

    /// Lets stages reach the member `member` of the state, an `array<ELEMENT, LENGTH>`, through generated functions: `load_MEMBER(state,
    /// index) -> ELEMENT` and `store_MEMBER(state, index, value)`. A stage then moves the elements that it touches and no others. All
    /// elements are zero when a walk begins; an index out of range reads zeros, writes nothing, and counts in
    /// [`Report::out_of_range`](crate::Report). The member itself is then out of reach, and the state cannot be copied whole.
    pub fn array(mut self, member: &str) -> Self {
        self.arrays.push(member.to_owned());
        self
    }

    /// Checks everything that needs no device: imports, signatures, the rules of a stage, resources.
    ///
    /// # Errors
    /// [`Error::Shader`] with file, line and caret for each mistake; [`Error::Field`] for a field that does not exist or a format that
    /// does not go with it; [`Error::Feature`] and [`Error::Constant`] for a name that cannot be one, or a value that WGSL cannot write.
    pub fn build(self) -> Result<Program> {
        let ProgramBuilder { name, names, mut sources, gauges, is_sharing, storage, arrays } = self;
        gauge::check(&gauges).map_err(|diagnostic| Error::Shader(vec![diagnostic]))?;
        sources.check()?;
        if names.stages.is_empty() {
            return Err(Error::Shader(vec![Diagnostic::nowhere(format!("program `{name}` has no stage: name one with `stage`"))]));
        }
        if let Some(twice) = names.stages.iter().enumerate().find(|(index, stage)| names.stages[..*index].contains(stage)) {
            let message = format!("stage `{}` of program `{name}` is named twice: a step runs each stage once", twice.1);
            return Err(Error::Shader(vec![Diagnostic::nowhere(message)]));
        }
        for format in Storage::ALL.iter().filter(|format| storage.iter().any(|(_, declared)| declared == *format)) {
            sources.roots.extend(
                wavepool_shaders::MATH.iter().filter(|module| module.path == format.module()).map(|m| library_module("wavepool", m)),
            );
        }
        let mut composition = composition(&sources, &gauges, &default_source(), true).map_err(Error::Shader)?;
        let arrays = find_arrays(&composition, &names.generate, &arrays)?;
        let accessors = plain_accessors(&arrays);
        composition.push(GENERATED, &accessors, &accessors);
        let mut interface = inspect(&composition, &names, &arrays).map_err(Error::Shader)?;
        interface.cells = cells(&interface.fields, &interface.leaves, &storage)?;
        let Interface { arrays, cells, .. } = &mut interface;
        arrays.iter_mut().try_for_each(|array| array.take_cells(cells))?;
        Ok(Program { name, names, sources, gauges, interface, is_sharing })
    }
}
