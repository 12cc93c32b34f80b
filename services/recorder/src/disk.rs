//! Recordings in their folder: names, and which of them have to go.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use halcyon_model::{FleetId, Stamp};

/// Recordings of one fleet that are kept at most, however small.
const FILES_MAX: usize = 10_000;

/// Makes a new file `FLEET-YYYYMMDDThhmmssZ[-N].mcap`; never an existing one.
///
/// # Errors
/// If the folder or the file cannot be made.
pub(crate) fn create(folder: &Path, fleet: &FleetId, now: Stamp) -> io::Result<(File, PathBuf)> {
    fs::create_dir_all(folder)?;
    let time = jiff::Timestamp::from_nanosecond(i128::from(now.as_nanos())).unwrap_or_default();
    let stem = format!("{fleet}-{}", time.strftime("%Y%m%dT%H%M%SZ"));
    for number in 1..=FILES_MAX {
        let suffix = if number == 1 { String::new() } else { format!("-{number}") };
        let path = folder.join(format!("{stem}{suffix}.mcap"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((file, path)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::AlreadyExists, "too many recordings were begun in one second"))
}

/// Deletes the oldest recordings of `fleet`, other than `current`, until all of them together take at most `bytes_max`. Returns
/// what went.
///
/// # Errors
/// If the folder cannot be read or a file cannot be deleted.
pub(crate) fn prune(folder: &Path, fleet: &FleetId, current: &Path, bytes_max: u64) -> io::Result<Vec<PathBuf>> {
    let mut recordings = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_str().is_some_and(|name| is_recording_of(name, fleet)) {
            let metadata = entry.metadata()?;
            recordings.push((metadata.modified()?, entry.path(), metadata.len()));
        }
    }
    recordings.sort();
    let mut bytes: u64 = recordings.iter().map(|(.., size)| size).sum();
    let mut count = recordings.len();
    let mut gone = Vec::new();
    for (_, path, size) in recordings {
        if bytes <= bytes_max && count <= FILES_MAX {
            break;
        }
        if path == current {
            continue;
        }
        fs::remove_file(&path)?;
        bytes -= size;
        count -= 1;
        gone.push(path);
    }
    Ok(gone)
}

/// Whether a file name is one that [`create`] makes for this fleet. Anything else in the folder is not ours to delete.
fn is_recording_of(name: &str, fleet: &FleetId) -> bool {
    let stem = name.strip_suffix(".mcap").and_then(|stem| stem.strip_prefix(fleet.as_str())?.strip_prefix('-'));
    stem.is_some_and(|stem| {
        let (time, number) = stem.split_once('-').map_or((stem, None), |(time, number)| (time, Some(number)));
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let time_is_ours = time.len() == 16 && time.ends_with('Z') && time.is_char_boundary(8) && {
            let (date, rest) = time.split_at(8);
            digits(date) && rest.strip_prefix('T').and_then(|rest| rest.strip_suffix('Z')).is_some_and(digits)
        };
        time_is_ours && number.is_none_or(digits)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_recordings_of_this_fleet_are_ours_to_delete() {
        let fleet = FleetId::new("alpha").unwrap();
        for (name, ours) in [
            ("alpha-20261123T224104Z.mcap", true),
            ("alpha-20261123T224104Z-12.mcap", true),
            ("alpha-2-20261123T224104Z.mcap", false),
            ("beta-20261123T224104Z.mcap", false),
            ("alpha-20261123T224104Z.mcap.bak", false),
            ("alpha-20261123T224104Z-x.mcap", false),
            ("alpha-thesis-dataZZZZ.mcap", false),
            ("alpha-éééééééé.mcap", false),
            ("alpha.mcap", false),
        ] {
            assert_eq!(is_recording_of(name, &fleet), ours, "{name}");
        }
    }

    #[test]
    fn names_never_collide_and_the_oldest_go_first() {
        let folder = tempfile::tempdir().unwrap();
        let fleet = FleetId::new("alpha").unwrap();
        let now = Stamp::from_nanos(1_795_473_664_000_000_000);
        let mut paths = Vec::new();
        for (index, age_s) in [300u64, 200, 100, 0].into_iter().enumerate() {
            let (file, path) = create(folder.path(), &fleet, now).unwrap();
            fs::write(&path, vec![0u8; 1000]).unwrap();
            file.set_modified(std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000 - age_s)).unwrap();
            let number = if index == 0 { String::new() } else { format!("-{}", index + 1) };
            assert_eq!(path.file_name().unwrap().to_str().unwrap(), format!("alpha-20261123T224104Z{number}.mcap"));
            paths.push(path);
        }
        fs::write(folder.path().join("precious.mcap"), vec![0u8; 5000]).unwrap();
        assert_eq!(prune(folder.path(), &fleet, &paths[3], 4000).unwrap(), Vec::<PathBuf>::new());
        // The oldest is the current one here, and so the next two go.
        assert_eq!(prune(folder.path(), &fleet, &paths[0], 2000).unwrap(), paths[1..3]);
        assert!(folder.path().join("precious.mcap").exists());
    }
}
