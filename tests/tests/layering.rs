//! Dependencies point down only, and crates on one layer never see each other.

#![allow(clippy::expect_used, reason = "tests fail by panicking")]

use cargo_metadata::{DependencyKind, MetadataCommand};

/// From the top. A crate may use what stands below its own line.
const LAYERS: [&[&str]; 6] = [
    &["halcyon-tests"],
    &["halcyon"],
    &[
        "halcyon-capture",
        "halcyon-reconstruction",
        "halcyon-wave-assessment",
        "halcyon-mission-planner",
        "halcyon-vehicle-link",
        "halcyon-recorder",
        "halcyon-gateway",
    ],
    &["halcyon-chassis", "halcyon-sim"],
    &["halcyon-proto", "halcyon-ocean"],
    &["halcyon-model"],
];

/// Crates that may see the simulator: it never lends its truth to what it judges.
const MAY_SEE_THE_SIMULATOR: [&str; 4] = ["halcyon", "halcyon-capture", "halcyon-tests", "halcyon-vehicle-link"];

/// Those of them that may only behind a feature: what flies doesn't carry it.
const ONLY_BEHIND_A_FEATURE: [&str; 1] = ["halcyon-vehicle-link"];

/// Heavy or worldly dependencies, and the only crates that may have them directly.
const CONFINED: [(&str, &[&str]); 8] = [
    ("opencv", &["halcyon-capture", "halcyon-reconstruction"]),
    ("mavlink", &["halcyon-sim", "halcyon-vehicle-link", "halcyon"]),
    ("zenoh", &["halcyon-chassis"]),
    ("prost", &["halcyon-proto"]),
    ("axum", &["halcyon-chassis", "halcyon-gateway"]),
    ("rusqlite", &["halcyon-mission-planner"]),
    ("mcap", &["halcyon-recorder"]),
    ("clap", &["halcyon", "halcyon-chassis"]),
];

/// Pure crates: neither asynchronous nor on the bus.
const PURE: [&str; 4] = ["halcyon-model", "halcyon-ocean", "halcyon-sim", "halcyon-proto"];

#[test]
fn dependencies_point_down_only() {
    let metadata = MetadataCommand::new().no_deps().exec().expect("cargo describes the workspace");
    let layer = |name: &str| LAYERS.iter().position(|layer| layer.contains(&name));
    let mut wrong = Vec::new();
    for package in &metadata.packages {
        let name = package.name.as_str();
        let Some(own) = layer(name) else {
            wrong.push(format!("{name} is on no layer: place it"));
            continue;
        };
        for dependency in package.dependencies.iter().filter(|dependency| dependency.kind != DependencyKind::Development) {
            let on = dependency.name.as_str();
            if layer(on).is_some_and(|below| below <= own) {
                wrong.push(format!("{name} may not use {on}: it is not below it"));
            }
            if on == "halcyon-sim" && !MAY_SEE_THE_SIMULATOR.contains(&name) {
                wrong.push(format!("{name} may not use {on}: the simulator does not lend its truth to what it judges"));
            }
            if on == "halcyon-sim" && ONLY_BEHIND_A_FEATURE.contains(&name) && !dependency.optional {
                wrong.push(format!("{name} may use {on} only behind a feature"));
            }
            if let Some((_, allowed)) = CONFINED.iter().find(|(confined, _)| *confined == on)
                && !allowed.contains(&name)
            {
                wrong.push(format!("{name} may not use {on}: only {allowed:?} may"));
            }
            if PURE.contains(&name) && ["tokio", "zenoh", "halcyon-chassis", "reqwest", "axum"].contains(&on) {
                wrong.push(format!("{name} is pure and may not use {on}"));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert_eq!(metadata.packages.len(), LAYERS.iter().map(|layer| layer.len()).sum::<usize>(), "every crate is placed once");
}

/// A core takes `now` and knows no task, bus, file, socket or clock.
#[test]
fn cores_are_pure() {
    const FORBIDDEN: [&str; 10] = [
        "tokio::",
        "zenoh::",
        "std::fs",
        "TcpStream",
        "TcpListener",
        "UdpSocket",
        "std::thread",
        "SystemTime",
        "Instant::now",
        "halcyon_chassis::Clock",
    ];
    let root = halcyon_tests::root();
    let mut wrong = Vec::new();
    let mut files = 0;
    for service in
        ["services/model", "services/ocean", "services/sim"].iter().map(|service| root.join(service).join("src")).chain(
            ["capture", "reconstruction", "wave-assessment", "mission-planner", "vehicle-link", "recorder"]
                .iter()
                .map(|service| root.join("services").join(service).join("src/core"))
                .chain([root.join("gateway/src/core")]),
        )
    {
        visit(&service, &mut |path, text| {
            files += 1;
            // Tests and documentation may speak of the world.
            let code = text
                .lines()
                .take_while(|line| !line.contains("#[cfg(test)]"))
                .filter(|line| !line.trim_start().starts_with("//"));
            for (number, line) in code.enumerate() {
                for forbidden in FORBIDDEN.iter().filter(|forbidden| line.contains(*forbidden)) {
                    wrong.push(format!("{}:{}: {forbidden}", path.display(), number + 1));
                }
            }
        });
    }
    assert!(files > 30, "only {files} core files were found: did a folder move?");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn visit(folder: &std::path::Path, look: &mut impl FnMut(&std::path::Path, &str)) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            visit(&path, look);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !path.ends_with("tests.rs") {
            look(&path, &std::fs::read_to_string(&path).expect("a source file can be read"));
        }
    }
}
