//! Small good files, broken at random: whatever a reader is given, it ends soon, without a panic, in a scene or in an error, and holds
//! no more memory than the file can explain.
//!
//! Key decision: the mutations are a function of a fixed seed and the number of the trial, so that every finding can be repeated.
//! `WAVEPOOL_FULL=1` makes a million trials for each format instead of a few thousand.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;

use path_tracer::scene;

use super::memory::most_held;
use super::{LONGEST, samples};

/// What a reader may hold: this, and so many bytes for each byte that it was given.
const FREE_BYTES: usize = 64 << 20;
const BYTES_PER_BYTE: usize = 64;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ bits >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ bits >> 31
    }

    /// Less than `n`, or 0.
    fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.next() % (n.max(1) as u64)).unwrap_or(0)
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }
}

const BYTES: [u8; 12] = [0, 1, 2, 10, 127, 128, 255, b'-', b'0', b'9', b' ', b'\\'];
const WORDS: [u32; 10] = [0, 1, 0xFF, 0xFFFF, 0x0001_0000, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x7F80_0000, 0x0100_0000];
const TOKENS: [&str; 20] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "4",
    "5",
    "7",
    "0.5",
    "255",
    "256",
    "65536",
    "999999",
    "33554432",
    "2147483647",
    "4294967295",
    "1e39",
    "nan",
    "-1e-40",
    "18446744073709551615",
];

/// Breaks `bytes` in one to four places.
fn mutate(bytes: &mut Vec<u8>, is_text: bool, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let doublings = random.below(8);
        let length = 1 + random.below(1 << doublings);
        let end = (at + length).min(bytes.len());
        match random.below(if is_text { 10 } else { 7 }) {
            0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << random.below(8)),
            1 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = random.of(&BYTES)),
            2 => {
                let word = random.of(&WORDS);
                let word = if random.below(2) == 0 { word.to_le_bytes() } else { word.to_be_bytes() };
                bytes.iter_mut().skip(at).zip(word).for_each(|(byte, new)| *byte = new);
            }
            // Most files are cut near their end, because what is cut early is refused early.
            3 => bytes.truncate(if random.below(4) == 0 { at } else { bytes.len().saturating_sub(length) }),
            4 => {
                let block = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, block);
            }
            5 => drop(bytes.drain(at..end)),
            6 => {
                let word = random.of(&WORDS[..4]).to_le_bytes();
                bytes.iter_mut().skip(at).zip(word).for_each(|(byte, new)| *byte = byte.wrapping_add(new));
            }
            7 | 8 => {
                let new = random.of(&TOKENS);
                replace_number(bytes, at, |_| new.as_bytes().to_vec());
            }
            _ => {
                let mut other = Vec::new();
                replace_number(bytes, random.below(usize::MAX), |old| {
                    other = old.to_vec();
                    other.clone()
                });
                if !other.is_empty() {
                    replace_number(bytes, at, |_| other);
                }
            }
        }
    }
}

/// Replaces the first number at or after a place.
fn replace_number(bytes: &mut Vec<u8>, from: usize, new: impl FnOnce(&[u8]) -> Vec<u8>) {
    let from = if bytes.is_empty() { 0 } else { from % bytes.len() };
    let is_part = |c: &u8| c.is_ascii_digit() || b"+-.eE".contains(c);
    let Some(start) = bytes[from..].iter().position(u8::is_ascii_digit).map(|at| from + at) else { return };
    let end = bytes[start..].iter().position(|c| !is_part(c)).map_or(bytes.len(), |length| start + length);
    let new = new(&bytes[start..end]);
    bytes.splice(start..end, new);
}

/// A file of a scene: its name, whether it is text, its bytes.
type Sample = (&'static str, bool, Vec<u8>);

/// A folder in memory where the system has one: a disk would be most of the time.
fn quick_folder() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory).ok() } else { None };
    made.unwrap_or_else(|| tempfile::tempdir().expect("a folder"))
}

/// Breaks one file of one of the sets at a time and loads the first file of that set.
fn hammer(sets: &[Vec<Sample>], load: impl Fn(&Path) -> bool) {
    let full = std::env::var_os("WAVEPOOL_FULL").is_some_and(|value| value == "1");
    let n_trials = if full { 1_000_000 } else { 4_000 };
    let folder = quick_folder();
    let name = |set: usize, file: &str| folder.path().join(format!("set{set}")).join(file);
    for (number, set) in sets.iter().enumerate() {
        fs::create_dir(folder.path().join(format!("set{number}"))).expect("made");
        set.iter().for_each(|(file, _, bytes)| fs::write(name(number, file), bytes).expect("written"));
        assert!(load(&name(number, set[0].0)), "the good file {} of set {number} is refused", set[0].0);
    }
    let (mut n_read, mut worst, mut complaints) = (0usize, 0usize, Vec::new());
    for trial in 0..n_trials {
        let mut random = Random(trial);
        let number = random.below(sets.len());
        let set = &sets[number];
        let (file, is_text, good) = &set[random.below(set.len())];
        let mut bytes = good.clone();
        mutate(&mut bytes, *is_text, &mut random);
        fs::write(name(number, file), &bytes).expect("written");
        let size: usize = set.iter().map(|(_, _, bytes)| bytes.len()).sum::<usize>().max(bytes.len());
        let start = Instant::now();
        let (result, most) = most_held(|| catch_unwind(AssertUnwindSafe(|| load(&name(number, set[0].0)))));
        let seconds = start.elapsed();
        let cap = FREE_BYTES + BYTES_PER_BYTE * size;
        worst = worst.max(most);
        let complaint = match result {
            Err(_) => Some(String::from("panics")),
            Ok(_) if seconds > LONGEST => Some(format!("takes {seconds:?}")),
            Ok(_) if most > cap => Some(format!("holds {most} bytes, {size} bytes explain {cap}")),
            Ok(read) => {
                n_read += usize::from(read);
                None
            }
        };
        if let Some(what) = complaint {
            complaints.push(format!("trial {trial}: {} {what}; kept as {}", file, keep(file, &bytes).display()));
            if complaints.len() >= 10 {
                break;
            }
        }
        fs::write(name(number, file), good).expect("written");
    }
    println!("{n_read} of {n_trials} broken files are read, at most {worst} bytes are held");
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    // Mutations that are all refused at the first byte would prove nothing.
    assert!(n_read > 0 && n_read < usize::try_from(n_trials).expect("small"), "{n_read}");
}

/// Puts a finding where it can be looked at.
fn keep(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = tempfile::Builder::new().prefix("finding").tempdir().expect("a folder").keep();
    fs::write(folder.join(name), bytes).expect("written");
    folder.join(name)
}

/// True when the file is read; an error must be one line with the file's name.
fn loads(path: &Path) -> bool {
    is_read(path, scene::load(path))
}

fn loads_environment(path: &Path) -> bool {
    is_read(path, scene::load_environment(path))
}

fn is_read<T>(path: &Path, result: Result<T, scene::Error>) -> bool {
    match result {
        Ok(_) => true,
        Err(error) => {
            let text = error.to_string();
            assert!(text.lines().count() == 1 && text.contains(&path.display().to_string()), "the error says too little: {text}");
            false
        }
    }
}

// Kills: in the reader of glTF text, a panic, an endless loop, recursion, and memory by promise.
#[test]
fn broken_gltf() {
    hammer(&[vec![("a.gltf", true, samples::gltf(&samples::png()))], vec![("a.gltf", true, samples::gltf(&samples::jpeg()))]], loads);
}

// Kills: the same in containers, buffers and pictures.
#[test]
fn broken_glb() {
    hammer(&[vec![("a.glb", false, samples::glb(&samples::png()))], vec![("a.glb", true, samples::glb(&samples::jpeg()))]], loads);
}

// Kills: the same in both run-length encodings.
#[test]
fn broken_hdr() {
    let sets: Vec<Vec<Sample>> = (0..3).map(|kind| vec![("a.hdr", kind == 0, samples::hdr(kind))]).collect();
    hammer(&sets, loads_environment);
}

// Kills: sizes, windows, tiles and channels of a header that are believed.
#[test]
fn broken_exr() {
    use samples::Compression::{B44, PIZ, PXR24, RLE, Uncompressed, ZIP16};
    let kinds = [(ZIP16, false), (ZIP16, true), (Uncompressed, false), (RLE, false), (PIZ, false), (PXR24, true), (B44, false)];
    let sets: Vec<Vec<Sample>> = kinds.into_iter().map(|(kind, tiled)| vec![("a.exr", false, samples::exr(kind, tiled))]).collect();
    hammer(&sets, loads_environment);
}

// Kills: counts and lengths of a header or a list that are believed, in all encodings.
#[test]
fn broken_ply() {
    let sets: Vec<Vec<Sample>> = (0..3).map(|kind| vec![("a.ply", true, samples::ply(kind))]).collect();
    hammer(&sets, loads);
}

// Kills: indices, names and options that are believed, in the mesh and in its library.
#[test]
fn broken_obj() {
    let set: Vec<Sample> =
        vec![("a.obj", true, samples::OBJ.into()), ("m.mtl", true, samples::MTL.into()), ("a.png", false, samples::png())];
    hammer(&[set], loads);
}

/// Small files whose headers ask for very much. The four last bytes of a JPEG's frame header and of a PNG's size are their sides.
fn promises() -> Vec<(&'static str, Vec<u8>)> {
    let mut jpeg = samples::jpeg();
    let frame = jpeg.windows(3).position(|marker| marker[0] == 0xFF && marker[1] == 0xC0).expect("a frame");
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0x3F, 0xFF, 0x3F, 0xFF]);
    let many = format!(r#""nodes":[{{"mesh":0}}{}]"#, r#",{"mesh":0}"#.repeat(5000));
    let implied = |count: usize| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},{many},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"componentType":5126,"type":"VEC3","count":{count}}}]}}"#
        )
        .into_bytes()
    };
    let windows = |side: &str| {
        let resolution = format!("-Y {side} +X {side}");
        samples::with(samples::hdr(1), "-Y 8 +X 16", &resolution)
    };
    vec![
        ("jpeg.glb", samples::glb(&jpeg)),
        ("count.gltf", samples::with(samples::gltf(&samples::png()), r#""count":4"#, r#""count":4294967295"#)),
        ("implied.gltf", implied(1_000_000)),
        ("instances.gltf", implied(131_072)),
        ("runs.hdr", windows("11000")),
        ("vertices.ply", samples::with(samples::ply(0), "vertex 5", "vertex 33000000")),
    ]
}

// Kills: memory by promise: of a picture, an accessor without data, a mesh that is shown very often, and counts of headers.
#[test]
fn promises_are_refused_before_memory_is_taken() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in promises() {
        let path = folder.path().join(name);
        fs::write(&path, &bytes).expect("written");
        let read = || if name.ends_with("hdr") { loads_environment(&path) } else { loads(&path) };
        let (read, most) = most_held(read);
        println!("{name}: {} bytes, {most} bytes are held", bytes.len());
        assert!(!read && most <= FREE_BYTES, "{name}: {read}, {most} for {}", bytes.len());
    }
}

/// A picture of one colour in the flattest encoding that honest programs wrote: whole lines as runs of one texel.
fn flat_panorama() -> Vec<u8> {
    let lines = [[90, 60, 30, 128], [1, 1, 1, 255], [1, 1, 1, 15]].concat().repeat(512);
    [b"#?RADIANCE\n\n-Y 512 +X 4096\n".to_vec(), lines].concat()
}

/// A mesh without normals, whose indices take a byte each.
fn flat_mesh(n_bytes: usize) -> Vec<u8> {
    let mut bin: Vec<u8> = [0.0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|number| number.to_le_bytes()).collect();
    let count = n_bytes / 12 * 12;
    bin.extend([0, 1, 2].repeat(count / 3));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":3}},
        {{"bufferView":1,"componentType":5121,"type":"SCALAR","count":{count}}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":{count}}}],"buffers":[{{"byteLength":{}}}]}}"#,
        bin.len()
    );
    samples::container(json.into_bytes(), &bin)
}

/// Files that promise nothing false and are as dense as their format allows.
fn dense() -> Vec<(&'static str, Vec<u8>, usize)> {
    const SIZE: usize = 1 << 20;
    let mut points =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {SIZE}\nproperty char x\nproperty char y\nproperty char z\n")
            .into_bytes();
    let faces = points.len() + b"element face 349525\nproperty list char char vertex_index\nend_header\n".len();
    points.extend(b"element face 349525\nproperty list char char vertex_index\nend_header\n");
    points.resize(faces + 3 * SIZE, 1);
    points.extend([3, 0, 1, 2].repeat(349_525));
    let mut polygons = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".repeat(40);
    (0..SIZE / 200).for_each(|_| polygons.extend([b"f".to_vec(), b" 12 45 78".repeat(22), b"\n".to_vec()].concat()));
    let mut smooth = b"v 0 0 0\n".repeat(SIZE / 16);
    smooth.extend(b"s 1\n");
    (0..SIZE / 24).for_each(|at| smooth.extend(format!("f {} {} {}\n", 1 + at, 2 + at, 3 + at).bytes()));
    let names: Vec<u8> = (0..SIZE / 20).flat_map(|at| format!("usemtl {at}\nf 1 2 3\n").into_bytes()).collect();
    let mut bumpy = b"mtllib m.mtl\nusemtl wood\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n".to_vec();
    bumpy.extend(b"f 1/1 2/2 3/3\n".repeat(SIZE / 14));
    let materials = [b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec(), names].concat();
    vec![
        ("a.ply", points, BYTES_PER_BYTE),
        ("polygons.obj", polygons, BYTES_PER_BYTE),
        ("smooth.obj", smooth, BYTES_PER_BYTE),
        ("materials.obj", materials, BYTES_PER_BYTE),
        // Corners that share nothing, with tangents.
        ("bumpy.obj", bumpy, BYTES_PER_BYTE),
        // Three indices of one byte are three vertices of 72 bytes, which exist three times while they move into the world.
        ("flat.glb", flat_mesh(SIZE), 4 * BYTES_PER_BYTE),
        // 341 texels for a byte, each of which takes 4 bytes encoded, again while the list grows, and 12 as a colour.
        ("flat.hdr", flat_panorama(), 1 << 13),
    ]
}

// Kills: time that grows with the square of a file, and memory beyond the cap for files whose every byte is used.
#[test]
fn dense_files_keep_the_cap() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("m.mtl"), samples::MTL).expect("written");
    fs::write(folder.path().join("a.png"), samples::png()).expect("written");
    for (name, bytes, factor) in dense() {
        let path = folder.path().join(name);
        fs::write(&path, &bytes).expect("written");
        let start = Instant::now();
        let (result, most) = most_held(|| match name.ends_with("hdr") {
            true => scene::load_environment(&path).map(|(environment, _)| environment.texels.len()),
            false => scene::load(&path).map(|scene| scene.triangles.len()),
        });
        println!("{name}: {} bytes, {result:?}, {most} bytes are held, {:?}", bytes.len(), start.elapsed());
        assert!(result.is_ok() && start.elapsed() < LONGEST, "{name}: {result:?} {:?}", start.elapsed());
        assert!(most <= FREE_BYTES + factor * bytes.len(), "{name}: {most} for {}", bytes.len());
    }
}
