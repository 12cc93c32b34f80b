//! `halcyon vehicle command ID …`.

use serde_json::{Value, json};

/// A number that is one.
fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("not a finite number".into()) }
}

#[derive(Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Arm the motors
    Arm,
    /// Disarm on the ground
    Disarm,
    /// Climb to a height above the take-off point, the safe height (`vehicle_link.limits`) at least
    TakeOff {
        /// Metres
        #[arg(long, allow_negative_numbers = true, value_parser = finite)]
        height: f64,
    },
    /// Fly to a place
    GoTo {
        /// Metres north of the fleet's origin
        #[arg(long, allow_negative_numbers = true, value_parser = finite, requires = "east", required_unless_present = "latitude")]
        north: Option<f64>,
        /// Metres east of the fleet's origin
        #[arg(long, allow_negative_numbers = true, value_parser = finite, requires = "north")]
        east: Option<f64>,
        /// Latitude, degrees
        #[arg(long, allow_negative_numbers = true, value_parser = finite, requires = "longitude", conflicts_with = "north")]
        latitude: Option<f64>,
        /// Longitude, degrees
        #[arg(long, allow_negative_numbers = true, value_parser = finite, requires = "latitude", conflicts_with = "east")]
        longitude: Option<f64>,
        /// Metres above the mean water
        #[arg(long, allow_negative_numbers = true, value_parser = finite)]
        height: f64,
    },
    /// Keep a slot beside a leader, in its heading's frame
    Follow {
        /// Its id
        leader: String,
        /// Metres ahead of it
        #[arg(long, allow_negative_numbers = true, value_parser = finite, default_value_t = 0.0)]
        forward: f64,
        /// Metres to its right
        #[arg(long, allow_negative_numbers = true, value_parser = finite)]
        right: f64,
        /// Metres above it
        #[arg(long, allow_negative_numbers = true, value_parser = finite, default_value_t = 0.0)]
        up: f64,
    },
    /// Stop and hold
    Hold,
    /// Land here
    Land,
    /// Fly home and land
    Return,
    /// Change the flight mode; GUIDED hands a vehicle back that its pilot has, and starts at once what a plan asks of it
    SetMode {
        /// In ArduCopter's words, such as LOITER
        mode: String,
    },
    /// Turn to a heading
    SetHeading {
        /// Degrees clockwise from true north
        #[arg(allow_negative_numbers = true, value_parser = finite)]
        degrees: f64,
    },
    /// Stop the motors now, in the air or not
    Terminate,
    /// Let the payload go; on the ground or the water only
    ReleasePayload,
    /// Hold the payload
    SecurePayload,
    /// End the transfer of parameters or items that is under way
    CancelTransfer,
}

impl Action {
    /// As the REST API takes it.
    pub(super) fn body(self) -> Value {
        let plain = |action: &str| json!({ "action": action });
        match self {
            Self::Arm => plain("arm"),
            Self::Disarm => plain("disarm"),
            Self::TakeOff { height } => json!({ "action": "take_off", "parameters": { "height_m": height } }),
            Self::GoTo { north, east, latitude, longitude, height } => {
                let point = match (latitude, longitude) {
                    (Some(latitude), Some(longitude)) => json!({ "latitude_deg": latitude, "longitude_deg": longitude }),
                    _ => json!({ "north_m": north, "east_m": east }),
                };
                json!({ "action": "go_to", "parameters": { "point": point, "height_m": height } })
            }
            Self::Follow { leader, forward, right, up } => {
                let slot = json!({ "forward_m": forward, "right_m": right, "up_m": up });
                json!({ "action": "follow", "parameters": { "leader": leader, "slot": slot } })
            }
            Self::Hold => plain("hold"),
            Self::Land => plain("land"),
            Self::Return => plain("return"),
            Self::SetMode { mode } => json!({ "action": "set_mode", "parameters": { "mode": mode } }),
            Self::SetHeading { degrees } => json!({ "action": "set_heading", "parameters": { "heading_deg": degrees } }),
            Self::Terminate => plain("terminate"),
            Self::ReleasePayload => plain("release_payload"),
            Self::SecurePayload => plain("secure_payload"),
            Self::CancelTransfer => plain("cancel_transfer"),
        }
    }
}
