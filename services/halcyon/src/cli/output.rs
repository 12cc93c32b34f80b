//! Results go to stdout, everything else to stderr.

use std::io::{IsTerminal as _, Write as _};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

/// Prints one JSON object.
pub(super) fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string_pretty(value)?)
}

/// Prints a line. A reader that has gone (`| head`) is no error.
pub(super) fn line(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// A line on stderr. Whoever has closed it does not want it.
pub(super) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Warnings go to stderr, beside JSON and beside text; JSON has them, too.
pub(super) fn warnings(texts: &[String]) {
    for text in texts {
        note(&format!("warning: {text}"));
    }
}

/// So many significant digits, in whatever size the number is; no exponent. What is less than a billionth is 0.
pub(super) fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{value}");
    }
    let leading = value.abs().log10().floor() as i32;
    if leading < -9 {
        return "0".to_owned();
    }
    let decimals = (digits - 1 - leading).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}

/// A progress bar on stderr; nothing where stderr is no terminal.
pub(super) fn bar(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} {eta}");
    let bar = ProgressBar::with_draw_target(None, target()).with_message(what);
    if let Ok(style) = style { bar.with_style(style) } else { bar }
}

/// One step of something long is done: above the bar, or as a line of its own where stderr is no terminal.
pub(super) fn step(bar: &ProgressBar, text: &str) {
    if std::io::stderr().is_terminal() {
        bar.println(text);
    } else {
        note(text);
    }
}

/// A spinner on stderr for what has no known length; nothing where stderr is no terminal.
pub(super) fn spinner() -> ProgressBar {
    let spinner = ProgressBar::with_draw_target(None, target());
    let spinner = match ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        Ok(style) => spinner.with_style(style),
        Err(_) => spinner,
    };
    if std::io::stderr().is_terminal() {
        spinner.enable_steady_tick(Duration::from_millis(200));
    }
    spinner
}

fn target() -> ProgressDrawTarget {
    if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
}

#[cfg(test)]
mod tests {
    use super::significant;

    #[test]
    fn digits_that_count_are_kept_at_any_size() {
        for (value, text) in [
            (0.000_123_456, "0.0001235"),
            (1.234_56, "1.235"),
            (123.456, "123.5"),
            (12_345.6, "12346"),
            (-0.05, "-0.05000"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(significant(value, 4), text);
        }
    }
}
