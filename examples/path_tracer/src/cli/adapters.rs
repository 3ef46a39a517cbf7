//! `path-tracer adapters`: which GPUs there are.

use path_tracer::wavepool;

use super::{Failure, say};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// As a JSON array of objects with name, backend, driver and device_type.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let adapters = wavepool::adapters();
    if arguments.json {
        let list: Vec<_> = adapters
            .iter()
            .map(|adapter| {
                serde_json::json!({
                    "name": adapter.name,
                    "backend": adapter.backend,
                    "driver": adapter.driver,
                    "device_type": adapter.device_type,
                })
            })
            .collect();
        say(serde_json::Value::Array(list));
    } else if adapters.is_empty() {
        say("no adapter; `cargo xtask setup` installs a software Vulkan driver on Debian and Ubuntu");
    } else {
        adapters.iter().for_each(|adapter| say(format_args!("{adapter}, {}", adapter.device_type)));
    }
    Ok(())
}
