//! The report, experiment by experiment: what is done is written at once, and what another run has done stays.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{EXPERIMENTS, Exhibit, Experiment};
use crate::report::Page;

/// Where the parts of a report are kept, within its folder.
const PARTS: &str = "parts";

/// One experiment's part of the report, as it is kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The experiment's name.
    pub name: String,
    /// Day and time of the run, and how much of it was run.
    pub run: String,
    /// Rows of the table of figures.
    rows: Vec<Vec<String>>,
    /// Its section of the page.
    html: String,
}

impl Part {
    /// What an experiment has shown.
    #[must_use]
    pub fn new(experiment: &Experiment, exhibit: &Exhibit, run: &str) -> Self {
        let mut section = Page::new("");
        exhibit.add_to(&mut section);
        let rows = exhibit.rows(experiment.name);
        Self { name: experiment.name.into(), run: run.into(), rows, html: section.into_body() }
    }
}

/// The parts that a folder keeps, in the thesis's order. What is damaged, or of an experiment that is no more, is as if it were not there.
#[must_use]
pub fn read_parts(folder: &Path) -> Vec<Part> {
    let read = |experiment: &Experiment| -> Option<Part> {
        let text = std::fs::read(part_file(folder, experiment.name)).ok()?;
        serde_json::from_slice::<Part>(&text).ok().filter(|part| part.name == experiment.name)
    };
    EXPERIMENTS.iter().filter_map(read).collect()
}

fn part_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(PARTS).join(format!("{name}.json"))
}

/// All parts as one page.
#[must_use]
pub fn page(parts: &[Part]) -> String {
    let mut page = Page::new("Halcyon beside the thesis");
    page.paragraph(
        "Tables and figures with a result, made again. The thesis's own pictures are not public: public pictures and simulated water stand in, \
         so that counts differ with the scene while errors can be compared.",
    );
    let known = |part: &&Part| EXPERIMENTS.iter().find(|experiment| experiment.name == part.name);
    let title = |experiment: &Experiment| format!("{} ({})", experiment.about, experiment.shows.join(", "));
    let contents: Vec<(String, String)> =
        parts.iter().filter_map(|part| Some((part.name.clone(), title(known(&part)?)))).collect();
    page.contents(&contents);
    let rows: Vec<Vec<String>> = parts.iter().flat_map(|part| part.rows.clone()).collect();
    page.table(&["experiment", "figure", "unit", "measured", "thesis"], &rows);
    for part in parts {
        let Some(experiment) = known(&part) else { continue };
        page.anchored_heading(&part.name, &title(experiment));
        page.paragraph(&part.run);
        page.append(&part.html);
    }
    page.html()
}

/// Writes a part, the files of its exhibit, and the page of all parts that are there: `index.html`.
///
/// # Errors
/// Where the folder or a file cannot be written.
pub fn write(folder: &Path, part: &Part, exhibit: &Exhibit) -> std::io::Result<()> {
    std::fs::create_dir_all(folder.join(PARTS))?;
    for file in &exhibit.files {
        replace(&folder.join(&file.name), &file.bytes)?;
    }
    replace(&part_file(folder, &part.name), &serde_json::to_vec(part)?)?;
    replace(&folder.join("index.html"), page(&read_parts(folder)).as_bytes())
}

/// Beside it first: a reader, or a run that is broken off, never meets half a file.
fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    std::fs::write(&beside, bytes)?;
    std::fs::rename(&beside, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(experiment: &Experiment, text: &str) -> (Part, Exhibit) {
        let mut exhibit = Exhibit::default();
        exhibit.text(text);
        exhibit.find("kappa", "mm", 1.5, None);
        (Part::new(experiment, &exhibit, "quick run"), exhibit)
    }

    #[test]
    fn a_later_run_keeps_what_an_earlier_one_has_shown() {
        let folder = tempfile::tempdir().unwrap();
        let index = || std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        for (experiment, text) in [(&EXPERIMENTS[3], "alpha"), (&EXPERIMENTS[0], "beta"), (&EXPERIMENTS[3], "gamma")] {
            let (part, exhibit) = part(experiment, text);
            write(folder.path(), &part, &exhibit).unwrap();
        }
        let html = index();
        assert!(html.contains("beta") && html.contains("gamma") && !html.contains("alpha"));
        assert!(html.find("beta") < html.find("gamma"), "in the thesis's order");
        assert_eq!(html.matches("kappa").count(), 2);
        // Damage loses a part, not the report.
        std::fs::write(part_file(folder.path(), EXPERIMENTS[0].name), "{").unwrap();
        let (part, exhibit) = part(&EXPERIMENTS[1], "delta");
        write(folder.path(), &part, &exhibit).unwrap();
        assert!(index().contains("gamma") && index().contains("delta") && !index().contains("beta"));
    }
}
