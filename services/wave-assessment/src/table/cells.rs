//! Cutting text into columns.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

use super::units::{is_unit, with_unit};

/// Lines that are looked at to find out how a table is written.
const SAMPLE_LINES: usize = 200;
/// Lines of words before the data; a text of more is no table.
const HEADER_LINES_MAX: usize = 100;
/// More readings than this are refused: two days at 1 kHz are fewer.
const ROWS_MAX: usize = 200_000_000;
/// More columns than any logger writes.
const COLUMNS_MAX: usize = 10_000;

/// Why a text is no table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Not text.
    #[error("the file is not text: byte {at} is no UTF-8")]
    NotText {
        /// Offset of the first bad byte.
        at: usize,
    },
    /// No line of numbers.
    #[error("there is no line of numbers in it")]
    Empty,
    /// A cell among the data that is neither a number nor missing.
    #[error("line {line}, column {column}: {text:?} is no number")]
    Cell {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What stands there, shortened.
        text: String,
    },
    /// A line with another number of cells.
    #[error("line {line} has {cells} cells, the lines before it {columns}")]
    Ragged {
        /// From 1.
        line: usize,
        /// Cells on it.
        cells: usize,
        /// Columns of the table.
        columns: usize,
    },
    /// Too large.
    #[error("the table has more than {ROWS_MAX} lines or {COLUMNS_MAX} columns")]
    TooLarge,
}

/// Columns of numbers; NaN is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    /// Columns of dates, whose numbers are seconds of Unix time.
    dated: Vec<bool>,
}

/// What separates cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Char(char),
    Blanks,
}

impl Separator {
    /// The most specific first: blanks are in dates and names, too.
    const ALL: [Self; 5] = [Self::Char(';'), Self::Char('\t'), Self::Char('|'), Self::Char(','), Self::Blanks];

    fn cut(self, line: &str) -> Vec<&str> {
        match self {
            Self::Blanks => line.split_whitespace().map(unquoted).collect(),
            Self::Char(separator) => line.split(separator).map(unquoted).collect(),
        }
    }
}

/// How a table is written.
#[derive(Debug, Clone, Copy)]
struct Style {
    separator: Separator,
    comma_is_decimal: bool,
    /// Lines end with a separator: some loggers and spreadsheets add one.
    is_closed: bool,
}

impl Style {
    fn new(separator: Separator) -> Self {
        Self { separator, comma_is_decimal: separator != Separator::Char(','), is_closed: false }
    }

    fn cut(self, line: &str) -> Vec<&str> {
        let mut cells = self.separator.cut(line);
        if self.is_closed && cells.last() == Some(&"") {
            cells.pop();
        }
        cells
    }

    fn read(self, line: &str) -> Vec<Cell> {
        self.cut(line).iter().map(|cell| Cell::read(cell, self.comma_is_decimal)).collect()
    }
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell).trim()
}

/// Lines that are no comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    every_line(text).filter(|(_, line)| !line.trim_start().starts_with(['#', '%']))
}

/// Lines that hold something, with their numbers from 1.
fn every_line(text: &str) -> impl Iterator<Item = (usize, &str)> {
    // Old Macintosh files end lines with a carriage return alone.
    let ends: &[char] = if text.contains('\n') { &['\n'] } else { &['\n', '\r'] };
    let numbered = text.split(ends).enumerate().map(|(i, line)| (i + 1, line.trim_end_matches('\r')));
    numbered.filter(|(_, line)| !line.trim().is_empty())
}

/// What a cell says.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell {
    Number(f64),
    Date(f64),
    Missing,
    Text,
}

impl Cell {
    fn read(text: &str, comma_is_decimal: bool) -> Self {
        const MISSING: [&str; 9] = ["", "nan", "na", "n/a", "null", "none", "nil", "-", "--"];
        if MISSING.iter().any(|missing| text.eq_ignore_ascii_case(missing)) {
            return Self::Missing;
        }
        let with_point = if comma_is_decimal && !text.contains('.') { text.replacen(',', ".", 1) } else { String::new() };
        let number = if with_point.is_empty() { text } else { &with_point };
        match number.parse::<f64>() {
            Ok(number) if number.is_finite() => Self::Number(number),
            // An infinite reading is one that could not be taken.
            Ok(_) => Self::Missing,
            Err(_) => date_s(text).map_or(Self::Text, Self::Date),
        }
    }
}

/// Seconds of Unix time of an ISO 8601 date and time; without a zone it is UTC.
fn date_s(text: &str) -> Option<f64> {
    // Cheap first: a date has digits and a separator.
    if !text.starts_with(|c: char| c.is_ascii_digit()) || text.len() < 8 {
        return None;
    }
    let stamp = text.parse::<Timestamp>().ok().or_else(|| {
        let civil: DateTime = text.parse().ok()?;
        TimeZone::UTC.to_timestamp(civil).ok()
    })?;
    Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9)
}

impl Table {
    /// Reads a table.
    ///
    /// # Errors
    /// [`TableError`], which names the line.
    pub fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|error| TableError::NotText { at: error.valid_up_to() })?;
        let Some(style) = how_written(text) else { return Err(TableError::Empty) };
        let mut header: Vec<Vec<&str>> = Vec::new();
        let mut table: Option<Self> = None;
        for (number, line) in every_line(text) {
            if let Some(comment) = line.trim_start().strip_prefix(['#', '%']) {
                // Names and units may stand in a comment above the data.
                if table.is_none() && header.len() < HEADER_LINES_MAX {
                    header.push(style.cut(comment.trim_start_matches(['#', '%'])));
                }
                continue;
            }
            let cells = style.cut(line);
            let Some(table) = &mut table else {
                let read = style.read(line);
                if !is_data(&read) {
                    header.push(cells);
                    if header.len() > HEADER_LINES_MAX {
                        return Err(TableError::Empty);
                    }
                    continue;
                }
                if read.len() > COLUMNS_MAX {
                    return Err(TableError::TooLarge);
                }
                table = Some(Self::begin(&header, &read));
                continue;
            };
            if cells.len() != table.columns.len() {
                return Err(TableError::Ragged { line: number, cells: cells.len(), columns: table.columns.len() });
            }
            if table.rows() >= ROWS_MAX {
                return Err(TableError::TooLarge);
            }
            for (column, cell) in cells.iter().enumerate() {
                let value = match Cell::read(cell, style.comma_is_decimal) {
                    Cell::Number(value) => value,
                    Cell::Date(value) => {
                        table.dated[column] = true;
                        value
                    }
                    Cell::Missing => f64::NAN,
                    Cell::Text => {
                        let text = cell.chars().take(40).collect();
                        return Err(TableError::Cell { line: number, column: column + 1, text });
                    }
                };
                table.columns[column].push(value);
            }
        }
        table.ok_or(TableError::Empty)
    }

    fn begin(header: &[Vec<&str>], first: &[Cell]) -> Self {
        // The nearest line with a name for each column: above it are titles, below it may be units.
        let mut fitting: Vec<&Vec<&str>> = header.iter().filter(|names| names.len() == first.len()).collect();
        let is_units = |line: &&&Vec<&str>| line.iter().all(|cell| is_unit(cell)) && line.iter().any(|cell| !cell.is_empty());
        let units = fitting.last().filter(is_units).copied();
        fitting.truncate(fitting.len() - usize::from(units.is_some()));
        let words = |names: &&&Vec<&str>| names.iter().all(|name| name.chars().any(char::is_alphabetic));
        let names = fitting.iter().rev().find(words).or(fitting.last());
        let name = |i: usize| {
            let name = match names.and_then(|names| names.get(i)) {
                Some(name) if !name.is_empty() => (*name).to_owned(),
                _ => format!("column {}", i + 1),
            };
            units.and_then(|units| units.get(i)).map_or(name.clone(), |unit| with_unit(&name, unit))
        };
        let value = |cell: &Cell| match cell {
            Cell::Number(value) | Cell::Date(value) => *value,
            Cell::Missing | Cell::Text => f64::NAN,
        };
        Self {
            names: (0..first.len()).map(name).collect(),
            columns: first.iter().map(|cell| vec![value(cell)]).collect(),
            dated: first.iter().map(|cell| matches!(cell, Cell::Date(_))).collect(),
        }
    }

    /// Names of the columns, from its header or made up.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Column `column`, NaN where a reading is missing; empty where there is no such column.
    #[must_use]
    pub fn column(&self, column: usize) -> &[f64] {
        self.columns.get(column).map_or(&[], Vec::as_slice)
    }

    /// Whether the column held dates, which became seconds of Unix time.
    #[must_use]
    pub fn is_dated(&self, column: usize) -> bool {
        self.dated.get(column).copied().unwrap_or_default()
    }

    /// Lines of data.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// A line of data: no words, and not all of it missing.
fn is_data(cells: &[Cell]) -> bool {
    cells.iter().all(|cell| *cell != Cell::Text) && cells.iter().any(|cell| !matches!(cell, Cell::Missing))
}

/// The style in which the lines of a sample are data, all with equally many cells: of those that do nearly as well as the best, the one
/// that makes most columns. `None` where no line is data in any.
fn how_written(text: &str) -> Option<Style> {
    let sample: Vec<&str> = lines(text).map(|(_, line)| line).take(SAMPLE_LINES).collect();
    let scored = Separator::ALL.into_iter().filter_map(|separator| {
        let style = Style::new(separator);
        let mut counts = std::collections::BTreeMap::<usize, usize>::new();
        sample.iter().map(|line| style.read(line)).filter(|cells| is_data(cells)).for_each(|cells| {
            *counts.entry(cells.len()).or_default() += 1;
        });
        let (columns, lines) = counts.into_iter().max_by_key(|(_, lines)| *lines)?;
        Some((lines, columns, style))
    });
    let scored: Vec<(usize, usize, Style)> = scored.collect();
    let most = scored.iter().map(|(lines, ..)| *lines).max()?;
    let good = scored.into_iter().filter(|(lines, ..)| lines * 10 >= most * 9);
    // The first of the best: `max_by_key` would take the last.
    let (_, columns, mut style) = good.rev().max_by_key(|(_, columns, _)| *columns)?;
    let data = || sample.iter().filter(|line| is_data(&style.read(line)));
    // Two names are of two columns, whatever the numbers look like: whole seconds that repeat do not rise.
    let is_named = sample.iter().map(|line| style.cut(line)).any(|cells| {
        cells.len() == 2
            && cells.iter().all(|cell| cell.chars().any(char::is_alphabetic) && Cell::read(cell, false) == Cell::Text)
    });
    if style.separator == Separator::Char(',') && columns == 2 && !is_named && is_decimal(data().map(|line| style.cut(line))) {
        return Some(Style { comma_is_decimal: true, ..Style::new(Separator::Char(';')) });
    }
    style.is_closed = columns > 1 && data().all(|line| style.cut(line).last() == Some(&""));
    Some(style)
}

/// Whether pairs of whole numbers are halves of one column with decimal commas: neither has a point, the second no sign, and the first
/// does not rise as stamps would.
fn is_decimal<'a>(pairs: impl Iterator<Item = Vec<&'a str>>) -> bool {
    let mut last = f64::NEG_INFINITY;
    let mut rises = true;
    for pair in pairs {
        let [whole, fraction] = pair.as_slice() else { continue };
        if whole.contains('.') || !fraction.bytes().all(|byte| byte.is_ascii_digit()) || fraction.is_empty() {
            return false;
        }
        let Ok(number) = whole.parse::<f64>() else { return false };
        rises &= number > last;
        last = number;
    }
    !rises
}
