//! The thesis's results, table by table and figure by figure, its values beside ours: `halcyon lab`.
//!
//! An experiment is a function from a [`Lab`] (where the sample pictures are, how much to run) to an [`Exhibit`] (what to show, and
//! which figures stand against the thesis's). Several tables and figures may come out of one experiment: a wave tank is run once.
//!
//! The thesis's own pictures are not public. Where it photographed a board, OpenCV's public board pictures stand in; for its bone,
//! the aloe pair; for its water, simulated water whose every height is known. Pictures of its apparatus and drawings that explain a method
//! are no results and have no experiment.

mod air;
mod calibration;
mod context;
mod costs;
mod dense;
mod exhibit;
mod features;
mod flat;
mod formation;
mod parts;
mod pictures;
mod speed;
mod tank;
mod verdicts;

pub use context::{Lab, LabError};
pub use exhibit::{Exhibit, File, Finding, number};
pub use parts::{Part, page, read_parts, write};

/// One experiment.
#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// For the command line.
    pub name: &'static str,
    /// Tables, figures and equations that come out of it, in the thesis's numbering.
    pub shows: &'static [&'static str],
    /// What it is about.
    pub about: &'static str,
    run: fn(&Lab) -> Result<Exhibit, LabError>,
}

/// Every experiment, in the thesis's order.
pub const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "calibration",
        shows: &["figure 3-7", "table 3-1"],
        about: "Zhang's calibration: reprojection error against number of views; parameters",
        run: calibration::run,
    },
    Experiment {
        name: "rectification",
        shows: &["figure 4-4", "figure 4-22"],
        about: "A pair before and after rectification, with epipolar lines",
        run: dense::rectification,
    },
    Experiment {
        name: "costs",
        shows: &["figure 4-6", "figure 4-7", "figure 4-8", "equations 4-10 to 4-15"],
        about: "Six ways to compare pixels; rank and census transforms",
        run: costs::costs,
    },
    Experiment {
        name: "windows",
        shows: &["figure 4-9"],
        about: "One correlation window against nine shifted ones",
        run: costs::windows,
    },
    Experiment {
        name: "left-right",
        shows: &["figure 4-10"],
        about: "What the left-right consistency check takes out",
        run: costs::left_right,
    },
    Experiment {
        name: "paths",
        shows: &["figure 4-11", "equation 4-16"],
        about: "Semi-global matching over 4, 8 and 16 paths",
        run: costs::paths,
    },
    Experiment {
        name: "keypoints",
        shows: &["table 4-2", "table 4-3", "figure 4-16", "figure 4-17", "figure 4-18", "figure 4-19"],
        about: "Keypoints of a textured object by four detectors, before and after RANSAC",
        run: features::object,
    },
    Experiment {
        name: "epipolar",
        shows: &["equations 4-25 to 4-31", "figure 4-20"],
        about: "F, E, pose, projection matrices and sparse cloud from SIFT matches alone",
        run: features::epipolar,
    },
    Experiment {
        name: "dense",
        shows: &["figure 4-5", "figure 4-23", "figure 4-24", "figure 4-25"],
        about: "Block matching and semi-global matching: disparity, points, clouds",
        run: dense::object,
    },
    Experiment {
        name: "water-keypoints",
        shows: &["table 5-1", "table 5-2", "figure 5-2", "figure 5-3", "figure 5-4", "figure 5-5"],
        about: "Keypoints of clear water, before and after RANSAC",
        run: features::water,
    },
    Experiment {
        name: "film",
        shows: &["figure 5-6", "figure 5-15", "figure 5-16"],
        about: "Dense matching of clear water, and of water under an opaque film",
        run: dense::film,
    },
    Experiment {
        name: "baseline",
        shows: &["figure 5-8", "figure 5-9", "figure 5-10"],
        about: "A plane at 0.5 m with baselines of 9.2, 12 and 15 cm",
        run: flat::baseline,
    },
    Experiment { name: "speed", shows: &["figure 5-17"], about: "Time from pair to patch against resolution", run: speed::run },
    Experiment {
        name: "still-water",
        shows: &["figure 5-18", "figure 5-19", "figure 5-20"],
        about: "False wave height over still water from four heights",
        run: flat::still,
    },
    Experiment {
        name: "tank",
        shows: &[
            "figure 5-22",
            "figure 5-23",
            "figure 5-24",
            "figure 5-25",
            "figure 5-26",
            "figure 5-27",
            "figure 5-28",
            "figure 5-29",
            "figure 5-30",
        ],
        about: "The wave tank: stereo, ultrasonic sensor and wave probe in time and frequency",
        run: tank::run,
    },
    Experiment {
        name: "formation",
        shows: &["table 6-6", "table 6-7", "table 6-8", "table 6-9"],
        about: "A follower at 5 and 7 m in wind, by the thesis's law and others: square and sweep of the heading",
        run: formation::run,
    },
    Experiment {
        name: "air",
        shows: &["figure 7-6", "figure 7-7", "figure 7-8", "table 7-1", "table 7-2"],
        about: "From the air: outliers, crests and troughs, wave heights against the truth",
        run: air::run,
    },
    Experiment {
        name: "verdicts",
        shows: &["beyond the thesis"],
        about: "How far a verdict can be trusted: thousands of random seas about the limits",
        run: verdicts::run,
    },
];

impl Experiment {
    /// Runs it.
    ///
    /// # Errors
    /// [`LabError`] where pictures are missing or nothing can be measured in them.
    pub fn run(&self, lab: &Lab) -> Result<Exhibit, LabError> {
        (self.run)(lab)
    }

    /// Whether `wanted` means this one: its name, a table, figure or equation of it (`5-1`, `table 5-1`, `fig 5-1`), or its chapter
    /// (`chapter 5`).
    fn is(&self, wanted: &str) -> bool {
        let wanted = wanted.trim().to_lowercase().replace("figure", "").replace("fig.", "").replace("fig", "");
        let is_table = wanted.contains("table");
        let wanted = wanted.replace("table", "").replace("equation", "");
        let wanted = wanted.trim_matches([' ', '-', '_', '.']);
        let shown = |shown: &&str| match shown.rsplit_once(' ') {
            Some((kind, number)) => number == wanted && (!is_table || kind == "table"),
            None => false,
        };
        let chapter = wanted.strip_prefix("chapter").map(|chapter| chapter.trim_matches([' ', '-']));
        let of_chapter = |chapter: &str| {
            chapter.parse::<u32>().is_ok()
                && self.shows.iter().any(|shown| shown.rsplit(' ').next().is_some_and(|n| n.split('-').next() == Some(chapter)))
        };
        self.name == wanted || self.shows.iter().any(shown) || chapter.is_some_and(of_chapter)
    }
}

/// The experiments that `wanted` names, each once, in the thesis's order; all where it names none.
///
/// # Errors
/// The first name that means nothing here.
pub fn select(wanted: &[String]) -> Result<Vec<&'static Experiment>, &str> {
    if let Some(unknown) = wanted.iter().find(|name| !EXPERIMENTS.iter().any(|experiment| experiment.is(name))) {
        return Err(unknown);
    }
    let is_wanted = |experiment: &&Experiment| wanted.is_empty() || wanted.iter().any(|name| experiment.is(name));
    Ok(EXPERIMENTS.iter().filter(is_wanted).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(wanted: &[&str]) -> Vec<&'static str> {
        let wanted: Vec<String> = wanted.iter().map(|name| (*name).to_owned()).collect();
        select(&wanted).unwrap().iter().map(|experiment| experiment.name).collect()
    }

    #[test]
    fn experiments_go_by_name_by_number_and_by_chapter() {
        assert_eq!(names(&["tank"]), ["tank"]);
        assert_eq!(names(&["5-1"]), ["water-keypoints"]);
        assert_eq!(names(&["table 5-1", "Fig. 5-4", "fig-5-10", "table-7-1"]), ["water-keypoints", "baseline", "air"]);
        assert_eq!(names(&["chapter 3"]), ["calibration"]);
        assert_eq!(names(&[]).len(), EXPERIMENTS.len());
        assert_eq!(select(&["table 5-17".to_owned()]).unwrap_err(), "table 5-17", "5-17 is a figure");
        assert_eq!(names(&["chapter 6"]), ["formation"]);
        assert!(select(&["chapter 8".to_owned()]).is_err() && select(&[String::new()]).is_err());
    }

    /// Every table and figure of chapters 3 to 5 that holds a result, and the flights' tables. The others are photographs of apparatus and drawings.
    #[test]
    fn nothing_of_the_thesis_is_left_out() {
        let figures = [
            "3-7", "4-4", "4-5", "4-7", "4-8", "4-9", "4-10", "4-11", "4-16", "4-17", "4-18", "4-19", "4-20", "4-22", "4-23",
            "4-24", "4-25", "5-2", "5-3", "5-4", "5-5", "5-6", "5-8", "5-9", "5-10", "5-15", "5-16", "5-17", "5-18", "5-19",
            "5-20", "5-22", "5-23", "5-24", "5-25", "5-26", "5-27", "5-28", "5-29", "5-30",
        ];
        let tables = ["3-1", "4-2", "4-3", "5-1", "5-2", "6-6", "6-7", "6-8", "6-9"];
        for (kind, numbers) in [("figure", &figures[..]), ("table", &tables[..])] {
            for number in numbers {
                let wanted = format!("{kind} {number}");
                let shown = EXPERIMENTS.iter().filter(|experiment| experiment.shows.contains(&wanted.as_str())).count();
                assert_eq!(shown, 1, "{wanted}");
            }
        }
    }
}
