//! What is wrong with a command line, on one line.

use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Clap's text without its frame: what is wrong, what may be meant, and where to read on. A file that stands where no argument is
/// taken comes from a shell that expanded a pattern; then that is said.
pub(super) fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let says = text.split("\n\nUsage:").next().unwrap_or_default().split("\n\nFor more information").next().unwrap_or_default();
    let says = says.strip_prefix("error: ").unwrap_or(says);
    let parts: Vec<&str> = says.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let mut line = parts.first().copied().unwrap_or_default().to_owned();
    for pair in parts.windows(2) {
        // A list follows its heading, a tip what it is about.
        line.push_str(match (pair[0].ends_with(':'), pair[1].starts_with("tip:") || pair[1].starts_with('[')) {
            (_, true) => "; ",
            (true, false) => " ",
            (false, false) => ", ",
        });
        line.push_str(pair[1]);
    }
    if is_expanded_pattern(error) {
        return format!("{line}; did the shell expand a pattern? Put it in quotes, such as --left 'left*.png'");
    }
    format!("{line}; see '{} --help'", program(&text))
}

/// The command as clap's usage names it: `halcyon rig`.
fn program(text: &str) -> String {
    let usage = text.split("Usage: ").nth(1).unwrap_or("halcyon").lines().next().unwrap_or("halcyon");
    let words = usage.split_whitespace().take_while(|word| word.chars().all(|c| c.is_ascii_lowercase() || c == '-'));
    words.take_while(|word| !word.starts_with('-')).collect::<Vec<_>>().join(" ")
}

fn is_expanded_pattern(error: &clap::Error) -> bool {
    let Some(ContextValue::String(argument)) = error.get(ContextKind::InvalidArg) else { return false };
    error.kind() == ErrorKind::UnknownArgument && !argument.starts_with('-') && Path::new(argument).is_file()
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::Cli;

    fn line(arguments: &[&str]) -> String {
        let error = Cli::try_parse_from([&["halcyon"], arguments].concat()).unwrap_err();
        let line = one_line(&error);
        assert!(!line.contains('\n') && !line.contains("Usage:"), "{line}");
        line
    }

    #[test]
    fn every_mistake_is_one_line_that_says_where_to_read_on() {
        let missing = line(&["rig"]);
        assert!(
            missing.contains("--fov-deg <DEG>, --width <PX>") && missing.ends_with("see 'halcyon rig --help'"),
            "{missing}"
        );
        let tip = line(&["features", "--lft", "a.png"]);
        assert!(tip.contains("unexpected argument '--lft'") && tip.contains("; tip: ") && tip.contains("'--left'"), "{tip}");
        let value = line(&["rig", "--width", "wide"]);
        assert!(value.contains("invalid value 'wide' for '--width <PX>'"), "{value}");
        let choice = line(&["reconstruct", "--mesh-of", "sand"]);
        assert!(choice.contains("'sand'") && choice.contains("cloud, grid"), "{choice}");
        assert!(line(&["frobnicate"]).contains("unrecognized subcommand"));
    }

    #[test]
    fn files_where_no_argument_is_taken_come_from_a_pattern_without_quotes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        std::fs::write(at("left2.png"), "").unwrap();
        let shell = line(&["calibrate", "--left", &at("left1.png"), &at("left2.png"), "--right", &at("right1.png")]);
        assert!(shell.contains("left2.png") && shell.contains("Put it in quotes"), "{shell}");
        let no_file = line(&["calibrate", "--left", &at("left1.png"), &at("left3.png")]);
        assert!(!no_file.contains("quotes"), "{no_file}");
    }
}
