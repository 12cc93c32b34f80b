//! What is read from an autopilot and written to it as a whole: parameters; the items of a mission, a fence, rally points.

use std::fmt;
use std::str::FromStr;

/// Items of one list; more are refused.
pub const ITEMS_MAX: usize = 700;
/// Parameters in one answer; more are refused.
pub const PARAMETERS_MAX: usize = 4096;

/// Name of a parameter in the autopilot's own words, such as `WPNAV_SPEED`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterName(String);

/// Why a string is not the name of a parameter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("parameter name {text:?} must be 1 to 16 characters of A-Z, a-z, 0-9 or '_'")]
pub struct ParameterNameError {
    text: String,
}

impl ParameterName {
    /// Checks and wraps `text`.
    ///
    /// # Errors
    /// [`ParameterNameError`] unless `text` is 1 to 16 characters of `A-Z a-z 0-9 _`, which is all that MAVLink carries.
    pub fn new(text: impl Into<String>) -> Result<Self, ParameterNameError> {
        let text = text.into();
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if (1..=16).contains(&text.len()) && text.chars().all(allowed) {
            Ok(Self(text))
        } else {
            Err(ParameterNameError { text: text.chars().take(40).collect() })
        }
    }

    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for ParameterName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for ParameterName {
    type Err = ParameterNameError;
    fn from_str(text: &str) -> Result<Self, ParameterNameError> {
        Self::new(text)
    }
}

/// What a parameter holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum ParameterKind {
    Uint8,
    Int8,
    Uint16,
    Int16,
    Uint32,
    Int32,
    Real32,
}

impl ParameterKind {
    /// Every kind, in the order of MAVLink's numbers.
    pub const ALL: [Self; 7] = [Self::Uint8, Self::Int8, Self::Uint16, Self::Int16, Self::Uint32, Self::Int32, Self::Real32];

    /// In a word, such as `int16`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Uint8 => "uint8",
            Self::Int8 => "int8",
            Self::Uint16 => "uint16",
            Self::Int16 => "int16",
            Self::Uint32 => "uint32",
            Self::Int32 => "int32",
            Self::Real32 => "real32",
        }
    }

    /// MAVLink's MAV_PARAM_TYPE.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::Uint8 => 1,
            Self::Int8 => 2,
            Self::Uint16 => 3,
            Self::Int16 => 4,
            Self::Uint32 => 5,
            Self::Int32 => 6,
            Self::Real32 => 9,
        }
    }

    /// From MAVLink's MAV_PARAM_TYPE; the 64-bit ones, which its messages cannot carry, are `None`.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }

    /// Least and greatest value that it can hold.
    #[must_use]
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Uint8 => (0.0, u8::MAX.into()),
            Self::Int8 => (i8::MIN.into(), i8::MAX.into()),
            Self::Uint16 => (0.0, u16::MAX.into()),
            Self::Int16 => (i16::MIN.into(), i16::MAX.into()),
            Self::Uint32 => (0.0, u32::MAX.into()),
            Self::Int32 => (i32::MIN.into(), i32::MAX.into()),
            Self::Real32 => (f32::MIN.into(), f32::MAX.into()),
        }
    }
}

/// One parameter of an autopilot.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Which.
    pub name: ParameterName,
    /// Its value, in the autopilot's unit; finite.
    pub value: f64,
    /// What it holds.
    pub kind: ParameterKind,
}

/// A list of items that an autopilot keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ItemKind {
    /// What it flies in AUTO.
    Mission,
    /// Where it must stay, or must not go.
    Fence,
    /// Where it may return to instead of home.
    Rally,
}

impl ItemKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Mission, Self::Fence, Self::Rally];

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mission => "mission",
            Self::Fence => "fence",
            Self::Rally => "rally",
        }
    }

    /// From a word, as [`Self::name`] writes it.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Whether a command (MAV_CMD) belongs into this list.
    #[must_use]
    pub fn takes(self, command: u16) -> bool {
        match self {
            Self::Mission => !(5000..5200).contains(&command),
            // Return point; polygon vertex in and ex; circle in and ex.
            Self::Fence => (5000..=5004).contains(&command),
            Self::Rally => command == 5100,
        }
    }
}

/// What an item's altitude counts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ItemFrame {
    /// Mean sea level.
    SeaLevel,
    /// Home.
    Home,
    /// The ground below.
    Terrain,
    /// The item has no place: its latitude, longitude and altitude are the command's parameters 5 to 7 as they are.
    None,
}

impl ItemFrame {
    /// Every frame.
    pub const ALL: [Self; 4] = [Self::SeaLevel, Self::Home, Self::Terrain, Self::None];

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SeaLevel => "sea_level",
            Self::Home => "home",
            Self::Terrain => "terrain",
            Self::None => "none",
        }
    }

    /// MAVLink's MAV_FRAME.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::SeaLevel => 0,
            Self::None => 2,
            Self::Home => 3,
            Self::Terrain => 10,
        }
    }

    /// From MAVLink's MAV_FRAME; its other name for the same frame counts, too. Local frames are `None`.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        match number {
            0 | 5 => Some(Self::SeaLevel),
            2 => Some(Self::None),
            3 | 6 => Some(Self::Home),
            10 | 11 => Some(Self::Terrain),
            _ => None,
        }
    }
}

/// One item of a mission, a fence or a list of rally points. A number that is `None` is left to the autopilot (NaN in MAVLink).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Item {
    /// What, as a MAV_CMD.
    pub command: u16,
    /// What the altitude counts from.
    pub frame: ItemFrame,
    /// The command's parameters 1 to 4.
    pub parameters: [Option<f64>; 4],
    /// Latitude, degrees.
    pub latitude_deg: Option<f64>,
    /// Longitude, degrees.
    pub longitude_deg: Option<f64>,
    /// Altitude, metres.
    pub altitude_m: Option<f64>,
    /// Go on to the next item by itself.
    pub autocontinue: bool,
}

impl Item {
    /// What is wrong with it as a member of `kind`, if anything.
    #[must_use]
    pub fn problem(&self, kind: ItemKind) -> Option<String> {
        if !kind.takes(self.command) {
            return Some(format!("command {} does not belong into a {}", self.command, kind.name()));
        }
        let (parameter_max, place_max) = (f64::from(f32::MAX), f64::from(i32::MAX - 1));
        let bounds =
            if self.frame == ItemFrame::None { [place_max, place_max, parameter_max] } else { [90.0, 180.0, 100_000.0] };
        let place = [self.latitude_deg, self.longitude_deg, self.altitude_m];
        let names = ["latitude_deg", "longitude_deg", "altitude_m"];
        for ((name, value), bound) in names.into_iter().zip(place).zip(bounds) {
            // A range, so that NaN fails, too.
            if value.is_some_and(|value| !(-bound..=bound).contains(&value)) {
                return Some(format!("{name} must be -{bound} to {bound}, not {}", value.unwrap_or_default()));
            }
        }
        let wild = self.parameters.iter().flatten().find(|value| !(-parameter_max..=parameter_max).contains(*value));
        wild.map(|value| format!("a parameter cannot be {value}"))
    }
}

/// What was read, as part of the answer to a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Parameters, in the autopilot's order.
    Parameters(Vec<Parameter>),
    /// Items, in the order of the list. ArduPilot's item 0, which is home, is left out.
    Items(Vec<Item>),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers by MAVLink's common.xml.
    #[test]
    fn numbers_are_mavlinks() {
        for (number, name) in
            [(1, "uint8"), (2, "int8"), (3, "uint16"), (4, "int16"), (5, "uint32"), (6, "int32"), (9, "real32")]
        {
            assert_eq!(ParameterKind::from_number(number).map(ParameterKind::name), Some(name));
        }
        for unknown in [0, 7, 8, 10, 255] {
            assert_eq!(ParameterKind::from_number(unknown), None);
        }
        for (number, name) in [(0, "sea_level"), (5, "sea_level"), (3, "home"), (6, "home"), (10, "terrain"), (2, "none")] {
            assert_eq!(ItemFrame::from_number(number).map(ItemFrame::name), Some(name));
        }
        assert_eq!(ItemFrame::from_number(1), None);
    }

    #[test]
    fn names_of_parameters_fit_the_wire() {
        for bad in ["", "A B", "WPNAV/SPEED", "SEVENTEEN_LETTERS", "é"] {
            assert!(ParameterName::new(bad).is_err(), "{bad:?}");
        }
        assert!(ParameterName::new("SIXTEEN_LETTERS_").is_ok());
    }

    #[test]
    fn items_that_make_no_sense_say_why() {
        let good = Item {
            command: 16,
            frame: ItemFrame::Home,
            parameters: [None; 4],
            latitude_deg: Some(53.1),
            longitude_deg: Some(-2.9),
            altitude_m: Some(5.0),
            autocontinue: true,
        };
        let check = |item: Item, kind: ItemKind, expected: Option<&str>| {
            let problem = item.problem(kind);
            assert_eq!(problem.is_some(), expected.is_some(), "{problem:?}");
            assert!(expected.is_none_or(|words| problem.unwrap().contains(words)));
        };
        check(good, ItemKind::Mission, None);
        check(good, ItemKind::Fence, Some("fence"));
        check(Item { command: 5001, ..good }, ItemKind::Fence, None);
        check(Item { command: 5001, ..good }, ItemKind::Mission, Some("5001"));
        check(Item { command: 5100, ..good }, ItemKind::Rally, None);
        check(Item { latitude_deg: Some(90.1), ..good }, ItemKind::Mission, Some("latitude_deg"));
        check(Item { latitude_deg: Some(90.1), frame: ItemFrame::None, ..good }, ItemKind::Mission, None);
        check(Item { altitude_m: Some(f64::NAN), ..good }, ItemKind::Mission, Some("altitude_m"));
        check(Item { parameters: [None, Some(f64::INFINITY), None, None], ..good }, ItemKind::Mission, Some("parameter"));
        check(Item { latitude_deg: None, ..good }, ItemKind::Mission, None);
    }
}
