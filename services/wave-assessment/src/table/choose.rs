//! Which columns are time and elevation, and in which units.

use super::cells::Table;
use super::units::{LengthUnit, Stated, TimeUnit};

/// Stamps that are this far from evenly spaced, as a share of their interval, contradict a stated rate.
const RATE_DISAGREEMENT_MAX: f64 = 0.05;

/// What the user says about a table; what is not said is told from the names of its columns, or else from what they hold.
///
/// Time: the column named so (`time`, `t`, `stamp`, `date` …); otherwise, of several columns, the first if it rises. With a rate
/// and no named column, readings are taken as evenly spaced. Elevation: the column named so (`eta`, `elevation`, `level`, `z` …);
/// otherwise the only one that is left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Choice {
    /// Name or number (from 1) of the column of stamps.
    pub time_column: Option<String>,
    /// Name or number (from 1) of the column of elevations.
    pub value_column: Option<String>,
    /// Readings a second, hertz.
    pub rate_hz: Option<f64>,
    /// Unit of the stamps; `None` tells it from the column's name (`t_ms`, `time [min]`), seconds where that says nothing.
    pub time_unit: Option<TimeUnit>,
    /// Unit of the elevations; `None` tells it from the column's name (`eta_mm`, `level (cm)`), metres where that says nothing.
    pub unit: Option<LengthUnit>,
}

/// Readings as they stand in a table, oldest first or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Seconds; NaN where missing.
    pub stamp_s: Vec<f64>,
    /// Metres; NaN where missing.
    pub elevation_m: Vec<f64>,
    /// The column that stamps come from; `None` where they come from the rate.
    pub time_column: Option<String>,
    /// The column that elevations come from.
    pub value_column: String,
    /// Its unit.
    pub unit: LengthUnit,
    /// Whether stamps are seconds of Unix time.
    pub is_dated: bool,
}

/// Why no readings were found in a table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// No column is called so.
    #[error("there is no column {wanted:?}; there are {}", list(names))]
    NoColumn {
        /// As asked for.
        wanted: String,
        /// What there is.
        names: Vec<String>,
    },
    /// Several could be meant.
    #[error("which column holds the elevation? Say --value-column; there are {}", list(names))]
    WhichValue {
        /// What there is.
        names: Vec<String>,
    },
    /// Neither stamps nor rate.
    #[error("there is no column of stamps: say --rate-hz, or --time-column; there are {}", list(names))]
    NoTime {
        /// What there is.
        names: Vec<String>,
    },
    /// A rate that is none.
    #[error("--rate-hz must be above 0 Hz and at most 1000000 Hz, not {rate_hz}")]
    Rate {
        /// As given.
        rate_hz: f64,
    },
    /// Stamps and rate contradict each other.
    #[error("the stamps say {stamped_hz:.4} Hz and --rate-hz says {rate_hz} Hz: leave one of them out")]
    RatesDisagree {
        /// By the stamps.
        stamped_hz: f64,
        /// As stated.
        rate_hz: f64,
    },
    /// The column says that it is no length.
    #[error("column {name:?} is in {unit:?}, which is no unit of length known here: say --unit, or --value-column")]
    NoLength {
        /// The column.
        name: String,
        /// What it says.
        unit: String,
    },
    /// The column says that it is no time.
    #[error("column {name:?} is in {unit:?}, which is no unit of time known here: say --time-unit, or --time-column")]
    NoTimeUnit {
        /// The column.
        name: String,
        /// What it says.
        unit: String,
    },
    /// Not a single reading.
    #[error("column {name:?} holds no reading")]
    AllMissing {
        /// The column.
        name: String,
    },
}

fn list(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("{name:?}")).collect();
    let more = names.len().saturating_sub(SHOWN);
    if more > 0 { format!("{} and {more} more", shown.join(", ")) } else { shown.join(", ") }
}

impl Table {
    /// The readings that `choice` means.
    ///
    /// # Errors
    /// [`ChoiceError`], which says what to say.
    pub fn readings(&self, choice: &Choice) -> Result<Readings, ChoiceError> {
        if let Some(rate_hz) = choice.rate_hz
            && !(rate_hz > 0.0 && rate_hz <= 1e6)
        {
            return Err(ChoiceError::Rate { rate_hz });
        }
        let named_time = choice.time_column.as_deref().map(|wanted| self.find(wanted)).transpose()?;
        let named_value = choice.value_column.as_deref().map(|wanted| self.find(wanted)).transpose()?;
        let time = match named_time {
            Some(column) => Some(column),
            None => self.guess_time(named_value, choice.rate_hz.is_some()),
        };
        let value = match named_value {
            Some(column) => column,
            None => self.guess_value(time)?,
        };
        let name = self.names()[value].clone();
        let unit = match (choice.unit, LengthUnit::stated(&name)) {
            (Some(unit), _) | (None, Stated::Unit(unit)) => unit,
            (None, Stated::Nothing) => LengthUnit::Metres,
            (None, Stated::Unknown(unit)) => return Err(ChoiceError::NoLength { name, unit }),
        };
        let elevation_m: Vec<f64> = self.column(value).iter().map(|reading| reading * unit.factor()).collect();
        if elevation_m.iter().all(|reading| reading.is_nan()) {
            return Err(ChoiceError::AllMissing { name });
        }
        let is_dated = time.is_some_and(|column| self.is_dated(column));
        let stamp_s: Vec<f64> = match (time, choice.rate_hz) {
            (None, None) => return Err(ChoiceError::NoTime { names: self.names().to_vec() }),
            (None, Some(rate_hz)) => (0..elevation_m.len()).map(|i| i as f64 / rate_hz).collect(),
            (Some(column), rate_hz) => {
                let name = &self.names()[column];
                let factor = match (choice.time_unit, TimeUnit::stated(name)) {
                    // Dates are seconds, whatever zone or format stands beside their name.
                    _ if is_dated => 1.0,
                    (Some(unit), _) | (None, Stated::Unit(unit)) => unit.factor(),
                    (None, Stated::Nothing) => 1.0,
                    (None, Stated::Unknown(unit)) => return Err(ChoiceError::NoTimeUnit { name: name.clone(), unit }),
                };
                let stamp_s: Vec<f64> = self.column(column).iter().map(|stamp| stamp * factor).collect();
                match rate_hz {
                    None => stamp_s,
                    Some(rate_hz) => match spread(&stamp_s, rate_hz) {
                        Some(spread_s) => spread_s,
                        None => {
                            agree(&stamp_s, rate_hz)?;
                            stamp_s
                        }
                    },
                }
            }
        };
        let time_column = time.map(|column| self.names()[column].clone());
        Ok(Readings { stamp_s, elevation_m, time_column, value_column: name, unit, is_dated })
    }

    /// A column by its name, or else by its number.
    fn find(&self, wanted: &str) -> Result<usize, ChoiceError> {
        let names = self.names();
        let by_name = names.iter().position(|name| name == wanted);
        let by_name = by_name.or_else(|| names.iter().position(|name| name.eq_ignore_ascii_case(wanted.trim())));
        let by_number = || wanted.trim().parse::<usize>().ok().filter(|number| (1..=names.len()).contains(number));
        by_name
            .or_else(|| by_number().map(|number| number - 1))
            .ok_or_else(|| ChoiceError::NoColumn { wanted: wanted.to_owned(), names: names.to_vec() })
    }

    fn guess_time(&self, value: Option<usize>, has_rate: bool) -> Option<usize> {
        const TIMES: &[&str] = &["time", "t", "stamp", "timestamp", "date", "datetime", "epoch", "seconds", "elapsed", "utc"];
        let others = || (0..self.names().len()).filter(|column| Some(*column) != value);
        let dated = others().find(|column| self.is_dated(*column));
        let named = dated.or_else(|| others().find(|column| is_called(&self.names()[*column], TIMES)));
        // A rate was stated because stamps are none, or are only a counter.
        if named.is_some() || has_rate || self.names().len() < 2 {
            return named;
        }
        others().next().filter(|column| rises(self.column(*column)))
    }

    fn guess_value(&self, time: Option<usize>) -> Result<usize, ChoiceError> {
        const VALUES: &[&str] = &[
            "eta",
            "elevation",
            "level",
            "waterlevel",
            "water",
            "surface",
            "z",
            "height",
            "wse",
            "heave",
            "displacement",
            "value",
        ];
        let others: Vec<usize> = (0..self.names().len()).filter(|column| Some(*column) != time).collect();
        let named: Vec<usize> = others.iter().copied().filter(|column| is_called(&self.names()[*column], VALUES)).collect();
        match (named.as_slice(), others.as_slice()) {
            ([column], _) | ([], [column]) => Ok(*column),
            _ => Err(ChoiceError::WhichValue { names: self.names().to_vec() }),
        }
    }
}

/// Whether a column's name begins with one of `words`, whatever follows as a unit or a qualifier.
fn is_called(name: &str, words: &[&str]) -> bool {
    let first = name.trim().split(|c: char| !c.is_alphanumeric()).find(|word| !word.is_empty()).unwrap_or_default();
    words.iter().any(|word| first.eq_ignore_ascii_case(word))
}

/// Whether a column rises as stamps do, some of them missing or out of order: it gets somewhere by its steps, where waves go to and fro.
fn rises(stamps: &[f64]) -> bool {
    /// Of the way that the steps make together.
    const NET_MIN: f64 = 0.3;
    let known: Vec<f64> = stamps.iter().copied().filter(|stamp| !stamp.is_nan()).collect();
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return false };
    let way: f64 = known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    known.len() > 1 && known.len() * 2 > stamps.len() && last - first > NET_MIN * way
}

/// Stamps that are cut off to whole seconds (or whatever the logger's clock shows), several readings to each, put at a stated rate within what they
/// say; `None` where they are not so, or there are not as many readings as the rate has.
fn spread(stamp_s: &[f64], rate_hz: f64) -> Option<Vec<f64>> {
    let mut steps_s: Vec<f64> = stamp_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // A missing stamp, or one out of order, is no clock that is read too seldom.
    if steps_s.iter().any(|step| step.is_nan() || *step < 0.0) || !steps_s.contains(&0.0) {
        return None;
    }
    steps_s.retain(|step| *step > 0.0);
    if steps_s.is_empty() {
        return None;
    }
    let middle = steps_s.len() / 2;
    let tick_s = *steps_s.select_nth_unstable_by(middle, f64::total_cmp).1;
    let ticks = stamp_s.chunk_by(|a, b| a == b);
    let rate = stamp_s.len() as f64 / (ticks.clone().count() as f64 * tick_s);
    // The first and the last second may be cut, too.
    let share = RATE_DISAGREEMENT_MAX + 2.0 / ticks.clone().count() as f64;
    if tick_s * rate_hz < 1.5 || (rate / rate_hz - 1.0).abs() > share {
        return None;
    }
    let step_s = 1.0 / rate_hz;
    // The first tick's readings are its last ones.
    let first = ticks.clone().next().map_or(0, <[f64]>::len);
    let mut next_s = stamp_s.first()? + (tick_s - first as f64 * step_s).max(0.0);
    let put = |stamp: &f64| {
        // Where readings are missing, or the clocks have drifted a reading apart, the stamps say so.
        if next_s < stamp - step_s || next_s >= stamp + tick_s + step_s {
            next_s = *stamp;
        }
        let at_s = next_s;
        next_s += step_s;
        at_s
    };
    Some(stamp_s.iter().map(put).collect())
}

/// Whether stamps are a stated rate's.
fn agree(stamp_s: &[f64], rate_hz: f64) -> Result<(), ChoiceError> {
    let mut steps_s: Vec<f64> = stamp_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    if steps_s.is_empty() {
        return Ok(());
    }
    let middle = steps_s.len() / 2;
    let stamped_hz = 1.0 / *steps_s.select_nth_unstable_by(middle, f64::total_cmp).1;
    if (stamped_hz / rate_hz - 1.0).abs() > RATE_DISAGREEMENT_MAX {
        return Err(ChoiceError::RatesDisagree { stamped_hz, rate_hz });
    }
    Ok(())
}
