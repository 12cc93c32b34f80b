//! Flight modes, by ArduCopter's numbers and names.

/// A flight mode that this autopilot has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Sticks lean the vehicle, throttle is thrust.
    Stabilize,
    /// Sticks lean the vehicle, throttle is climb rate.
    AltHold,
    /// Flies the mission.
    Auto,
    /// Flies where it is told over MAVLink.
    Guided,
    /// Sticks are velocity; holds its place without them.
    Loiter,
    /// Climbs, returns, lands.
    Rtl,
    /// Lands here.
    Land,
    /// Stops and holds.
    Brake,
}

impl Mode {
    /// From ArduCopter's `custom_mode`; `None` for a mode that this autopilot lacks.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        Some(match number {
            0 => Self::Stabilize,
            2 => Self::AltHold,
            3 => Self::Auto,
            4 => Self::Guided,
            5 => Self::Loiter,
            6 => Self::Rtl,
            9 => Self::Land,
            17 => Self::Brake,
            _ => return None,
        })
    }

    /// ArduCopter's `custom_mode`.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::Stabilize => 0,
            Self::AltHold => 2,
            Self::Auto => 3,
            Self::Guided => 4,
            Self::Loiter => 5,
            Self::Rtl => 6,
            Self::Land => 9,
            Self::Brake => 17,
        }
    }

    /// ArduCopter's name, as its texts write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stabilize => "STABILIZE",
            Self::AltHold => "ALT_HOLD",
            Self::Auto => "AUTO",
            Self::Guided => "GUIDED",
            Self::Loiter => "LOITER",
            Self::Rtl => "RTL",
            Self::Land => "LAND",
            Self::Brake => "BRAKE",
        }
    }

    /// Whether it needs a trusted position.
    #[must_use]
    pub fn needs_position(self) -> bool {
        !matches!(self, Self::Stabilize | Self::AltHold | Self::Land)
    }

    /// Whether motors may be armed in it.
    #[must_use]
    pub fn may_arm(self) -> bool {
        matches!(self, Self::Stabilize | Self::AltHold | Self::Guided | Self::Loiter)
    }

    /// Whether a ground station sees it as guided by the autopilot.
    #[must_use]
    pub fn is_guided(self) -> bool {
        self.needs_position()
    }
}
