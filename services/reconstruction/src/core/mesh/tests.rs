//! Against closed forms: areas, Euler's characteristic, normals.

use super::*;
use crate::core::cloud::CloudPoint;

fn grid(rows: u32, cols: u32, cell_m: f64, up_m: impl Fn(f64, f64) -> f64) -> ElevationGrid {
    let mut elevation_m = Vec::new();
    for row in 0..rows {
        for col in 0..cols {
            elevation_m.push(up_m(f64::from(row) * cell_m, f64::from(col) * cell_m) as f32);
        }
    }
    let sigma_m = vec![0.001; elevation_m.len()];
    ElevationGrid { south_west_north_m: 0.0, south_west_east_m: 0.0, cell_m, rows, cols, elevation_m, sigma_m }
}

fn area_m2(mesh: &Mesh) -> f64 {
    let area = |face: &[u32; 3]| {
        let [p, q, r] = face.map(|i| mesh.vertices[i as usize].at_m);
        (q - p).cross(&(r - p)).norm() / 2.0
    };
    mesh.faces.iter().map(area).sum()
}

/// Vertices − edges + faces. Also: no edge has more than two faces, and the two of an edge run along it in opposite directions,
/// which is what "consistently oriented" means.
fn euler(mesh: &Mesh) -> i64 {
    let mut directed = std::collections::HashSet::new();
    let mut edges = std::collections::HashSet::new();
    for face in &mesh.faces {
        for (i, j) in [(face[0], face[1]), (face[1], face[2]), (face[2], face[0])] {
            assert_ne!(i, j, "degenerate");
            assert!(directed.insert((i, j)), "two faces run the same way along an edge");
            edges.insert((i.min(j), i.max(j)));
        }
    }
    mesh.vertices.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64
}

#[test]
fn level_water_is_a_disc_of_its_area() {
    let mesh = of_grid(&grid(21, 31, 0.1, |_, _| 0.0), CloudFrame::Gravity);
    assert_eq!((mesh.vertices.len(), mesh.faces.len()), (21 * 31, 2 * 20 * 30));
    assert_eq!(euler(&mesh), 1, "a disc");
    assert!((area_m2(&mesh) - 2.0 * 3.0).abs() < 1e-9);
    assert!(mesh.vertices.iter().all(|vertex| (vertex.normal - Vector3::z()).norm() < 1e-12));
}

/// A plane that rises by (0.3, 0.4) is √1.25 times its shadow, and its normal is (−0.4, −0.3, 1) / √1.25 in east, north, up.
#[test]
fn sloping_water_is_larger_and_its_normals_lean() {
    let mesh = of_grid(&grid(11, 11, 0.2, |north, east| 0.3 * north + 0.4 * east), CloudFrame::Gravity);
    assert!((area_m2(&mesh) - 4.0 * 1.25_f64.sqrt()).abs() < 1e-6);
    let expected = Vector3::new(-0.4, -0.3, 1.0).normalize();
    assert!(mesh.vertices.iter().all(|vertex| (vertex.normal - expected).norm() < 1e-5));
}

/// Area of z = a sin(k x): the elliptic integral by Simpson's rule.
#[test]
fn a_wave_has_the_area_of_its_arc() {
    let (a, k) = (0.05, std::f64::consts::TAU);
    let mesh = of_grid(&grid(2, 1001, 0.001, |_, east| a * (k * east).sin()), CloudFrame::Gravity);
    let steps = 1000;
    let f = |i: i32| (1.0 + (a * k * (k * f64::from(i) / f64::from(steps)).cos()).powi(2)).sqrt();
    let simpson: f64 = (0..steps).step_by(2).map(|i| (f(i) + 4.0 * f(i + 1) + f(i + 2)) / 3.0).sum::<f64>() / f64::from(steps);
    assert!((area_m2(&mesh) / 0.001 - simpson).abs() < 1e-5, "{} {simpson}", area_m2(&mesh) / 0.001);
}

#[test]
fn a_hole_stays_a_hole() {
    let mut grid = grid(9, 9, 0.1, |_, _| 0.0);
    grid.elevation_m[4 * 9 + 4] = f32::NAN;
    let mesh = of_grid(&grid, CloudFrame::Gravity);
    assert_eq!(euler(&mesh), 0, "a ring");
    // Half of each of the four squares around it is missing.
    assert!((area_m2(&mesh) - 0.62).abs() < 1e-9, "{}", area_m2(&mesh));
    assert_eq!(mesh.vertices.len(), 80);
}

#[test]
fn a_jump_is_not_bridged_and_a_lone_cell_is_no_vertex() {
    let mesh = of_grid(&grid(5, 10, 0.1, |_, east| if east < 0.45 { 0.0 } else { 1.0 }), CloudFrame::Gravity);
    assert_eq!(euler(&mesh), 2, "two discs");
    assert!((area_m2(&mesh) - 2.0 * 0.4 * 0.4).abs() < 1e-6, "{}", area_m2(&mesh));
    let mut lone = grid(3, 3, 0.1, |_, _| f64::NAN);
    lone.elevation_m[4] = 0.0;
    let mesh = of_grid(&lone, CloudFrame::Gravity);
    assert!(mesh.vertices.is_empty() && mesh.faces.is_empty());
    assert!(of_cloud(&PointCloud { frame: CloudFrame::Plane, points: Vec::new() }).faces.is_empty());
}

/// Pixels run down the picture, the world's north up: orientation must not depend on it. The stride is found.
#[test]
fn a_cloud_of_every_second_pixel_is_joined() {
    let mut points = Vec::new();
    for y in (10..=30).step_by(2) {
        for x in (4..=24).step_by(2) {
            let at_m = Vector3::new(f64::from(x) * 0.01, -f64::from(y) * 0.01, 0.0);
            points.push(CloudPoint { at_m, sigma_m: 0.001, grey: 9, pixel: (x, y) });
        }
    }
    let mesh = of_cloud(&PointCloud { frame: CloudFrame::Plane, points });
    assert_eq!((mesh.vertices.len(), mesh.faces.len(), euler(&mesh)), (121, 200, 1));
    assert!((area_m2(&mesh) - 0.04).abs() < 1e-12);
    assert!(mesh.vertices.iter().all(|vertex| vertex.normal.z > 0.999 && vertex.grey == Some(9)));
}
