//! What apt's source lists say: which suites are switched on, and from which mirror.
//!
//! Key decision: both notations are read (one line per source, and deb822 paragraphs), because Debian's installer writes the first and
//! its containers the second. Nothing is ever written back.

/// One switched-on source of binary packages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Source {
    /// Where the packages come from.
    pub(crate) uri: String,
    /// `bookworm`, `bookworm-backports`, ...
    pub(crate) suite: String,
}

/// Reads the text of a `.list` file.
pub(crate) fn parse_list(text: &str) -> Vec<Source> {
    let mut sources = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let Some(rest) = line.strip_prefix("deb ").or_else(|| line.strip_prefix("deb\t")) else { continue };
        // Options in square brackets stand between the word `deb` and the address.
        let rest = rest.trim_start();
        let rest = if rest.starts_with('[') { rest.split_once(']').map_or("", |(_, after)| after) } else { rest };
        let mut words = rest.split_whitespace();
        if let (Some(uri), Some(suite)) = (words.next(), words.next()) {
            sources.push(Source { uri: uri.to_owned(), suite: suite.to_owned() });
        }
    }
    sources
}

/// Reads the text of a deb822 `.sources` file.
pub(crate) fn parse_deb822(text: &str) -> Vec<Source> {
    let visible: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    visible.split(|line| line.trim().is_empty()).flat_map(parse_paragraph).collect()
}

fn parse_paragraph(lines: &[&str]) -> Vec<Source> {
    let field = |name: &str| -> Vec<&str> {
        let Some(start) = lines.iter().position(|line| line.split_once(':').is_some_and(|(key, _)| key.eq_ignore_ascii_case(name))) else {
            return Vec::new();
        };
        let first = lines[start].split_once(':').map_or("", |(_, value)| value);
        let folded = lines[start + 1..].iter().take_while(|line| line.starts_with([' ', '\t'])).copied();
        std::iter::once(first).chain(folded).flat_map(str::split_whitespace).collect()
    };
    let off = field("Enabled").first().is_some_and(|word| word.eq_ignore_ascii_case("no"));
    if off || !field("Types").contains(&"deb") {
        return Vec::new();
    }
    let suites = field("Suites");
    field("URIs").iter().flat_map(|uri| suites.iter().map(|suite| Source { uri: (*uri).to_owned(), suite: (*suite).to_owned() })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(uri: &str, suite: &str) -> Source {
        Source { uri: uri.into(), suite: suite.into() }
    }

    /// Kills: comments and source packages taken for sources, options in brackets taken for the address.
    #[test]
    fn one_line_sources() {
        let text = "# deb http://a.example x main\ndeb-src http://a.example y main\n\
                    deb [arch=amd64 signed-by=/k.gpg] http://b.example/debian bookworm main # why\ndeb http://c.example z-backports main\n";
        assert_eq!(parse_list(text), [source("http://b.example/debian", "bookworm"), source("http://c.example", "z-backports")]);
    }

    /// Kills: a switched-off paragraph counted, folded lines lost, a comment that ends a paragraph.
    #[test]
    fn deb822_sources() {
        let text = "Types: deb deb-src\n# a comment\nURIs: http://a.example/debian\nSuites: bookworm\n bookworm-updates\nComponents: main\n\n\
                    Enabled: no\nTypes: deb\nURIs: http://a.example/debian\nSuites: bookworm-backports\n\n\
                    Types: deb-src\nURIs: http://a.example/debian\nSuites: sid\n";
        let expected = [source("http://a.example/debian", "bookworm"), source("http://a.example/debian", "bookworm-updates")];
        assert_eq!(parse_deb822(text), expected);
    }
}
