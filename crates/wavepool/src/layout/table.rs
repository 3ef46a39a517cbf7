//! The table `leaves x stages` as data, and as text.
//!
//! **Invariant:** the text is printed from the rows; whatever it shows, a program can read.

use super::{ArrayPlanes, Layout, Storage};

/// One stored word of the state, one leaf that is never stored, or an array behind accessors; and who moves it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Row {
    /// As WGSL reaches it from the state, without the leading dot: `origin.x`, or `direction` in a packed format,
    /// `vertices[8]` for an array.
    pub leaf: String,
    /// How it is kept.
    pub storage: Storage,
    /// Where; `None` when it never outlives a kernel. Rows may share a plane.
    pub plane: Option<u32>,
    /// Bytes that it takes per lane.
    pub bytes: u32,
    /// True when a newly assigned block stores it; arrays are zeroed.
    pub is_born: bool,
    /// In the order of the stages.
    pub stages: Vec<Moves>,
}

/// What the kernel of one stage does with one row, per lane and step; with an array, per call of an accessor.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Moves {
    /// The stage.
    pub stage: String,
    /// Loaded before the stage runs.
    pub is_loaded: bool,
    /// Loaded by lanes that finish.
    pub is_late: bool,
    /// Loaded by lanes killed with their block.
    pub is_killed: bool,
    /// Stored by lanes that continue.
    pub is_stored: bool,
    /// Bytes read by a lane that continues.
    pub bytes_read: u32,
    /// Bytes written by a lane that continues.
    pub bytes_written: u32,
}

impl Moves {
    /// `r` loaded, `f` loaded when finishing, `k` loaded when killed with the block, `w` stored.
    pub fn marks(&self) -> String {
        let marks = [(self.is_loaded, 'r'), (self.is_late, 'f'), (self.is_killed, 'k'), (self.is_stored, 'w')];
        marks.iter().filter(|(is_there, _)| *is_there).map(|(_, mark)| *mark).collect()
    }
}

impl Layout {
    /// One row per stored word, and one per leaf that is not stored, in order of declaration.
    pub fn rows(&self) -> Vec<Row> {
        let row = |cell: &super::Cell| {
            let leaf = cell.leaves.start;
            let stages = self.kernels.iter().map(|kernel| {
                let [is_loaded, is_late, is_killed, is_stored] =
                    [&kernel.load, &kernel.load_late, &kernel.load_killed, &kernel.store].map(|set| set.contains(leaf));
                let (bytes_read, bytes_written) = (4 * u32::from(is_loaded), 4 * u32::from(is_stored));
                Moves { stage: kernel.stage.clone(), is_loaded, is_late, is_killed, is_stored, bytes_read, bytes_written }
            });
            Row {
                leaf: cell.path.trim_start_matches('.').to_owned(),
                storage: cell.storage,
                plane: self.plane_of[leaf],
                bytes: self.plane_of[leaf].map_or(0, |_| 4),
                is_born: self.generate.contains(leaf),
                stages: stages.collect(),
            }
        };
        self.cells.iter().map(row).chain(self.arrays.iter().map(|array| self.array_row(array))).collect()
    }

    fn array_row(&self, array: &ArrayPlanes) -> Row {
        let used_by = |name: &str| array.users.iter().find(|(user, ..)| user == name).map_or((false, false), |user| (user.1, user.2));
        let size = 4 * array.cells.len() as u32;
        let stages = self.kernels.iter().map(|kernel| {
            let (is_loaded, is_stored) = used_by(&kernel.stage);
            let (bytes_read, bytes_written) = (size * u32::from(is_loaded), size * u32::from(is_stored));
            Moves {
                stage: kernel.stage.clone(),
                is_loaded,
                is_late: kernel.ends && used_by("finish").0,
                is_killed: false,
                is_stored,
                bytes_read,
                bytes_written,
            }
        });
        Row {
            leaf: format!("{}[{}]", array.name, array.length),
            storage: Storage::Word,
            plane: array.plane,
            bytes: array.plane.map_or(0, |_| 4 * array.planes()),
            is_born: array.plane.is_some(),
            stages: stages.collect(),
        }
    }

    /// The table `leaves x stages`: `r` loaded, `f` loaded when finishing, `k` loaded when killed with the block, `w` stored. A column
    /// tells the formats, where there are any.
    pub fn table(&self) -> String {
        let rows = self.rows();
        let width = rows.iter().map(|row| row.leaf.len()).max().unwrap_or(0).max(14);
        let format = if rows.iter().any(|row| row.storage != Storage::Word) { 12 } else { 0 };
        let head = |name: &str, storage: &str, plane: &str, born: &str| {
            let storage = if format > 0 { format!(" {storage:format$}") } else { String::new() };
            format!("{name:width$}{storage} {plane:>5} {born:>9}")
        };
        let column = |stage: &str, text: &str| format!(" {text:>0$}", stage.len().max(3));
        let mut text = head("leaf", "storage", "plane", "generate");
        text.extend(self.kernels.iter().map(|kernel| column(&kernel.stage, &kernel.stage)));
        for row in &rows {
            let plane = row.plane.map_or_else(|| "-".into(), |plane| plane.to_string());
            let storage = if row.storage == Storage::Word { "" } else { row.storage.name() };
            text.push('\n');
            text.push_str(&head(&row.leaf, storage, &plane, if row.is_born { "w" } else { "" }));
            text.extend(row.stages.iter().map(|moves| column(&moves.stage, &moves.marks())));
            if row.bytes > 4 {
                text.push_str(&format!("  {} bytes, by element", row.bytes));
            }
        }
        text.push('\n');
        let born = 4 + 4 * self.words(&self.generate);
        text.push_str(&head("bytes per lane", "", &self.bytes_per_lane().to_string(), &born.to_string()));
        for kernel in &self.kernels {
            let (read, written) = kernel.bytes();
            text.push_str(&column(&kernel.stage, &format!("{read}/{written}")));
        }
        if self.planes() < self.planes_unshared() {
            let (planes, unshared, least) = (self.planes(), self.planes_unshared(), self.planes_at_least());
            text.push_str(&format!("\n{planes} planes; {unshared} without sharing, {least} at the busiest border"));
        }
        if self.item_planes > 0 {
            text.push_str(&format!("\n{} of them say which item a lane walks, and which lanes come next", self.item_planes));
        }
        text
    }
}
