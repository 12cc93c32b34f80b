//! The key file of message signing.

use std::path::Path;

use anyhow::Context as _;
use tracing::warn;

use crate::core::signing::Key;

/// Longer is no key file.
const KEY_FILE_BYTES_MAX: u64 = 4096;

/// Reads a key; warns when others may read it too.
///
/// # Errors
/// If the file can't be read, or holds no key. The message names the file, never what is in it.
pub(crate) fn read(path: &Path) -> anyhow::Result<Key> {
    let what = || format!("signing.key_file {}", path.display());
    let about = std::fs::metadata(path).with_context(what)?;
    anyhow::ensure!(about.is_file() && about.len() <= KEY_FILE_BYTES_MAX, "{} is not a key file", what());
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = about.permissions().mode() & 0o777;
        if mode & 0o077 != 0 {
            warn!(file = %path.display(), mode = format!("{mode:o}"), "others may read the signing key: chmod 600");
        }
    }
    Key::from_file_bytes(&std::fs::read(path).with_context(what)?).with_context(what)
}
