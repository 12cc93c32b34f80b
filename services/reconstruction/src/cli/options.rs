//! Options of `halcyon match` beyond the engine's name.

use std::path::PathBuf;

use crate::core::matcher::{Engine, Matcher};
use crate::core::study::cost::Cost;
use crate::core::study::path::Paths;
use crate::core::study::window::Windows;
use crate::core::study::{Optimiser, ReferenceMatcher, Settings};

/// What else can be chosen; `None` and `false` take what suits the engine.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchOptions {
    /// Side of the window, pixels, odd.
    pub window_px: Option<u32>,
    /// `wta-` and `sgm-`: 1 window or the best of 9.
    pub windows: Option<u32>,
    /// `-rank` and `-census`: side of the neighbourhood, pixels, odd.
    pub transform_px: Option<u32>,
    /// `sgm-`: 4, 8 or 16 paths.
    pub paths: Option<u32>,
    /// `sgm-`: penalty for a step by one pixel, in the unit of the cost.
    pub p1: Option<f32>,
    /// `sgm-`: penalty for a larger step.
    pub p2: Option<f32>,
    /// `sgm-`: a smaller P2 across edges of brightness.
    pub adaptive_p2: bool,
    /// `wta-` and `sgm-`: leave out the left-right check.
    pub no_left_right_check: bool,
    /// `wta-` and `sgm-`: percent by which the best cost must beat all others.
    pub uniqueness_percent: Option<f32>,
    /// `wta-` and `sgm-`: whole pixels only.
    pub no_sub_pixel: bool,
    /// The true disparity, PFM or picture.
    pub truth: Option<PathBuf>,
    /// Pixels of disparity for one grey level of a truth that is a picture.
    pub truth_scale_px: f32,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self {
            window_px: None,
            windows: None,
            transform_px: None,
            paths: None,
            p1: None,
            p2: None,
            adaptive_p2: false,
            no_left_right_check: false,
            uniqueness_percent: None,
            no_sub_pixel: false,
            truth: None,
            truth_scale_px: 1.0,
        }
    }
}

/// An option that makes no sense, or not with this engine.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OptionError {
    /// Only other engines have it.
    #[error("{option} is for engines that {engines}, not for {engine}")]
    Engine {
        /// The option.
        option: &'static str,
        /// Which engines have it, after "that".
        engines: &'static str,
        /// The one that was asked for.
        engine: &'static str,
    },
    /// Out of range.
    #[error("{0}")]
    Value(String),
}

impl MatchOptions {
    /// The window that will be used with `engine`.
    #[must_use]
    pub fn window_px(&self, engine: Engine) -> u32 {
        self.window_px.unwrap_or_else(|| engine.block_px_default())
    }

    /// A matcher with these options.
    ///
    /// # Errors
    /// [`OptionError`] for the first option that does not fit.
    pub fn matcher(&self, engine: Engine) -> Result<Box<dyn Matcher>, OptionError> {
        // Negated so that NaN is refused, too.
        if !(self.truth_scale_px > 0.0 && self.truth_scale_px.is_finite()) {
            return Err(OptionError::Value(format!(
                "--truth-scale must be above 0 px for a grey level, not {}",
                self.truth_scale_px
            )));
        }
        let study = [
            ("--windows", self.windows.is_some()),
            ("--transform", self.transform_px.is_some()),
            ("--no-lr-check", self.no_left_right_check),
            ("--uniqueness", self.uniqueness_percent.is_some()),
            ("--no-sub-pixel", self.no_sub_pixel),
        ];
        let semi_global = [
            ("--paths", self.paths.is_some()),
            ("--p1", self.p1.is_some()),
            ("--p2", self.p2.is_some()),
            ("--adaptive-p2", self.adaptive_p2),
        ];
        let set = |options: &[(&'static str, bool)]| options.iter().find(|(_, is_set)| *is_set).map(|(option, _)| *option);
        let refuse = |option, engines| Err(OptionError::Engine { option, engines, engine: engine.name() });
        let Engine::Study(method) = engine else {
            if let Some(option) = set(&study) {
                return refuse(option, "start with wta- or sgm-");
            }
            if let Some(option) = set(&semi_global) {
                return refuse(option, "start with sgm-");
            }
            let (window_px, least) = (self.window_px(engine), if engine == Engine::Bm { 5 } else { 1 });
            if window_px % 2 == 0 || !(least..=51).contains(&window_px) {
                return Err(OptionError::Value(format!("--window must be odd, {least} to 51 px, not {window_px} px")));
            }
            return Ok(engine.matcher(window_px));
        };
        if let (false, Some(option)) = (method.semi_global, set(&semi_global)) {
            return refuse(option, "start with sgm-");
        }
        if self.transform_px.is_some() && !matches!(method.cost, Cost::Rank | Cost::Census) {
            return refuse("--transform", "end in -rank or -census");
        }
        let settings = self.settings(Settings::new(method, self.window_px(engine)))?;
        settings.check().map_err(OptionError::Value)?;
        Ok(Box::new(ReferenceMatcher::new(settings)))
    }

    fn settings(&self, mut settings: Settings) -> Result<Settings, OptionError> {
        settings.windows = match self.windows {
            None | Some(1) => Windows::One,
            Some(9) => Windows::Nine,
            Some(other) => return Err(OptionError::Value(format!("there can be 1 or 9 windows, not {other}"))),
        };
        if let Some(side_px) = self.transform_px {
            settings.transform_px = side_px;
        }
        if let Optimiser::SemiGlobal { paths, penalties } = &mut settings.optimiser {
            if let Some(count) = self.paths {
                *paths = Paths::of(count)
                    .ok_or_else(|| OptionError::Value(format!("there can be 4, 8 or 16 paths, not {count}")))?;
            }
            penalties.p1 = self.p1.unwrap_or(penalties.p1);
            // Whoever raises only P1 means steps of any size.
            penalties.p2 = self.p2.unwrap_or(penalties.p2.max(penalties.p1));
            penalties.adaptive = self.adaptive_p2;
        }
        if self.no_left_right_check {
            settings.left_right_px = None;
        }
        settings.uniqueness_percent = self.uniqueness_percent.unwrap_or(settings.uniqueness_percent);
        settings.sub_pixel = !self.no_sub_pixel;
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn refused(engine: &str, options: &MatchOptions) -> String {
        options.matcher(engine.parse().unwrap()).err().unwrap().to_string()
    }

    #[test]
    fn options_that_do_not_fit_are_named() {
        let default = MatchOptions::default;
        for (engine, options, expected) in [
            ("sgbm", MatchOptions { paths: Some(8), ..default() }, "--paths is for engines that start with sgm-"),
            ("bm", MatchOptions { windows: Some(9), ..default() }, "--windows is for engines that start with wta- or sgm-"),
            ("wta-sad", MatchOptions { p1: Some(1.0), ..default() }, "--p1 is for engines that start with sgm-"),
            (
                "wta-sad",
                MatchOptions { transform_px: Some(5), ..default() },
                "--transform is for engines that end in -rank or -census",
            ),
            (
                "sgm-mi",
                MatchOptions { transform_px: Some(5), ..default() },
                "--transform is for engines that end in -rank or -census",
            ),
            ("bm", MatchOptions { window_px: Some(3), ..default() }, "5 to 51 px, not 3 px"),
            ("sgbm", MatchOptions { window_px: Some(4), ..default() }, "odd"),
            ("wta-sad", MatchOptions { window_px: Some(53), ..default() }, "1 to 51, not 53"),
            ("wta-ncc", MatchOptions { window_px: Some(1), ..default() }, "3 to 51, not 1"),
            ("wta-census", MatchOptions { transform_px: Some(13), ..default() }, "3 to 11, not 13"),
            ("wta-sad", MatchOptions { windows: Some(4), ..default() }, "1 or 9"),
            ("sgm-sad", MatchOptions { paths: Some(5), ..default() }, "4, 8 or 16"),
            ("sgm-sad", MatchOptions { p1: Some(9.0), p2: Some(3.0), ..default() }, "P1 <= P2"),
            ("sgm-sad", MatchOptions { p2: Some(f32::NAN), ..default() }, "P1 <= P2"),
            ("sgm-sad", MatchOptions { p1: Some(-1.0), ..default() }, "0 <= P1"),
            ("wta-sad", MatchOptions { uniqueness_percent: Some(f32::NAN), ..default() }, "uniqueness"),
            ("sgbm", MatchOptions { truth_scale_px: 0.0, ..default() }, "scale"),
        ] {
            let error = refused(engine, &options);
            assert!(error.contains(expected), "{error}");
        }
        let all = MatchOptions {
            window_px: Some(5),
            windows: Some(9),
            transform_px: Some(5),
            paths: Some(16),
            p1: Some(1.0),
            p2: Some(9.0),
            adaptive_p2: true,
            no_left_right_check: true,
            uniqueness_percent: Some(5.0),
            no_sub_pixel: true,
            ..default()
        };
        assert!(all.matcher("sgm-census".parse().unwrap()).is_ok());
    }
}
