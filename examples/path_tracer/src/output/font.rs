//! Letters of 5 x 9 pixels, two of them below the line, for captions within pictures.
//!
//! Key decision: the letters are drawn in a text file, where they can be seen and changed. It holds printable ASCII alone; everything else
//! shows as a question mark.

/// Pixels from one letter to the next.
pub(super) const ADVANCE: u32 = 6;
/// Pixels of a letter's height.
pub(super) const HEIGHT: u32 = 9;

/// Bands of sixteen letters side by side, beginning with the space.
const LETTERS: &str = include_str!("font.txt");
const BAND: u32 = 16;

/// True where a letter has ink; `x` below [`ADVANCE`], `y` below [`HEIGHT`].
fn is_inked(letter: char, x: u32, y: u32) -> bool {
    let letter = if letter.is_ascii_graphic() || letter == ' ' { letter } else { '?' };
    let index = u32::from(letter) - u32::from(' ');
    let line = LETTERS.lines().nth((index / BAND * HEIGHT + y) as usize);
    line.and_then(|line| line.as_bytes().get((index % BAND * ADVANCE + x) as usize)) == Some(&b'#')
}

/// The inked pixels of a line of text, from its upper left corner.
pub(super) fn ink(text: &str) -> impl Iterator<Item = (u32, u32)> {
    text.chars().zip(0u32..).flat_map(|(letter, place)| {
        let pixels = (0..HEIGHT).flat_map(|y| (0..ADVANCE).map(move |x| (x, y)));
        pixels.filter(move |&(x, y)| is_inked(letter, x, y)).map(move |(x, y)| (place * ADVANCE + x, y))
    })
}

/// The text in lines of at most `most` letters, broken at spaces where there are any.
pub(super) fn wrap(text: &str, most: usize) -> Vec<String> {
    let most = most.max(1);
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let mut rest: Vec<char> = word.chars().collect();
        while !rest.is_empty() {
            let last = lines.last_mut().map_or(0, |line| line.chars().count());
            let gap = usize::from(last > 0);
            if last + gap + rest.len() <= most || last == 0 {
                let taken: String = rest.drain(..rest.len().min(most)).collect();
                if let Some(line) = lines.last_mut() {
                    line.push_str(&" ".repeat(gap));
                    line.push_str(&taken);
                }
            } else {
                lines.push(String::new());
            }
        }
    }
    lines.retain(|line| !line.is_empty());
    lines
}

/// A path in at most `most` letters: the last part alone when the whole is too long, without its middle when even that is.
pub(super) fn shorten(path: &str, most: usize) -> String {
    let n = |text: &str| text.chars().count();
    let name = if n(path) <= most { path } else { path.rsplit(['/', '\\']).next().unwrap_or(path) };
    if n(name) <= most {
        return String::from(name);
    }
    let kept = most.saturating_sub(2);
    let tail = kept / 2;
    let head: String = name.chars().take(kept - tail).collect();
    let tail: String = name.chars().skip(n(name) - tail).collect();
    format!("{head}..{tail}").chars().take(most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: a letter that is missing, drawn twice or cut off, bands in another order, letters that touch.
    #[test]
    fn every_letter_has_a_shape_of_its_own() {
        let shape = |letter: char| ink(&letter.to_string()).collect::<Vec<_>>();
        let mut shapes: Vec<_> = (' '..='~').map(shape).collect();
        assert!(shapes.iter().flatten().all(|&(x, y)| x < ADVANCE - 1 && y < HEIGHT));
        assert_eq!(shapes.iter().filter(|shape| shape.is_empty()).count(), 1);
        shapes.sort();
        shapes.dedup();
        assert_eq!(shapes.len(), 95);
        assert_eq!(shape('-'), (0..5).map(|x| (x, 3)).collect::<Vec<_>>());
        assert_eq!(shape('\u{e9}'), shape('?'));
        assert_eq!(ink("l-").filter(|&(x, _)| x >= ADVANCE).count(), 5);
    }

    // Kills: words that are lost at the end of a line, an endless loop for a word longer than a line, a line that is too long.
    #[test]
    fn texts_are_broken_into_lines() {
        assert_eq!(wrap("one two  three", 7), ["one two", "three"]);
        assert_eq!(wrap("abcdefgh i", 3), ["abc", "def", "gh", "i"]);
        assert_eq!(wrap("no abcdefgh", 4), ["no", "abcd", "efgh"]);
        assert!(wrap(" ", 5).is_empty() && wrap("ab", 0) == ["a", "b"]);
    }

    // Kills: a name whose end, which tells neighbours apart, is cut off; a caption that is too long.
    #[test]
    fn paths_are_shortened() {
        assert_eq!(shorten("a/b.glb", 7), "a/b.glb");
        assert_eq!(shorten("folder/b.glb", 7), "b.glb");
        assert_eq!(shorten("folder/mode_3.gltf", 10), "mode..gltf");
        for most in 0..12 {
            assert!(shorten("x/abcdefghijklmnop", most).len() <= most, "{most}");
        }
    }
}
