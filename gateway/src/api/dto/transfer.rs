//! Parameters and items as JSON.

use halcyon_model as model;
use halcyon_model::{ItemFrame, ItemKind, ParameterKind, mav_cmd};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::api::problem::ApiError;

/// What a parameter holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum ParameterType {
    /// 0 to 255.
    Uint8,
    /// −128 to 127.
    Int8,
    /// 0 to 65 535.
    Uint16,
    /// −32 768 to 32 767.
    Int16,
    /// 0 to 2³² − 1.
    Uint32,
    /// −2³¹ to 2³¹ − 1.
    Int32,
    /// A floating-point number.
    Real32,
}

impl From<ParameterKind> for ParameterType {
    fn from(kind: ParameterKind) -> Self {
        match kind {
            ParameterKind::Uint8 => Self::Uint8,
            ParameterKind::Int8 => Self::Int8,
            ParameterKind::Uint16 => Self::Uint16,
            ParameterKind::Int16 => Self::Int16,
            ParameterKind::Uint32 => Self::Uint32,
            ParameterKind::Int32 => Self::Int32,
            ParameterKind::Real32 => Self::Real32,
        }
    }
}

/// One parameter of an autopilot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Parameter {
    /// Its name in the autopilot's words, such as `WPNAV_SPEED`.
    pub name: String,
    /// Its value, in the autopilot's unit.
    pub value: f64,
    /// What it holds.
    #[serde(rename = "type")]
    pub kind: ParameterType,
}

impl From<model::Parameter> for Parameter {
    fn from(parameter: model::Parameter) -> Self {
        Self { name: parameter.name.to_string(), value: parameter.value, kind: parameter.kind.into() }
    }
}

/// Parameters of an autopilot, in its own order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ParameterList {
    /// The parameters.
    pub parameters: Vec<Parameter>,
}

/// A new value for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetParameter {
    /// In the autopilot's unit.
    pub value: f64,
    /// Also while the motors turn. Some parameters are dangerous in flight.
    #[serde(default)]
    pub even_in_flight: bool,
}

/// Which list of items.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ListKind {
    /// What the autopilot flies in AUTO.
    Mission,
    /// Where it must stay, or must not go.
    Fence,
    /// Where it may return to instead of home.
    Rally,
}

impl From<ItemKind> for ListKind {
    fn from(kind: ItemKind) -> Self {
        match kind {
            ItemKind::Mission => Self::Mission,
            ItemKind::Fence => Self::Fence,
            ItemKind::Rally => Self::Rally,
        }
    }
}

/// What an item's altitude counts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// Mean sea level.
    SeaLevel,
    /// Home.
    Home,
    /// The ground below.
    Terrain,
    /// The item has no place: latitude, longitude and altitude are the command's parameters 5 to 7 as they are.
    None,
}

impl From<ItemFrame> for Frame {
    fn from(frame: ItemFrame) -> Self {
        match frame {
            ItemFrame::SeaLevel => Self::SeaLevel,
            ItemFrame::Home => Self::Home,
            ItemFrame::Terrain => Self::Terrain,
            ItemFrame::None => Self::None,
        }
    }
}

impl From<Frame> for ItemFrame {
    fn from(frame: Frame) -> Self {
        match frame {
            Frame::SeaLevel => Self::SeaLevel,
            Frame::Home => Self::Home,
            Frame::Terrain => Self::Terrain,
            Frame::None => Self::None,
        }
    }
}

/// A MAVLink command, by its number or by its name with or without `MAV_CMD_`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum CommandId {
    /// Such as 16.
    Number(u16),
    /// Such as `NAV_WAYPOINT`.
    Name(String),
}

fn yes() -> bool {
    true
}

/// One item of a mission, a fence or rally points. A number that is `null` is left to the autopilot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// What: name or number; answers give the name where there is one.
    pub command: CommandId,
    /// What the altitude counts from.
    pub frame: Frame,
    /// The command's parameters 1 to 4.
    #[serde(default)]
    pub parameters: [Option<f64>; 4],
    /// Latitude, degrees, positive north.
    #[serde(default)]
    pub latitude_deg: Option<f64>,
    /// Longitude, degrees, positive east.
    #[serde(default)]
    pub longitude_deg: Option<f64>,
    /// Altitude, metres.
    #[serde(default)]
    pub altitude_m: Option<f64>,
    /// Go on to the next item by itself.
    #[serde(default = "yes")]
    pub autocontinue: bool,
}

impl From<model::Item> for Item {
    fn from(item: model::Item) -> Self {
        let command = mav_cmd::name(item.command).map_or(CommandId::Number(item.command), |name| CommandId::Name(name.into()));
        Self {
            command,
            frame: item.frame.into(),
            parameters: item.parameters,
            latitude_deg: item.latitude_deg,
            longitude_deg: item.longitude_deg,
            altitude_m: item.altitude_m,
            autocontinue: item.autocontinue,
        }
    }
}

impl Item {
    /// In the model's words, if it makes sense as a member of `kind`.
    ///
    /// # Errors
    /// [`ApiError::Invalid`] that names what is wrong.
    pub fn read(self, kind: ItemKind) -> Result<model::Item, ApiError> {
        let command = match self.command {
            CommandId::Number(number) => number,
            CommandId::Name(name) => mav_cmd::number(&name).ok_or_else(|| {
                let name: String = name.chars().take(60).collect();
                ApiError::Invalid(format!("{name:?} is not a command with a name here; give its number"))
            })?,
        };
        let item = model::Item {
            command,
            frame: self.frame.into(),
            parameters: self.parameters,
            latitude_deg: self.latitude_deg,
            longitude_deg: self.longitude_deg,
            altitude_m: self.altitude_m,
            autocontinue: self.autocontinue,
        };
        item.problem(kind).map_or(Ok(item), |problem| Err(ApiError::Invalid(problem)))
    }
}

/// A list of items that an autopilot keeps. ArduPilot's item 0, which is home, is not among them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ItemList {
    /// Which list.
    pub kind: ListKind,
    /// The items, in order.
    pub items: Vec<Item>,
}

/// The items to put in place of those that are there. None clears the list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ItemUpload {
    /// At most 700, in order.
    #[schema(max_items = 700)]
    pub items: Vec<Item>,
}
