//! The mission store: an append-only SQLite file, owned by one planner at a time.
//!
//! A batch of records is stored whole or not at all, and is on the disk when [`Store::append`] returns. The file is locked
//! for as long as the store is open: two planners on one file would issue the same generations.

mod formation;
mod read;
mod thread;
mod write;

use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, ErrorCode, OpenFlags};

use crate::core::{Record, Saved};

pub use thread::StoreThread;

/// `HALC`: marks the file as ours.
const APPLICATION_ID: i32 = 0x4841_4C43;
/// The schema that this build writes.
const SCHEMA_VERSION: i32 = 3;
/// What versions 2 and 3 added.
const ADDED: [&str; 2] = [include_str!("formation.sql"), include_str!("release.sql")];
/// How long to wait for another planner to let go of the file; a planner that is restarted in place needs a moment.
const LOCK_WAIT: Duration = Duration::from_secs(3);

/// Why the store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder for the file cannot be made.
    #[error("the folder of the mission store {path} could not be made")]
    Folder {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The file cannot be opened or written.
    #[error("the mission store {path} could not be opened for writing")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: rusqlite::Error,
    },
    /// Another planner has it.
    #[error("the mission store {path} is in use by another mission planner")]
    Locked {
        /// The file.
        path: PathBuf,
    },
    /// It is damaged.
    #[error("the mission store {path} is damaged ({detail}); move it away to start with an empty one")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        detail: String,
    },
    /// It is something else.
    #[error("{path} is not a mission store")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// A newer build wrote it.
    #[error("the mission store {path} has schema version {found}, this build knows {SCHEMA_VERSION}")]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: i32,
    },
    /// It could not be written. Nothing of the batch was stored.
    #[error("the mission store {path} could not be written")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: rusqlite::Error,
    },
    /// A line of it makes no sense.
    #[error("the mission store {path} could not be read")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: rusqlite::Error,
    },
    /// It did not answer in time, or its thread is gone.
    #[error("the mission store does not answer")]
    Silent,
}

/// An open store.
#[derive(Debug)]
pub struct Store {
    connection: Connection,
    path: PathBuf,
}

impl Store {
    /// Opens the store, and makes it if it is not there. `:memory:` is one that forgets.
    ///
    /// # Errors
    /// [`StoreError`] if it is damaged, locked, not writable or not ours.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let in_memory = path == Path::new(":memory:");
        if !in_memory && let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|source| StoreError::Folder { path: path.into(), source })?;
        }
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let trouble = |source| opening(path, source);
        let connection = Connection::open_with_flags(path, flags).map_err(trouble)?;
        connection.busy_timeout(LOCK_WAIT).map_err(trouble)?;
        // Written through before the planner says it: EXTRA also syncs the folder after the journal is deleted.
        connection
            .execute_batch("PRAGMA locking_mode = EXCLUSIVE; PRAGMA foreign_keys = ON; PRAGMA synchronous = EXTRA;")
            .map_err(trouble)?;
        // Takes the lock for good, and finds out now whether the file can be written.
        connection.execute_batch("BEGIN EXCLUSIVE; COMMIT;").map_err(trouble)?;
        let store = Self { connection, path: path.into() };
        store.check_or_make()?;
        Ok(store)
    }

    fn check_or_make(&self) -> Result<(), StoreError> {
        let path = || self.path.clone();
        let trouble = |source| opening(&self.path, source);
        let number = |sql: &str| self.connection.query_row(sql, [], |row| row.get::<_, i32>(0)).map_err(trouble);
        let health: String = self.connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0)).map_err(trouble)?;
        if health != "ok" {
            return Err(StoreError::Damaged { path: path(), detail: health });
        }
        let (application, version) = (number("PRAGMA application_id")?, number("PRAGMA user_version")?);
        let tables = number("SELECT count(*) FROM sqlite_schema")?;
        match (application, version) {
            (0, 0) if tables == 0 => self
                .connection
                .execute_batch(&format!(
                    "BEGIN; {} {} PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;",
                    include_str!("schema.sql"),
                    ADDED.concat(),
                ))
                .map_err(|source| StoreError::Write { path: path(), source }),
            (APPLICATION_ID, old @ 1..SCHEMA_VERSION) => self
                .connection
                .execute_batch(&format!(
                    "BEGIN; {} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;",
                    ADDED.get(old as usize - 1..).unwrap_or_default().concat(),
                ))
                .map_err(|source| StoreError::Write { path: path(), source }),
            (APPLICATION_ID, SCHEMA_VERSION) => Ok(()),
            (APPLICATION_ID, found) if found > SCHEMA_VERSION => Err(StoreError::Newer { path: path(), found }),
            _ => Err(StoreError::Foreign { path: path() }),
        }
    }

    /// Stores `records`, all or none, and returns once they are on the disk.
    ///
    /// # Errors
    /// [`StoreError::Write`]; nothing was stored.
    pub fn append(&mut self, records: &[Record]) -> Result<(), StoreError> {
        write::append(&mut self.connection, records).map_err(|source| StoreError::Write { path: self.path.clone(), source })
    }

    /// Everything that is stored.
    ///
    /// # Errors
    /// [`StoreError::Read`] at the first line that makes no sense.
    pub fn load(&self) -> Result<Saved, StoreError> {
        read::load(&self.connection).map_err(|source| StoreError::Read { path: self.path.clone(), source })
    }
}

/// What an error while opening means.
fn opening(path: &Path, source: rusqlite::Error) -> StoreError {
    let path = path.to_path_buf();
    match source.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => StoreError::Locked { path },
        Some(ErrorCode::DatabaseCorrupt) => StoreError::Damaged { path, detail: source.to_string() },
        Some(ErrorCode::NotADatabase) => StoreError::Foreign { path },
        _ => StoreError::Open { path, source },
    }
}
