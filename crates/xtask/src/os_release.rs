//! Which Linux distribution this is, from the text of `/etc/os-release`.

/// What the file says of the distribution.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct OsRelease {
    /// `debian`, `ubuntu`, ...
    pub(crate) id: String,
    /// The distributions it descends from.
    pub(crate) id_like: Vec<String>,
    /// The major version, where the distribution has one.
    pub(crate) major: Option<u32>,
    /// For messages.
    pub(crate) pretty_name: String,
}

impl OsRelease {
    /// Reads the file's text; what is not there stays empty.
    pub(crate) fn parse(text: &str) -> Self {
        let mut release = Self::default();
        for line in text.lines() {
            let Some((key, value)) = line.trim().split_once('=') else { continue };
            let value = value.trim_matches(['"', '\'']);
            match key {
                "ID" => release.id = value.to_lowercase(),
                "ID_LIKE" => release.id_like = value.split_whitespace().map(str::to_lowercase).collect(),
                "VERSION_ID" => release.major = value.split('.').next().and_then(|major| major.parse().ok()),
                "PRETTY_NAME" => release.pretty_name = value.to_owned(),
                _ => {}
            }
        }
        release
    }

    /// True for the named distribution and for those that descend from it.
    pub(crate) fn descends_from(&self, id: &str) -> bool {
        self.id == id || self.id_like.iter().any(|like| like == id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kills: quotes kept as part of a value, `VERSION_ID="24.04"` read as no number, `ID_LIKE` taken for `ID`.
    #[test]
    fn values_are_read_with_and_without_quotes() {
        let debian = OsRelease::parse("PRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\nVERSION_ID=\"12\"\nID=debian\n");
        assert_eq!((debian.id.as_str(), debian.major), ("debian", Some(12)));
        assert_eq!(debian.pretty_name, "Debian GNU/Linux 12 (bookworm)");
        let mint = OsRelease::parse("ID=linuxmint\nID_LIKE=\"ubuntu debian\"\nVERSION_ID='22.1'\n");
        assert_eq!((mint.id.as_str(), mint.major), ("linuxmint", Some(22)));
        assert!(mint.descends_from("ubuntu") && mint.descends_from("debian") && !mint.descends_from("fedora"));
    }
}
