//! What a piece of work takes, and with how many threads.

use std::time::Instant;

use cpu_time::ProcessTime;
use opencv::core as cvcore;

/// What a piece of work took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spent {
    /// Processor time, all threads, milliseconds; `None` where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time, milliseconds.
    pub wall_ms: f64,
}

/// Does `work`, and says what it took.
pub fn spent<T>(work: impl FnOnce() -> T) -> (T, Spent) {
    let (wall, cpu) = (Instant::now(), ProcessTime::try_now().ok());
    let result = work();
    let wall_ms = wall.elapsed().as_secs_f64() * 1e3;
    let cpu_ms = cpu.and_then(|start| start.try_elapsed().ok()).map(|cpu| cpu.as_secs_f64() * 1e3);
    (result, Spent { cpu_ms, wall_ms })
}

/// The value in the middle, the upper of two; NaN of nothing.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The median of several runs; `None` of nothing.
#[must_use]
pub fn median_spent(runs: &[Spent]) -> Option<Spent> {
    let cpu = runs.iter().map(|run| run.cpu_ms).collect::<Option<Vec<_>>>();
    (!runs.is_empty()).then(|| Spent { cpu_ms: cpu.map(median), wall_ms: median(runs.iter().map(|run| run.wall_ms)) })
}

/// The worker threads of all engines, ours and OpenCV's. OpenCV's number is the process's: one at a time.
pub struct Threads {
    pool: rayon::ThreadPool,
    count: usize,
}

impl Threads {
    /// `count` of them, at least one.
    ///
    /// # Errors
    /// Where the system gives none.
    pub fn new(count: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let count = count.max(1);
        Ok(Self { pool: rayon::ThreadPoolBuilder::new().num_threads(count).build()?, count })
    }

    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Does `work` on them, and gives OpenCV its own threads back.
    ///
    /// # Errors
    /// OpenCV's.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> opencv::Result<T> {
        let before = cvcore::get_num_threads()?;
        cvcore::set_num_threads(self.count as i32)?;
        let result = self.pool.install(work);
        cvcore::set_num_threads(before)?;
        Ok(result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_odd_even_and_none() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), 3.0);
        assert!(median([]).is_nan() && median_spent(&[]).is_none());
    }

    #[test]
    fn work_runs_on_as_many_threads_as_asked() {
        for count in [1, 2] {
            let threads = Threads::new(count).unwrap();
            let (ours, theirs) = threads.run(|| (rayon::current_num_threads(), cvcore::get_num_threads().unwrap())).unwrap();
            assert_eq!((ours, theirs), (count, count as i32));
        }
        let (value, took) = spent(|| (0..1000).sum::<i32>());
        assert!(value == 499_500 && took.wall_ms >= 0.0 && took.cpu_ms.is_none_or(|ms| ms >= 0.0));
    }
}
