//! Progress on stderr: a bar on a terminal, nothing elsewhere.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use path_tracer::wavepool::Progress;

/// Shows samples per second and the time left.
pub(crate) struct Meter {
    bar: ProgressBar,
}

impl Meter {
    /// `title` stands before the bar.
    pub(crate) fn new(items: u64, title: String) -> Self {
        let bar = ProgressBar::new(items).with_prefix(title);
        let template = "{prefix}{wide_bar} {percent:>3} %  {per_sec}  {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            let style = style.with_key("per_sec", |state: &indicatif::ProgressState, w: &mut dyn std::fmt::Write| {
                let _ = write!(w, "{:.2} Msamples/s", state.per_sec() / 1e6);
            });
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Meter { bar }
    }

    pub(crate) fn update(&self, progress: &Progress) {
        self.bar.set_position(progress.items_started);
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
