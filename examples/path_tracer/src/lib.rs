//! A path tracer on wavepool: scenes from files, stages in WGSL, images out.
//!
//! Key decision: the renderer is an ordinary user of the scheduler. It declares a program (the stages in `shaders/path_tracer`), gives
//! it buffers, and never mentions a schedule except to pass one on.
//!
//! **Invariant:** nothing here knows how stages become kernels.

mod crop;
pub mod error;
pub mod export;
mod film_layers;
pub mod gpu_scene;
pub mod layers;
pub mod output;
mod renderer;
pub mod scene;

pub use crop::Crop;
pub use error::Error;
pub use gpu_scene::LayerRequest;
pub use renderer::{Observer, Renderer, Rendering, Settings, Wish};
pub use wavepool;
