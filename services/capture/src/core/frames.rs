//! The table of a survey folder's frames: `frames.csv`, as text.

use std::collections::BTreeSet;

use halcyon_model::Stamp;
use nalgebra::UnitQuaternion;

/// Rows that a table may have: two days at 5 Hz.
const ROWS_MAX: usize = 1_000_000;
/// The four columns that make an attitude.
const ATTITUDE: [&str; 4] = ["roll_deg", "pitch_deg", "heading_deg", "height_m"];

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRow {
    /// Name of the pictures without their folder, and usually without their ending.
    pub name: String,
    /// Mid-exposure.
    pub stamp: Stamp,
    /// Attitude and height by the autopilot, if the table has them.
    pub attitude: Option<FrameAttitude>,
}

/// How the body was turned, and how high it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameAttitude {
    /// Rotates body axes into north, east, down.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Height above the mean water, metres.
    pub height_m: f64,
}

/// What is wrong with the table. Lines count from 1, the header.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FramesError {
    /// Not CSV.
    #[error("line {line}: {problem}")]
    Csv {
        /// Where.
        line: u64,
        /// What the reader says.
        problem: String,
    },
    /// A column that must be there.
    #[error("line 1: column {column} is missing{because}")]
    Column {
        /// Which.
        column: &'static str,
        /// Why it must be there.
        because: &'static str,
    },
    /// A value that is not what it should be.
    #[error("line {line}: {column} is {text:?}, expected {expected}")]
    Value {
        /// Where.
        line: u64,
        /// Which column.
        column: &'static str,
        /// The value.
        text: String,
        /// What it should be.
        expected: &'static str,
    },
    /// No frame at all.
    #[error("there are no frames in it")]
    Empty,
    /// More frames than anybody flies.
    #[error("there are more than {ROWS_MAX} frames in it")]
    TooMany,
}

/// Reads a table with the columns `name` and `stamp_s` and optionally `roll_deg`, `pitch_deg`, `heading_deg` and `height_m` (all four or
/// none). Columns may stand in any order; others are ignored.
///
/// # Errors
/// [`FramesError`] for the first defect: stamps must rise, names must differ and be plain file names, numbers be finite.
pub fn parse(text: &str) -> Result<Vec<FrameRow>, FramesError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| csv_error(&error))?.clone();
    let find = |column: &str| header.iter().position(|name| name.trim_start_matches('\u{feff}') == column);
    let missing = |column, because| FramesError::Column { column, because };
    let name_at = find("name").ok_or(missing("name", ""))?;
    let stamp_at = find("stamp_s").ok_or(missing("stamp_s", ""))?;
    let attitude_at = if ATTITUDE.iter().any(|column| find(column).is_some()) {
        let mut places = [0; 4];
        for (place, column) in places.iter_mut().zip(ATTITUDE) {
            *place =
                find(column).ok_or(missing(column, ": an attitude needs roll_deg, pitch_deg, heading_deg and height_m"))?;
        }
        Some(places)
    } else {
        None
    };

    let (mut rows, mut names) = (Vec::<FrameRow>::new(), BTreeSet::new());
    for record in reader.records() {
        let record = record.map_err(|error| csv_error(&error))?;
        let row = Row { line: record.position().map_or(0, csv::Position::line), record: &record };
        if rows.len() == ROWS_MAX {
            return Err(FramesError::TooMany);
        }
        let name = row.text(name_at);
        let plain = !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\', '\0']);
        if !plain {
            return Err(row.error("name", name, "a plain file name"));
        }
        if !names.insert(name.to_owned()) {
            return Err(row.error("name", name, "a name that no frame before it has"));
        }
        // Up to the year 2255: what a stamp's nanoseconds hold.
        let stamp_s = row.number("stamp_s", stamp_at, 0.0, 9e9, "seconds since 1970, 0 to 9e9")?;
        let stamp = exact_stamp(row.text(stamp_at)).unwrap_or(Stamp::from_secs_f64(stamp_s));
        if rows.last().is_some_and(|last| stamp <= last.stamp) {
            return Err(row.error("stamp_s", row.text(stamp_at), "a later time than in the row before"));
        }
        let attitude = attitude_at.map(|[roll, pitch, heading, height]| {
            let roll_deg = row.number("roll_deg", roll, -180.0, 180.0, "-180 to 180")?;
            let pitch_deg = row.number("pitch_deg", pitch, -90.0, 90.0, "-90 to 90")?;
            let heading_deg = row.number("heading_deg", heading, -360.0, 360.0, "-360 to 360")?;
            let height_m = row.number("height_m", height, 0.01, 1e4, "0.01 to 10000")?;
            let [roll, pitch, heading] = [roll_deg, pitch_deg, heading_deg].map(f64::to_radians);
            Ok(FrameAttitude { ned_from_body: UnitQuaternion::from_euler_angles(roll, pitch, heading), height_m })
        });
        rows.push(FrameRow { name: name.to_owned(), stamp, attitude: attitude.transpose()? });
    }
    if rows.is_empty() { Err(FramesError::Empty) } else { Ok(rows) }
}

/// Plain decimal seconds to the nanosecond: a double holds a quarter of a microsecond at today's dates.
fn exact_stamp(text: &str) -> Option<Stamp> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    if !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let whole_s: i64 = whole.parse().ok()?;
    let nanos: i64 = format!("{fraction:0<9}").get(..9)?.parse().ok()?;
    Some(Stamp::from_nanos(whole_s.checked_mul(1_000_000_000)?.checked_add(nanos)?))
}

struct Row<'a> {
    line: u64,
    record: &'a csv::StringRecord,
}

impl Row<'_> {
    fn text(&self, at: usize) -> &str {
        // The reader has refused rows of another length than the header's.
        self.record.get(at).unwrap_or_default()
    }

    fn error(&self, column: &'static str, text: &str, expected: &'static str) -> FramesError {
        FramesError::Value { line: self.line, column, text: text.chars().take(80).collect(), expected }
    }

    fn number(&self, column: &'static str, at: usize, low: f64, high: f64, expected: &'static str) -> Result<f64, FramesError> {
        let text = self.text(at);
        let value = text.parse::<f64>().ok().filter(|value| (low..=high).contains(value));
        value.ok_or_else(|| self.error(column, text, expected))
    }
}

fn csv_error(error: &csv::Error) -> FramesError {
    let line = error.position().map_or(0, csv::Position::line);
    let problem = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => format!("{len} values, the header has {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "not UTF-8".to_owned(),
        _ => error.to_string(),
    };
    FramesError::Csv { line, problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_frames_with_and_without_attitude() {
        let rows = parse("name,stamp_s\n000,100.25\n001,100.5\n").unwrap();
        assert_eq!(rows[1], FrameRow { name: "001".into(), stamp: Stamp::from_nanos(100_500_000_000), attitude: None });
        let fine = &parse("name,stamp_s\na,1750000000.123456789\nb,1.75e9\n");
        assert!(fine.as_ref().is_err_and(|error| error.to_string().starts_with("line 3: stamp_s")), "{fine:?}");
        let fine = parse("name,stamp_s\nb,1.75e9\na,1750000000.123456789\n").unwrap();
        assert_eq!(
            fine.iter().map(|row| row.stamp.as_nanos()).collect::<Vec<_>>(),
            [1_750_000_000_000_000_000, 1_750_000_000_123_456_789]
        );
        let text = "\u{feff}stamp_s, height_m, note, roll_deg, pitch_deg, heading_deg, name\r\n# hover\r\n7, 5.5, x, 0, 0, 90, a.png\r\n";
        let row = &parse(text).unwrap()[0];
        let attitude = row.attitude.unwrap();
        assert_eq!((row.name.as_str(), attitude.height_m), ("a.png", 5.5));
        // Heading 90°: the body's forward axis points east.
        assert!((attitude.ned_from_body * nalgebra::Vector3::x() - nalgebra::Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn every_defect_has_its_line() {
        #[track_caller]
        fn check(text: &str, expected: &str) {
            assert_eq!(parse(text).unwrap_err().to_string(), expected);
        }
        check("name,stamp_s\n", "there are no frames in it");
        check("", "line 1: column name is missing");
        check("name,time\na,1\n", "line 1: column stamp_s is missing");
        check(
            "name,stamp_s,roll_deg\na,1,2\n",
            "line 1: column pitch_deg is missing: an attitude needs roll_deg, pitch_deg, heading_deg and height_m",
        );
        check("name,stamp_s\na,1\nb,NaN\n", "line 3: stamp_s is \"NaN\", expected seconds since 1970, 0 to 9e9");
        check("name,stamp_s\na,1\nb\n", "line 3: 1 values, the header has 2");
        check("name,stamp_s\na,2\nb,1\n", "line 3: stamp_s is \"1\", expected a later time than in the row before");
        check("name,stamp_s\na,1\na,2\n", "line 3: name is \"a\", expected a name that no frame before it has");
        check("name,stamp_s\n../a,1\n", "line 2: name is \"../a\", expected a plain file name");
        let attitude = "name,stamp_s,roll_deg,pitch_deg,heading_deg,height_m\n";
        check(&format!("{attitude}a,1,0,0,0,-5\n"), "line 2: height_m is \"-5\", expected 0.01 to 10000");
        check(&format!("{attitude}a,1,0,,0,5\n"), "line 2: pitch_deg is \"\", expected -90 to 90");
    }
}
