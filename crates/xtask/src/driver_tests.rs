//! The decision about installing a driver, for machines we do not have.

use super::*;

fn debian(version: &str) -> Situation {
    Situation {
        system: "linux",
        release: OsRelease::parse(&format!("ID=debian\nVERSION_ID=\"{version}\"\n")),
        sources: vec![Source { uri: "http://mirror.example/debian".into(), suite: "bookworm".into() }],
        root: true,
        sudo: false,
        interactive: false,
        agreed: true,
    }
}

fn lines(decision: &Decision) -> Vec<String> {
    match decision {
        Decision::Install(tasks) | Decision::AskThenInstall(tasks) | Decision::Refuse { tasks, .. } => {
            tasks.iter().map(ToString::to_string).collect()
        }
        Decision::ByHand(_) => Vec::new(),
    }
}

/// Kills: Debian 12 left with its own Mesa 22, and a source that points past the mirror which the machine uses.
#[test]
fn debian_12_takes_the_backports_of_its_own_mirror() {
    let decision = decide(&debian("12"));
    assert!(matches!(decision, Decision::Install(_)));
    assert_eq!(
        lines(&decision),
        [
            "printf 'Types: deb\\nURIs: http://mirror.example/debian\\nSuites: bookworm-backports\\nComponents: main\\n\
             Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\\n' | tee /etc/apt/sources.list.d/wavepool-backports.sources",
            "apt-get update",
            "env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends -o DPkg::Lock::Timeout=300 \
             -t bookworm-backports mesa-vulkan-drivers libvulkan1",
        ]
    );
}

/// Kills: a second source file written although some list offers the backports already.
#[test]
fn backports_are_added_only_when_absent() {
    let mut situation = debian("12");
    situation.sources.push(Source { uri: "http://other.example/debian".into(), suite: "bookworm-backports".into() });
    let lines = lines(&decide(&situation));
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[1].contains("-t bookworm-backports"));
}

/// Kills: backports asked for where they do not exist (Debian 13, Ubuntu, their derivatives, Debian unstable).
#[test]
fn newer_systems_take_the_plain_package() {
    let mut situation = debian("13");
    let texts = [
        "ID=debian\nVERSION_ID=13\n",
        "ID=debian\n",
        "ID=ubuntu\nID_LIKE=debian\nVERSION_ID=\"24.04\"\n",
        "ID=linuxmint\nID_LIKE=\"ubuntu debian\"\n",
    ];
    for text in texts {
        situation.release = OsRelease::parse(text);
        let lines = lines(&decide(&situation));
        assert_eq!(lines.len(), 2, "{text}: {lines:?}");
        assert!(lines[1].ends_with("mesa-vulkan-drivers libvulkan1") && !lines[1].contains("backports"), "{text}: {lines:?}");
    }
}

/// Kills: apt called with the wrong rights, a password question where nobody can answer it, and `sudo` shown to somebody without it.
#[test]
fn sudo_only_where_it_is_needed_and_there() {
    for (root, sudo, interactive, agreed, prefix) in [
        (true, true, true, false, ""),
        (false, true, true, false, "sudo "),
        (false, true, true, true, "sudo "),
        (false, true, false, true, "sudo -n "),
        (false, true, false, false, "sudo "),
        (false, false, true, false, ""),
    ] {
        let lines = lines(&decide(&Situation { root, sudo, interactive, agreed, ..debian("12") }));
        assert!(lines[0].contains(&format!("| {prefix}tee ")), "{lines:?}");
        assert_eq!(lines[1], format!("{prefix}apt-get update"));
        assert!(lines[2].starts_with(&format!("{prefix}env ")), "{lines:?}");
    }
}

/// Kills: an installation without consent, a question to nobody, `--yes` that still asks, and a user without rights told to wait.
#[test]
fn nothing_runs_without_consent() {
    for (root, sudo, interactive, agreed, expected) in [
        (true, false, false, true, "install"),
        (true, false, true, true, "install"),
        (false, true, false, true, "install"),
        (true, false, true, false, "ask"),
        (false, true, true, false, "ask"),
        (true, false, false, false, "refuse"),
        (false, true, false, false, "refuse"),
        (false, false, true, true, "refuse"),
        (false, false, true, false, "refuse"),
    ] {
        let found = match decide(&Situation { root, sudo, interactive, agreed, ..debian("13") }) {
            Decision::Install(_) => "install",
            Decision::AskThenInstall(_) => "ask",
            Decision::Refuse { tasks, .. } => {
                assert_eq!(tasks.len(), 2, "a refusal still shows the commands");
                "refuse"
            }
            Decision::ByHand(_) => "by hand",
        };
        assert_eq!(found, expected, "root {root}, sudo {sudo}, interactive {interactive}, agreed {agreed}");
    }
}

/// Kills: apt called where there is none, or on a Debian too old for the packages.
#[test]
fn other_systems_are_told_what_to_do() {
    for (system, release, wanted) in [
        ("macos", "", "Metal"),
        ("windows", "", "driver"),
        ("linux", "ID=fedora\nPRETTY_NAME=\"Fedora 42\"\n", "dnf install mesa-vulkan-drivers"),
        ("linux", "ID=arch\n", "pacman -S vulkan-swrast"),
        ("linux", "ID=debian\nVERSION_ID=11\n", "lavapipe"),
        ("linux", "", "lavapipe"),
    ] {
        let situation = Situation { system, release: OsRelease::parse(release), ..debian("12") };
        let Decision::ByHand(advice) = decide(&situation) else { panic!("{system} {release}: something would be installed") };
        assert!(advice.contains(wanted), "{system} {release}: {advice}");
    }
}
