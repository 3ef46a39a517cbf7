//! The graphics adapters of this machine, as the renderer sees them.

use std::path::Path;

use crate::{
    json::{self, Value},
    process::{self, Failure},
};

/// One adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Adapter {
    /// The name the driver gives.
    pub(crate) name: String,
    /// `vulkan`, `metal` or `dx12`.
    pub(crate) backend: String,
    /// Everything else that is said of it, for instance the driver's version.
    details: Vec<String>,
}

impl Adapter {
    /// One line for people.
    pub(crate) fn label(&self) -> String {
        let about = std::iter::once(&self.backend).chain(&self.details).filter(|detail| !detail.is_empty());
        format!("{} ({})", self.name, about.map(String::as_str).collect::<Vec<_>>().join(", "))
    }

    /// True for the software driver of Mesa 22 and older, which runs a path tracing kernel several times slower than that of Mesa 25.
    pub(crate) fn is_slow_software(&self) -> bool {
        let all = || std::iter::once(&self.name).chain(&self.details);
        let software = all().any(|text| text.contains("llvmpipe"));
        let major = all().find_map(|text| {
            let (_, version) = text.split_once("Mesa ")?;
            version.split('.').next()?.trim().parse::<u32>().ok()
        });
        software && major.is_some_and(|major| major <= 22)
    }
}

/// Asks the renderer for its adapters; it must be built already.
///
/// # Errors
/// When the renderer fails or prints something that is not a list of adapters.
pub(crate) fn ask(root: &Path) -> Result<Vec<Adapter>, Failure> {
    let mut command =
        process::cargo(root, &["run", "--quiet", "--package", "path_tracer", "--bin", "path-tracer", "--", "adapters", "--json"]);
    let text = process::capture(&mut command)?;
    parse(&text).map_err(|why| Failure::step(format!("`path-tracer adapters --json`: {why}")))
}

/// Reads the renderer's list.
///
/// # Errors
/// One line that says what is wrong with the list.
pub(crate) fn parse(text: &str) -> Result<Vec<Adapter>, String> {
    let Value::List(entries) = json::parse(text)? else {
        return Err("not a JSON array".into());
    };
    entries.into_iter().map(adapter).collect()
}

fn adapter(entry: Value) -> Result<Adapter, String> {
    let Value::Object(members) = entry else {
        return Err("an entry is not a JSON object".into());
    };
    let mut adapter = Adapter { name: String::new(), backend: String::new(), details: Vec::new() };
    for (key, value) in members {
        match (key.as_str(), value) {
            ("name", Value::Text(text)) => adapter.name = text,
            ("backend", Value::Text(text)) => adapter.backend = text,
            (_, Value::Text(text)) => adapter.details.push(text),
            _ => {}
        }
    }
    if adapter.name.is_empty() { Err("an adapter has no name".into()) } else { Ok(adapter) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(name: &str, driver: &str) -> String {
        format!(r#"[{{"name":"{name}","backend":"vulkan","driver":"{driver}","device_type":"Cpu"}}]"#)
    }

    /// Kills: an empty answer taken for "no adapter", which would install a driver because of a broken renderer.
    #[test]
    fn no_list_is_not_an_empty_list() {
        assert_eq!(parse("[]\n"), Ok(vec![]));
        assert!(parse("").is_err());
        assert!(parse("{}").is_err());
        assert!(parse(r#"[{"backend":"vulkan"}]"#).is_err());
    }

    /// Kills: the hint about slow drivers shown to everybody, or to nobody, or to owners of real graphics cards with an old Mesa.
    #[test]
    fn only_the_old_software_driver_is_slow() {
        let slow = |name, driver| parse(&list(name, driver)).expect("a list")[0].is_slow_software();
        assert!(slow("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"));
        assert!(!slow("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"));
        assert!(!slow("AMD Radeon Graphics (RADV RENOIR)", "radv Mesa 22.3.6"));
        assert!(!slow("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe"));
    }

    /// Kills: a label without the driver, which numbers in reports need.
    #[test]
    fn the_label_names_the_driver() {
        let adapters = parse(&list("llvmpipe", "Mesa 25.0.7")).expect("a list");
        assert_eq!(adapters[0].label(), "llvmpipe (vulkan, Mesa 25.0.7, Cpu)");
    }
}
