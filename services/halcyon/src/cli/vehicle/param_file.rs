//! Files of parameters: `NAME,VALUE` (Mission Planner), `NAME VALUE` (MAVProxy), and QGroundControl's five columns (vehicle,
//! component, name, value, type). `#` begins a comment.

use std::collections::BTreeMap;

/// The values in a file, by name.
///
/// # Errors
/// One line that says which line of the file is wrong, and how.
pub(super) fn read(text: &str) -> Result<BTreeMap<String, f64>, String> {
    let mut values = BTreeMap::new();
    for (at, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let wrong = |what: &str| format!("line {}: {what}", at + 1);
        let columns: Vec<&str> =
            line.split(|c: char| c == ',' || c.is_whitespace()).filter(|column| !column.is_empty()).collect();
        let (name, value) = match columns[..] {
            [name, value] | [_, _, name, value, _] => (name, value),
            _ => return Err(wrong("expected NAME,VALUE or NAME VALUE, or QGroundControl's five columns")),
        };
        halcyon_model::ParameterName::new(name).map_err(|error| wrong(&error.to_string()))?;
        let number: f64 = value.parse().map_err(|_| wrong(&format!("{value:?} is not a number")))?;
        if !number.is_finite() {
            return Err(wrong(&format!("{value:?} is not finite")));
        }
        if values.insert(name.to_owned(), number).is_some_and(|before| before != number) {
            return Err(wrong(&format!("{name} is there twice, with different values")));
        }
    }
    Ok(values)
}

/// The file's text, in the form that most programs read.
pub(super) fn write(values: &[(String, f64)]) -> String {
    values.iter().map(|(name, value)| format!("{name},{value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_three_forms_are_read() {
        let check = |text: &str| {
            let values = read(text).unwrap();
            assert_eq!(values, BTreeMap::from([("RTL_ALT".into(), 1500.0), ("WPNAV_SPEED".into(), 450.5)]), "{text}");
        };
        check("RTL_ALT,1500\nWPNAV_SPEED,450.5\n");
        check("#NOTE: saved by Mission Planner\r\nRTL_ALT,1500.000000\r\nWPNAV_SPEED,450.5 # slow\r\n");
        check("RTL_ALT          1500.000000\nWPNAV_SPEED      450.500000\n\n");
        check("# Onboard parameters for Vehicle 1\n#\n1\t1\tRTL_ALT\t1500\t6\n1\t1\tWPNAV_SPEED\t450.5\t9\n");
        check(&write(&[("WPNAV_SPEED".into(), 450.5), ("RTL_ALT".into(), 1500.0)]));
    }

    #[test]
    fn what_is_wrong_is_named_by_its_line() {
        for (text, words) in [
            ("A,1\nB\n", "line 2"),
            ("A,much", "\"much\""),
            ("A,nan", "finite"),
            ("A B C,1,2,3", "line 1"),
            ("A,1\nA,2", "twice"),
            ("A-B,1", "parameter name"),
        ] {
            let problem = read(text).unwrap_err();
            assert!(problem.contains(words), "{problem}");
        }
    }
}
