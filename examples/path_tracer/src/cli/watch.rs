//! Looking on while a picture is made: a file that is replaced now and then, a viewer that is sent what there is.
//!
//! Key decision: a picture that cannot be shown does not stop the one that is being made; the trouble is noted once.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use path_tracer::output::{self, Options, Picture, tev::Viewer};

use super::{Failure, value, voice::Voice};

#[derive(Debug, clap::Args)]
pub(crate) struct WatchArguments {
    /// Write what there is into this file every so often; .png, .exr, .pfm or .npy.
    #[arg(long, value_name = "FILE")]
    preview: Option<PathBuf>,
    /// Send what there is to the viewer tev every so often; its port is 14158 unless it was told another.
    #[arg(long, value_name = "HOST:PORT")]
    tev: Option<String>,
    /// How often, as 10s, 0.5s or 2m.
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = value::duration)]
    every: Duration,
}

impl WatchArguments {
    /// Everything that can be known before the work: names, places, connections.
    pub(crate) fn begin(&self, name: &str) -> Result<Watch, Failure> {
        if let Some(path) = &self.preview {
            output::check_writable(path)?;
        }
        let viewer = self.tev.as_deref().map(|address| Viewer::connect(address, name)).transpose()?;
        Ok(Watch { preview: self.preview.clone(), viewer, every: self.every, last: Instant::now() })
    }
}

pub(crate) struct Watch {
    preview: Option<PathBuf>,
    viewer: Option<Viewer>,
    every: Duration,
    last: Instant,
}

impl Watch {
    /// True when somebody looks on and has waited long enough.
    pub(crate) fn is_due(&self) -> bool {
        self.is_on() && self.last.elapsed() >= self.every
    }

    /// True when somebody looks on.
    pub(crate) fn is_on(&self) -> bool {
        self.preview.is_some() || self.viewer.is_some()
    }

    /// Shows what there is. Whatever fails is not tried again.
    pub(crate) fn show(&mut self, picture: &Picture, options: &Options, voice: &mut Voice) {
        if let Some(path) = &self.preview {
            match output::write_picture(path, picture, options) {
                Ok(_) => {}
                Err(error) => {
                    voice.note(format_args!("{error}; there will be no further previews"));
                    self.preview = None;
                }
            }
        }
        self.send(picture, voice);
        self.last = Instant::now();
    }

    /// Shows the finished picture to the viewer; the file of it is somebody else's.
    pub(crate) fn send(&mut self, picture: &Picture, voice: &mut Voice) {
        if let Some(Err(error)) = self.viewer.as_mut().map(|viewer| viewer.update(picture)) {
            voice.note(format_args!("{error}; nothing more will be sent"));
            self.viewer = None;
        }
    }
}
