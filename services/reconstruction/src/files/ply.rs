//! PLY (Turk 1994), binary little-endian: clouds and meshes that MeshLab, CloudCompare and Blender open.
//!
//! Written here: a header of text and rows of numbers need no library. `sigma` and `quality` hold the same number: CloudCompare
//! makes a scalar field of any property, MeshLab only of one called `quality`.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Vector3;

use super::{FileError, write_bytes};
use crate::core::cloud::{CloudFrame, PointCloud};
use crate::core::mesh::Mesh;

/// Further from the origin than this, metres, single precision (24 bits) would round by more than 60 µm.
const SINGLE_MAX_M: f64 = 1000.0;

/// Writes a cloud: x y z (metres; `double` far from the origin), red green blue, sigma, quality.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_cloud(path: &Path, cloud: &PointCloud) -> Result<(), FileError> {
    write_bytes(path, &encode_cloud(cloud))
}

/// Writes a mesh: as a cloud with normals nx ny nz, and triangles; colour only where the mesh has it.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<(), FileError> {
    write_bytes(path, &encode_mesh(mesh))
}

/// The bytes of a cloud.
#[must_use]
pub fn encode_cloud(cloud: &PointCloud) -> Vec<u8> {
    let double = is_far(cloud.points.iter().map(|point| &point.at_m));
    let mut header = header(cloud.frame, cloud.points.len(), double);
    header.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    header.push_str("property float sigma\nproperty float quality\nend_header\n");
    let mut bytes = header.into_bytes();
    bytes.reserve(cloud.points.len() * 35);
    for point in &cloud.points {
        put_vector(&mut bytes, &point.at_m, double);
        bytes.extend_from_slice(&[point.grey; 3]);
        put_sigma(&mut bytes, point.sigma_m);
    }
    bytes
}

/// The bytes of a mesh.
#[must_use]
pub fn encode_mesh(mesh: &Mesh) -> Vec<u8> {
    let double = is_far(mesh.vertices.iter().map(|vertex| &vertex.at_m));
    let coloured = !mesh.vertices.is_empty() && mesh.vertices.iter().all(|vertex| vertex.grey.is_some());
    let mut header = header(mesh.frame, mesh.vertices.len(), double);
    header.push_str("property float nx\nproperty float ny\nproperty float nz\n");
    if coloured {
        header.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    }
    header.push_str("property float sigma\nproperty float quality\n");
    // Writing to a String cannot fail.
    let _ = write!(header, "element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.faces.len());
    let mut bytes = header.into_bytes();
    bytes.reserve(mesh.vertices.len() * 47 + mesh.faces.len() * 13);
    for vertex in &mesh.vertices {
        put_vector(&mut bytes, &vertex.at_m, double);
        put_vector(&mut bytes, &vertex.normal, false);
        if coloured {
            bytes.extend_from_slice(&[vertex.grey.unwrap_or(0); 3]);
        }
        put_sigma(&mut bytes, vertex.sigma_m);
    }
    for face in &mesh.faces {
        bytes.push(3);
        for corner in face {
            bytes.extend_from_slice(&corner.to_le_bytes());
        }
    }
    bytes
}

fn header(frame: CloudFrame, vertices: usize, double: bool) -> String {
    let number = if double { "double" } else { "float" };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment Halcyon\ncomment units metres\ncomment frame {}: {}\n\
         comment sigma and quality: one standard deviation of z\nelement vertex {vertices}\n\
         property {number} x\nproperty {number} y\nproperty {number} z\n",
        frame.name(),
        frame.describe()
    )
}

fn is_far<'a>(places: impl Iterator<Item = &'a Vector3<f64>>) -> bool {
    let mut places = places;
    places.any(|at_m| at_m.amax() > SINGLE_MAX_M)
}

fn put_vector(bytes: &mut Vec<u8>, vector: &Vector3<f64>, double: bool) {
    for x in vector {
        if double {
            bytes.extend_from_slice(&x.to_le_bytes());
        } else {
            bytes.extend_from_slice(&(*x as f32).to_le_bytes());
        }
    }
}

fn put_sigma(bytes: &mut Vec<u8>, sigma_m: f32) {
    bytes.extend_from_slice(&sigma_m.to_le_bytes());
    bytes.extend_from_slice(&sigma_m.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::cloud::CloudPoint;
    use crate::core::mesh::Vertex;

    /// A reader of its own: each element's rows as numbers by property name, straight from the header.
    fn parse(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f64>>, Vec<Vec<i64>>) {
        let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n") && header.contains("comment units metres\n"));
        let count = |element: &str| {
            let line = header.lines().find_map(|line| line.strip_prefix(&format!("element {element} ")));
            line.map_or(0, |count| count.parse::<usize>().unwrap())
        };
        let properties: Vec<(&str, &str)> = header
            .lines()
            .filter_map(|line| line.strip_prefix("property "))
            .filter(|line| !line.starts_with("list"))
            .map(|line| line.split_once(' ').unwrap())
            .collect();
        let mut at = end;
        let mut take = |size: usize| {
            at += size;
            bytes[at - size..at].to_vec()
        };
        let mut vertices = Vec::new();
        for _ in 0..count("vertex") {
            let mut number = |kind: &str| match kind {
                "float" => f64::from(f32::from_le_bytes(take(4).try_into().unwrap())),
                "double" => f64::from_le_bytes(take(8).try_into().unwrap()),
                "uchar" => f64::from(take(1)[0]),
                other => panic!("{other}"),
            };
            vertices.push(properties.iter().map(|(kind, _)| number(kind)).collect());
        }
        let mut faces = Vec::new();
        for _ in 0..count("face") {
            let corners = take(1)[0];
            faces.push((0..corners).map(|_| i64::from(i32::from_le_bytes(take(4).try_into().unwrap()))).collect());
        }
        assert_eq!(at, bytes.len(), "nothing is left over");
        (properties.iter().map(|(_, name)| (*name).to_owned()).collect(), vertices, faces)
    }

    fn cloud(x_m: f64) -> PointCloud {
        let point = |x_m: f64, grey| CloudPoint { at_m: Vector3::new(x_m, -2.5, 0.25), sigma_m: 0.5, grey, pixel: (0, 0) };
        PointCloud { frame: CloudFrame::Gravity, points: vec![point(x_m, 10), point(1.0, 255)] }
    }

    #[test]
    fn a_cloud_is_read_back() {
        let (names, vertices, faces) = parse(&encode_cloud(&cloud(0.5)));
        assert_eq!(names, ["x", "y", "z", "red", "green", "blue", "sigma", "quality"]);
        assert_eq!(vertices[0], [0.5, -2.5, 0.25, 10.0, 10.0, 10.0, 0.5, 0.5]);
        assert_eq!(vertices[1][..4], [1.0, -2.5, 0.25, 255.0]);
        assert!(faces.is_empty() && vertices.len() == 2);
    }

    #[test]
    fn far_from_the_origin_no_millimetre_is_lost() {
        let (_, vertices, _) = parse(&encode_cloud(&cloud(123_456.789)));
        assert_eq!(vertices[0][0], 123_456.789);
        assert!(parse(&encode_cloud(&PointCloud { frame: CloudFrame::Plane, points: Vec::new() })).1.is_empty());
    }

    #[test]
    fn a_mesh_is_read_back() {
        let vertex = |x, y, grey| Vertex { at_m: Vector3::new(x, y, 0.0), normal: Vector3::z(), sigma_m: 0.25, grey };
        let mut mesh = Mesh {
            frame: CloudFrame::Plane,
            vertices: vec![vertex(0.0, 0.0, Some(1)), vertex(1.0, 0.0, Some(2)), vertex(0.0, 1.0, Some(3))],
            faces: vec![[0, 1, 2]],
        };
        let (names, vertices, faces) = parse(&encode_mesh(&mesh));
        assert_eq!(names, ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "sigma", "quality"]);
        assert_eq!(vertices[1], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 0.25, 0.25]);
        assert_eq!(faces, [[0, 1, 2]]);
        mesh.vertices[0].grey = None;
        assert_eq!(parse(&encode_mesh(&mesh)).0.len(), 8, "half coloured is not coloured");
    }
}
