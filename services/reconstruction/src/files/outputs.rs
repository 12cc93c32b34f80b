//! Looks at every output of a command before any work is done: its name, its folder, and that it is no input and no other output.
//! What would only fail after minutes of work fails at once, and nobody's pictures are overwritten.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::FileError;

/// Why a command must not start. Each names the option that asked for the output.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The name says no format that is written there.
    #[error("{option} {}: the name must end in {expected}", path.display())]
    Ending {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// What it may end in.
        expected: String,
    },
    /// There is no such folder.
    #[error("{option} {}: there is no folder {}", path.display(), folder.display())]
    NoFolder {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// Where it should go.
        folder: PathBuf,
    },
    /// A folder stands where a file should go, or the other way round.
    #[error("{option} {} is {found}", path.display())]
    Kind {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// The system does not let a file be made there.
    #[error("{option} {} cannot be written", path.display())]
    NotWritable {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// It would overwrite an input.
    #[error("{option} {} would overwrite an input, that of {input}", path.display())]
    Input {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// The input's option.
        input: &'static str,
    },
    /// Two outputs are one file.
    #[error("{option} and {other} would write the same file, {}", path.display())]
    Twice {
        /// The option.
        option: &'static str,
        /// The output.
        path: PathBuf,
        /// The other option.
        other: &'static str,
    },
}

/// What may stand under the name of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    /// A file; a device or a pipe is written as it is.
    File,
    /// A file that a library makes: no device.
    PlainFile,
    /// A file in a folder that the command makes where there is none.
    InNewFolder,
}

/// One file that a command will write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    option: &'static str,
    path: PathBuf,
    endings: &'static [&'static str],
    sort: Sort,
}

impl Output {
    /// A file whose name must end in one of `endings` (lower case, without the dot; none of them: any name).
    pub fn file(option: &'static str, path: impl Into<PathBuf>, endings: &'static [&'static str]) -> Self {
        Self { option, path: path.into(), endings, sort: Sort::File }
    }

    /// The same, but neither a device nor a pipe.
    pub fn plain_file(option: &'static str, path: impl Into<PathBuf>, endings: &'static [&'static str]) -> Self {
        Self { sort: Sort::PlainFile, ..Self::file(option, path, endings) }
    }

    /// ROS's two files in a folder, which is made where there is none.
    #[must_use]
    pub fn ros(option: &'static str, folder: &Path) -> [Self; 2] {
        super::rig::ROS_FILES.map(|name| Self { sort: Sort::InNewFolder, ..Self::file(option, folder.join(name), &[]) })
    }

    fn check(&self) -> Result<(), OutputError> {
        let Self { option, ref path, .. } = *self;
        let kind = |found| OutputError::Kind { option, path: path.clone(), found };
        match std::fs::metadata(path).map(|data| data.file_type()) {
            Ok(there) if there.is_dir() => return Err(kind("a folder, not a file")),
            // What is neither file nor folder is written as it is; its name says no format.
            Ok(there) if !there.is_file() => {
                return if self.sort == Sort::File { Ok(()) } else { Err(kind("a device or a pipe, not a file")) };
            }
            _ => {}
        }
        if !self.endings.is_empty() && !has_ending(path, self.endings) {
            let expected = self.endings.iter().map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(" or ");
            return Err(OutputError::Ending { option, path: path.clone(), expected });
        }
        let mut folder = folder_of(path);
        if self.sort == Sort::InNewFolder {
            while !folder.exists() && folder != Path::new(".") {
                folder = folder_of(folder);
            }
        }
        match std::fs::metadata(folder) {
            Ok(there) if there.is_dir() => {}
            Ok(_) => return Err(OutputError::NoFolder { option, path: path.clone(), folder: folder.into() }),
            Err(error) if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                return Err(OutputError::NoFolder { option, path: path.clone(), folder: folder.into() });
            }
            Err(source) => return Err(OutputError::NotWritable { option, path: path.clone(), source }),
        }
        // The only proof that a file can be made is to make one. It has no name, and is gone at once.
        let made = tempfile::tempfile_in(folder);
        // The library adds a path of its own to the text.
        made.map_err(|error| OutputError::NotWritable { option, path: path.clone(), source: plain(&error) })?;
        Ok(())
    }
}

/// The system's own words, without what a library has added.
fn plain(error: &std::io::Error) -> std::io::Error {
    error.raw_os_error().map_or_else(|| error.kind().into(), std::io::Error::from_raw_os_error)
}

/// Checks the outputs of a command against the disk, its inputs and each other; inputs come with the option that names them.
///
/// Two names are one file when they lead to one place, whatever links are on the way, or when they are hard links of one file.
///
/// # Errors
/// [`OutputError`] for the first output that must not be written.
pub fn check_outputs<'a>(
    inputs: impl IntoIterator<Item = (&'static str, &'a Path)>,
    outputs: &[Output],
) -> Result<(), OutputError> {
    if outputs.is_empty() {
        return Ok(());
    }
    let mut known: HashMap<Identity, &'static str> = HashMap::new();
    for (option, path) in inputs {
        for identity in identities(path) {
            known.entry(identity).or_insert(option);
        }
    }
    let mut written: HashMap<Identity, &'static str> = HashMap::new();
    for output in outputs {
        output.check()?;
        let Output { option, ref path, .. } = *output;
        // Nothing is lost by writing to a device twice.
        if path.exists() && !path.is_file() {
            continue;
        }
        for identity in identities(path) {
            if let Some(input) = known.get(&identity) {
                return Err(OutputError::Input { option, path: path.clone(), input });
            }
            match written.insert(identity, option) {
                Some(other) if other != option => return Err(OutputError::Twice { option, path: path.clone(), other }),
                _ => {}
            }
        }
    }
    Ok(())
}

/// What makes a file the same as another one.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Identity {
    /// Its place, links followed as far as there is something.
    Place(PathBuf),
    /// Device and number.
    #[cfg(unix)]
    Number(u64, u64),
}

fn identities(path: &Path) -> Vec<Identity> {
    let place = path.canonicalize().ok().or_else(|| {
        let name: OsString = path.file_name()?.to_owned();
        Some(folder_of(path).canonicalize().ok()?.join(name))
    });
    let mut all = vec![Identity::Place(place.unwrap_or_else(|| path.to_owned()))];
    #[cfg(unix)]
    if let Ok(data) = std::fs::metadata(path) {
        use std::os::unix::fs::MetadataExt as _;
        all.push(Identity::Number(data.dev(), data.ino()));
    }
    all
}

/// The folder that a file is in; `.` for a bare name.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether the name ends in one of these (lower case, without the dot), in any case.
#[must_use]
pub fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    ending.is_some_and(|ending| endings.iter().any(|known| ending == *known))
}

impl From<OutputError> for FileError {
    fn from(error: OutputError) -> Self {
        Self::Output(error)
    }
}

#[cfg(test)]
#[path = "outputs/tests.rs"]
mod tests;
