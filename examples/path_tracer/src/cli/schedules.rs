//! `path-tracer schedules`: what `--schedule` understands, from the library's own lists.

use path_tracer::wavepool::{
    SCHEDULE_KEYS, SCHEDULES,
    policy::{LAUNCHES, ORDERS, ROULETTES},
};

use super::{Failure, say};

pub(crate) fn run() -> Result<(), Failure> {
    say("--schedule NAME[,key=value...], for example block,threshold=0.25,order=depth-max");
    list("names", SCHEDULES.iter().map(|choice| (choice.name.to_owned(), choice.about.to_owned())));
    list("keys", SCHEDULE_KEYS.iter().map(|(key, values, about)| (format!("{key}="), format!("{values}: {about}"))));
    list("order=", ORDERS.iter().map(|choice| (choice.name.to_owned(), choice.about.to_owned())));
    list("roulette=", ROULETTES.iter().map(|choice| (choice.name.to_owned(), choice.about.to_owned())));
    list("launch=", LAUNCHES.iter().map(|choice| (choice.name.to_owned(), choice.about.to_owned())));
    Ok(())
}

fn list(title: &str, entries: impl Iterator<Item = (String, String)>) {
    say(format_args!("\n{title}"));
    entries.for_each(|(name, about)| say(format_args!("  {name:13} {about}")));
}
