use super::*;

fn check(inputs: &[(&'static str, &Path)], outputs: &[Output]) -> String {
    check_outputs(inputs.iter().copied(), outputs).map_or_else(|error| error.to_string(), |()| String::new())
}

#[test]
fn an_input_is_never_overwritten_whatever_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("left.png"), "a picture").unwrap();
    std::fs::create_dir(at("deep")).unwrap();
    std::fs::hard_link(at("left.png"), at("hard.png")).unwrap();
    let mut names = vec![at("left.png"), at("deep/../left.png"), at("./left.png"), at("hard.png")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(at("left.png"), at("soft.png")).unwrap();
        std::os::unix::fs::symlink(folder.path(), at("deep/up")).unwrap();
        names.extend([at("soft.png"), at("deep/up/left.png")]);
    }
    for name in &names {
        let error = check(&[("--left", &at("left.png"))], &[Output::file("--out", name, &["png"])]);
        assert!(error.starts_with("--out") && error.contains("overwrite an input, that of --left"), "{error}");
        // And the other way round: the input is named by the link.
        let error = check(&[("--left", name)], &[Output::file("--out", at("left.png"), &["png"])]);
        assert!(error.contains("overwrite an input"), "{error}");
    }
    assert_eq!(check(&[("--left", &at("left.png"))], &[Output::file("--out", at("other.png"), &["png"])]), "");
    assert_eq!(std::fs::read(at("left.png")).unwrap(), b"a picture");
}

#[test]
fn two_outputs_are_two_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let two = |a: PathBuf, b: PathBuf| check(&[], &[Output::file("--cloud", a, &["ply"]), Output::file("--mesh", b, &["ply"])]);
    std::fs::create_dir(at("deep")).unwrap();
    for same in [at("x.ply"), at("deep/../x.ply")] {
        let error = two(at("x.ply"), same);
        assert!(error.contains("--mesh and --cloud would write the same file"), "{error}");
    }
    assert_eq!(two(at("x.ply"), at("y.ply")), "");
    assert_eq!(two(at("x.ply"), at("deep/x.ply")), "");
    let ros: Vec<Output> =
        Output::ros("--ros", &at("ros")).into_iter().chain([Output::file("--out", at("ros2.yaml"), &["yaml"])]).collect();
    assert_eq!(check(&[], &ros), "", "a folder is made where there is none");
    std::fs::create_dir(at("ros")).unwrap();
    let clash: Vec<Output> =
        Output::ros("--ros", &at("ros")).into_iter().chain([Output::file("--out", at("ros/left.yaml"), &["yaml"])]).collect();
    assert!(check(&[], &clash).contains("same file"));
}

#[test]
fn what_cannot_be_written_is_refused_by_its_option_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("file"), "").unwrap();
    std::fs::create_dir(at("folder.png")).unwrap();
    for (path, expected) in [
        (at("x.jpg"), ".png or .pfm"),
        (at("x"), ".png or .pfm"),
        (at("nowhere/x.png"), "there is no folder"),
        (at("file/x.png"), "there is no folder"),
        (at("folder.png"), "is a folder"),
        (PathBuf::from("/proc/x.png"), "cannot be written"),
        (PathBuf::new(), "must end in"),
    ] {
        let error = check(&[], &[Output::file("--out", &path, &["png", "pfm"])]);
        assert!(error.starts_with("--out") && error.contains(expected), "{}: {error}", path.display());
    }
    assert_eq!(check(&[], &[Output::file("--out", at("x.PNG"), &["png"])]), "");
    let ros = Output::ros("--ros", &at("file"));
    assert!(check(&[], &ros).contains("there is no folder"), "a file where a folder should be");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing was left behind");
}

#[cfg(unix)]
#[test]
fn devices_are_written_where_bytes_are_and_refused_where_a_library_writes() {
    let null = Path::new("/dev/null");
    assert_eq!(check(&[], &[Output::file("--out", null, &["png"]), Output::file("--cloud", null, &["ply"])]), "");
    assert!(check(&[], &[Output::plain_file("--grid", null, &["nc"])]).contains("a device or a pipe"));
}
