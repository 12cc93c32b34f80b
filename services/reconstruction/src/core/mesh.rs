//! A triangle mesh of the water (thesis fig. 7-6 b), from the elevation grid or from a point cloud.
//!
//! Both are pictures: neighbours are known, so no surface has to be guessed from scattered points. Each square of four
//! neighbours becomes two triangles along its flatter diagonal; three present corners make one triangle; a triangle across a
//! jump, or without area, is left out. Faces are counter-clockwise seen from above, so that all normals point up.

use std::collections::HashMap;

use halcyon_model::ElevationGrid;
use nalgebra::Vector3;

use super::cloud::{CloudFrame, PointCloud};

/// Corners this many times further apart in height than their standard deviations explain are on two surfaces …
const JUMP_SIGMAS: f64 = 6.0;
/// … if the edge between them is also steeper than this; no water is.
const SLOPE_MAX: f64 = 1.5;
/// A face with less of its area seen from above than this share is degenerate or stands on its edge.
const UPRIGHT_MIN: f64 = 1e-3;

/// A vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Place, metres, z up.
    pub at_m: Vector3<f64>,
    /// Unit normal, z positive: the area-weighted mean of the faces around it.
    pub normal: Vector3<f64>,
    /// One standard deviation of z, metres.
    pub sigma_m: f32,
    /// Grey level; `None` where the mesh comes from a grid.
    pub grey: Option<u8>,
}

/// A mesh. Every vertex belongs to at least one face.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// The axes.
    pub frame: CloudFrame,
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// Indices of three vertices each, counter-clockwise from above.
    pub faces: Vec<[u32; 3]>,
}

/// The mesh of a grid: a vertex for each filled cell, at its centre, elevation above the patch's mean.
#[must_use]
pub fn of_grid(grid: &ElevationGrid, frame: CloudFrame) -> Mesh {
    let (rows, cols) = (grid.rows as usize, grid.cols as usize);
    let mut lattice = Lattice::new(rows, cols);
    let values = grid.elevation_m.iter().zip(&grid.sigma_m).enumerate();
    for (i, (elevation_m, sigma_m)) in values.take(rows * cols).filter(|(_, (elevation_m, _))| elevation_m.is_finite()) {
        let (row, col) = (i / cols, i % cols);
        let at_m = Vector3::new(
            grid.south_west_east_m + col as f64 * grid.cell_m,
            grid.south_west_north_m + row as f64 * grid.cell_m,
            f64::from(*elevation_m),
        );
        lattice.put(row, col, Vertex { at_m, normal: Vector3::z(), sigma_m: *sigma_m, grey: None });
    }
    lattice.mesh(frame)
}

/// The mesh of a cloud: a vertex for each point, joined to the points of the neighbouring pixels (at the cloud's own stride).
#[must_use]
pub fn of_cloud(cloud: &PointCloud) -> Mesh {
    let stride = stride_px(cloud);
    let (mut right, mut bottom) = (0, 0);
    for point in &cloud.points {
        (right, bottom) = (right.max(point.pixel.0 / stride), bottom.max(point.pixel.1 / stride));
    }
    let mut lattice = Lattice::new(bottom as usize + 1, right as usize + 1);
    for point in &cloud.points {
        let (row, col) = ((point.pixel.1 / stride) as usize, (point.pixel.0 / stride) as usize);
        let vertex = Vertex { at_m: point.at_m, normal: Vector3::z(), sigma_m: point.sigma_m, grey: Some(point.grey) };
        lattice.put(row, col, vertex);
    }
    lattice.mesh(cloud.frame)
}

/// Pixels between neighbouring points: the largest step that all of them are multiples of.
fn stride_px(cloud: &PointCloud) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    cloud.points.iter().fold(0, |step, point| gcd(gcd(step, point.pixel.0), point.pixel.1)).max(1)
}

/// Vertices in rows and columns; `NONE` where there is none.
struct Lattice {
    cols: usize,
    index: Vec<u32>,
    vertices: Vec<Vertex>,
}

const NONE: u32 = u32::MAX;

impl Lattice {
    fn new(rows: usize, cols: usize) -> Self {
        Self { cols, index: vec![NONE; rows * cols], vertices: Vec::new() }
    }

    fn put(&mut self, row: usize, col: usize, vertex: Vertex) {
        if vertex.at_m.iter().all(|x| x.is_finite()) {
            self.index[row * self.cols + col] = self.vertices.len() as u32;
            self.vertices.push(vertex);
        }
    }

    fn mesh(&self, frame: CloudFrame) -> Mesh {
        let mut faces = Vec::with_capacity(2 * self.vertices.len());
        let rows = self.index.len() / self.cols.max(1);
        for row in 1..rows {
            for col in 1..self.cols {
                // Around the square: neighbours in this order share an edge.
                let around = [(row - 1, col - 1), (row - 1, col), (row, col), (row, col - 1)];
                self.square(around.map(|(row, col)| self.index[row * self.cols + col]), &mut faces);
            }
        }
        finish(&self.vertices, faces, frame)
    }

    /// Up to two faces of a square of corners, along its flatter diagonal.
    fn square(&self, corners: [u32; 4], faces: &mut Vec<[u32; 3]>) {
        let [a, b, c, d] = corners;
        let span = |i: u32, j: u32| {
            if i == NONE || j == NONE {
                return f64::INFINITY;
            }
            (self.vertices[i as usize].at_m.z - self.vertices[j as usize].at_m.z).abs()
        };
        let triangles = if span(a, c) <= span(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        faces.extend(triangles.into_iter().filter_map(|triangle| self.face(triangle)));
    }

    /// The triangle, turned so that its normal points up; `None` where a corner is missing, an edge jumps, or there is no area.
    fn face(&self, triangle: [u32; 3]) -> Option<[u32; 3]> {
        if triangle.contains(&NONE) {
            return None;
        }
        let [p, q, r] = triangle.map(|i| &self.vertices[i as usize]);
        if jumps(p, q) || jumps(q, r) || jumps(r, p) {
            return None;
        }
        let normal = (q.at_m - p.at_m).cross(&(r.at_m - p.at_m));
        // Comparisons with NaN are false.
        let upright = normal.z.abs() > UPRIGHT_MIN * normal.norm();
        let [i, j, k] = triangle;
        upright.then_some(if normal.z > 0.0 { [i, j, k] } else { [i, k, j] })
    }
}

fn jumps(p: &Vertex, q: &Vertex) -> bool {
    let step = q.at_m - p.at_m;
    let explained_m = JUMP_SIGMAS * f64::from(p.sigma_m).hypot(f64::from(q.sigma_m));
    step.z.abs() > explained_m.max(SLOPE_MAX * step.xy().norm())
}

/// Leaves out vertices without a face and gives the others their normals.
fn finish(vertices: &[Vertex], faces: Vec<[u32; 3]>, frame: CloudFrame) -> Mesh {
    let mut mesh = Mesh { frame, vertices: Vec::with_capacity(vertices.len()), faces };
    let mut moved = HashMap::with_capacity(vertices.len());
    for face in &mut mesh.faces {
        let [p, q, r] = face.map(|i| vertices[i as usize].at_m);
        // Twice the area: larger faces count more.
        let normal = (q - p).cross(&(r - p));
        for corner in face {
            let at = *moved.entry(*corner).or_insert_with(|| {
                mesh.vertices.push(Vertex { normal: Vector3::zeros(), ..vertices[*corner as usize] });
                mesh.vertices.len() as u32 - 1
            });
            mesh.vertices[at as usize].normal += normal;
            *corner = at;
        }
    }
    for vertex in &mut mesh.vertices {
        vertex.normal = vertex.normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
    }
    mesh
}

#[cfg(test)]
mod tests;
