//! Specks: small patches whose disparity differs from all around them are noise.
//!
//! Patches are joined from runs, stretches of a row without a step, as in two-pass labelling of connected components.

/// Finds specks; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Specks {
    /// For each run: the run that stands for its patch (itself for one), and how many pixels the patch has.
    runs: Vec<(u32, u32)>,
    /// For each run: where it starts and ends in the picture.
    spans: Vec<(u32, u32)>,
}

impl Specks {
    /// Makes every patch of at most `area_max` pixels NaN. Neighbours (left, right, above, below) belong together where they
    /// differ by at most `step_max_px`.
    pub(super) fn remove(&mut self, disparity_px: &mut [f32], width: usize, area_max: u32, step_max_px: f32) {
        if area_max == 0 {
            return;
        }
        self.runs.clear();
        self.spans.clear();
        let mut above = 0..0;
        for (y, row) in disparity_px.chunks_exact(width).enumerate() {
            let first = self.spans.len();
            self.find_runs(row, (y * width) as u32, step_max_px);
            if y > 0 {
                self.join(disparity_px, width, (above.clone(), first..self.spans.len()), step_max_px);
            }
            above = first..self.spans.len();
        }
        for run in 0..self.spans.len() {
            let root = self.root(run as u32);
            let (start, end) = self.spans[run];
            if self.runs[root as usize].1 <= area_max {
                disparity_px[start as usize..end as usize].fill(f32::NAN);
            }
        }
    }

    fn find_runs(&mut self, row: &[f32], start: u32, step_max_px: f32) {
        let mut before = f32::NAN;
        let mut begin = 0;
        let mut open = false;
        for (x, value) in row.iter().enumerate() {
            // False for NaN on either side.
            let goes_on = (value - before).abs() <= step_max_px;
            if !goes_on {
                if open {
                    self.push(start + begin, start + x as u32);
                }
                open = !value.is_nan();
                begin = x as u32;
            }
            before = *value;
        }
        if open {
            self.push(start + begin, start + row.len() as u32);
        }
    }

    fn push(&mut self, start: u32, end: u32) {
        self.runs.push((self.runs.len() as u32, end - start));
        self.spans.push((start, end));
    }

    fn join(
        &mut self,
        disparity_px: &[f32],
        width: usize,
        (above, here): (std::ops::Range<usize>, std::ops::Range<usize>),
        step_max_px: f32,
    ) {
        let mut upper = above.start;
        for run in here {
            let (start, end) = self.spans[run];
            // Runs above that end before this one starts are done with.
            while upper < above.end && self.spans[upper].1 as usize + width <= start as usize {
                upper += 1;
            }
            let mut beside = upper;
            while beside < above.end && self.spans[beside].0 as usize + width < end as usize {
                let from = (self.spans[beside].0 as usize + width).max(start as usize);
                let to = (self.spans[beside].1 as usize + width).min(end as usize);
                let (up, down) = (&disparity_px[from - width..to - width], &disparity_px[from..to]);
                if up.iter().zip(down).any(|(up, down)| (up - down).abs() <= step_max_px) {
                    self.unite(run as u32, beside as u32);
                }
                beside += 1;
            }
        }
    }

    fn root(&mut self, mut run: u32) -> u32 {
        while self.runs[run as usize].0 != run {
            // Halve the way for whoever comes next.
            let parent = self.runs[run as usize].0;
            self.runs[run as usize].0 = self.runs[parent as usize].0;
            run = self.runs[run as usize].0;
        }
        run
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            let (from, to) = (a.max(b) as usize, a.min(b) as usize);
            self.runs[from].0 = to as u32;
            self.runs[to].1 += self.runs[from].1;
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        (self.runs.capacity() + self.spans.capacity()) * size_of::<(u32, u32)>()
    }
}
