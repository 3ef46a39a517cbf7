//! What a chart says in words: names of tiles, the queue, what happened.
//!
//! Key decision: the queue is what was taken from it later, in that order, so it needs no second account of the order's rules.

use super::{Chart, Span};

impl Chart {
    /// The tile's name: a digit or a letter while these suffice, else its number; with the pass as index when there are several.
    pub fn name(&self, span: &Span) -> String {
        let mut name = match char::from_digit(span.tile, LETTERS) {
            Some(letter) if self.has_letters => letter.to_ascii_uppercase().to_string(),
            _ => span.tile.to_string(),
        };
        if self.has_passes {
            name.extend(span.pass_index.to_string().chars().filter_map(|c| char::from_u32('\u{2080}' as u32 + c.to_digit(10)?)));
        }
        name
    }

    /// What waits behind a step, in the order in which it was taken later.
    pub(super) fn queue(&self, step: u32) -> &[Span] {
        // Single items wait in a queue that nobody wants to read.
        let taken = if self.is_mixed { self.spans.len() } else { self.spans.partition_point(|span| span.first <= step) };
        &self.spans[taken..]
    }

    /// What the tick before a step has found and done, in words, with `most` names of each kind.
    pub(super) fn happened(&self, step: u32, most: usize) -> String {
        if self.is_mixed {
            let lanes = self.rows().get(step as usize).map_or(0, |row| row.new_lanes);
            return if lanes > 0 { format!("{lanes} lanes take items") } else { String::new() };
        }
        let list = |spans: &mut dyn Iterator<Item = &Span>| listed(spans.map(|span| self.name(span)), most);
        let died = list(&mut self.spans.iter().filter(|span| span.end() == step));
        let begun = list(&mut self.spans.iter().filter(|span| span.first == step));
        let last = if !begun.is_empty() && self.queue(step).is_empty() { "; none left" } else { "" };
        match (died.is_empty(), begun.is_empty()) {
            _ if step == 0 => format!("first fill{last}"),
            (true, true) => String::new(),
            (true, false) => format!("begin: {begun}{last}"),
            (false, true) => format!("died: {died}"),
            (false, false) => format!("died: {died}; begin: {begun}{last}"),
        }
    }
}

/// Tiles that have a digit or a letter.
pub(super) const LETTERS: u32 = 36;

/// The first `most` of them, and how many more there are.
pub(super) fn listed(names: impl Iterator<Item = String>, most: usize) -> String {
    let mut names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(most);
    names.truncate(most);
    if more > 0 {
        names.push(format!("+{more}"));
    }
    names.join(" ")
}
