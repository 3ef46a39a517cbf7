//! Lists the WGSL files of each folder, so that adding a shader means adding one file.

use std::{env, fmt::Write as _, fs, io, path::Path};

const FOLDERS: [&str; 3] = ["scheduler", "math", "path_tracer"];

fn main() -> io::Result<()> {
    let root = env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?;
    let mut generated = String::new();
    for folder in FOLDERS {
        println!("cargo::rerun-if-changed={folder}");
        let mut stems = Vec::new();
        for entry in fs::read_dir(Path::new(&root).join(folder))? {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == "wgsl") {
                stems.extend(path.file_stem().and_then(|stem| stem.to_str()).map(String::from));
            }
        }
        stems.sort();
        let constant = folder.to_uppercase();
        if folder == "path_tracer" {
            generated.push_str("#[cfg(feature = \"path_tracer\")]\n");
        }
        let _ = writeln!(generated, "/// The modules of the folder `{folder}`, by name.\npub const {constant}: &[Module] = &[");
        for stem in stems {
            let _ = writeln!(
                generated,
                "    Module {{ path: \"{folder}::{stem}\", file: \"shaders/{folder}/{stem}.wgsl\", \
                 text: include_str!(concat!(env!(\"CARGO_MANIFEST_DIR\"), \"/{folder}/{stem}.wgsl\")) }},"
            );
        }
        generated.push_str("];\n");
    }
    let out = env::var("OUT_DIR").map_err(io::Error::other)?;
    fs::write(Path::new(&out).join("modules.rs"), generated)
}
