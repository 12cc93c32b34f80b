//! `*`, `?` and `[…]` in paths, expanded by us where the shell did not, in natural order: `left2` before `left10`.

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

/// The files that match `pattern`, in natural order. `*` stands for any characters but `/`, `?` for one of them, `[1-3a]` for one of
/// a set, `[!1]` for one that is not in it. A file of exactly this name comes before any pattern; without wildcards the name need
/// not exist (reading it will say so).
///
/// # Errors
/// [`GlobError`] where nothing matches or a folder cannot be listed.
pub fn glob(pattern: &str) -> Result<Vec<PathBuf>, GlobError> {
    let is_pattern = |text: &str| text.contains(['*', '?', '[']);
    // `left[12].png` may well be a name: browsers and cameras make such.
    if !pattern.is_empty() && (!is_pattern(pattern) || Path::new(pattern).exists()) {
        return Ok(vec![PathBuf::from(pattern)]);
    }
    let mut found = vec![if pattern.starts_with('/') { PathBuf::from("/") } else { PathBuf::new() }];
    for part in pattern.split('/').filter(|part| !part.is_empty()) {
        let mut next = Vec::new();
        for folder in found {
            if !is_pattern(part) || folder.join(part).is_dir() {
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
                if matches(&parts(part), &text) && (!text.starts_with('.') || part.starts_with('.')) {
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

/// One place of a pattern.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    /// `*`
    Any,
    /// `?`
    One,
    /// `[…]`: ranges of characters, and whether the character must be in none of them.
    Set(Vec<(char, char)>, bool),
    /// This character.
    Just(char),
}

impl Part {
    fn fits(&self, c: char) -> bool {
        match self {
            Self::Any => false,
            Self::One => true,
            Self::Set(ranges, is_negated) => ranges.iter().any(|(low, high)| (*low..=*high).contains(&c)) != *is_negated,
            Self::Just(own) => *own == c,
        }
    }
}

/// Takes a pattern apart. A `[` without its `]` stands for itself, as in a shell.
fn parts(pattern: &str) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut rest = pattern;
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        parts.push(match c {
            '*' => Part::Any,
            '?' => Part::One,
            '[' => match set(rest) {
                Some((set, after)) => {
                    rest = after;
                    set
                }
                None => Part::Just('['),
            },
            other => Part::Just(other),
        });
    }
    parts
}

/// The set that `text` starts with, behind its `[`, and what follows it. A `]` right at the start is in the set.
fn set(text: &str) -> Option<(Part, &str)> {
    let (is_negated, body) = match text.strip_prefix(['!', '^']) {
        Some(body) => (true, body),
        None => (false, text),
    };
    let first = body.chars().next()?.len_utf8();
    let end = first + body[first..].find(']')?;
    let inner: Vec<char> = body[..end].chars().collect();
    let (mut ranges, mut at) = (Vec::new(), 0);
    while let Some(low) = inner.get(at).copied() {
        match (inner.get(at + 1), inner.get(at + 2)) {
            (Some('-'), Some(high)) => {
                ranges.push((low, *high));
                at += 3;
            }
            _ => {
                ranges.push((low, low));
                at += 1;
            }
        }
    }
    Some((Part::Set(ranges, is_negated), &body[end + 1..]))
}

/// Linear in practice and never worse than quadratic: only the last `*` is ever tried again.
fn matches(pattern: &[Part], text: &str) -> bool {
    let text: Vec<char> = text.chars().collect();
    let (mut p, mut t) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        match pattern.get(p) {
            Some(Part::Any) => {
                star = Some((p, t));
                p += 1;
            }
            Some(part) if part.fits(text[t]) => (p, t) = (p + 1, t + 1),
            _ => match star {
                Some((at, from)) => {
                    star = Some((at, from + 1));
                    (p, t) = (at + 1, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|part| *part == Part::Any)
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
            assert_eq!(matches(&parts(pattern), text), expected, "{pattern} {text}");
        };
        check("left*.jpg", "left01.jpg", true);
        check("left??.jpg", "left01.jpg", true);
        check("left?.jpg", "left01.jpg", false);
        check("*a*b", "xaxbxab", true);
        check("*a*b", "xaxbxa", false);
        check("*", "", true);
        check("left?.jpg", "leftµ.jpg", true);
        check("left[12].jpg", "left2.jpg", true);
        check("left[12].jpg", "left3.jpg", false);
        check("left[0-2a]*.jpg", "left1x.jpg", true);
        check("left[0-2a]*.jpg", "lefta.jpg", true);
        check("left[!0-2].jpg", "left1.jpg", false);
        check("left[!0-2].jpg", "left7.jpg", true);
        check("left[]-].jpg", "left].jpg", true);
        check("left[12.jpg", "left[12.jpg", true);
        check("left[2-1].jpg", "left1.jpg", false);
        check("[", "[", true);
        check("[]", "[]", true);
    }

    #[test]
    fn a_file_of_that_very_name_comes_before_the_pattern() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let found = |name: &str| glob(at(name).to_str().unwrap()).unwrap();
        for name in ["left1.png", "left2.png", "left[12].png"] {
            std::fs::write(at(name), "").unwrap();
        }
        assert_eq!(found("left[12].png"), [at("left[12].png")]);
        std::fs::remove_file(at("left[12].png")).unwrap();
        assert_eq!(found("left[12].png"), [at("left1.png"), at("left2.png")]);
        // A folder's name, too, may look like a pattern.
        std::fs::create_dir(at("run[1]")).unwrap();
        std::fs::write(at("run[1]/a.png"), "").unwrap();
        assert_eq!(found("run[1]/*.png"), [at("run[1]/a.png")]);
    }

    #[test]
    fn ten_comes_after_two() {
        let mut names = vec!["l10.png", "l2.png", "l1.png", "l02b.png", "k3.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["k3.png", "l1.png", "l2.png", "l02b.png", "l10.png"]);
    }
}
