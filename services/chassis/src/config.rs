//! Configuration in layers: the defaults in the code, one TOML file, `HALCYON_…` variables, flags; later ones win.
//!
//! `HALCYON_CAPTURE__RATE_HZ=10` and `--set capture.rate_hz=10` both set `rate_hz` in `[capture]`. An unknown section or key is
//! refused with the nearest known one.

use std::path::{Path, PathBuf};

use figment::Figment;
use figment::error::Kind;
use figment::providers::{Env, Format as _, Serialized, Toml};
use figment::value::{Dict, Value};
use halcyon_model::{FleetId, FleetOrigin, Geodetic};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Every section there is. A file may hold them all: each process reads those that concern it.
pub const SECTIONS: [&str; 12] = [
    "fleet",
    "bus",
    "clock",
    "log",
    "sim",
    "capture",
    "reconstruction",
    "wave_assessment",
    "mission_planner",
    "vehicle_link",
    "recorder",
    "gateway",
];

/// The configuration cannot be used. Its text is one line that names the section, the key and the source.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ConfigError(String);

impl ConfigError {
    /// With a text of its own.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}

/// One section of the configuration. Derive `Serialize` and `Deserialize` with `#[serde(default, deny_unknown_fields)]`.
pub trait Section: Default + Clone + Serialize + DeserializeOwned + Send + 'static {
    /// The section's name in TOML.
    const NAME: &'static str;

    /// Checks ranges and combinations; the text names the key.
    ///
    /// # Errors
    /// One line for people, without the section's name.
    fn validate(&self) -> Result<(), String>;

    /// Reads the section. Services that need another section too override this and call [`Settings::section`] for each.
    ///
    /// # Errors
    /// [`ConfigError`] if a value is unknown, of the wrong type or out of range.
    fn resolve(settings: &Settings) -> Result<Self, ConfigError> {
        settings.section()
    }
}

/// `[fleet]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FleetConfig {
    /// The fleet's name: hosts with different names do not see each other.
    pub id: String,
    /// This host's name; names the instances of its services, such as `capture.leader-1`.
    pub host: String,
    /// Latitude of the local frame's origin, degrees.
    pub origin_latitude_deg: f64,
    /// Longitude of the local frame's origin, degrees.
    pub origin_longitude_deg: f64,
    /// Mean water level at the origin above mean sea level, metres.
    pub origin_altitude_m: f64,
}

impl Default for FleetConfig {
    fn default() -> Self {
        // The lake of the thesis (7.3). It prints the longitude without its sign; Chester is west of Greenwich.
        Self {
            id: "fleet".into(),
            host: "local".into(),
            origin_latitude_deg: 53.117_274,
            origin_longitude_deg: -2.905_347,
            origin_altitude_m: 12.0,
        }
    }
}

impl FleetConfig {
    /// The origin of the fleet's local frame.
    #[must_use]
    pub fn origin(&self) -> FleetOrigin {
        FleetOrigin(Geodetic::from_deg(self.origin_latitude_deg, self.origin_longitude_deg, self.origin_altitude_m))
    }
}

impl Section for FleetConfig {
    const NAME: &'static str = "fleet";

    fn validate(&self) -> Result<(), String> {
        FleetId::new(&self.id).map_err(|error| format!("id: {error}"))?;
        halcyon_model::InstanceId::new(&self.host).map_err(|error| format!("host: {error}"))?;
        // A tangent plane at a pole has no north.
        if self.origin().0.is_valid() && self.origin_latitude_deg.abs() < 89.0 {
            Ok(())
        } else {
            Err("origin_latitude_deg, origin_longitude_deg or origin_altitude_m is out of range".into())
        }
    }
}

/// One effective setting, for people.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// Dotted key.
    pub key: String,
    /// Value as TOML writes it.
    pub value: String,
    /// Where it came from.
    pub source: String,
}

/// All layers but the defaults.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    layers: Figment,
}

impl Settings {
    /// Reads the file (if `None`: `halcyon.toml` in the working folder, if there is one), the environment and `overrides`
    /// (`section.key=value`).
    ///
    /// # Errors
    /// [`ConfigError`] if the file is missing or no TOML, if an override is no assignment, or if a section is unknown.
    pub fn load(file: Option<&Path>, overrides: &[String]) -> Result<Self, ConfigError> {
        let mut layers = Figment::new();
        let default = PathBuf::from("halcyon.toml");
        if let Some(path) = file.or_else(|| default.is_file().then_some(default.as_path())) {
            layers = layers.merge(file_layer(path)?);
        }
        // Other HALCYON_ variables (HALCYON_CONFIG, HALCYON_URL) are not settings: settings have a section.
        layers = layers.merge(Env::prefixed("HALCYON_").filter(|key| key.as_str().contains("__")).split("__"));
        for assignment in overrides {
            layers = layers.merge(flag(assignment)?);
        }
        let settings = Self { layers };
        settings.check_sections()?;
        Ok(settings)
    }

    /// Puts a file on top, such as a scenario.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn with_file(self, path: &Path) -> Result<Self, ConfigError> {
        let settings = Self { layers: self.layers.merge(file_layer(path)?) };
        settings.check_sections()?;
        Ok(settings)
    }

    /// Puts one more layer on top: the values of `section` under its name.
    #[must_use]
    pub fn with<T: Section>(self, section: &T) -> Self {
        Self { layers: self.layers.merge(Serialized::default(T::NAME, section)) }
    }

    /// One section, defaults below, validated.
    ///
    /// # Errors
    /// [`ConfigError`] if a key is unknown, or a value of the wrong type or out of range.
    pub fn section<T: Section>(&self) -> Result<T, ConfigError> {
        let section: T = self.layered::<T>().extract_inner(T::NAME).map_err(|error| describe_error(T::NAME, &error))?;
        section.validate().map_err(|problem| ConfigError(format!("[{}] {problem}", T::NAME)))?;
        Ok(section)
    }

    /// Every effective value of a section, with where it came from.
    ///
    /// # Errors
    /// As [`Self::section`].
    pub fn describe<T: Section>(&self) -> Result<Vec<Setting>, ConfigError> {
        self.section::<T>()?;
        let figment = self.layered::<T>();
        let value = figment.find_value(T::NAME).map_err(|error| describe_error(T::NAME, &error))?;
        let mut settings = Vec::new();
        flatten(T::NAME.to_owned(), &value, &figment, &mut settings);
        Ok(settings)
    }

    fn layered<T: Section>(&self) -> Figment {
        Figment::from(Serialized::default(T::NAME, T::default())).merge(self.layers.clone())
    }

    fn check_sections(&self) -> Result<(), ConfigError> {
        let all: Dict = self.layers.extract().map_err(|error| describe_error("", &error))?;
        for name in all.keys() {
            if !SECTIONS.contains(&name.as_str()) {
                let source = self.layers.find_metadata(name).map(source_of).unwrap_or_default();
                return Err(ConfigError(format!("unknown section [{name}]{}{source}", hint(name, &SECTIONS))));
            }
        }
        Ok(())
    }
}

/// A TOML file as a layer. figment alone takes a missing file for an empty one, and a syntax error without its line.
fn file_layer(path: &Path) -> Result<Figment, ConfigError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| ConfigError(format!("configuration file {}: {error}", path.display())))?;
    toml::from_str::<toml::Table>(&text).map_err(|error| {
        let line = error.span().map_or(0, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        ConfigError(format!("configuration file {}, line {line}: {}", path.display(), error.message()))
    })?;
    Ok(Figment::from(Toml::file_exact(path)))
}

/// `section.key=value` as a layer.
fn flag(assignment: &str) -> Result<Figment, ConfigError> {
    let usage = || ConfigError(format!("--set {assignment:?} must be section.key=value, such as capture.rate_hz=10"));
    let (key, text) = assignment.split_once('=').ok_or_else(usage)?;
    let key = key.trim();
    if !key.contains('.') || key.split('.').any(str::is_empty) {
        return Err(usage());
    }
    // A bare word is a string: `--set capture.source=folder` needs no quotes in quotes.
    let value: toml::Value = toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.to_owned()));
    Ok(Figment::from(Serialized::default(key, value)))
}

fn flatten(path: String, value: &Value, figment: &Figment, settings: &mut Vec<Setting>) {
    if let Value::Dict(_, dict) = value {
        for (key, value) in dict {
            flatten(format!("{path}.{key}"), value, figment, settings);
        }
        return;
    }
    let source = figment.get_metadata(value.tag()).map_or_else(|| "default".into(), describe_source);
    let text = toml::Value::try_from(value).map_or_else(|_| format!("{value:?}"), |value| value.to_string());
    settings.push(Setting { key: path, value: text, source });
}

fn describe_source(metadata: &figment::Metadata) -> String {
    match &metadata.source {
        Some(figment::Source::File(path)) => format!("file {}", path.display()),
        Some(figment::Source::Code(_)) if metadata.name.contains("toml::value::Value") => "flag".into(),
        Some(figment::Source::Code(_)) => "default".into(),
        _ if metadata.name.contains("environment") => "environment".into(),
        _ => metadata.name.to_string(),
    }
}

fn source_of(metadata: &figment::Metadata) -> String {
    match describe_source(metadata).as_str() {
        "default" => String::new(),
        source => format!(" ({source})"),
    }
}

fn hint(name: &str, known: &[&str]) -> String {
    let nearest = known.iter().map(|known| (strsim::jaro_winkler(name, known), known)).max_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((likeness, nearest)) if likeness > 0.7 => format!("; did you mean {nearest}?"),
        _ => format!("; known are {}", known.join(", ")),
    }
}

/// figment's error on one line, with the key's path and source.
fn describe_error(section: &str, error: &figment::Error) -> ConfigError {
    let source = error.metadata.as_ref().map(source_of).unwrap_or_default();
    // figment gives the path sometimes from the top and sometimes from the section, with the profile and the field or without.
    let path = error.path.iter().map(String::as_str).filter(|part| ![section, "default"].contains(part));
    let text = match &error.kind {
        Kind::UnknownField(field, known) => {
            let key: Vec<&str> = path.filter(|part| part != field).chain([field.as_str()]).collect();
            format!("[{section}] unknown key {}{}{source}", key.join("."), hint(field, known))
        }
        kind => format!("[{section}] {}: {kind}{source}", path.collect::<Vec<_>>().join(".")),
    };
    ConfigError(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::ClockConfig;

    fn load(file: &str, overrides: &[&str]) -> Result<Settings, ConfigError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("h.toml");
        std::fs::write(&path, file).unwrap();
        Settings::load(Some(&path), &overrides.iter().map(ToString::to_string).collect::<Vec<_>>())
    }

    #[test]
    fn later_layers_win_and_say_so() {
        let settings = load("[clock]\nspeed = 2\nepoch_s = 5.0\n", &["clock.speed=3"]).unwrap();
        assert_eq!(settings.section::<ClockConfig>().unwrap(), ClockConfig { speed: 3.0, epoch_s: 5.0 });
        let described = settings.describe::<ClockConfig>().unwrap();
        let source = |key: &str| described.iter().find(|setting| setting.key == key).unwrap().source.clone();
        assert_eq!(source("clock.speed"), "flag");
        assert!(source("clock.epoch_s").starts_with("file "), "{described:?}");
        assert_eq!(Settings::default().describe::<ClockConfig>().unwrap()[0].source, "default");
    }

    #[track_caller]
    fn refused(file: &str, overrides: &[&str], expected: &str) {
        let error = load(file, overrides).and_then(|settings| settings.section::<ClockConfig>()).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error:?} should contain {expected:?}");
    }

    #[test]
    fn what_is_not_known_is_refused_with_the_nearest() {
        refused("[clock]\nsped = 2.0\n", &[], "[clock] unknown key sped; did you mean speed?");
        refused("[klock]\n", &[], "unknown section [klock]; did you mean clock?");
        refused("[clock]\nspeed = \"fast\"\n", &[], "[clock] speed");
        refused("[clock]\nspeed = nan\n", &[], "[clock] speed must be in 0.01 to 100, not NaN");
        refused("[clock\n", &[], "line 1");
        refused("", &["speed"], "section.key=value");
        refused("", &["clock.speed=soon"], "[clock] speed");
    }

    #[test]
    fn a_missing_file_is_an_error_and_not_an_empty_one() {
        let error = Settings::load(Some(Path::new("no/such/file.toml")), &[]).unwrap_err();
        assert!(error.to_string().contains("no/such/file.toml"));
    }
}
