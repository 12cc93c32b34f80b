//! `*` and `?` in paths, expanded by us where the shell did not, in natural order: `left2` before `left10`.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Why a pattern gave no files.
#[derive(Debug, thiserror::Error)]
pub enum GlobError {
    /// Nothing there.
    #[error("no file matches {pattern}")]
    NoMatch {
        /// The pattern.
        pattern: String,
    },
    /// A folder that cannot be listed.
    #[error("cannot list {}", folder.display())]
    List {
        /// The folder.
        folder: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
}

/// The files that match `pattern`, in natural order. `*` stands for any characters but `/`, `?` for one of them; a pattern
/// without either names one file, which need not exist (reading it will say so).
///
/// # Errors
/// [`GlobError`] where nothing matches or a folder cannot be listed.
pub fn glob(pattern: &str) -> Result<Vec<PathBuf>, GlobError> {
    let is_pattern = |text: &str| text.contains(['*', '?']);
    if !is_pattern(pattern) && !pattern.is_empty() {
        return Ok(vec![PathBuf::from(pattern)]);
    }
    let mut found = vec![if pattern.starts_with('/') { PathBuf::from("/") } else { PathBuf::new() }];
    for part in pattern.split('/').filter(|part| !part.is_empty()) {
        let mut next = Vec::new();
        for folder in found {
            if !is_pattern(part) {
                next.push(folder.join(part));
                continue;
            }
            let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
            let entries = match std::fs::read_dir(listed) {
                Ok(entries) => entries,
                // A file, or nothing, where the pattern wants a folder: no match, not a failure.
                Err(error) if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                    continue;
                }
                Err(source) => return Err(GlobError::List { folder, source }),
            };
            for entry in entries {
                let name = entry.map_err(|source| GlobError::List { folder: folder.clone(), source })?.file_name();
                let text = name.to_string_lossy();
                // As in a shell, a wildcard does not find hidden files.
                if matches(part.as_bytes(), text.as_bytes()) && (!text.starts_with('.') || part.starts_with('.')) {
                    next.push(folder.join(&name));
                }
            }
        }
        found = next;
    }
    found.retain(|path| path.is_file());
    if found.is_empty() {
        return Err(GlobError::NoMatch { pattern: pattern.into() });
    }
    found.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(found)
}

/// Linear in practice and never worse than quadratic: only the last `*` is ever tried again.
fn matches(pattern: &[u8], text: &[u8]) -> bool {
    let (mut p, mut t) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        match pattern.get(p) {
            Some(b'*') => {
                star = Some((p, t));
                p += 1;
            }
            Some(b'?') => (p, t) = (p + 1, t + 1),
            Some(byte) if *byte == text[t] => (p, t) = (p + 1, t + 1),
            _ => match star {
                Some((at, from)) => {
                    star = Some((at, from + 1));
                    (p, t) = (at + 1, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|byte| *byte == b'*')
}

/// Runs of digits compare as numbers, everything else as text.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    loop {
        let (Some(x), Some(y)) = (left.first(), right.first()) else { return left.len().cmp(&right.len()).then(a.cmp(b)) };
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let digits = |text: &[u8]| text.iter().take_while(|byte| byte.is_ascii_digit()).count();
            let (run_left, rest_left) = left.split_at(digits(left));
            let (run_right, rest_right) = right.split_at(digits(right));
            (left, right) = (rest_left, rest_right);
            let significant = |run: &'_ [u8]| run.iter().skip_while(|byte| **byte == b'0').copied().collect::<Vec<u8>>();
            let (run_left, run_right) = (significant(run_left), significant(run_right));
            run_left.len().cmp(&run_right.len()).then(run_left.cmp(&run_right))
        } else {
            (left, right) = (&left[1..], &right[1..]);
            x.cmp(y)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wildcards() {
        let check = |pattern: &str, text: &str, expected| {
            assert_eq!(matches(pattern.as_bytes(), text.as_bytes()), expected, "{pattern} {text}");
        };
        check("left*.jpg", "left01.jpg", true);
        check("left??.jpg", "left01.jpg", true);
        check("left?.jpg", "left01.jpg", false);
        check("*a*b", "xaxbxab", true);
        check("*a*b", "xaxbxa", false);
        check("*", "", true);
    }

    #[test]
    fn ten_comes_after_two() {
        let mut names = vec!["l10.png", "l2.png", "l1.png", "l02b.png", "k3.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["k3.png", "l1.png", "l2.png", "l02b.png", "l10.png"]);
    }
}
